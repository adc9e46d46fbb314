//! Parameters of a moving scene.

use super::check::{Fault, all_within, within};
use serde::{Deserialize, Serialize};

/// How the hair of a scene moves. Without this table a scene is one frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MotionSpec {
    /// Number of frames at `rig.frame_rate_hz`; frame 0 is the groomed pose at rest.
    pub frames: u32,
    /// What the head does.
    #[serde(default)]
    pub head: HeadDrive,
    /// Moving air; still air where absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wind: Option<WindSpec>,
    /// How the motion is computed.
    #[serde(default)]
    pub solver: MotionSolver,
}

/// Motion of the head about the neck; the shoulders keep still. Every motion begins and ends at rest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "lowercase", tag = "kind")]
pub enum HeadDrive {
    /// No motion.
    #[default]
    Still,
    /// From side to side: "no".
    Shake(Swing),
    /// Up and down: "yes".
    Nod(Swing),
    /// To one side, to stay there.
    Turn {
        /// Angle, degrees; positive to the subject's left.
        angle_deg: f64,
        /// How long it takes, s.
        duration_s: f64,
        /// When it begins, s.
        start_s: f64,
    },
    /// Chin down, thrown back past upright, upright again.
    Flick {
        /// How far the chin goes down first, degrees.
        forward_deg: f64,
        /// How far the head is thrown back past upright, degrees.
        back_deg: f64,
        /// Time for the chin to go down, s; being thrown back takes half of it, coming upright as long again.
        duration_s: f64,
        /// When it begins, s.
        start_s: f64,
    },
}

/// A few swings about the middle, that grow and fade within a cycle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Swing {
    /// To either side, degrees.
    pub amplitude_deg: f64,
    /// Swings to and fro a second.
    pub frequency_hz: f64,
    /// Number of swings to and fro, 1 or more.
    pub cycles: f64,
    /// When it begins, s.
    pub start_s: f64,
}

/// Moving air.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WindSpec {
    /// Mean speed, m/s.
    pub speed_m_s: f64,
    /// Where it comes from, degrees as of `rig.azimuth_deg`: 0 blows in the face, 90 on the subject's left ear.
    pub from_deg: f64,
    /// Standard deviation of gusts relative to the mean speed, along the wind; half of it across.
    #[serde(default = "gusts")]
    pub gusts: f64,
    /// When it begins, s; it is at full strength half a second later.
    #[serde(default)]
    pub start_s: f64,
    /// When it ends, s; it has died down half a second later.
    #[serde(default = "never", skip_serializing_if = "is_never")]
    pub end_s: f64,
}

fn gusts() -> f64 {
    0.3
}
fn never() -> f64 {
    1e9
}
fn is_never(s: &f64) -> bool {
    *s == never()
}

/// How the motion is computed; the defaults suit a full head.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MotionSolver {
    /// Fibres that are simulated, about; the others follow those around them.
    pub guides: u32,
    /// Steps of the solver a frame.
    pub substeps: u32,
    /// Longest segment of a guide, mm; where hair curls, segments are shorter.
    pub segment_mm: f64,
    /// Rate at which a fibre's velocity relative to the hair around it dies away, 1/s: friction between fibres.
    pub friction_per_s: f64,
    /// Rate at which a fibre's velocity relative to the air dies away, 1/s, besides the drag that follows from its
    /// radius: what rubbing dissipates when a bundle of hair swings as one, and how wind takes the bundle along.
    pub damping_per_s: f64,
    /// Time constant of the fibre's inner (Kelvin-Voigt) damping, s.
    pub fibre_damping_s: f64,
    /// Coulomb's coefficient of friction between hair and skin.
    pub skin_friction: f64,
}

impl Default for MotionSolver {
    fn default() -> MotionSolver {
        MotionSolver {
            guides: 1500,
            substeps: 8,
            segment_mm: 11.0,
            friction_per_s: 8.0,
            damping_per_s: 0.8,
            fibre_damping_s: 0.004,
            skin_friction: 0.3,
        }
    }
}

impl MotionSpec {
    pub(super) fn check(&self) -> Result<(), Fault> {
        within("motion.frames", self.frames, 1.0, 100_000.0)?;
        let time = |name: &str, s: f64| within(&format!("motion.{name}"), s, 0.0, 1e4);
        match self.head {
            HeadDrive::Still => {}
            HeadDrive::Shake(s) | HeadDrive::Nod(s) => {
                within("motion.head.amplitude_deg", s.amplitude_deg, -60.0, 60.0)?;
                within("motion.head.frequency_hz", s.frequency_hz, 0.05, 5.0)?;
                within("motion.head.cycles", s.cycles, 1.0, 1e3)?;
                time("head.start_s", s.start_s)?;
            }
            HeadDrive::Turn { angle_deg, duration_s, start_s } => {
                within("motion.head.angle_deg", angle_deg, -80.0, 80.0)?;
                within("motion.head.duration_s", duration_s, 0.1, 100.0)?;
                time("head.start_s", start_s)?;
            }
            HeadDrive::Flick { forward_deg, back_deg, duration_s, start_s } => {
                within("motion.head.forward_deg", forward_deg, 0.0, 60.0)?;
                within("motion.head.back_deg", back_deg, 0.0, 60.0)?;
                within("motion.head.duration_s", duration_s, 0.1, 100.0)?;
                time("head.start_s", start_s)?;
            }
        }
        if let Some(w) = &self.wind {
            within("motion.wind.speed_m_s", w.speed_m_s, 0.0, 15.0)?;
            within("motion.wind.from_deg", w.from_deg, -360.0, 360.0)?;
            within("motion.wind.gusts", w.gusts, 0.0, 1.0)?;
            time("wind.start_s", w.start_s)?;
            within("motion.wind.end_s", w.end_s, w.start_s, never())?;
        }
        let s = &self.solver;
        let ranges = [
            ("guides", f64::from(s.guides), 1.0, 20_000.0),
            ("substeps", f64::from(s.substeps), 1.0, 100.0),
            ("segment_mm", s.segment_mm, 2.0, 50.0),
            ("friction_per_s", s.friction_per_s, 0.0, 200.0),
            ("damping_per_s", s.damping_per_s, 0.0, 100.0),
            ("fibre_damping_s", s.fibre_damping_s, 0.0, 1.0),
            ("skin_friction", s.skin_friction, 0.0, 5.0),
        ];
        all_within("motion.solver", &ranges)
    }
}

//! What faces do: weights and turns of the head as smooth functions of time.
//!
//! All are sums of cubic B-splines over evenly spaced knots and of ramps of degree 5, so that positions, velocities and
//! accelerations are continuous. A B-spline stays between its knots' values, so that weights need no clamping.

use super::{FaceModel, FacePose};
use glam::DVec3;
use serde::{Deserialize, Serialize};
use strandbench_rng::Rng;

/// Frames a second of a face's rig; Winberg et al. 2022 state none.
pub const FRAME_RATE_HZ: f64 = 25.0;

/// What is performed. All begin in the neutral, frontal pose: the reference frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Act {
    /// The neutral face turns slowly in a circle (Winberg et al. 2022, 3.4).
    Rotation,
    /// Jaw and lips as in talking.
    Dialogue,
    /// A broad smile, then puffed cheeks.
    SmilePuff,
    /// Brows up, down and apart.
    Brows,
}

/// An act by one performer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Performance {
    /// What is performed.
    pub act: Act,
    /// Seed of timing and strength.
    pub seed: u64,
}

impl Performance {
    /// Length of the act, s.
    pub fn duration_s(&self) -> f64 {
        match self.act {
            Act::Rotation => 10.0,
            Act::Dialogue => 6.0,
            Act::SmilePuff => 6.0,
            Act::Brows => 5.0,
        }
    }

    /// Frames of the act at [`FRAME_RATE_HZ`].
    pub fn frames(&self) -> u32 {
        (self.duration_s() * FRAME_RATE_HZ) as u32
    }

    /// The pose at a time in seconds; before the beginning and after the end it is neutral.
    pub fn pose(&self, model: &FaceModel, time_s: f64) -> FacePose {
        let mut out = model.neutral();
        let names: Vec<&str> = model.expressions().collect();
        let mut set = |name: &str, w: f64| {
            if let Some(i) = names.iter().position(|n| *n == name) {
                out.weights[i] = w as f32;
            }
        };
        let end = self.duration_s();
        let t = time_s.clamp(0.0, end);
        let both = |set: &mut dyn FnMut(&str, f64), stem: &str, w: f64| {
            set(&format!("{stem}Left"), w);
            set(&format!("{stem}Right"), w);
        };
        match self.act {
            Act::Rotation => {
                // Out to the circle's left, once around, and back; every angle's rate is slow.
                let round = std::f64::consts::TAU * ramp(t, 0.5, end - 0.5);
                let out_of_middle = pulse(t, 0.0, 2.0, end - 2.0, end);
                out.turn = turn(
                    -28.0 * out_of_middle * libm::cos(round),
                    18.0 * out_of_middle * libm::sin(round),
                    0.0,
                );
                return out;
            }
            Act::Dialogue => {
                set("jawOpen", self.syllables(t, 0.13, 0.6));
                set("mouthFunnel", 0.5 * self.words(t, 1, 0.22, 0.55));
                set("mouthPucker", 0.5 * self.words(t, 2, 0.27, 0.55));
                set("mouthRollLower", 0.35 * self.words(t, 3, 0.25, 0.6));
                set("mouthShrugUpper", 0.3 * self.words(t, 4, 0.3, 0.5));
                both(&mut set, "mouthStretch", 0.35 * self.words(t, 5, 0.29, 0.5));
                both(&mut set, "mouthLowerDown", 0.5 * self.words(t, 6, 0.19, 0.4));
                both(&mut set, "mouthUpperUp", 0.4 * self.words(t, 7, 0.21, 0.4));
                both(&mut set, "mouthPress", 0.25 * self.words(t, 8, 0.31, 0.6));
                set("browInnerUp", 0.4 * self.words(t, 9, 0.6, 0.5));
            }
            Act::SmilePuff => {
                let smile = pulse(t, 0.3, 1.1, 2.0, 2.8);
                set("mouthSmileLeft", 0.9 * smile);
                set("mouthSmileRight", 0.82 * smile);
                both(&mut set, "cheekSquint", 0.55 * smile);
                both(&mut set, "eyeSquint", 0.35 * smile);
                set("jawOpen", 0.12 * pulse(t, 0.7, 1.4, 1.8, 2.5));
                let puff = pulse(t, 3.1, 3.8, 4.7, 5.5);
                set("cheekPuff", 0.9 * puff);
                both(&mut set, "mouthPress", 0.3 * puff);
                set("mouthPucker", 0.2 * puff);
            }
            Act::Brows => {
                set("browInnerUp", 0.85 * pulse(t, 0.3, 0.9, 1.3, 1.8));
                both(&mut set, "eyeWide", 0.5 * pulse(t, 0.4, 0.9, 1.3, 1.7));
                let (left, right) = (pulse(t, 0.4, 1.0, 1.3, 1.9), pulse(t, 3.3, 3.8, 4.2, 4.7));
                set("browOuterUpLeft", 0.85 * left);
                set("browOuterUpRight", 0.7 * left + 0.3 * right);
                let down = pulse(t, 1.9, 2.5, 2.9, 3.4);
                both(&mut set, "browDown", 0.9 * down);
                both(&mut set, "noseSneer", 0.4 * down);
                set("browDownLeft", 0.9 * down + 0.1 * right);
                both(&mut set, "mouthFrown", 0.25 * down);
            }
        }
        both(&mut set, "eyeBlink", self.blinks(t));
        out.turn =
            turn(9.0 * self.sway(t, 21, 0.8), 6.0 * self.sway(t, 22, 0.7), 4.0 * self.sway(t, 23, 0.9));
        out.shift_mm = DVec3::new(0.0, 0.0, 3.0 * self.sway(t, 24, 1.0));
        out
    }

    /// A number of this act and seed in 0..1.
    fn random(&self, stream: u64, knot: i64) -> f64 {
        Rng::keyed(&[0xAC7, self.seed, self.act as u64, stream, knot as u64]).f64()
    }

    /// A spline over knots `spacing_s` apart; the value is 0 in the first and the last three knots.
    fn spline(&self, t: f64, spacing_s: f64, value: impl Fn(i64) -> f64) -> f64 {
        let last = (self.duration_s() / spacing_s) as i64;
        let at = |k: i64| if k < 3 || k > last - 3 { 0.0 } else { value(k) };
        let x = t / spacing_s;
        let k = x.floor() as i64;
        let (f, g) = (x - x.floor(), 1.0 - (x - x.floor()));
        (g * g * g * at(k - 1)
            + (3.0 * f * f * f - 6.0 * f * f + 4.0) * at(k)
            + (3.0 * g * g * g - 6.0 * g * g + 4.0) * at(k + 1)
            + f * f * f * at(k + 2))
            / 6.0
    }

    /// Opening and closing by turns.
    fn syllables(&self, t: f64, spacing_s: f64, most: f64) -> f64 {
        self.spline(t, spacing_s, |k| {
            let r = self.random(0, k);
            if k % 2 == 0 { most * 0.1 * r } else { most * (0.35 + 0.65 * r) }
        })
    }

    /// Now and then: 0 in a share of the knots, anything up to 1 in the others.
    fn words(&self, t: f64, stream: u64, spacing_s: f64, idle: f64) -> f64 {
        self.spline(t, spacing_s, |k| ((self.random(stream, k) - idle) / (1.0 - idle)).max(0.0))
    }

    /// -1 to 1, slowly.
    fn sway(&self, t: f64, stream: u64, spacing_s: f64) -> f64 {
        self.spline(t, spacing_s, |k| 2.0 * self.random(stream, k) - 1.0)
    }

    /// A blink of a quarter of a second about every two seconds.
    fn blinks(&self, t: f64) -> f64 {
        const SPACING_S: f64 = 0.06;
        const EVERY: i64 = 34;
        self.spline(t, SPACING_S, |k| {
            let start = 4 + (self.random(31, k.div_euclid(EVERY)) * (EVERY - 12) as f64) as i64;
            if (0..3).contains(&(k.rem_euclid(EVERY) - start)) { 1.0 } else { 0.0 }
        })
    }
}

/// 0 before `from`, 1 after `to`; two derivatives vanish at both.
fn ramp(t: f64, from: f64, to: f64) -> f64 {
    let x = ((t - from) / (to - from)).clamp(0.0, 1.0);
    x * x * x * (x * (x * 6.0 - 15.0) + 10.0)
}

/// Up between `a` and `b`, down between `c` and `d`.
fn pulse(t: f64, a: f64, b: f64, c: f64, d: f64) -> f64 {
    ramp(t, a, b) * (1.0 - ramp(t, c, d))
}

/// Rotation vector of a turn to the subject's left, up, and towards the left shoulder, degrees. The axes are those
/// of one rotation, not of three in turn.
fn turn(left_deg: f64, up_deg: f64, tilt_deg: f64) -> DVec3 {
    DVec3::new(-up_deg, left_deg, -tilt_deg) * (std::f64::consts::PI / 180.0)
}

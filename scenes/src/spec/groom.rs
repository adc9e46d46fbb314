//! Parameters of procedural hair.

use serde::{Deserialize, Serialize};

/// More strands than this are refused: a head has 80,000 to 150,000.
pub const MAX_STRANDS: u32 = 400_000;

/// The kind of hair, for grouping results; the parameters below decide the shape.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Family {
    /// No waves beyond the drape.
    Straight,
    /// Flat waves in step with their neighbours.
    Wavy,
    /// Helices.
    Curly,
    /// Wisps that cross.
    Messy,
}

/// Where the hair is parted, seen by the subject.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Parting {
    /// Combed in one direction, [`StyleSpec::comb`].
    None,
    /// In the middle.
    Centre,
    /// On the subject's left.
    Left,
    /// On the subject's right.
    Right,
}

/// Procedural hair.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GroomSpec {
    /// The kind of hair.
    pub family: Family,
    /// Number of fibres, 1 to [`MAX_STRANDS`].
    pub strands: u32,
    /// Median fibre radius, mm: human hair has 0.03 to 0.05.
    #[serde(default = "radius")]
    pub radius_mm: f32,
    /// Standard deviation of the logarithm of the radius between fibres.
    #[serde(default = "radius_spread")]
    pub radius_spread: f32,
    /// Radius at the tip relative to the root's; the last fifth of a fibre tapers.
    #[serde(default = "tip_radius")]
    pub tip_radius: f32,
    /// Largest distance between the polyline and the curve that it stands for, mm.
    #[serde(default = "chord_error")]
    pub chord_error_mm: f32,
    /// Longest segment, mm.
    #[serde(default = "max_segment")]
    pub max_segment_mm: f32,
    /// How long.
    pub length: LengthSpec,
    /// How combed and how it falls.
    pub style: StyleSpec,
    /// How fibres gather.
    #[serde(default)]
    pub clumping: Clumping,
    /// Waves and curls.
    #[serde(default)]
    pub wave: WaveSpec,
    /// What spoils the order.
    #[serde(default)]
    pub disorder: Disorder,
}

fn radius() -> f32 {
    0.04
}
fn radius_spread() -> f32 {
    0.1
}
fn tip_radius() -> f32 {
    0.75
}
fn chord_error() -> f32 {
    0.02
}
fn max_segment() -> f32 {
    6.0
}

/// How long hair is. Lengths are along the hanging hair, before waves and curls take it up.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LengthSpec {
    /// Length on the top of the head, mm.
    pub top_mm: f32,
    /// Length at the sides and the nape, mm; as on the top where absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sides_mm: Option<f32>,
    /// Standard deviation of the logarithm of length between wisps.
    #[serde(default = "wisp_spread")]
    pub wisp_spread: f32,
    /// Standard deviation of the logarithm of length between the fibres of a wisp.
    #[serde(default = "strand_spread")]
    pub strand_spread: f32,
    /// Height at which scissors cut, mm from the middle of the cranium (chin near -140, shoulders -200).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cut_height_mm: Option<f32>,
    /// Standard deviation of that height between wisps, mm.
    #[serde(default = "cut_spread")]
    pub cut_spread_mm: f32,
    /// Hair over the forehead.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fringe: Option<Fringe>,
}

fn wisp_spread() -> f32 {
    0.06
}
fn strand_spread() -> f32 {
    0.05
}
fn cut_spread() -> f32 {
    6.0
}

/// A fringe: the foremost hair, combed forward and cut short.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fringe {
    /// How far it hangs below the hairline, along the hair, mm.
    pub length_mm: f32,
    /// Half of its width on the scalp, mm.
    pub half_width_mm: f32,
    /// How far behind the hairline its roots reach in the middle, mm; at the half width they reach 0.
    pub depth_mm: f32,
}

/// How hair is combed and how it falls.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct StyleSpec {
    /// Where hair is parted.
    pub parting: Parting,
    /// Distance of a side parting from the middle, mm.
    pub part_offset_mm: f32,
    /// Direction of combing without a parting; world axes, any length.
    pub comb: [f32; 3],
    /// How much the front is swept back rather than to the side, 0..1.
    pub sweep_back: f32,
    /// Arc length over which combing yields to gravity, mm.
    pub comb_reach_mm: f32,
    /// Angle between skin and hair where it emerges, degrees.
    pub emergence_deg: f32,
    /// Turn of the whorl about the crown, degrees.
    pub whorl_deg: f32,
    /// Height to which the roots lift hair off the scalp, mm.
    pub lift_mm: f32,
    /// Thickness of hair gathered from crown to tip: hair lies over the hair that is rooted below it, mm.
    pub layer_mm: f32,
    /// Weight relative to natural hair; 0 lets hair stand.
    pub gravity: f32,
    /// Young's modulus of the fibre, GPa; with the radius it sets how sharply hair bends under its weight.
    pub young_gpa: f32,
    /// How strongly hair above its layer is drawn back to it, 0..1.
    pub cling: f32,
    /// Hair in front of this z falls before the shoulder, the rest behind it, mm.
    pub shoulder_divide_mm: f32,
    /// Half width of the window in front of the face that hair keeps out of, mm; 0 for none.
    pub face_window_mm: f32,
}

impl Default for StyleSpec {
    fn default() -> StyleSpec {
        StyleSpec {
            parting: Parting::Centre,
            part_offset_mm: 28.0,
            comb: [0.0, 0.0, -1.0],
            sweep_back: 0.35,
            comb_reach_mm: 70.0,
            emergence_deg: 30.0,
            whorl_deg: 25.0,
            lift_mm: 5.0,
            layer_mm: 16.0,
            gravity: 1.0,
            young_gpa: 3.9,
            cling: 0.35,
            shoulder_divide_mm: -40.0,
            face_window_mm: 58.0,
        }
    }
}

/// How fibres gather: tufts of wisps of fibres.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Clumping {
    /// Mean distance of tufts on the scalp, mm.
    pub tuft_spacing_mm: f32,
    /// How far wisps close up to their tuft towards the tip, 0..1.
    pub tuft_strength: f32,
    /// Mean distance of wisps on the scalp, mm.
    pub wisp_spacing_mm: f32,
    /// How far fibres close up to their wisp towards the tip, 0..1.
    pub wisp_strength: f32,
    /// Spread of both strengths between clumps, relative.
    pub strength_spread: f32,
    /// Arc length at which gathering begins, mm.
    pub onset_mm: f32,
    /// Arc length over which it becomes full, mm.
    pub reach_mm: f32,
}

impl Default for Clumping {
    fn default() -> Clumping {
        Clumping {
            tuft_spacing_mm: 14.0,
            tuft_strength: 0.35,
            wisp_spacing_mm: 4.0,
            wisp_strength: 0.6,
            strength_spread: 0.5,
            onset_mm: 8.0,
            reach_mm: 160.0,
        }
    }
}

/// Waves and curls about the carrier.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct WaveSpec {
    /// Median radius (a flat wave's amplitude), mm; 0 for none.
    pub radius_mm: f32,
    /// Median length of a turn along the carrier, mm.
    pub pitch_mm: f32,
    /// 0 is a round helix, 1 a wave in the plane of the hair's surface.
    pub flatness: f32,
    /// Standard deviation of the logarithm of the radius between wisps.
    pub radius_spread: f32,
    /// Standard deviation of the logarithm of the pitch between wisps.
    pub pitch_spread: f32,
    /// Standard deviation of both along a fibre, relative.
    pub drift: f32,
    /// Distance on the scalp over which waves stay in step, mm; 0 gives each wisp its own phase.
    pub coherence_mm: f32,
    /// Standard deviation of phase between the fibres of a wisp, degrees.
    pub strand_phase_deg: f32,
    /// Arc length at which the radius begins to grow, mm.
    pub onset_mm: f32,
    /// Arc length over which it becomes full, mm.
    pub reach_mm: f32,
}

impl Default for WaveSpec {
    fn default() -> WaveSpec {
        WaveSpec {
            radius_mm: 0.0,
            pitch_mm: 40.0,
            flatness: 0.0,
            radius_spread: 0.2,
            pitch_spread: 0.12,
            drift: 0.15,
            coherence_mm: 0.0,
            strand_phase_deg: 12.0,
            onset_mm: 5.0,
            reach_mm: 50.0,
        }
    }
}

/// What spoils the order. Wander is the standard deviation of heading that a clump or fibre has of its own.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Disorder {
    /// Wander of tufts, degrees.
    pub tuft_wander_deg: f32,
    /// Wander of wisps, degrees: large values make them cross.
    pub wisp_wander_deg: f32,
    /// Wander of fibres, degrees.
    pub strand_wander_deg: f32,
    /// Arc length over which headings change, mm.
    pub wander_length_mm: f32,
    /// Amplitude of frizz at the tip, mm.
    pub frizz_mm: f32,
    /// Length of frizz's kinks, mm.
    pub frizz_length_mm: f32,
    /// Share of fibres that leave their clump.
    pub flyaway_share: f32,
    /// Wander of those, degrees.
    pub flyaway_deg: f32,
}

impl Default for Disorder {
    fn default() -> Disorder {
        Disorder {
            tuft_wander_deg: 4.0,
            wisp_wander_deg: 4.0,
            strand_wander_deg: 2.0,
            wander_length_mm: 60.0,
            frizz_mm: 0.3,
            frizz_length_mm: 22.0,
            flyaway_share: 0.008,
            flyaway_deg: 14.0,
        }
    }
}

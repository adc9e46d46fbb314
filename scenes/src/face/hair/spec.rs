//! What a scene says of the hair on its face.

use super::HairKind;
use crate::face::FaceError;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Patches of hair by kind: the table `[hair]` of a face's scene. What is not stated does not grow.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct FacialHairSpec {
    /// One patch a kind.
    pub patches: BTreeMap<HairKind, Patch>,
}

/// Hair of one kind.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Patch {
    /// Hairs a square centimetre where the patch is dense; of lashes, hairs a centimetre of the lid.
    pub density_per_cm2: f32,
    /// Map over texture coordinates whose values 0..1 take the place of the region that the kind has: a square grey PNG
    /// of 8 or 16 bits, 256 to 8192 pixels a side.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub density_map: Option<PathBuf>,
    /// Median length, mm.
    pub length_mm: f32,
    /// Map whose values 0..1 scale the length; as `density_map`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub length_map: Option<PathBuf>,
    /// Standard deviation of the logarithm of length.
    pub length_spread: f32,
    /// Median diameter, micrometres.
    pub diameter_um: f32,
    /// Standard deviation of the logarithm of the diameter between hairs.
    pub diameter_spread: f32,
    /// Diameter at the tip relative to the root's: near 1 where it was cut.
    pub tip: f32,
    /// Angle between skin and hair where it emerges, degrees.
    pub angle_deg: f32,
    /// Standard deviation of that angle and of the direction on the skin, degrees.
    pub disorder_deg: f32,
    /// Arc length over which a hair bends from where it emerges to where it lies or hangs, mm.
    pub bend_mm: f32,
    /// Pull of gravity against the direction of growth, 0..1.
    pub hang: f32,
    /// Radius of curls, mm.
    pub curl_mm: f32,
    /// Length of a turn of a curl, mm.
    pub pitch_mm: f32,
    /// Mean distance of tufts, mm.
    pub tuft_mm: f32,
    /// How far hairs close up to their tuft towards the tip, 0..1.
    pub tuft_strength: f32,
    /// Share of hairs that keep to no tuft.
    pub stray: f32,
    /// Median concentration of eumelanin ([`crate::Pigment`]).
    pub eumelanin: f32,
    /// Median concentration of pheomelanin.
    pub pheomelanin: f32,
    /// Standard deviation of the logarithm of both between hairs.
    pub pigment_spread: f32,
    /// Share of hairs without pigment, more on the chin than elsewhere.
    pub grey: f32,
}

impl Default for Patch {
    /// Brows.
    fn default() -> Patch {
        Patch {
            density_per_cm2: 70.0,
            density_map: None,
            length_mm: 8.0,
            length_map: None,
            length_spread: 0.2,
            diameter_um: 70.0,
            diameter_spread: 0.12,
            tip: 0.35,
            angle_deg: 18.0,
            disorder_deg: 9.0,
            bend_mm: 4.0,
            hang: 0.0,
            curl_mm: 0.0,
            pitch_mm: 12.0,
            tuft_mm: 3.0,
            tuft_strength: 0.25,
            stray: 0.08,
            eumelanin: 1.6,
            pheomelanin: 0.3,
            pigment_spread: 0.25,
            grey: 0.0,
        }
    }
}

impl Default for FacialHairSpec {
    /// Brows and lashes.
    fn default() -> FacialHairSpec {
        let lashes = Patch {
            density_per_cm2: 40.0,
            length_mm: 8.5,
            length_spread: 0.1,
            diameter_um: 80.0,
            tip: 0.2,
            angle_deg: 40.0,
            disorder_deg: 6.0,
            bend_mm: 6.0,
            tuft_strength: 0.0,
            ..Patch::default()
        };
        FacialHairSpec {
            patches: BTreeMap::from([(HairKind::Brow, Patch::default()), (HairKind::Lash, lashes)]),
        }
    }
}

impl FacialHairSpec {
    /// Says what is out of range, if anything is.
    ///
    /// # Errors
    /// [`FaceError::Hair`] with kind and key.
    pub fn check(&self) -> Result<(), FaceError> {
        for (kind, p) in &self.patches {
            let ranges = [
                ("density_per_cm2", p.density_per_cm2, 0.1, 400.0),
                ("length_mm", p.length_mm, 0.2, 80.0),
                ("length_spread", p.length_spread, 0.0, 1.0),
                ("diameter_um", p.diameter_um, 20.0, 300.0),
                ("diameter_spread", p.diameter_spread, 0.0, 0.5),
                ("tip", p.tip, 0.05, 1.0),
                ("angle_deg", p.angle_deg, 2.0, 90.0),
                ("disorder_deg", p.disorder_deg, 0.0, 60.0),
                ("bend_mm", p.bend_mm, 0.5, 200.0),
                ("hang", p.hang, 0.0, 1.0),
                ("curl_mm", p.curl_mm, 0.0, 20.0),
                ("pitch_mm", p.pitch_mm, 3.0, 200.0),
                ("tuft_mm", p.tuft_mm, 0.5, 50.0),
                ("tuft_strength", p.tuft_strength, 0.0, 1.0),
                ("stray", p.stray, 0.0, 1.0),
                ("eumelanin", p.eumelanin, 0.0, 50.0),
                ("pheomelanin", p.pheomelanin, 0.0, 50.0),
                ("pigment_spread", p.pigment_spread, 0.0, 2.0),
                ("grey", p.grey, 0.0, 1.0),
            ];
            for (key, value, low, high) in ranges {
                if !(low..=high).contains(&value) {
                    let problem = format!("{value} is not between {low} and {high}");
                    return Err(FaceError::Hair { key: format!("hair.{}.{key}", kind.name()), problem });
                }
            }
        }
        Ok(())
    }

    /// The maps that are named.
    pub fn files(&self) -> impl Iterator<Item = &PathBuf> {
        self.patches.values().flat_map(|p| p.density_map.iter().chain(&p.length_map))
    }
}

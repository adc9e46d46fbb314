//! Hair on a face that moves: beards, moustaches, goatees, brows, lashes.
//!
//! Follicles stand on the skin of a person by a density that is a function of the place on the mean neutral face, or of a
//! map over texture coordinates. Each hair is grown on the neutral face and then carried: its root by the skin's own frame
//! there, the rest more and more by the frames around it, with a small motion of its own; the skin keeps it out at every
//! moment, and all its segments keep their length.

mod map;
mod motion;
mod region;
mod roots;
mod shape;
mod spec;
#[cfg(test)]
mod tests;

pub use map::{HairMaps, MAP_SIDES_PX};
pub use motion::PosedHair;
pub use spec::{FacialHairSpec, Patch};

use super::{FaceError, FaceModel, Follicle, FollicleFrame, Identity, Part};
use crate::Pigment;
use crate::groom::standard_lognormal;
use crate::head::MeshBvh;
use glam::Vec3;
use motion::Around;
use roots::{Ground, Root};
use serde::{Deserialize, Serialize};
use shape::Shape;
use std::path::Path;
use strandbench_rng::Rng;
use strandbench_types::StrandSet;

/// Most hairs of a face.
const MOST_HAIRS: usize = 60_000;
/// Length at which hair shades the skin beneath no more than its own shadow does, mm.
const STUBBLE_MM: f32 = 6.0;

/// What a hair belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[repr(u8)]
pub enum HairKind {
    /// Cheeks, jaw, chin and the upper neck.
    Beard,
    /// Between nose and upper lip, down to the corners of the mouth.
    Moustache,
    /// Chin, below the lower lip, and to the corners of the mouth.
    Goatee,
    /// Eyebrows.
    Brow,
    /// Eyelashes.
    Lash,
}

impl HairKind {
    /// All kinds, in the order of their numbers.
    pub const ALL: [HairKind; 5] =
        [HairKind::Beard, HairKind::Moustache, HairKind::Goatee, HairKind::Brow, HairKind::Lash];

    /// Name in scene files.
    pub fn name(self) -> &'static str {
        match self {
            HairKind::Beard => "beard",
            HairKind::Moustache => "moustache",
            HairKind::Goatee => "goatee",
            HairKind::Brow => "brow",
            HairKind::Lash => "lash",
        }
    }
}

/// The hair of one person.
pub struct FacialHair {
    /// In the neutral pose, mm, root first.
    pub strands: StrandSet,
    /// Where each hair stands, indexed `[strand]`.
    pub follicles: Vec<Follicle>,
    /// What each hair belongs to, indexed `[strand]`.
    pub kinds: Vec<HairKind>,
    /// Indexed `[strand]`.
    pub pigments: Vec<Pigment>,
    shapes: Vec<Shape>,
    /// Frames of the follicles on the neutral face.
    rest: Vec<FollicleFrame>,
    around: Around,
    /// Indexed `[vertex]` of the face.
    shadow: Vec<f32>,
    key: u64,
}

impl FacialHair {
    /// Grows the hair of a person. The same arguments give the same bits, whatever the number of threads. File names in
    /// `spec` are relative to `maps_dir`.
    ///
    /// # Errors
    /// [`FaceError::Hair`] for a value out of range or more hairs than [`FacialHair`] takes; [`FaceError::File`] for a map
    /// that cannot be read, is not square, or has hair beside the skin's texture coordinates.
    pub fn grow(
        model: &FaceModel,
        identity: &Identity,
        spec: &FacialHairSpec,
        seed: u64,
        maps_dir: Option<&Path>,
    ) -> Result<FacialHair, FaceError> {
        spec.check()?;
        let mean = Identity::mean(model).vertices(model);
        let neutral = model.pose(identity, &model.neutral())?;
        let skin = model.part(&[Part::Skin]);
        let bvh = MeshBvh::new(&skin.gather(&neutral.vertices), &skin.triangles);
        let (mut follicles, mut kinds, mut pigments) = (Vec::new(), Vec::new(), Vec::new());
        let (mut shapes, mut rest) = (Vec::new(), Vec::new());
        let mut shadow = vec![0.0f32; model.vertex_count()];
        for (&kind, patch) in &spec.patches {
            let key = Rng::keyed(&[seed, 0x4A12, kind as u64]).next_u64();
            let path = |file: &Path| maps_dir.map_or_else(|| file.to_owned(), |d| d.join(file));
            let (density, length) = (patch.density_map.as_deref(), patch.length_map.as_deref());
            let ground = Ground {
                model,
                rest: &mean,
                neutral: &neutral.vertices,
                density: density.map(|f| map::read_density(&path(f), model)).transpose()?,
                length: length.map(|f| map::read(&path(f))).transpose()?,
            };
            let roots: Vec<(Root, bool)> = match kind {
                HairKind::Lash => ground.lashes(patch, key, &bvh, &skin.faces),
                _ => ground.roots(kind, patch, key).into_iter().map(|r| (r, false)).collect(),
            };
            if follicles.len() + roots.len() > MOST_HAIRS {
                let problem = format!(
                    "{} hairs are more than {MOST_HAIRS}; lower it (a dense beard has 60 to 120)",
                    follicles.len() + roots.len()
                );
                return Err(FaceError::Hair {
                    key: format!("hair.{}.density_per_cm2", kind.name()),
                    problem,
                });
            }
            let frames: Vec<FollicleFrame> =
                roots.iter().map(|(r, _)| r.follicle.frame(model, &neutral)).collect();
            shapes.extend(shape::shapes(kind, patch, &roots, &frames, key));
            for (i, (root, _)) in roots.iter().enumerate() {
                follicles.push(root.follicle);
                kinds.push(kind);
                pigments.push(pigment(patch, root.rest, &[key, i as u64, 4]));
            }
            rest.extend(frames);
            ground.shade(kind, patch, &mut shadow);
        }
        let around = Around::new(&rest);
        let mut hair = FacialHair {
            strands: StrandSet::new(),
            follicles,
            kinds,
            pigments,
            shapes,
            rest,
            around,
            shadow,
            key: Rng::keyed(&[seed, 0x4A13]).next_u64(),
        };
        hair.strands = hair.posed(model, &neutral, 0.0).strands;
        Ok(hair)
    }

    /// How much the roots of hair darken the skin, 0..1, indexed `[vertex]` of the face: with their density, where hair is
    /// short.
    pub fn stubble_shadow(&self) -> &[f32] {
        &self.shadow
    }
}

fn pigment(patch: &Patch, rest: Vec3, key: &[u64]) -> Pigment {
    let mut rng = Rng::keyed(key);
    let tone = standard_lognormal(&mut rng, patch.pigment_spread);
    let grey = rng.f32() < patch.grey * region::greying(rest);
    let left = if grey { 0.04 } else { 1.0 };
    Pigment { eumelanin: patch.eumelanin * tone * left, pheomelanin: patch.pheomelanin * tone * left }
}

impl Ground<'_> {
    /// Adds the shadow of a patch's roots to the face's vertices.
    fn shade(&self, kind: HairKind, patch: &Patch, shadow: &mut [f32]) {
        let dark = (patch.eumelanin / 1.5).min(1.0) * (STUBBLE_MM / patch.length_mm.max(STUBBLE_MM));
        let full = (patch.density_per_cm2 / 90.0).min(1.0) * dark * (1.0 - 0.8 * patch.grey);
        if kind == HairKind::Lash || self.density.is_some() {
            return;
        }
        for (out, p) in shadow.iter_mut().zip(self.rest) {
            *out = (*out + full * region::density(kind, *p)).min(1.0);
        }
    }
}

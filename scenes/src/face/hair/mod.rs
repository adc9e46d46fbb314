//! Temporary.
use super::{FaceError, FaceModel, Follicle, FollicleFrame, Identity, PosedFace};
use crate::Pigment;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use strandbench_types::StrandSet;
/// x
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct FacialHairSpec {}
impl FacialHairSpec {
    /// x
    pub fn check(&self) -> Result<(), FaceError> {
        Ok(())
    }
    /// x
    pub fn files(&self) -> impl Iterator<Item = &PathBuf> {
        [].iter()
    }
}
/// x
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HairKind {
    /// x
    Beard,
}
impl HairKind {
    /// x
    pub const ALL: [HairKind; 1] = [HairKind::Beard];
    /// x
    pub fn name(self) -> &'static str {
        "beard"
    }
}
/// x
pub struct FacialHair {
    /// x
    pub strands: StrandSet,
    /// x
    pub follicles: Vec<Follicle>,
    /// x
    pub kinds: Vec<HairKind>,
    /// x
    pub pigments: Vec<Pigment>,
}
/// x
pub struct PosedHair {
    /// x
    pub strands: StrandSet,
    /// x
    pub frames: Vec<FollicleFrame>,
}
impl FacialHair {
    /// x
    pub fn grow(
        model: &FaceModel,
        identity: &Identity,
        _: &FacialHairSpec,
        _: u64,
        _: Option<&Path>,
    ) -> Result<FacialHair, FaceError> {
        let face = model.pose(identity, &model.neutral())?;
        let mut strands = StrandSet::new();
        let mut follicles = Vec::new();
        for t in (0..model.triangles().len()).step_by(7) {
            let f = Follicle { triangle: t as u32, barycentric: [0.3, 0.3, 0.4] };
            let at = f.frame(model, &face);
            let p = at.position;
            if model.parts()[t] != super::Part::Skin || p.y > -70.0 || p.y < -140.0 || p.z < 30.0 {
                continue;
            }
            let n = at.axes.col(2);
            strands.push(&[p, p + n * 2.0, p + n * 4.0 - glam::Vec3::Y * 2.0], 0.05);
            follicles.push(f);
        }
        let n = follicles.len();
        Ok(FacialHair {
            strands,
            follicles,
            kinds: vec![HairKind::Beard; n],
            pigments: vec![Pigment { eumelanin: 1.0, pheomelanin: 0.2 }; n],
        })
    }
    /// x
    pub fn posed(&self, model: &FaceModel, face: &PosedFace, _: f64) -> PosedHair {
        let frames: Vec<FollicleFrame> = self.follicles.iter().map(|f| f.frame(model, face)).collect();
        let mut strands = StrandSet::new();
        for f in &frames {
            let (p, n) = (f.position, f.axes.col(2));
            strands.push(&[p, p + n * 2.0, p + n * 4.0 - glam::Vec3::Y * 2.0], 0.05);
        }
        PosedHair { strands, frames }
    }
    /// x
    pub fn stubble_shadow(&self, model: &FaceModel) -> Vec<f32> {
        vec![0.0; model.vertex_count()]
    }
}

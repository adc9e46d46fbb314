//! A face that moves: identities, expressions, performances, and the frames that hair stands in.
//!
//! [`FaceModel::embedded`] is derived from the MakeHuman base mesh (CC0). Its control mesh of 5,112 vertices is
//! subdivided twice (Catmull and Clark); texture coordinates are refined chart by chart by the same rule, so that
//! seams stay where they are. The layout of the charts is stated in `assets/README.md`. An [`Identity`] is the
//! control mesh of one person, drawn from the targets with a seed; a [`FacePose`] adds expressions by their ARKit names
//! and turns the head about the neck; [`Performance`] gives a pose for any time. All lengths are mm; the axes are
//! those of every scene: +y up, +z the way the face looks, +x the subject's left.

mod asset;
mod error;
mod follicle;
mod hair;
mod ict;
mod identity;
mod model;
mod performance;
mod pose;
mod scene;
mod spec;
#[cfg(test)]
mod tests;
mod texture;

pub use asset::Part;
pub use error::FaceError;
pub use follicle::{Follicle, FollicleFrame};
pub use hair::{FacialHair, FacialHairSpec, HairKind, HairMaps, MAP_SIDES_PX, Patch, PosedHair};
pub use ict::IctFace;
pub use identity::Identity;
pub use model::{FaceModel, PartTopology};
pub use performance::{Act, FRAME_RATE_HZ, Performance};
pub use pose::{FacePose, PosedFace};
pub use scene::{FaceMoment, FaceRigSpec, FaceScene, FaceStage, Frame, LedSpec, catalog};
pub use spec::FaceSpec;
pub use texture::{SkinDetail, SkinLook, SkinTexture, Tissue};

//! The nouns that cross crate boundaries: cameras, images, strands, meshes, estimates and truth.
//!
//! World units are millimetres, angles are radians, time is seconds. Cameras follow OpenCV: +x right,
//! +y down, +z forward, and the centre of the top-left pixel is (0.5, 0.5). Transforms are named
//! `target_from_source`.

mod camera;
mod estimate;
mod face_truth;
mod first_hit;
mod frame;
mod hull;
mod image;
mod mesh;
mod monitor;
pub mod nearest;
mod raster;
mod strands;
mod truth;

pub use camera::{Camera, Rig};
pub use estimate::{DepthMap, Estimate, OrientationField};
pub use face_truth::{
    DENSITY_BOUNDS_PER_CM2, FaceTruth, FaceView, FlowMap, FlowState, HairField, HairRoot, LABEL_HAIR,
    LABEL_NOTHING, LABEL_OTHER, LABEL_SKIN, LENGTH_BOUNDS_MM, SkinCover,
};
pub use first_hit::{Element, FirstHit, HitPlane, Moment, Sight};
pub use frame::Frame;
pub use hull::{HullRays, HullSpan, Silhouette, in_hull};
pub use image::Plane;
pub use mesh::TriMesh;
pub use monitor::{Cancelled, Monitor, Silent, StopOnly};
pub use strands::{StrandError, StrandSet};
pub use truth::{SampleHit, SampleHits, Truth, VISIBILITY_STEP_MM, ViewTruth, Visibility};

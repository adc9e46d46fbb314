//! Luo et al., Dynamic Hair Capture, sections 4.3-5: images and a rig in, envelopes and strands out.
//!
//! [`reconstruct`] is the whole method for one frame, [`SequenceReconstructor`] for frames that follow one another;
//! a [`Variant`] is one setting of it. Where the paper leaves
//! something open, the documentation of the field of [`Parameters`] or of the function says what is done.

pub mod aggregate;
mod checkpoint;
pub mod cost;
pub mod depth;
pub mod envelope;
pub mod field3d;
pub mod grid;
pub mod growth;
pub mod kernel;
pub mod layer;
mod motion_parameters;
pub mod mrf;
pub mod ncc;
pub mod orientation;
mod parameters;
mod pipeline;
pub mod pyramid;
pub mod refine;
pub mod seeds;
mod sequence;
mod simd;
mod strands;
pub mod surface;
pub mod template;
pub mod temporal;
pub mod tensor;
mod variant;

pub use checkpoint::Checkpoint;
pub use motion_parameters::{StrandParameters, TemporalParameters};
pub use parameters::Parameters;
pub use pipeline::reconstruct;
pub use sequence::{SequenceFrame, SequenceReconstructor};
pub use variant::{LUO, MatchCost, Minimiser, VARIANTS, Variant, Views};

use serde::{Deserialize, Serialize};
use strandbench_types::{Cancelled, Estimate};

/// Why a frame could not be reconstructed.
#[derive(Debug, thiserror::Error)]
pub enum ReconError {
    /// The rig or the frame is at fault.
    #[error("{0}")]
    Input(String),
    /// The reference view shows no hair.
    #[error(
        "frame {frame}: the hair mask of reference camera {camera} is empty; there is nothing to reconstruct"
    )]
    EmptyMask {
        /// Name of the reference camera.
        camera: String,
        /// Time index of the frame.
        frame: u32,
    },
    /// No filter answers anywhere in the hair.
    #[error(
        "camera {camera}: no hair pixel has a positive filter response; the image is flat inside its mask (check exposure and mask)"
    )]
    NoResponse {
        /// Name of the reference camera.
        camera: String,
    },
    /// The cameras asked for cannot be compared.
    #[error(
        "views {views} of a rig of {cameras} cameras: stereo needs camera 0 and at least one other that the rig has"
    )]
    Views {
        /// The choice of cameras.
        views: String,
        /// Cameras in the rig.
        cameras: usize,
    },
    /// A parameter's value does not fit.
    #[error("parameter {key} = {value}: wants {wanted}")]
    Parameter {
        /// Name of the parameter.
        key: String,
        /// The value refused.
        value: String,
        /// What would fit.
        wanted: String,
    },
    /// There is no such parameter.
    #[error("unknown parameter {key}; there are: {known}")]
    UnknownKey {
        /// The name given.
        key: String,
        /// Names that exist.
        known: String,
    },
    /// There is no such variant.
    #[error("unknown variant {name}; there are: {known}")]
    UnknownVariant {
        /// The name given.
        name: String,
        /// Names that exist.
        known: String,
    },
    /// The cost volume would take too much memory.
    #[error(
        "cost volumes of {width}x{height} pixels and {labels} labels would take {bytes} bytes, more than {limit}; use fewer labels, smaller images or a tighter mask"
    )]
    TooLarge {
        /// Width of the hair's bounding box, pixels.
        width: usize,
        /// Height of the hair's bounding box, pixels.
        height: usize,
        /// Depth labels.
        labels: usize,
        /// Bytes wanted.
        bytes: u64,
        /// Bytes allowed.
        limit: u64,
    },
    /// The minimiser refused the problem.
    #[error("minimising the energy: {0}")]
    Solve(strandbench_solve::SolveError),
    /// Registering or tracking a surface failed.
    #[error("frame {frame}, {stage}: {source}")]
    Deform {
        /// Time index of the frame.
        frame: u32,
        /// What was being done.
        stage: &'static str,
        /// What went wrong.
        source: strandbench_solve::deform::DeformError,
    },
    /// The envelope has no triangle.
    #[error(
        "frame {frame}: the envelope of {pixels} answered pixels has no triangle; strands need a surface (check mask and cut_mm)"
    )]
    NoSurface {
        /// Time index of the frame.
        frame: u32,
        /// Pixels with a depth.
        pixels: usize,
    },
    /// The voxel grid would take too much memory.
    #[error(
        "frame {frame}: a grid of {voxels} voxels of {voxel_mm} mm is more than {limit}; use larger voxels or a smaller template_margin"
    )]
    TooManyVoxels {
        /// Time index of the frame.
        frame: u32,
        /// Voxels wanted.
        voxels: u64,
        /// Edge of a voxel, mm.
        voxel_mm: f32,
        /// Voxels allowed.
        limit: u64,
    },
    /// Neither the envelope nor the layer has a place for a seed.
    #[error(
        "frame {frame}: no seed: no place of the envelope is as strong as seed_strength = {strength}, and no interior seed lies in the visual hull"
    )]
    NoSeeds {
        /// Time index of the frame.
        frame: u32,
        /// Strength asked for.
        strength: f32,
    },
    /// A frame came out of order.
    #[error("frame {frame} came after frame {last}; frames of a sequence come in ascending order")]
    Order {
        /// Time index of the frame.
        frame: u32,
        /// Time index of the one before.
        last: u32,
    },
    /// Stopped from outside.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Wall time of one stage.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StageTime {
    /// Stage name.
    pub name: String,
    /// Wall seconds.
    pub wall_s: f64,
}

/// What happened inside the method, for the report.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Diagnostics {
    /// Stages in order.
    pub stages: Vec<StageTime>,
    /// Energy of Eq. 2 at the labelling found.
    pub energy: f64,
    /// Lower bound of that energy, where the minimiser gives one.
    pub lower_bound: Option<f64>,
    /// (energy - lower bound) / |lower bound|, where there is a bound.
    pub gap: Option<f64>,
    /// Depth labels.
    pub labels: usize,
    /// Depth between neighbouring labels at the geometric mean of near and far, mm.
    pub label_step_mm: f64,
    /// What happened in the stages that follow more than one frame or grow strands, a line each.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
    /// Every parameter used, by name, printed in the report.
    pub parameters: std::collections::BTreeMap<String, String>,
}

/// An estimate and how it came about.
#[derive(Clone, Debug)]
pub struct Reconstruction {
    /// The answer.
    pub estimate: Estimate,
    /// How it was found.
    pub diagnostics: Diagnostics,
}

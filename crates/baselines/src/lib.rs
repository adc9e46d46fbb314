//! Methods of the field beside which the benchmark's own is held: patch-based stereo with a Poisson surface, the visual
//! hull, and a constant depth. Each runs from what every method is given: rig, images and masks.
//!
//! [`BASELINES`] is the table, [`reconstruct`] the whole of it for one frame. All of them give the same bits whatever the
//! number of threads.

mod account;
mod constant;
mod lattice;
mod patch;
mod poisson;
mod silhouettes;
mod table;

pub use account::Account;
pub use constant::ConstantDepth;
pub use patch::PatchStereo;
pub use poisson::{Oriented, PoissonOptions, Solved, poisson};
pub use silhouettes::VisualHull;
pub use table::{BASELINES, Baseline, Kind};

use strandbench_types::{Cancelled, Estimate, Frame, Monitor, Rig};

/// Why a baseline has no answer.
#[derive(Debug, thiserror::Error)]
pub enum BaselineError {
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
    /// The method cannot work with so few or so many cameras.
    #[error("the rig has {cameras} cameras; this method needs {wanted}")]
    Cameras {
        /// Cameras of the rig.
        cameras: usize,
        /// What would fit.
        wanted: String,
    },
    /// No patch was found.
    #[error(
        "frame {frame}: no patch agrees in enough views, starting from {features} features; the images are without texture or out of focus, or too few of the cameras see the same (lower min_images or ncc_after)"
    )]
    NoPatches {
        /// Time index of the frame.
        frame: u32,
        /// Features found in all views.
        features: usize,
    },
    /// Too few patches for a surface.
    #[error("{found} oriented points with finite numbers are too few for a surface; it takes {wanted}")]
    FewPatches {
        /// Patches found.
        found: usize,
        /// Patches wanted.
        wanted: usize,
    },
    /// The masks have nothing in common.
    #[error(
        "frame {frame}: no point of the working volume lies inside the masks of all cameras; check masks and calibration"
    )]
    NoHull {
        /// Time index of the frame.
        frame: u32,
    },
    /// A grid would take too much memory.
    #[error(
        "a grid of {nodes} nodes {cell_mm} mm apart is more than {limit}; use a larger surface_cell_mm or cell_mm"
    )]
    TooManyNodes {
        /// Nodes wanted.
        nodes: u64,
        /// Distance between nodes, mm.
        cell_mm: f64,
        /// Nodes allowed.
        limit: u64,
    },
    /// The surface cannot be drawn.
    #[error("{0}")]
    Mesh(String),
    /// A linear system was not solved.
    #[error("solving for the surface: {0}")]
    Solve(#[from] strandbench_solve::SparseError),
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
    #[error("unknown parameter {key} of {name}; there are: {known}")]
    UnknownKey {
        /// The name given.
        key: String,
        /// The baseline.
        name: &'static str,
        /// Names that exist.
        known: String,
    },
    /// Stopped from outside.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// An estimate and how it came about.
#[derive(Clone, Debug)]
pub struct Reconstruction {
    /// The answer.
    pub estimate: Estimate,
    /// How it was found.
    pub account: Account,
}

/// Reconstructs one frame from images, masks and calibration alone.
///
/// # Errors
/// If the frame disagrees with the rig, the reference mask is empty, the rig has too few cameras, nothing is found, a grid
/// would be too large, or the work is cancelled.
pub fn reconstruct(
    rig: &Rig,
    frame: &Frame,
    baseline: &Baseline,
    monitor: &dyn Monitor,
) -> Result<Reconstruction, BaselineError> {
    baseline.validate()?;
    rig.validate().map_err(BaselineError::Input)?;
    frame.validate(rig).map_err(BaselineError::Input)?;
    if !frame.masks[0].data.contains(&true) {
        let camera = rig.cameras[0].name.clone();
        return Err(BaselineError::EmptyMask { camera, frame: frame.index });
    }
    match &baseline.kind {
        Kind::PatchStereo(p) => patch::reconstruct(rig, frame, p, monitor),
        Kind::VisualHull(p) => silhouettes::reconstruct(rig, frame, p, monitor),
        Kind::ConstantDepth(_) => constant::reconstruct(rig, frame, monitor),
    }
}

#[cfg(test)]
mod testing;
#[cfg(test)]
mod tests;

//! Luo et al., Dynamic Hair Capture, sections 4.3-4.4: images and a rig in, an envelope out.

use serde::{Deserialize, Serialize};
use strandbench_types::{Cancelled, Estimate, Frame, Monitor, Rig};

/// Why a frame could not be reconstructed.
#[derive(Debug, thiserror::Error)]
pub enum ReconError {
    /// The input cannot be used.
    #[error("{0}")]
    Input(String),
    /// Stopped from outside.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// A named setting of the method; a row of [`VARIANTS`].
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Variant {
    /// Name on the command line and in reports.
    pub name: &'static str,
    /// The question that this row answers.
    pub asks: &'static str,
}

/// Luo et al. as published.
pub const LUO: Variant = Variant { name: "luo", asks: "the paper's method" };

/// Every setting that the harness runs and tests.
pub const VARIANTS: &[Variant] = &[LUO];

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
    /// Depth labels.
    pub labels: usize,
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

/// Reconstructs one frame from images, masks and calibration alone.
///
/// # Errors
/// If the frame disagrees with the rig, a mask is empty, or the work is cancelled.
pub fn reconstruct(
    rig: &Rig,
    frame: &Frame,
    _variant: &Variant,
    _monitor: &dyn Monitor,
) -> Result<Reconstruction, ReconError> {
    frame.validate(rig).map_err(ReconError::Input)?;
    Err(ReconError::Input("not built yet".into()))
}

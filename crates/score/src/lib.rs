//! Scores an estimate against the truth by the published protocol.

use serde::{Deserialize, Serialize};
use strandbench_types::{Cancelled, Estimate, Monitor, Plane, Truth};

/// Why no score could be given.
#[derive(Debug, thiserror::Error)]
pub enum ScoreError {
    /// Nothing could be evaluated, or the input is inconsistent.
    #[error("{0}")]
    Input(String),
    /// Stopped from outside.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// One figure.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Score {
    /// Whose figure: `method`, a null (`N0`, `N1`, `N2`), or the ceiling `C`.
    pub subject: String,
    /// Metric, for example `A1.median`.
    pub metric: String,
    /// Value; `None` where nothing was answered, which counts as worst.
    pub value: Option<f64>,
    /// `mm`, `deg`, `share`, `px`.
    pub unit: String,
    /// Whether a lower value is better.
    pub lower_is_better: bool,
    /// Share of what was wanted that was answered, 0..1.
    pub coverage: f64,
    /// Number of pixels or samples wanted.
    pub wanted: u64,
}

/// All figures of one estimate, with the raw errors behind them.
#[derive(Clone, Debug)]
pub struct ScoreSheet {
    /// Protocol version and content hash.
    pub protocol: String,
    /// Figures, in the protocol's order.
    pub scores: Vec<Score>,
    /// A1 signed error z_est - z_true per pixel of the reference view, mm; NaN where not wanted, +inf where
    /// wanted and absent.
    pub depth_error_mm: Plane<f32>,
    /// Sorted |A1 error| per subject (`method`, nulls), mm, absent answers as +inf: the cumulative curves.
    pub depth_error_curves: Vec<(String, Vec<f32>)>,
}

/// Scores an estimate; `seed` drives the nulls alone.
///
/// # Errors
/// If sizes disagree, a value is NaN where a number is due, or nothing can be evaluated.
pub fn score(
    _truth: &Truth,
    _estimate: &Estimate,
    _seed: u64,
    _monitor: &dyn Monitor,
) -> Result<ScoreSheet, ScoreError> {
    Err(ScoreError::Input("not built yet".into()))
}

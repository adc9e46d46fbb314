//! What a scoring returns.

use crate::Place;
use crate::protocol::protocol_id;
use serde::{Deserialize, Serialize};
use strandbench_types::{Cancelled, Plane, Truth};

/// Why no score could be given.
#[derive(Debug, thiserror::Error)]
pub enum ScoreError {
    /// Nothing could be evaluated, or the input is inconsistent.
    #[error("{0}")]
    Input(String),
    /// A metric that the protocol does not know.
    #[error("the protocol has no metric {id:?}; METRICS lists those it has")]
    UnknownMetric {
        /// The name asked for.
        id: String,
    },
    /// Stopped from outside.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// One figure.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Score {
    /// Whose figure: `method`, a null (`N0`, `N1`, `N2`, `NC`), or the ceiling `C`.
    pub subject: String,
    /// Metric, for example `A1.median`.
    pub metric: String,
    /// Value; `None` where it is infinite or was not answered, which counts as worst.
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

/// Sorted raw errors of one subject, kept so that scenes can be pooled later.
#[derive(Clone, Debug, PartialEq)]
pub struct ErrorCurve {
    /// `method`, a null or the ceiling.
    pub subject: String,
    /// Ascending errors in degrees, +inf for each absent answer.
    pub errors_deg: Vec<f32>,
}

/// 2-D orientation error of the answered pixels in one tenth of the filter's confidence.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ConfidenceBin {
    /// 1 for the tenth in which the filter is least sure, 10 for the surest.
    pub decile: u32,
    /// Least and largest filter strength in the bin.
    pub strength: (f64, f64),
    /// Pixels in the bin.
    pub pixels: u64,
    /// Median axial error, degrees.
    pub median_deg: f64,
    /// Share of the bin's pixels within 10, 20 and 30 degrees.
    pub within: [f64; 3],
}

/// The square block of the reference view in which the method's depth is worst.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WorstRegion {
    /// Left column of the block.
    pub x: u32,
    /// Top row of the block.
    pub y: u32,
    /// Side of the block in pixels.
    pub size: u32,
    /// Wanted pixels in the block; at least a quarter of it.
    pub wanted: u64,
    /// Median |A1 error| of the block, mm; `None` where most of it is unanswered.
    pub median_mm: Option<f64>,
}

/// All figures of one estimate, with the raw errors behind them.
#[derive(Clone, Debug)]
pub struct ScoreSheet {
    /// Protocol version and content hash.
    pub protocol: String,
    /// Figures, in the protocol's order.
    pub scores: Vec<Score>,
    /// A1 signed error z_est - z_true per pixel of the reference view (inner mask and rim), mm; NaN where not
    /// wanted, +inf where wanted and absent.
    pub depth_error_mm: Plane<f32>,
    /// The pixels of the inner mask in reading order, with the strand and the clump that each shows.
    pub places: Vec<Place>,
    /// Sorted |A1 error| over the inner mask per subject (`method`, nulls, ceiling), mm, absent answers as
    /// +inf: the cumulative curves.
    pub depth_error_curves: Vec<(String, Vec<f32>)>,
    /// Sorted A5 errors per subject, degrees.
    pub axis_error_curves: Vec<ErrorCurve>,
    /// Sorted B7 errors per subject, degrees.
    pub line_error_curves: Vec<ErrorCurve>,
    /// B7 of the method by tenths of its confidence, least sure first; empty without an orientation map.
    pub orientation_by_confidence: Vec<ConfidenceBin>,
    /// Where the method's depth is worst; `None` if no block holds enough hair.
    pub worst_region: Option<WorstRegion>,
    /// Segments of true strands shorter than 1e-6 mm, left out.
    pub dropped_segments: u64,
}

impl ScoreSheet {
    pub(crate) fn new(truth: &Truth) -> ScoreSheet {
        let (width, height) = truth.views[0].mask.size();
        ScoreSheet {
            protocol: protocol_id(),
            scores: Vec::new(),
            depth_error_mm: Plane::filled(width, height, f32::NAN),
            places: Vec::new(),
            depth_error_curves: Vec::new(),
            axis_error_curves: Vec::new(),
            line_error_curves: Vec::new(),
            orientation_by_confidence: Vec::new(),
            worst_region: None,
            dropped_segments: 0,
        }
    }

    /// The figure of `subject` (for example `method`) for `metric` (for example `A1.median`).
    ///
    /// # Errors
    /// If the protocol has no such metric, or this sheet no such subject.
    pub fn get(&self, subject: &str, metric: &str) -> Result<&Score, ScoreError> {
        crate::metric(metric)?;
        self.scores.iter().find(|s| s.subject == subject && s.metric == metric).ok_or_else(|| {
            ScoreError::Input(format!("the sheet has no figure {metric} of subject {subject:?}"))
        })
    }
}

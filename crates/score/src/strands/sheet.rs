//! What a scoring of strands returns.

use crate::{Score, ScoreError};

/// Precision and recall over the whole grid of tolerances, indexed `[distance][angle]` ([`StrandGrid::MM`],
/// [`StrandGrid::DEG`]).
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StrandGrid {
    /// `method`, a null or the ceiling.
    pub subject: String,
    /// `v2` (the headline set), `v1` or `full`.
    pub set: String,
    /// `any` or `nearest` neighbour.
    pub mode: String,
    /// Share of observed estimated length that true strands confirm.
    pub precision: [[f64; 6]; 7],
    /// Share of the set's length that estimated strands confirm.
    pub recall: [[f64; 6]; 7],
    /// Share of estimated length that is observed.
    pub observed: [[f64; 6]; 7],
}

impl StrandGrid {
    /// Distances of the grid, mm.
    pub const MM: [f64; 7] = super::stairs::GRID_MM;
    /// Angles of the grid, degrees; the last one accepts every line.
    pub const DEG: [f64; 6] = super::stairs::GRID_DEG;
}

/// All strand figures of one frame.
#[derive(Clone, Debug)]
pub struct StrandSheet {
    /// Protocol version and content hash.
    pub protocol: String,
    /// Figures of the method, the nulls `N0`, `N1`, `N2` and the ceiling `C`, in the order of
    /// [`crate::strand_metrics`].
    pub scores: Vec<Score>,
    /// Precision and recall over the grid.
    pub grids: Vec<StrandGrid>,
    /// Segments of the method's strands shorter than 1e-6 mm, left out.
    pub dropped_segments: u64,
    /// The method's strands too short for a sample (under 0.25 mm), left out.
    pub dropped_strands: u64,
}

impl StrandSheet {
    /// The figure of `subject` (for example `method`) for `metric` (for example `B1.f_2mm`).
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

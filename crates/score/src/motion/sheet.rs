//! What a scoring of a sequence returns.

use crate::{Score, ScoreError};

/// Figures of one frame, for plots; `None` where there was nothing to measure.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FrameFigures {
    /// Index of the frame in the sequence, from 0.
    pub frame: u32,
    /// Mean jitter of tracked strands around this frame, mm/frame² (C1).
    pub jitter_mm: Option<f64>,
    /// Mean distance between the carried set and the next frame's, both ways, mm (C2).
    pub regrown_mm: Option<f64>,
    /// Mean error of the motion to the next frame, mm (C6).
    pub flow_mm: Option<f64>,
    /// Median drift against the first frame, mm (C4).
    pub drift_mm: Option<f64>,
    /// Root mean square distance of the true points from where they were in the first frame, mm.
    pub moved_mm: Option<f64>,
    /// Share of the first frame's tracked points that are still within 2 mm and 20 degrees (C7).
    pub survival: Option<f64>,
}

/// All figures of a sequence.
#[derive(Clone, Debug, PartialEq)]
pub struct SequenceSheet {
    /// Protocol version and content hash.
    pub protocol: String,
    /// Number of frames pushed.
    pub frames: u32,
    /// Figures of the method, in the order of [`crate::motion_metrics`].
    pub scores: Vec<Score>,
    /// Figures frame by frame.
    pub by_frame: Vec<FrameFigures>,
}

impl SequenceSheet {
    /// The method's figure for `metric` (for example `C1.noise_sd`).
    ///
    /// # Errors
    /// If the protocol has no such metric, or the sequence was too short for it.
    pub fn get(&self, metric: &str) -> Result<&Score, ScoreError> {
        crate::metric(metric)?;
        self.scores
            .iter()
            .find(|s| s.metric == metric)
            .ok_or_else(|| ScoreError::Input(format!("the sheet has no figure {metric}")))
    }
}

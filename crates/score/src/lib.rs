//! Scores an estimate against the truth by the published protocol ([`PROTOCOL`]).
//!
//! [`score`] takes a frame's maps and envelope, [`score_strands`] its strands, [`SequenceScorer`] a sequence. Every metric
//! is a row of [`METRICS`], [`strand_metrics`] or [`motion_metrics`]. Beside the method stand the nulls (`N0`, `N1`, `N2`, `NC`), which
//! know nothing of the images, and the ceiling `C`, the truth where a second camera could have confirmed it.

mod angles;
mod check;
mod depth;
mod hull;
mod luo;
mod metrics;
mod motion;
mod nulls;
mod places;
mod protocol;
mod regions;
mod rows;
mod sheet;
mod silhouette;
mod stats;
mod strands;
mod subject;
mod visible;

use strandbench_types::{Estimate, Monitor, Truth};

pub use metrics::{METRICS, Metric, metric};
pub use motion::{FrameFigures, SequenceScorer, SequenceSheet, flicker_floor_mm, motion_metrics};
pub use places::Place;
pub use protocol::{PROTOCOL, PROTOCOL_V1, PROTOCOL_V2, PROTOCOL_VERSION, protocol_id};
pub use sheet::{ConfidenceBin, ErrorCurve, Score, ScoreError, ScoreSheet, WorstRegion};
pub use strands::{StrandGrid, StrandSheet, score_strands, strand_metrics, strand_point_errors_mm};

use regions::Regions;
use rows::Rows;
use subject::Subject;

/// Scores an estimate; `seed` drives the nulls alone.
///
/// What the estimate does not say is scored as the worst answer. The truth itself is scored first, and must
/// come out perfect.
///
/// # Errors
/// If sizes disagree, a value is NaN where a number is due, the reference view shows no hair 2 px inside its
/// mask, no visible strand is there to measure against, or the work is cancelled.
pub fn score(
    truth: &Truth,
    estimate: &Estimate,
    seed: u64,
    monitor: &dyn Monitor,
) -> Result<ScoreSheet, ScoreError> {
    check::truth(truth)?;
    check::estimate(truth, estimate)?;
    let regions = Regions::of(&truth.views[0])?;
    monitor.begin("score", 4);
    perfect(truth, &regions)?;

    let masks: Vec<_> = truth.views.iter().map(|v| &v.mask).collect();
    let hull = hull::hull(&truth.rig, &masks, &regions.hair, seed);
    monitor.check()?;
    monitor.advance(1);
    let method = Subject::method(truth, estimate);
    let mut subjects = vec![method];
    subjects.extend(nulls::all(truth, &regions, &hull, seed));
    monitor.check()?;
    monitor.advance(1);

    let (curves, strand_of) = visible::curves(truth)?;
    let dropped_segments = visible::short_segments(&truth.strands);
    let index = strandbench_types::nearest::SegmentIndex::new(curves);
    monitor.check()?;
    monitor.advance(1);

    let cells = depth::Cells::new(truth, &regions);
    let mut rows = Rows::default();
    let mut sheet = ScoreSheet::new(truth);
    sheet.places = places::places(truth, &regions, &index, &strand_of);
    for subject in &subjects {
        depth::score(truth, &regions, &cells, subject, &mut rows, &mut sheet);
        luo::score(truth, &index, subject, &mut rows);
        silhouette::score(truth, subject, &mut rows);
        angles::score(truth, &regions, subject, &mut rows, &mut sheet)?;
        monitor.check()?;
    }
    rows.chance_corrected();
    sheet.scores = rows.finish();
    sheet.dropped_segments = dropped_segments;
    monitor.advance(1);
    Ok(sheet)
}

/// The truth as a submission must score perfectly (METRICS ground rule 10).
fn perfect(truth: &Truth, regions: &Regions) -> Result<(), ScoreError> {
    let subject = Subject::truth(truth);
    let worst_mm = depth::errors(&truth.views[0].depth_50, &subject.depth, &regions.hair)
        .into_iter()
        .fold(0.0, |m: f64, e| m.max(e.abs()));
    let worst = |errors: Vec<f64>| errors.into_iter().fold(0.0, f64::max);
    let axis_deg = worst(angles::axis_errors(truth, regions, &subject)?);
    let line_deg = worst(angles::line_errors(truth, regions, &subject)?);
    if worst_mm > 0.0 || axis_deg > 0.0 || line_deg > 0.0 {
        return Err(ScoreError::Input(format!(
            "the truth does not score 100 % against itself: depth is off by up to {worst_mm} mm, the axis by \
             {axis_deg} degrees, the line by {line_deg} degrees; the truth is inconsistent, make it again"
        )));
    }
    Ok(())
}

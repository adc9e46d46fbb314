//! B1 to B6: strands of one frame against the true ones.

mod alignment;
mod at_points;
mod cones;
pub(crate) mod curves;
mod free;
mod identity;
pub(crate) mod judge;
mod matching;
mod metrics;
mod nulls;
pub(crate) mod samples;
mod shape;
mod sheet;

pub use at_points::strand_point_errors_mm;
pub use metrics::strand_metrics;
pub use sheet::{StrandGrid, StrandSheet};

use crate::check::{self, fault};
use crate::rows::Rows;
use crate::{ScoreError, protocol_id};
use judge::{Candidate, Reference};
use strandbench_types::{Estimate, Monitor, StrandSet, Truth};

/// Most samples of the method's strands.
const MOST_METHOD: usize = 1 << 20;

/// Most samples of a null's or the ceiling's strands.
const MOST_NULL: usize = 1 << 16;

/// Most samples with which the truth is held against itself.
const MOST_SELF: usize = 1 << 14;

/// Scores the estimate's strands by B1 to B6 of the protocol, beside nulls and ceiling; `seed` drives the nulls
/// alone. An estimate without strands scores as an empty set: the worst.
///
/// The truth is held against itself first and must score perfectly.
///
/// # Errors
/// If truth and estimate do not fit each other, a number is not finite, a strand is absurdly long, no strand sample
/// is seen by two cameras, or the work is cancelled.
pub fn score_strands(
    truth: &Truth,
    estimate: &Estimate,
    seed: u64,
    monitor: &dyn Monitor,
) -> Result<StrandSheet, ScoreError> {
    check::truth(truth)?;
    check::estimate(truth, estimate)?;
    curves::check_lengths(&truth.strands, "true")?;
    let empty = StrandSet::new();
    let strands = estimate.strands.as_ref().unwrap_or(&empty);
    curves::check_lengths(strands, "estimate's")?;
    monitor.begin("score strands", 7);
    let step = || -> Result<(), ScoreError> {
        monitor.advance(1);
        Ok(monitor.check()?)
    };
    let reference = Reference::new(truth)?;
    step()?;
    perfect(&reference)?;
    let population = shape::Population::new(&reference, MOST_METHOD as u64);
    step()?;
    let mut sheet = StrandSheet {
        protocol: protocol_id(),
        scores: Vec::new(),
        grids: Vec::new(),
        dropped_segments: 0,
        dropped_strands: 0,
    };
    let mut rows = Rows::default();
    let mut one = |name, strands: &StrandSet, most, sheet: &mut StrandSheet| -> Result<(), ScoreError> {
        let curves = Candidate::curves(strands)?;
        let c = Candidate::new(&reference, name, strands, &curves, most);
        monitor.check()?;
        alignment::score(&reference, &c, &mut rows, &mut sheet.grids);
        monitor.check()?;
        identity::score(&reference, &c, &mut rows);
        shape::score(&reference, &population, &c, &mut rows);
        if name == "method" {
            (sheet.dropped_segments, sheet.dropped_strands) = (c.curves.dropped, c.too_short);
        }
        step()
    };
    one("method", strands, MOST_METHOD, &mut sheet)?;
    for (name, strands) in nulls::all(&reference, &population, seed) {
        one(name, &strands, MOST_NULL, &mut sheet)?;
    }
    rows.above_chance(metrics::CHANCE_CORRECTED);
    sheet.scores = rows.finish();
    Ok(sheet)
}

/// The truth as a submission must score perfectly (METRICS ground rule 10).
fn perfect(reference: &Reference) -> Result<(), ScoreError> {
    let mut rows = Rows::default();
    let strands = &reference.strands;
    let truth = Candidate::new(reference, "method", &strands.truth.strands, &strands.full, MOST_SELF);
    alignment::score(reference, &truth, &mut rows, &mut Vec::new());
    for s in rows.finish() {
        let want = match s.unit.as_str() {
            "share" if s.metric.contains("precision") || s.metric.contains("recall") => 1.0,
            "mm" => 0.0,
            _ => continue,
        };
        if !s.value.is_some_and(|v| (v - want).abs() <= 1e-6) {
            return fault(format!(
                "the truth does not score 100 % against itself: its {} is {:?}; the truth is inconsistent, make it \
                 again",
                s.metric, s.value
            ));
        }
    }
    Ok(())
}

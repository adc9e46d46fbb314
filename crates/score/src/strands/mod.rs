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
pub(crate) mod stairs;

pub use at_points::strand_point_errors_mm;
pub use metrics::strand_metrics;
pub use sheet::{StrandGrid, StrandSheet};

use crate::check::{self, fault};
use crate::rows::Rows;
use crate::{ScoreError, protocol_id};
use judge::{Candidate, Reference};
use rayon::prelude::*;
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
    let (perfect, (population, nulls)) = rayon::join(
        || perfect(&reference),
        || {
            let population = shape::Population::new(&reference, MOST_METHOD as u64);
            let nulls = nulls::all(&reference, &population, seed);
            (population, nulls)
        },
    );
    perfect?;
    step()?;
    let one = |(name, strands, most): (&'static str, &StrandSet, usize)| -> Result<Scored, ScoreError> {
        let curves = Candidate::curves(strands)?;
        let c = Candidate::new(&reference, name, strands, &curves, most);
        monitor.check()?;
        let dropped = (curves.dropped, c.too_short);
        let mut s = Scored { rows: Rows::default(), grids: Vec::new(), dropped };
        alignment::score(&reference, &c, &mut s.rows, &mut s.grids);
        monitor.check()?;
        identity::score(&reference, &c, &mut s.rows);
        shape::score(&reference, &population, &c, &mut s.rows);
        step()?;
        Ok(s)
    };
    let asked: Vec<_> = std::iter::once(("method", strands, MOST_METHOD))
        .chain(nulls.iter().map(|(name, strands)| (*name, strands, MOST_NULL)))
        .collect();
    // Side by side: what one candidate does on one thread does not hold up the others.
    let scored = asked.into_par_iter().map(one).collect::<Result<Vec<Scored>, _>>()?;
    let dropped = scored[0].dropped;
    let (mut rows, mut grids) = (Rows::default(), Vec::new());
    for s in scored {
        rows.extend(s.rows);
        grids.extend(s.grids);
    }
    rows.above_chance(metrics::CHANCE_CORRECTED);
    Ok(StrandSheet {
        protocol: protocol_id(),
        scores: rows.finish(),
        grids,
        dropped_segments: dropped.0,
        dropped_strands: dropped.1,
    })
}

/// What one candidate's strands amount to.
struct Scored {
    rows: Rows,
    grids: Vec<StrandGrid>,
    /// Segments and strands that were left out.
    dropped: (u64, u64),
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

//! The statistical gate: seeds that nobody has seen, against the reference's own.

use super::Plan;
use crate::SuiteError;
use crate::results::Results;
use serde::{Deserialize, Serialize};
use strandbench_rng::Rng;
use strandbench_stats::{Stratified, Stratum, stratified};

/// One metric of one variant on fresh seeds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fresh {
    /// Variant.
    pub variant: String,
    /// Metric.
    pub metric: String,
    /// Unit.
    pub unit: String,
    /// Fresh less reference, the mean over scenes; the interval's ends leave out 2.5 % each.
    pub difference: Stratified,
    /// Loss that may pass.
    pub margin: f64,
    /// Whether the interval's worse end is within the margin.
    pub passes: bool,
}

/// Holds fresh seeds against the reference's seeds, scene by scene: every metric with a margin must be shown to have lost less
/// than it.
///
/// # Errors
/// If no margin is declared, a scene has fewer than two seeds on either side, a cell failed or a figure has no value: the gate then
/// fails, since nothing is shown.
pub fn fresh(reference: &[Results], now: &[Results], plan: &Plan) -> Result<Vec<Fresh>, SuiteError> {
    let refused = |problem: String| SuiteError::Gate { problem };
    if plan.margin.is_empty() {
        return Err(refused("the plan declares no margin: there is nothing to show".to_owned()));
    }
    let mut all = Vec::new();
    for r in reference {
        let n = now.iter().find(|n| n.variant == r.variant);
        let n = n.ok_or_else(|| refused(format!("variant {} of the reference was not run", r.variant)))?;
        if n.protocol != r.protocol {
            let problem =
                format!("{}: protocol {} now, {} in the reference", r.variant, n.protocol, r.protocol);
            return Err(refused(problem));
        }
        for (metric, &margin) in &plan.margin {
            let lower = strandbench_score::metric(metric).map_err(|e| refused(e.to_string()))?;
            let strata = strata(r, n, metric).map_err(refused)?;
            let difference =
                stratified(&strata, 0.95).map_err(|e| refused(format!("{metric} of {}: {e}", r.variant)))?;
            let [low, high] = difference.interval;
            let loss = if lower.lower_is_better { high } else { -low };
            all.push(Fresh {
                variant: r.variant.clone(),
                metric: metric.clone(),
                unit: lower.unit.to_owned(),
                difference,
                margin,
                // Figures without any spread (of a method that always answers alike) lose nothing at 0.
                passes: loss < margin || (loss == 0.0 && margin == 0.0),
            });
        }
    }
    if all.is_empty() {
        return Err(refused("the reference holds no variant: nothing was evaluated".to_owned()));
    }
    Ok(all)
}

fn strata(reference: &Results, now: &Results, metric: &str) -> Result<Vec<Stratum>, String> {
    let mut scenes: Vec<&str> =
        reference.cells.keys().chain(now.cells.keys()).map(|k| k.0.as_str()).collect();
    scenes.sort_unstable();
    scenes.dedup();
    let values = |results: &Results, scene: &str| {
        let of = results.cells.iter().filter(|(k, _)| k.0 == scene);
        of.map(|(key, cell)| {
            let value = cell.score(metric).and_then(|s| s.value);
            value.ok_or_else(|| {
                format!("{metric} of {} on {scene}, seed {}: no answer", results.variant, key.1)
            })
        })
        .collect::<Result<Vec<f64>, String>>()
    };
    scenes
        .into_iter()
        .map(|s| Ok(Stratum { name: s.to_owned(), a: values(reference, s)?, b: values(now, s)? }))
        .collect()
}

/// How often the statistical gate fails though nothing changed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FalseAlarms {
    /// Seeds in the pool, a scene.
    pub pool: usize,
    /// Seeds of either sample, a scene: reference and fresh.
    pub seeds: [usize; 2],
    /// Random splits of the pool.
    pub rounds: u32,
    /// Rounds in which any variant and metric failed: not shown to be within its margin.
    pub alarms: u32,
    /// Of all intervals, how many left out zero (nominal 5 %).
    pub intervals_without_zero: f64,
}

/// Splits the seeds of one program's results at random into a reference and fresh seeds, `rounds` times, and runs the statistical
/// gate on each: whatever fails is a false alarm. `seeds` are how many each side takes of every scene, the same for all.
///
/// # Errors
/// If the pool is too small, or as [`fresh`].
pub fn a_a(
    pool: &[Results],
    plan: &Plan,
    seeds: [usize; 2],
    rounds: u32,
    seed: u64,
) -> Result<FalseAlarms, SuiteError> {
    let all: std::collections::BTreeSet<u64> =
        pool.iter().flat_map(|r| r.cells.keys().map(|k| k.1)).collect();
    let all: Vec<u64> = all.into_iter().collect();
    let [a, b] = seeds;
    if a < 2 || b < 2 || a + b > all.len() || rounds == 0 {
        let problem = format!(
            "an A/A run splits its {} seeds into {a} and {b}, each two or more, in at least one round",
            all.len()
        );
        return Err(SuiteError::Gate { problem });
    }
    let (mut alarms, mut outside, mut intervals) = (0, 0u32, 0u32);
    for round in 0..rounds {
        let mut rng = Rng::keyed(&[seed, 0xaa, u64::from(round)]);
        let mut shuffled = all.clone();
        for i in 0..a + b {
            let j = i + rng.below((shuffled.len() - i) as u64) as usize;
            shuffled.swap(i, j);
        }
        let part = |of: &[u64]| -> Vec<Results> {
            let keep = |r: &Results| {
                let cells = r.cells.iter().filter(|(k, _)| of.contains(&k.1));
                Results { cells: cells.map(|(k, c)| (k.clone(), c.clone())).collect(), ..r.clone() }
            };
            pool.iter().map(keep).collect()
        };
        let found = fresh(&part(&shuffled[..a]), &part(&shuffled[a..a + b]), plan)?;
        alarms += u32::from(found.iter().any(|f| !f.passes));
        intervals += found.len() as u32;
        let without = |f: &&Fresh| f.difference.interval[0] > 0.0 || f.difference.interval[1] < 0.0;
        outside += found.iter().filter(without).count() as u32;
    }
    let intervals_without_zero = f64::from(outside) / f64::from(intervals);
    Ok(FalseAlarms { pool: all.len(), seeds, rounds, alarms, intervals_without_zero })
}

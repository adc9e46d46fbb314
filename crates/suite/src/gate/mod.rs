//! A run held against a committed reference: a numeric gate on fixed seeds, a statistical one on fresh seeds.

mod fresh;
mod plan;

#[cfg(test)]
mod tests;

pub use fresh::{FalseAlarms, Fresh, a_a, fresh};
pub use plan::Plan;

use crate::SuiteError;
use crate::results::{Results, to_csv};
use serde::{Deserialize, Serialize};
use std::path::Path;
use strandbench_score::Score;

/// A figure that is not what the reference says.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Change {
    /// Scene.
    pub scene: String,
    /// Variant.
    pub variant: String,
    /// Seed.
    pub seed: u64,
    /// Metric, or its coverage.
    pub metric: String,
    /// Unit.
    pub unit: String,
    /// In the reference; `None` is the worst answer.
    pub reference: Option<f64>,
    /// Now.
    pub now: Option<f64>,
    /// How far it may move.
    pub tolerance: f64,
    /// Whether it became better.
    pub better: bool,
}

/// What the numeric gate found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Held {
    /// Cells evaluated.
    pub cells: usize,
    /// Figures held against the reference.
    pub figures: usize,
    /// Figures that moved beyond their tolerance, to the better or the worse.
    pub changes: Vec<Change>,
    /// Everything else that fails the gate: cells missing, failed or unknown, another protocol.
    pub faults: Vec<String>,
}

impl Held {
    /// Whether the gate is open: something was evaluated and nothing is wrong.
    pub fn passes(&self) -> bool {
        self.figures > 0 && self.changes.is_empty() && self.faults.is_empty()
    }
}

/// Holds results against the reference, cell by cell and figure by figure.
pub fn hold(reference: &[Results], now: &[Results], plan: &Plan) -> Held {
    let mut held = Held { cells: 0, figures: 0, changes: Vec::new(), faults: Vec::new() };
    for r in reference {
        let Some(n) = now.iter().find(|n| n.variant == r.variant) else {
            held.faults.push(format!("variant {} of the reference was not run", r.variant));
            continue;
        };
        if n.protocol != r.protocol {
            held.faults.push(format!(
                "{}: protocol {:?} now, {:?} in the reference",
                r.variant, n.protocol, r.protocol
            ));
        }
        for ((scene, seed), was) in &r.cells {
            let at = format!("{scene} by {}, seed {seed}", r.variant);
            match n.cells.get(&(scene.clone(), *seed)) {
                None => held.faults.push(format!("{at}: not run")),
                Some(is) if is.trouble.is_some() => {
                    held.faults.push(format!("{at}: {}", is.trouble.as_deref().unwrap_or_default()));
                }
                Some(is) => {
                    held.cells += 1;
                    hold_cell(&mut held, plan, (scene, &r.variant, *seed), &was.scores, &is.scores);
                }
            }
        }
    }
    for n in now {
        let known = reference.iter().find(|r| r.variant == n.variant);
        for (scene, seed) in n.cells.keys().filter(|k| known.is_none_or(|r| !r.cells.contains_key(*k))) {
            held.faults.push(format!("{scene} by {}, seed {seed}: not in the reference", n.variant));
        }
    }
    if held.figures == 0 {
        held.faults.push("nothing was evaluated".to_owned());
    }
    held
}

fn hold_cell(
    held: &mut Held,
    plan: &Plan,
    (scene, variant, seed): (&str, &str, u64),
    was: &[Score],
    is: &[Score],
) {
    let method = |all: &[Score]| all.iter().filter(|s| s.subject == "method").cloned().collect::<Vec<_>>();
    let (was, is) = (method(was), method(is));
    for w in &was {
        let Some(i) = is.iter().find(|i| i.metric == w.metric) else {
            held.faults.push(format!("{scene} by {variant}, seed {seed}: has no {} any more", w.metric));
            continue;
        };
        held.figures += 1;
        let tolerance = plan.tolerance_of(&w.metric, &w.unit);
        let shares = plan.tolerance_of("share", "share");
        for (name, unit, reference, now, tolerance, lower) in [
            (w.metric.clone(), w.unit.clone(), w.value, i.value, tolerance, w.lower_is_better),
            (
                format!("{} (coverage)", w.metric),
                "share".to_owned(),
                Some(w.coverage),
                Some(i.coverage),
                shares,
                false,
            ),
        ] {
            let same = match (reference, now) {
                (Some(r), Some(n)) => (r - n).abs() <= tolerance,
                (None, None) => true,
                _ => false,
            };
            if !same {
                let worst = if lower { f64::INFINITY } else { f64::NEG_INFINITY };
                let size = |v: Option<f64>| v.map_or(worst, |v| if lower { v.abs() } else { v });
                let better = if lower { size(now) < size(reference) } else { size(now) > size(reference) };
                let (scene, variant) = (scene.to_owned(), variant.to_owned());
                held.changes.push(Change {
                    scene,
                    variant,
                    seed,
                    metric: name,
                    unit,
                    reference,
                    now,
                    tolerance,
                    better,
                });
            }
        }
    }
    for i in is.iter().filter(|i| !was.iter().any(|w| w.metric == i.metric)) {
        held.faults.push(format!("{scene} by {variant}, seed {seed}: {} is not in the reference", i.metric));
    }
}

/// Writes results as the new reference, whole or not at all.
///
/// # Errors
/// If a cell was not scored, there is none, or the file cannot be written.
pub fn accept(now: &[Results], file: &Path) -> Result<usize, SuiteError> {
    let failed: Vec<String> = now
        .iter()
        .flat_map(|r| r.cells.iter().filter_map(move |(k, c)| Some((r, k, c.trouble.as_ref()?))))
        .map(|(r, k, why)| format!("{} by {}, seed {}: {why}", k.0, r.variant, k.1))
        .collect();
    if !failed.is_empty() {
        let problem =
            format!("is left as it is: a cell without a score cannot be accepted ({})", failed.join("; "));
        return Err(SuiteError::file(file, problem));
    }
    let lines: Vec<_> = now.iter().flat_map(Results::lines).collect();
    if lines.is_empty() {
        return Err(SuiteError::file(file, "is left as it is: nothing was evaluated"));
    }
    strandbench_io::atomic_write(file, |w| w.write_all(to_csv(&lines).as_bytes()))?;
    Ok(lines.len())
}

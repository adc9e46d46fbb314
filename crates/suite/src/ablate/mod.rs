//! Ablations: what the papers show in pictures, as paired numbers with intervals.
//!
//! Each arm is run at the variant's own weight of smoothness and at the weight that does best on scenes kept apart, found with
//! the same trials for every arm. Arms are compared on the same renders, noise and seeds; a cell that fails
//! counts as the worst answer.

mod cells;
mod figure;
mod judge;
mod page;
mod table;

pub use cells::{Plan, Set};
pub use judge::Comparison;
pub use table::{ABLATIONS, Ablation, Arm};

use crate::cell::{Outcome, Row};
use crate::results::to_csv;
use crate::stage::{Progress, write_json};
use crate::{Provenance, SuiteError, history, score_cell};
use cells::{Case, cell, lambda};
use serde::Serialize;
use std::path::{Path, PathBuf};
use strandbench_io::atomic_folder;

/// The page of an ablation's folder.
pub const PAGE: &str = "ablation.html";

/// An arm's weight of smoothness.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Tuned {
    /// The arm.
    pub arm: String,
    /// The variant's own weight λ.
    pub own_lambda: f32,
    /// The weight that did best on the tuning scenes.
    pub lambda: f32,
    /// Every weight tried, with the mean of the primary metric over the tuning scenes; `None` where one gave no answer.
    pub tried: Vec<(f32, Option<f64>)>,
}

/// One case under one arm.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ArmRow {
    /// The arm.
    pub arm: String,
    /// Whether with the tuned weight or the variant's own.
    pub tuned: bool,
    /// Name of the condition.
    pub condition: String,
    /// The catalogue's name of the scene.
    pub scene_name: String,
    /// Figures, or how it failed.
    pub row: Row,
}

/// What came out.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Outcomes {
    /// Name of the ablation.
    pub name: String,
    /// `small`, `full`, or `own` for scenes of one's own.
    pub set: String,
    /// Where the paper answers it.
    pub source: String,
    /// What the paper says.
    pub claim: String,
    /// Weights of the arms; empty if the ablation does not tune.
    pub tuned: Vec<Tuned>,
    /// Every comparison of the paper's arm with another.
    pub comparisons: Vec<Comparison>,
    /// A sentence an arm: whether the claim is reproduced, and where not.
    pub sentences: Vec<String>,
    /// Every cell.
    pub rows: Vec<ArmRow>,
    /// Where page, tables and pictures lie.
    pub folder: PathBuf,
    /// Who made it.
    pub provenance: Provenance,
    /// Why the ablation is not in the history, if it is not; the results stand all the same.
    #[serde(skip)]
    pub history_problem: Option<String>,
}

/// Seconds of a reconstruction with its scores on two processors, roughly.
const ARM_S: f64 = 6.0;

/// Work that is still to be done, and roughly how long it takes on this machine.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Forecast {
    /// Frames to render.
    pub renders: u64,
    /// Reconstructions of a frame.
    pub reconstructions: u64,
    /// Wall-clock seconds.
    pub seconds: f64,
}

/// What `ablate` would still have to do below `out`: what is there is taken as current.
///
/// # Errors
/// If a scene or a variant cannot be read, or a scene does not move where it must.
pub fn forecast(ablation: &Ablation, plan: &Plan, out: &Path) -> Result<Forecast, SuiteError> {
    check(ablation, plan)?;
    let mut renders = std::collections::BTreeSet::new();
    let mut reconstructions = 0;
    let mut add = |case: &Case, factor: f32| -> Result<(), SuiteError> {
        for arm in ablation.arms() {
            let cell = cell(plan, case, arm, factor)?;
            let places = cell.places(out);
            let frames = cell.frame_count()?;
            if !places.render.is_dir() {
                renders.insert((places.render, frames));
            }
            reconstructions += if places.score.is_dir() { 0 } else { frames };
        }
        Ok(())
    };
    for case in &plan.tuning {
        for &factor in &plan.factors {
            add(case, factor)?;
        }
    }
    for case in &plan.cases {
        add(case, 1.0)?;
        if plan.tunes() {
            // Whatever the tuning will find, it is at most one more of each arm.
            add(case, 2.0)?;
        }
    }
    let renders: u64 = renders.iter().map(|r| r.1).sum();
    let speed = 2.0 / rayon::current_num_threads().max(1) as f64;
    let seconds = (renders as f64 * plan.render_s + reconstructions as f64 * ARM_S) * speed;
    Ok(Forecast { renders, reconstructions, seconds })
}

/// Refuses scenes on which the claim cannot be judged, and weights where there are none.
fn check(ablation: &Ablation, plan: &Plan) -> Result<(), SuiteError> {
    if let Some(case) = plan.tuning.first().filter(|_| !ablation.tuned) {
        let problem = format!("{} has no weight that could be tuned on it", ablation.name);
        return Err(SuiteError::Scene { scene: case.scene.clone(), problem });
    }
    for case in &plan.cases {
        let cell = cell(plan, case, &ablation.with, 1.0)?;
        cell.frame_count()?;
        if ablation.moving && !cell.scene.moves() {
            let problem = format!("has one pose; {} is about hair that moves", ablation.name);
            return Err(SuiteError::Scene { scene: cell.scene.name, problem });
        }
    }
    Ok(())
}

/// Runs an ablation; its page, tables and pictures go to `out/ablate/NAME-SET/`, and every cell where `run` has it, so
/// that what is finished is not repeated. Its cells are in the history of `out` like a run's, under the ablation's name.
///
/// # Errors
/// If the work is cancelled, a scene cannot be read or does not move where it must, or the results cannot be written. A
/// cell that fails is a row.
pub fn ablate(
    ablation: &Ablation,
    plan: &Plan,
    out: &Path,
    progress: &dyn Progress,
) -> Result<Outcomes, SuiteError> {
    check(ablation, plan)?;
    let run = |case: &Case, arm: &Arm, factor: f32| -> Result<Row, SuiteError> {
        score_cell(&cell(plan, case, arm, factor)?, out, progress)
    };
    let mut tuned = Vec::new();
    let mut factors = Vec::new();
    for arm in ablation.arms() {
        let (best, record) = tune(ablation, plan, arm, &run)?;
        factors.push(best);
        tuned.extend(record);
    }
    let mut rows = Vec::new();
    for case in &plan.cases {
        for (arm, &best) in ablation.arms().zip(&factors) {
            for (factor, is_tuned) in [(1.0, false), (best, true)] {
                if is_tuned && !plan.tunes() {
                    continue;
                }
                rows.push(ArmRow {
                    arm: arm.label.to_owned(),
                    tuned: is_tuned,
                    condition: case.condition.clone(),
                    scene_name: case.scene.clone(),
                    row: run(case, arm, factor)?,
                });
            }
        }
    }
    let comparisons = judge::compare(ablation, plan.tunes(), &rows)?;
    let sentences = judge::sentences(ablation, &comparisons);
    let folder = out.join("ablate").join(format!("{}-{}", ablation.name, plan.name));
    let mut result = Outcomes {
        name: ablation.name.to_owned(),
        set: plan.name.clone(),
        source: ablation.source.to_owned(),
        claim: ablation.claim.to_owned(),
        tuned,
        comparisons,
        sentences,
        rows,
        folder: folder.clone(),
        provenance: Provenance::here(),
        history_problem: None,
    };
    atomic_folder(&folder, |dir| -> Result<(), SuiteError> {
        let pictures = figure::write(plan, ablation, &factors, &result.rows, out, dir)?;
        write_json(&dir.join("ablation.json"), &result)?;
        let csv = dir.join("ablation.csv");
        std::fs::write(&csv, to_csv(page::lines(&result))).map_err(|e| SuiteError::file(&csv, e))?;
        let html = dir.join(PAGE);
        std::fs::write(&html, page::page(ablation, &result, &pictures))
            .map_err(|e| SuiteError::file(&html, e))
    })?;
    let job = format!("ablate {} ({})", ablation.name, plan.name);
    let appended = history::append(out, &job, once(&result.rows));
    result.history_problem = appended.err().map(|e| e.to_string());
    Ok(result)
}

/// Each cell once, though arms share cells: where the best weight is the variant's own, and where an arm is the variant.
fn once(rows: &[ArmRow]) -> impl Iterator<Item = &Row> {
    let mut seen = std::collections::BTreeSet::new();
    let rows = rows.iter().map(|r| &r.row);
    rows.filter(move |r| seen.insert((r.scene.as_str(), r.variant.as_str(), r.seed)))
}

/// The factor on the arm's weight that does best on the tuning scenes: least mean of the primary metric, of equal ones
/// the nearest to the variant's own. A trial with a scene without an answer is the worst.
fn tune(
    ablation: &Ablation,
    plan: &Plan,
    arm: &Arm,
    run: &dyn Fn(&Case, &Arm, f32) -> Result<Row, SuiteError>,
) -> Result<(f32, Option<Tuned>), SuiteError> {
    if !plan.tunes() {
        return Ok((1.0, None));
    }
    let mut tried: Vec<(f32, Option<f64>)> = Vec::new();
    for &factor in &plan.factors {
        let mut sum = Some(0.0);
        for case in &plan.tuning {
            let value = figure_of(&run(case, arm, factor)?, ablation.primary);
            sum = sum.zip(value).map(|(a, b)| a + b);
        }
        tried.push((factor, sum.map(|s| s / plan.tuning.len() as f64)));
    }
    let best = best_factor(&tried);
    let record = Tuned {
        arm: arm.label.to_owned(),
        own_lambda: lambda(arm, 1.0)?,
        lambda: lambda(arm, best)?,
        tried: tried.iter().map(|&(f, v)| Ok((lambda(arm, f)?, v))).collect::<Result<_, SuiteError>>()?,
    };
    Ok((best, Some(record)))
}

fn best_factor(tried: &[(f32, Option<f64>)]) -> f32 {
    let worst = |v: Option<f64>| v.unwrap_or(f64::INFINITY);
    let by = |a: &&(f32, Option<f64>), b: &&(f32, Option<f64>)| {
        let near = |f: f32| f.ln().abs();
        worst(a.1).total_cmp(&worst(b.1)).then(near(a.0).total_cmp(&near(b.0)))
    };
    tried.iter().min_by(by).map_or(1.0, |t| t.0)
}

/// The method's figure; `None` if the cell failed or the figure is infinite: the worst answer.
fn figure_of(row: &Row, metric: &str) -> Option<f64> {
    match row.outcome {
        Outcome::Ok => row.score(metric, "method").and_then(|s| s.value),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_best_weight_is_the_least_error_and_of_equal_ones_the_least_change() {
        let two = Some(2.0);
        assert_eq!(best_factor(&[(0.5, Some(2.1)), (1.0, two), (2.0, Some(1.9))]), 2.0);
        assert_eq!(best_factor(&[(0.5, two), (1.0, two), (2.0, two)]), 1.0);
        assert_eq!(best_factor(&[(0.5, Some(9.0)), (1.0, None), (2.0, None)]), 0.5);
        assert_eq!(best_factor(&[(0.25, None), (1.0, None)]), 1.0);
    }
}

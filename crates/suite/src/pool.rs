//! Many cells: each its own row and report, then one table over all of them.

use crate::cell::{Outcome, Row};
use crate::report::{costs, index};
use crate::results::{ResultLine, to_csv};
use crate::score::{SCORES, ScoreFile, read_curve};
use crate::stage::{Progress, read_json};
use crate::{Cell, Score, SuiteError, history, run_cell};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use strandbench_io::atomic_write;

/// All rows of a run and what they say together.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// A row a cell, failed ones included, in the order asked for.
    pub rows: Vec<Row>,
    /// Quantiles over all scenes of each variant's and null's raw errors; scenes weigh equally.
    pub pooled: Vec<Pooled>,
    /// The table over all rows.
    pub index: PathBuf,
    /// Why the run is not in the history, if it is not; the results stand all the same.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub history_problem: Option<String>,
}

/// |A1 error| of one subject over all scenes of a variant: raw errors pooled, each scene with the same weight.
/// A failed cell counts as a scene without any answer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pooled {
    /// Variant.
    pub variant: String,
    /// `method` or a null.
    pub subject: String,
    /// Scenes pooled.
    pub scenes: usize,
    /// Median, mm; `None` if infinite.
    pub median_mm: Option<f64>,
    /// 90th percentile, mm; `None` if infinite.
    pub p90_mm: Option<f64>,
    /// 95th percentile, mm; `None` if infinite.
    pub p95_mm: Option<f64>,
    /// Share of pixels within 10 mm.
    pub within_10mm: f64,
}

/// Runs every cell, whatever becomes of the others, and writes the table over all of them into `out`: figures alone
/// (`index.html`, `results.json`, `results.csv`), cost alone (`costs.html`), and both (`index.json`). Stopped after the
/// first cell, it still writes them: what was not run is a row too.
///
/// # Errors
/// If the work is cancelled, or the index cannot be written.
pub fn run_all(cells: &[Cell], out: &Path, progress: &dyn Progress) -> Result<Summary, SuiteError> {
    let mut rows = Vec::new();
    for cell in cells {
        match run_cell(cell, out, progress) {
            Err(SuiteError::Cancelled) if !rows.is_empty() => {
                rows.extend(cells[rows.len()..].iter().map(|cell| Row::empty(cell, Outcome::NotRun)));
                summarise(rows, out)?;
                return Err(SuiteError::Cancelled);
            }
            row => rows.push(row?),
        }
    }
    summarise(rows, out)
}

/// The figures of a run alone: nothing in it depends on the machine, the number of threads or the time, and so neither on
/// whether one process made the cells or many.
#[derive(Serialize)]
struct Accuracy<'a> {
    rows: Vec<AccuracyRow<'a>>,
    pooled: &'a [Pooled],
}

/// A [`Row`] without cost and places.
#[derive(Serialize)]
struct AccuracyRow<'a> {
    scene: &'a str,
    variant: &'a str,
    seed: u64,
    #[serde(flatten)]
    outcome: &'a Outcome,
    protocol: &'a str,
    scores: &'a [Score],
}

impl AccuracyRow<'_> {
    fn of(row: &Row) -> AccuracyRow<'_> {
        let Row { scene, variant, seed, outcome, protocol, scores, .. } = row;
        AccuracyRow { scene, variant, seed: *seed, outcome, protocol, scores }
    }
}

/// Writes what all rows say together into `out`, and adds them to the history.
///
/// # Errors
/// If raw errors cannot be read or a file cannot be written.
pub(crate) fn summarise(rows: Vec<Row>, out: &Path) -> Result<Summary, SuiteError> {
    let pooled = pool(&rows)?;
    let history_problem = history::append(out, "run", &rows).err().map(|e| e.to_string());
    let summary = Summary { rows, pooled, index: out.join("index.html"), history_problem };
    let accuracy =
        Accuracy { rows: summary.rows.iter().map(AccuracyRow::of).collect(), pooled: &summary.pooled };
    for (name, text) in [
        ("index.html", index::page(&summary, out)),
        (COSTS, costs::page(&summary)),
        ("results.csv", to_csv(ResultLine::all(&summary.rows))),
        ("results.json", json(&accuracy)),
        ("index.json", json(&summary)),
    ] {
        atomic_write(&out.join(name), |w| w.write_all(text.as_bytes()))?;
    }
    Ok(summary)
}

/// What the cells cost, apart from what they are worth.
pub(crate) const COSTS: &str = "costs.html";

fn json(value: &impl Serialize) -> String {
    serde_json::to_string_pretty(value).expect("figures and texts are plain data") + "\n"
}

fn pool(rows: &[Row]) -> Result<Vec<Pooled>, SuiteError> {
    let mut variants: Vec<&str> = Vec::new();
    for row in rows {
        if !variants.contains(&row.variant.as_str()) {
            variants.push(&row.variant);
        }
    }
    let mut pooled = Vec::new();
    for variant in variants {
        let mut curves: Vec<(String, Vec<Vec<f32>>)> = vec![("method".to_owned(), Vec::new())];
        let mut failed = 0;
        for row in rows.iter().filter(|r| r.variant == variant) {
            let Some(dir) = &row.score_dir else {
                debug_assert_ne!(row.outcome, Outcome::Ok);
                failed += 1;
                continue;
            };
            let file: ScoreFile = read_json(&dir.join(SCORES))?;
            for curve in file.curves.iter().filter(|c| c.metric == "A1") {
                let errors = read_curve(dir, curve)?;
                match curves.iter_mut().find(|(name, _)| *name == curve.subject) {
                    Some((_, all)) => all.push(errors),
                    None => curves.push((curve.subject.clone(), vec![errors])),
                }
            }
        }
        for (subject, mut scenes) in curves {
            if subject == "method" {
                scenes.extend(std::iter::repeat_n(vec![f32::INFINITY], failed));
            }
            if !scenes.is_empty() {
                pooled.push(quantiles(variant, &subject, &scenes));
            }
        }
    }
    Ok(pooled)
}

fn quantiles(variant: &str, subject: &str, scenes: &[Vec<f32>]) -> Pooled {
    let share = 1.0 / scenes.len() as f64;
    let mut all: Vec<(f32, f64)> = scenes
        .iter()
        .flat_map(|errors| errors.iter().map(move |&e| (e, share / errors.len() as f64)))
        .collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    let at = |q: f64| {
        let mut sum = 0.0;
        let found = all.iter().find(|(_, w)| {
            sum += w;
            sum >= q - 1e-12
        });
        found.map(|(e, _)| f64::from(*e)).filter(|e| e.is_finite())
    };
    // An empty sum is -0.
    let within = all.iter().filter(|(e, _)| *e <= 10.0).map(|(_, w)| w).sum::<f64>() + 0.0;
    Pooled {
        variant: variant.to_owned(),
        subject: subject.to_owned(),
        scenes: scenes.len(),
        median_mm: at(0.5),
        p90_mm: at(0.9),
        p95_mm: at(0.95),
        within_10mm: within,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scenes_weigh_equally_and_absent_answers_stay_infinite() {
        let big: Vec<f32> = (1..=900).map(|i| i as f32 / 900.0).collect();
        let small = vec![5.0, 20.0];
        let p = quantiles("v", "method", &[big, small]);
        assert_eq!(p.median_mm, Some(1.0), "the big scene is half of the weight, all of it below 5 mm");
        assert_eq!(p.p90_mm, Some(20.0));
        assert!((p.within_10mm - 0.75).abs() < 1e-9);
        let p = quantiles("v", "method", &[vec![1.0], vec![f32::INFINITY]]);
        assert_eq!((p.median_mm, p.p90_mm), (Some(1.0), None));
        let none = quantiles("v", "method", &[vec![f32::INFINITY]]);
        assert!(none.within_10mm == 0.0 && none.within_10mm.is_sign_positive());
    }
}

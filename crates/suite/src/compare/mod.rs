//! Two variants, or two earlier results, scene by scene.

pub(crate) mod drawing;
mod page;
mod pairs;
pub(crate) mod text;

#[cfg(test)]
mod tests;

use crate::SuiteError;
use crate::results::{CellResult, Results};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use strandbench_stats::{Difference, Options, Verdict, holm};
use strandbench_types::Monitor;

pub(crate) use pairs::{Pair, by_metric, raw_errors};
pub use text::{markdown, table};

/// Metrics declared ahead, on which decisions rest (the rest is exploratory). Those that neither side claims are left out of
/// the correction.
pub const PRIMARY: &[&str] = &["A1.median", "B1.f_2mm.cc", "B3.idf1", "C1.noise_sd", "C2.regrown.mean"];

/// Largest p, corrected, that counts as a difference.
pub const LEVEL: f64 = 0.05;

/// What to compare and how.
#[derive(Clone, Debug, Default)]
pub struct Question {
    /// Compare the scenes that both have where the sets differ, instead of refusing.
    pub allow_unequal: bool,
    /// What counts as no loss, by metric, in the metric's unit.
    pub margins: BTreeMap<String, f64>,
    /// Statistics; whether lower is better is taken from each metric.
    pub options: Options,
}

/// One side.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Side {
    /// Variant.
    pub variant: String,
    /// Where its figures were read.
    pub source: PathBuf,
    /// Cells that were not scored, with the reason: they count as the worst answer.
    pub failed: Vec<String>,
}

/// One metric.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Compared {
    /// Metric.
    pub metric: String,
    /// Unit.
    pub unit: String,
    /// Whether lower is better.
    pub lower_is_better: bool,
    /// `b - a`.
    pub difference: Difference,
    /// p by Holm's correction over the primary metrics; `None` for an exploratory one.
    pub p_holm: Option<f64>,
    /// What counts as no loss; 0 if no margin was declared.
    pub margin: f64,
    /// What the interval says.
    pub verdict: Verdict,
}

impl Compared {
    /// Whether a primary metric differs at [`LEVEL`].
    pub fn differs(&self) -> bool {
        self.p_holm.is_some_and(|p| p <= LEVEL)
    }

    /// Whether it differs to the worse: fewer scenes won than lost, or a mean on the worse side.
    pub fn loses(&self) -> bool {
        let d = &self.difference;
        let worse = match d.mean {
            Some(mean) => (mean > 0.0) == self.lower_is_better && mean != 0.0,
            None => d.won < 1.0 - d.won - d.tied,
        };
        self.differs() && worse
    }
}

/// `compare.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Comparison {
    /// Baseline.
    pub a: Side,
    /// The other.
    pub b: Side,
    /// Protocol of both.
    pub protocol: String,
    /// Cells compared.
    pub cells: usize,
    /// Scenes compared: what is resampled.
    pub scenes: usize,
    /// Least p that as many scenes can give.
    pub smallest_p: f64,
    /// Confidence of the intervals.
    pub confidence: f64,
    /// Resamples.
    pub resamples: u32,
    /// Seed of the resamples.
    pub seed: u64,
    /// Cells that one side does not have.
    pub left_out: Vec<String>,
    /// Metrics that one side alone has, and are not compared.
    pub one_sided: Vec<String>,
    /// Declared metrics, p corrected for their number.
    pub primary: Vec<Compared>,
    /// All others: no correction, no decision.
    pub exploratory: Vec<Compared>,
}

/// When a comparison fails a build.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FailIf {
    /// A primary metric is worse at [`LEVEL`], or b failed on a cell that a answered.
    Worse,
    /// A primary metric differs at [`LEVEL`] in either direction, or one side alone failed on a cell.
    Different,
    /// A primary metric is not shown to be within its margin (or better), or b failed on a cell that a answered.
    Inferior,
    /// Never.
    Never,
}

impl Comparison {
    /// Why the rule fails the comparison; empty if it does not.
    pub fn faults(&self, rule: FailIf) -> Vec<String> {
        let failed_more = |x: &Side, y: &Side| {
            let only = x.failed.iter().filter(|f| !y.failed.iter().any(|g| cell_of(g) == cell_of(f)));
            only.map(|f| format!("{} failed on {f}", x.variant)).collect::<Vec<_>>()
        };
        let mut faults = match rule {
            FailIf::Never => return Vec::new(),
            FailIf::Worse | FailIf::Inferior => failed_more(&self.b, &self.a),
            FailIf::Different => [failed_more(&self.b, &self.a), failed_more(&self.a, &self.b)].concat(),
        };
        for m in &self.primary {
            let p = m.p_holm.unwrap_or(1.0);
            let (at_fault, why) = match rule {
                FailIf::Worse => (m.loses(), format!("is worse (p {p:.4} after Holm)")),
                FailIf::Different => (m.differs(), format!("differs (p {p:.4} after Holm)")),
                FailIf::Inferior => {
                    let good =
                        [Verdict::Better, Verdict::Equivalent, Verdict::NotInferior].contains(&m.verdict);
                    (!good, format!("is not shown to lose less than {} {}", m.margin, m.unit))
                }
                FailIf::Never => (false, String::new()),
            };
            if at_fault {
                faults.push(format!("{} {why}", m.metric));
            }
        }
        faults
    }
}

/// The cell of a failure's text.
fn cell_of(failure: &str) -> &str {
    failure.split_once(": ").map_or(failure, |f| f.0)
}

/// Compares two results.
///
/// # Errors
/// If the protocols differ or neither side was scored, the cells differ (unless allowed) or none is common, a margin is for a metric that
/// is not primary, raw errors cannot be read, or the work is cancelled.
pub fn compare(
    a: &Results,
    b: &Results,
    question: &Question,
    monitor: &dyn Monitor,
) -> Result<Comparison, SuiteError> {
    let refused = |problem: String| SuiteError::Compare { a: name(a), b: name(b), problem };
    let protocols: BTreeSet<&str> =
        [a, b].map(|r| r.protocol.as_str()).into_iter().filter(|p| !p.is_empty()).collect();
    let protocol = match protocols.iter().collect::<Vec<_>>()[..] {
        [one] => (*one).to_owned(),
        [] => return Err(refused("no cell of either was scored: there is nothing to compare".to_owned())),
        _ => {
            let problem = "they follow different protocols, whose figures cannot be compared; score the older one again";
            return Err(refused(format!("{problem} ({} and {})", a.protocol, b.protocol)));
        }
    };
    let keys: BTreeSet<&(String, u64)> = a.cells.keys().chain(b.cells.keys()).collect();
    let (both, alone): (Vec<_>, Vec<_>) =
        keys.into_iter().partition(|k| a.cells.contains_key(*k) && b.cells.contains_key(*k));
    let left_out: Vec<String> = alone
        .iter()
        .map(|k| {
            format!("{}, seed {} (only {})", k.0, k.1, name(if a.cells.contains_key(*k) { a } else { b }))
        })
        .collect();
    if both.is_empty() {
        return Err(refused("they have no scene and seed in common".to_owned()));
    }
    if !left_out.is_empty() && !question.allow_unequal {
        let problem = format!(
            "{} of {} cells are not on both sides: {}. ",
            left_out.len(),
            both.len() + alone.len(),
            left_out.join("; ")
        );
        return Err(refused(problem + "Run what is missing, or say --allow-unequal to compare the rest"));
    }
    let mut metrics: Vec<&str> = Vec::new();
    for cell in a.cells.values().chain(b.cells.values()) {
        for s in cell.scores.iter().filter(|s| s.subject == "method") {
            if !metrics.contains(&s.metric.as_str()) {
                metrics.push(&s.metric);
            }
        }
    }
    let claims = |r: &Results, m: &str| {
        let scored = |c: &&CellResult| c.trouble.is_none();
        !r.cells.values().any(|c| scored(&c)) || r.cells.values().any(|c| c.score(m).is_some())
    };
    let (shared, one_sided): (Vec<&str>, Vec<&str>) =
        metrics.into_iter().partition(|m| claims(a, m) && claims(b, m));
    if let Some(stray) =
        question.margins.keys().find(|m| !PRIMARY.contains(&m.as_str()) || !shared.contains(&m.as_str()))
    {
        let problem = format!(
            "a margin is declared for {stray}, which is no primary metric that both have ({})",
            PRIMARY.join(", ")
        );
        return Err(refused(problem));
    }

    monitor.begin("compare", shared.len() as u64);
    let pairs: Vec<Pair<'_>> = both.iter().map(|k| (*k, &a.cells[*k], &b.cells[*k])).collect();
    let units = raw_errors(&pairs)?;
    let (mut primary, mut exploratory) = (Vec::new(), Vec::new());
    for metric in shared {
        monitor.check()?;
        let margin = question.margins.get(metric).copied().unwrap_or(0.0);
        let compared = by_metric(&pairs, &units, metric, &question.options, margin).map_err(refused)?;
        let into = if PRIMARY.contains(&metric) { &mut primary } else { &mut exploratory };
        into.push(compared);
        monitor.advance(1);
    }
    let Some(scenes) = primary.first().map(|m| m.difference.scenes) else {
        return Err(refused(format!("they share no primary metric ({})", PRIMARY.join(", "))));
    };
    let corrected = holm(&primary.iter().map(|m| m.difference.p).collect::<Vec<_>>());
    primary.iter_mut().zip(corrected).for_each(|(m, p)| m.p_holm = Some(p));
    Ok(Comparison {
        a: side(a, &both),
        b: side(b, &both),
        protocol,
        cells: both.len(),
        scenes,
        smallest_p: 0.5f64.powi(scenes as i32 - 1),
        confidence: question.options.confidence,
        resamples: question.options.resamples,
        seed: question.options.seed,
        left_out,
        one_sided: one_sided.into_iter().map(str::to_owned).collect(),
        primary,
        exploratory,
    })
}

fn name(results: &Results) -> String {
    format!("{} of {}", results.variant, results.source.display())
}

fn side(results: &Results, both: &[&(String, u64)]) -> Side {
    let of = both.iter().filter_map(|k| Some((k, results.cells[*k].trouble.as_ref()?)));
    let failed = of.map(|(k, why)| format!("{}, seed {}: {why}", k.0, k.1)).collect();
    Side { variant: results.variant.clone(), source: results.source.clone(), failed }
}

/// Writes `compare.html`, `compare.json` and `compare.md` into a folder, each whole or not at all.
///
/// # Errors
/// If the folder or a file cannot be written.
pub fn write(comparison: &Comparison, folder: &Path) -> Result<(), SuiteError> {
    std::fs::create_dir_all(folder).map_err(|e| SuiteError::file(folder, e))?;
    let json = serde_json::to_string_pretty(comparison).map_err(|e| SuiteError::file(folder, e))? + "\n";
    for (file, text) in [
        ("compare.html", page::page(comparison)),
        ("compare.md", text::markdown(comparison)),
        ("compare.json", json),
    ] {
        strandbench_io::atomic_write(&folder.join(file), |w| w.write_all(text.as_bytes()))?;
    }
    Ok(())
}

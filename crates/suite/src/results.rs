//! Figures of an earlier run, from its folder, its `index.json` or a CSV.

mod read;

use crate::SuiteError;
use crate::cell::Row;
use read::{from_csv, from_index};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use strandbench_score::Score;

/// The method's figures of one variant, a cell each.
#[derive(Clone, Debug, PartialEq)]
pub struct Results {
    /// Variant.
    pub variant: String,
    /// The file that they were read from.
    pub source: PathBuf,
    /// Protocol version and content hash of the cells that were scored; empty if none was.
    pub protocol: String,
    /// Cells by scene and seed. The seed is no part of the scene's name.
    pub cells: BTreeMap<(String, u64), CellResult>,
}

/// One cell of [`Results`].
#[derive(Clone, Debug, PartialEq)]
pub struct CellResult {
    /// What became of it, if it was not scored.
    pub trouble: Option<String>,
    /// Figures of the method, and of the null N1 where they are known; empty if it was not scored.
    pub scores: Vec<Score>,
    /// Folder of raw errors, where there is one.
    pub score_dir: Option<PathBuf>,
}

impl CellResult {
    /// The method's figure.
    pub fn score(&self, metric: &str) -> Option<&Score> {
        self.scores.iter().find(|s| s.metric == metric && s.subject == "method")
    }
}

impl From<&Row> for CellResult {
    fn from(row: &Row) -> CellResult {
        let kept = row.scores.iter().filter(|s| ["method", "N1"].contains(&s.subject.as_str()));
        CellResult {
            trouble: row.outcome.trouble(),
            scores: kept.cloned().collect(),
            score_dir: row.score_dir.clone(),
        }
    }
}

/// The part of `index.json` that is read.
#[derive(Deserialize)]
struct Index {
    rows: Vec<Row>,
}

/// One line of a CSV of results.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Line {
    /// Scene with overrides, without its seed.
    pub scene: String,
    /// Variant.
    pub variant: String,
    /// Seed.
    pub seed: u64,
    /// Metric.
    pub metric: String,
    /// Unit.
    pub unit: String,
    /// The method's value; empty for the worst answer.
    pub value: Option<f64>,
    /// Share of what was wanted that was answered, 0..1.
    pub coverage: f64,
    /// Protocol version and content hash.
    pub protocol: String,
    /// What became of a cell that was not scored, which then is one line without a metric; as `ResultLine` has it.
    #[serde(default, skip_serializing)]
    pub trouble: String,
}

/// One line of a run's `results.csv`: as [`Line`], cells that were not scored included.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct ResultLine {
    scene: String,
    variant: String,
    seed: u64,
    metric: String,
    unit: String,
    value: Option<f64>,
    coverage: f64,
    protocol: String,
    trouble: String,
}

impl ResultLine {
    /// The method's figures of all rows in their order; a row that was not scored is one line without a metric.
    pub(crate) fn all(rows: &[Row]) -> Vec<ResultLine> {
        let mut lines = Vec::new();
        for row in rows {
            let bare = ResultLine {
                scene: without_seed(&row.scene),
                variant: row.variant.clone(),
                seed: row.seed,
                metric: String::new(),
                unit: String::new(),
                value: None,
                coverage: 0.0,
                protocol: row.protocol.clone(),
                trouble: row.outcome.trouble().unwrap_or_default(),
            };
            let own = row.scores.iter().filter(|s| s.subject == "method").map(|s| ResultLine {
                metric: s.metric.clone(),
                unit: s.unit.clone(),
                value: s.value,
                coverage: s.coverage,
                ..bare.clone()
            });
            lines.extend(own);
            if !bare.trouble.is_empty() {
                lines.push(bare);
            }
        }
        lines
    }
}

/// Records as CSV, a line each after the fields' names.
pub(crate) fn to_csv<T: Serialize>(records: impl IntoIterator<Item = T>) -> String {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for record in records {
        writer.serialize(record).expect("numbers and texts always fit a line");
    }
    String::from_utf8(writer.into_inner().expect("memory takes every byte")).expect("written as text")
}

/// A scene's name without the seed that its folder's name may carry.
pub(crate) fn without_seed(label: &str) -> String {
    let mut parts = label.split('+');
    let name = parts.next().unwrap_or_default().to_owned();
    parts.filter(|p| !p.starts_with("seed=")).fold(name, |name, part| name + "+" + part)
}

impl Results {
    /// Reads all variants of a run folder, an `index.json` or a CSV.
    ///
    /// # Errors
    /// If it cannot be read, holds a cell twice, a value that is no number, an unknown metric, cells of several protocols, or nothing.
    pub fn read(path: &Path) -> Result<Vec<Results>, SuiteError> {
        let file = if path.is_dir() { path.join("index.json") } else { path.to_owned() };
        if !file.is_file() {
            let remedy = "there is no such file; `strandbench run` leaves an index.json in its folder";
            return Err(SuiteError::file(&file, remedy));
        }
        let csv = file.extension().is_some_and(|e| e.eq_ignore_ascii_case("csv"));
        let all = if csv { from_csv(&file)? } else { from_index(&file)? };
        if all.is_empty() {
            return Err(SuiteError::file(&file, "holds no cell; nothing can be said from it"));
        }
        Ok(all)
    }

    /// The results called `name`: a variant of the run in `out`, or a path to results of a single variant; `PATH:VARIANT` names one of
    /// several.
    ///
    /// # Errors
    /// As [`Results::read`], and if there is no such variant or several.
    pub fn find(name: &str, out: &Path) -> Result<Results, SuiteError> {
        let refused = |path: &Path, problem: String| Err(SuiteError::file(path, problem));
        let (path, variant) = match name.rsplit_once(':') {
            _ if Path::new(name).exists() => (Path::new(name), None),
            Some((path, variant)) if Path::new(path).exists() => (Path::new(path), Some(variant)),
            _ if name.contains(['/', '\\']) || name.ends_with(".csv") || name.ends_with(".json") => {
                return refused(Path::new(name), "there is no such file or folder".to_owned());
            }
            _ => (out, Some(name)),
        };
        let mut all = Results::read(path)?;
        let names: Vec<&str> = all.iter().map(|r| r.variant.as_str()).collect();
        let listed = names.join(", ");
        let at = match variant {
            Some(wanted) => names.iter().position(|n| *n == wanted),
            None if all.len() == 1 => Some(0),
            None => {
                return refused(
                    path,
                    format!("holds several variants: {listed}; say which with PATH:VARIANT"),
                );
            }
        };
        match at {
            Some(at) => Ok(all.swap_remove(at)),
            None => refused(
                path,
                format!(
                    "has no variant {:?}; it holds {listed}. The index is of the last run: name all variants in one \
                     `strandbench run` (what is unchanged is re-used)",
                    variant.unwrap_or_default()
                ),
            ),
        }
    }

    /// The lines of a CSV of all figures.
    pub fn lines(&self) -> Vec<Line> {
        let mut lines = Vec::new();
        for ((scene, seed), cell) in &self.cells {
            for s in cell.scores.iter().filter(|s| s.subject == "method") {
                lines.push(Line {
                    scene: scene.clone(),
                    variant: self.variant.clone(),
                    seed: *seed,
                    metric: s.metric.clone(),
                    unit: s.unit.clone(),
                    value: s.value,
                    coverage: s.coverage,
                    protocol: self.protocol.clone(),
                    trouble: String::new(),
                });
            }
        }
        lines
    }
}

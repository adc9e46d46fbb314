//! Figures of an earlier run, from its folder, its `index.json` or a CSV.

use crate::SuiteError;
use crate::cell::{Outcome, Row};
use crate::stage::read_json;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use strandbench_score::{Score, metric};

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

/// Gathers cells by variant, in the order in which variants come.
#[derive(Default)]
struct Gather(Vec<Results>);

impl Gather {
    fn of(&mut self, file: &Path, variant: &str, protocol: &str) -> Result<&mut Results, SuiteError> {
        let at = self.0.iter().position(|r| r.variant == variant).unwrap_or_else(|| {
            let (variant, source) = (variant.to_owned(), file.to_owned());
            self.0.push(Results { variant, source, protocol: String::new(), cells: BTreeMap::new() });
            self.0.len() - 1
        });
        let results = &mut self.0[at];
        if results.protocol.is_empty() {
            protocol.clone_into(&mut results.protocol);
        } else if !protocol.is_empty() && results.protocol != protocol {
            let problem = format!(
                "{variant} holds results of two protocols, {} and {protocol}; run it again with one program",
                results.protocol
            );
            return Err(SuiteError::file(file, problem));
        }
        Ok(results)
    }
}

fn from_index(file: &Path) -> Result<Vec<Results>, SuiteError> {
    let index: Index = read_json(file)?;
    let folder = file.parent().unwrap_or(Path::new("."));
    let mut gather = Gather::default();
    for row in index.rows {
        let key = (without_seed(&row.scene), row.seed);
        let variant = folder.join(&row.scene).join(&row.variant);
        let results = gather.of(file, &row.variant, &row.protocol)?;
        if results.cells.contains_key(&key) {
            return Err(twice(file, &row.variant, &key));
        }
        let scored = row.outcome == Outcome::Ok;
        if scored && !row.scores.iter().any(|s| s.subject == "method") {
            let problem = format!(
                "{}, {}, seed {} counts as scored but has no figure",
                row.scene, row.variant, row.seed
            );
            return Err(SuiteError::file(file, problem));
        }
        let cell = CellResult { score_dir: scored.then(|| variant.join("score")), ..CellResult::from(&row) };
        check(file, &cell)?;
        results.cells.insert(key, cell);
    }
    Ok(gather.0)
}

fn from_csv(file: &Path) -> Result<Vec<Results>, SuiteError> {
    let mut reader = csv::Reader::from_path(file).map_err(|e| SuiteError::file(file, e))?;
    let mut gather = Gather::default();
    for line in reader.deserialize() {
        let line: Line = line.map_err(|e| {
            SuiteError::file(
                file,
                format!("{e}; the columns are scene,variant,seed,metric,unit,value,coverage,protocol"),
            )
        })?;
        let key = (line.scene.clone(), line.seed);
        let results = gather.of(file, &line.variant, &line.protocol)?;
        if line.metric.is_empty() && !line.trouble.is_empty() {
            let cell = CellResult { trouble: Some(line.trouble), scores: Vec::new(), score_dir: None };
            if results.cells.insert(key.clone(), cell).is_some() {
                return Err(twice(file, &line.variant, &key));
            }
            continue;
        }
        let known = known(file, &line.metric)?;
        let cell = results.cells.entry(key.clone()).or_insert_with(|| CellResult {
            trouble: None,
            scores: Vec::new(),
            score_dir: None,
        });
        if cell.score(&line.metric).is_some() || cell.trouble.is_some() {
            return Err(twice(file, &format!("{} of {}", line.metric, line.variant), &key));
        }
        cell.scores.push(Score {
            subject: "method".to_owned(),
            metric: line.metric,
            value: line.value,
            unit: line.unit,
            lower_is_better: known.lower_is_better,
            coverage: line.coverage,
            wanted: 0,
        });
        check(file, cell)?;
    }
    Ok(gather.0)
}

fn twice(file: &Path, what: &str, (scene, seed): &(String, u64)) -> SuiteError {
    SuiteError::file(file, format!("{what} on scene {scene}, seed {seed} occurs twice"))
}

fn known(file: &Path, name: &str) -> Result<&'static strandbench_score::Metric, SuiteError> {
    metric(name).map_err(|e| SuiteError::file(file, format!("{e}; was it made by another version?")))
}

fn check(file: &Path, cell: &CellResult) -> Result<(), SuiteError> {
    for s in &cell.scores {
        let unit = known(file, &s.metric)?.unit;
        if s.value.is_some_and(|v| !v.is_finite()) || !(0.0..=1.0).contains(&s.coverage) {
            let problem = format!("{} is {:?} with coverage {}: not a figure", s.metric, s.value, s.coverage);
            return Err(SuiteError::file(file, problem));
        }
        if s.unit != unit {
            return Err(SuiteError::file(
                file,
                format!("{} is given in {}, not in {unit}", s.metric, s.unit),
            ));
        }
    }
    Ok(())
}

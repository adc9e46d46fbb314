//! Reading results from an `index.json` or a CSV.

use super::{CellResult, Index, Line, Results, without_seed};
use crate::SuiteError;
use crate::cell::Outcome;
use crate::stage::read_json;
use std::collections::BTreeMap;
use std::path::Path;
use strandbench_score::{Score, metric};

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

pub(super) fn from_index(file: &Path) -> Result<Vec<Results>, SuiteError> {
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

pub(super) fn from_csv(file: &Path) -> Result<Vec<Results>, SuiteError> {
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

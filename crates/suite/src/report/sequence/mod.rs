//! The report of a moving scene: a player, what changes over time, and the tables.

mod data;
mod draw;
mod frames;
mod page;
mod plots;

use crate::report::{CSV, JSON, PAGE, csv_of};
use crate::score::ScoreFile;
use crate::sequence::{SequenceFigures, SequenceFile};
use crate::stage::{self, Done, Progress, write_json};
use crate::{Places, SuiteError, hash};
use data::Moving;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Sub-folder of the player's pictures: `<frame>_<what>.jpg`.
pub const PICTURES: &str = "frames";

/// `report.json` of a moving scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SequenceReport {
    /// Which frames of what.
    pub sequence: SequenceFile,
    /// Variant, with overrides.
    pub variant: String,
    /// The result in words.
    pub verdict: String,
    /// Figures of the whole sequence.
    pub scores: ScoreFile,
    /// Figures frame by frame.
    pub frames: SequenceFigures,
    /// Median wall seconds a frame of each step of the method, in order.
    pub steps: Vec<(String, f64)>,
    /// Stages, each for all frames together: key, cost, provenance.
    pub stages: BTreeMap<String, crate::Cost>,
}

/// Makes the report of a scored sequence from its folders.
///
/// # Errors
/// If a stage's folder is missing or damaged, or the work is cancelled; the old report then stands.
pub fn report(places: &Places, variant: &str, progress: &dyn Progress) -> Result<Done, SuiteError> {
    let data = Moving::load(places, variant)?;
    let mut inputs = BTreeMap::from([
        ("code".to_owned(), env!("STRANDBENCH_CODE_REPORT").to_owned()),
        ("variant".to_owned(), variant.to_owned()),
    ]);
    for (name, records) in &data.records {
        let all: BTreeMap<String, String> = records
            .iter()
            .enumerate()
            .map(|(i, r)| (format!("{i:06}"), format!("{} {}", r.key, hash::of_map(&r.files))))
            .collect();
        inputs.insert(name.clone(), hash::of_map(&all));
    }
    stage::run("report", &places.report, inputs, progress, |dir| {
        let pictures = frames::write(&data, &dir.join(PICTURES), progress)?;
        let write = |name: &str, text: String| {
            let path = dir.join(name);
            std::fs::write(&path, text).map_err(|e| SuiteError::file(&path, e))
        };
        write(PAGE, page::page(&data, &pictures))?;
        write(CSV, csv_of(&data.sequence.file.scene, variant, data.scores.seed, &data.scores.scores))?;
        let file = SequenceReport {
            sequence: data.sequence.file.clone(),
            variant: variant.to_owned(),
            verdict: page::verdict(&data),
            scores: data.scores.clone(),
            frames: data.figures.clone(),
            steps: data.steps.clone(),
            stages: data.costs(),
        };
        write_json(&dir.join(JSON), &file)
    })
}

//! One page per scene and variant that opens from disk, and the same figures as JSON and CSV.

pub(crate) mod chart;
pub(crate) mod costs;
mod data;
mod goals;
pub(crate) mod index;
mod lines;
pub(crate) mod page;
pub(crate) mod rig;
mod sections;
pub mod sequence;
pub(crate) mod tables;
mod turntable;
mod views;

use crate::score::{CSV_COLUMNS, csv_line, csv_text};
use crate::stage::{self, Done, Progress, Record, write_json};
use crate::{Places, SuiteError, hash};
use data::Data;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use strandbench_recon::Diagnostics;
use strandbench_score::Score;

/// The page.
pub const PAGE: &str = "report.html";
/// The figures and everything behind them.
pub const JSON: &str = "report.json";
/// The figures, one a line.
pub const CSV: &str = "report.csv";

/// `report.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReportFile {
    /// Scene.
    pub scene: String,
    /// Variant, with overrides.
    pub variant: String,
    /// Seed of hair, sampling, noise and nulls.
    pub seed: u64,
    /// Protocol version and content hash.
    pub protocol: String,
    /// The result in words.
    pub verdict: String,
    /// Figures in the protocol's order.
    pub scores: Vec<Score>,
    /// The method's own account.
    pub diagnostics: Diagnostics,
    /// Stages with keys, inputs, costs and provenance.
    pub stages: Vec<Record>,
    /// The scene as TOML.
    pub scene_toml: String,
}

/// Makes the report of a finished cell from its folders.
///
/// # Errors
/// If a stage's folder is missing or damaged, or the work is cancelled; the old report then stands.
pub fn report(places: &Places, variant: &str, progress: &dyn Progress) -> Result<Done, SuiteError> {
    let mut inputs = BTreeMap::from([("code".to_owned(), env!("STRANDBENCH_CODE_REPORT").to_owned())]);
    inputs.insert("variant".into(), variant.to_owned());
    for folder in [&places.render, &places.reconstruct, &places.score] {
        let record = stage::read_record(folder)?;
        let everything = BTreeMap::from([
            ("key".to_owned(), record.key),
            ("files".to_owned(), hash::of_map(&record.files)),
        ]);
        inputs.insert(record.stage, hash::of_map(&everything));
    }
    stage::run("report", &places.report, inputs, progress, |dir| {
        progress.begin("report", 2);
        let data = Data::load(places, variant)?;
        progress.advance(1);
        progress.check()?;
        let path = dir.join(PAGE);
        std::fs::write(&path, page::page(&data)).map_err(|e| SuiteError::file(&path, e))?;
        let path = dir.join(CSV);
        std::fs::write(&path, csv(&data)).map_err(|e| SuiteError::file(&path, e))?;
        let file = ReportFile {
            scene: data.render.scene.clone(),
            variant: data.variant.clone(),
            seed: data.render.seed,
            protocol: data.scores.protocol.clone(),
            verdict: sections::verdict(&data),
            scores: data.scores.scores.clone(),
            diagnostics: data.diagnostics.clone(),
            stages: data.records.clone(),
            scene_toml: data.render.toml.clone(),
        };
        progress.advance(1);
        write_json(&dir.join(JSON), &file)
    })
}

fn csv(data: &Data) -> String {
    csv_of(&data.render.scene, &data.variant, data.render.seed, &data.scores.scores)
}

/// scene, variant and seed before the scorer's columns.
fn csv_of(scene: &str, variant: &str, seed: u64, scores: &[Score]) -> String {
    let mut text = format!("scene,variant,seed,{CSV_COLUMNS}\n");
    let (scene, variant) = (csv_text(scene), csv_text(variant));
    for s in scores {
        text.push_str(&format!("{scene},{variant},{seed},{}\n", csv_line(s)));
    }
    text
}

//! A run's cells as jobs of a workflow engine, for where one machine does not suffice.
//!
//! [`plan`] names every render and every cell of a matrix by a hash of what its result depends on; [`write()`] makes a
//! Snakemake workflow of it. Its jobs are calls of [`render_job`] and [`cell_job`], each of which does what [`crate::run_all`]
//! does for that cell, in the same folders, and leaves a note when it is done. [`merge`] reads the notes and the cells'
//! folders and writes what `run_all` would have written: it works nothing out anew.
//!
//! ```text
//! OUT/jobs/cell-<key>.json      a finished cell: how it ended, what it cost, and which scores it ended with
//! OUT/jobs/render-<key>.json    a finished render; of a moving scene also render-<key>.motion.json and .<A>..<B>.json
//! ```

mod jobs;
mod merge;
mod write;

#[cfg(test)]
mod tests;

pub use jobs::{Part, cell_job, render_job};
pub use merge::merge;
pub use write::{Files, PLAN, write};

use crate::reconstruct::flat;
use crate::{Cell, Solver, SuiteError, hash};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Folder of the notes that finished jobs leave.
pub const JOBS: &str = "jobs";

const FORMAT: &str = "strandbench-workflow";
const VERSION: u32 = 1;

/// A matrix as jobs: what the engine is told.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plan {
    /// `strandbench-workflow`.
    pub format: String,
    /// 1.
    pub version: u32,
    /// What the command line made the cells from, in its own words: it makes them again in every job.
    pub arguments: serde_json::Value,
    /// Where results go; relative names start at `root`.
    pub out: PathBuf,
    /// Folder in which the jobs work: where the plan was made.
    pub root: PathBuf,
    /// The program.
    pub program: PathBuf,
    /// Worker threads of a job.
    pub threads: u16,
    /// One a scene and seed.
    pub renders: Vec<RenderStep>,
    /// One a scene, seed and method, in the order of the report.
    pub cells: Vec<CellStep>,
}

/// The render that the cells of a scene and seed share.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RenderStep {
    /// Hash of what the images depend on.
    pub key: String,
    /// Folder name of the scene.
    pub scene: String,
    /// Parts of a moving scene that are rendered apart, `A..B` without B; empty if it is one job.
    pub parts: Vec<String>,
}

/// A cell.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CellStep {
    /// Hash of what its figures depend on.
    pub key: String,
    /// Key of its render.
    pub render: String,
    /// Folder name of the scene.
    pub scene: String,
    /// Folder name of the variant.
    pub variant: String,
    /// Seed.
    pub seed: u64,
}

/// What stands around a matrix.
#[derive(Clone, Debug)]
pub struct Around {
    /// See [`Plan::arguments`].
    pub arguments: serde_json::Value,
    /// See [`Plan::out`].
    pub out: PathBuf,
    /// See [`Plan::root`].
    pub root: PathBuf,
    /// See [`Plan::program`].
    pub program: PathBuf,
    /// See [`Plan::threads`].
    pub threads: u16,
    /// Most frames of a moving scene that one job renders; at least 1.
    pub frames_per_job: u32,
}

/// Names the jobs of a matrix.
///
/// # Errors
/// If two cells would be one or share a folder, a file that a scene names cannot be read, or frames are asked for that a scene
/// does not have.
pub fn plan(cells: &[Cell], around: Around) -> Result<Plan, SuiteError> {
    let mut plan = Plan {
        format: FORMAT.to_owned(),
        version: VERSION,
        arguments: around.arguments,
        out: around.out,
        root: around.root,
        program: around.program,
        threads: around.threads,
        renders: Vec::new(),
        cells: Vec::new(),
    };
    for cell in cells {
        let scene = cell.scene_label();
        let fault = |problem: &str| {
            Err(SuiteError::Scene {
                scene: format!("{scene} by {}, seed {}", cell.method.label, cell.seed),
                problem: problem.to_owned(),
            })
        };
        let render = render_key(cell)?;
        match plan.renders.iter().find(|r| r.scene == scene) {
            Some(known) if known.key == render => {}
            Some(_) => return fault("another scene of the same name has other contents: rename its file"),
            None => plan.renders.push(RenderStep {
                key: render.clone(),
                scene: scene.clone(),
                parts: parts(cell, around.frames_per_job)?,
            }),
        }
        if plan.cells.iter().any(|c| c.scene == scene && c.variant == cell.method.label) {
            return fault("is asked for twice");
        }
        let (variant, seed) = (cell.method.label.clone(), cell.seed);
        plan.cells.push(CellStep { key: cell_key(cell, &render), render, scene, variant, seed });
    }
    if plan.cells.is_empty() {
        return Err(SuiteError::Variant("the matrix has no cell".to_owned()));
    }
    Ok(plan)
}

impl Plan {
    /// Reads a plan that [`write()`] wrote.
    ///
    /// # Errors
    /// If it cannot be read or is not one.
    pub fn read(path: &Path) -> Result<Plan, SuiteError> {
        let plan: Plan = crate::stage::read_json(path)?;
        if plan.format != FORMAT || plan.version != VERSION {
            let problem =
                format!("is {} version {}, not {FORMAT} version {VERSION}", plan.format, plan.version);
            return Err(SuiteError::file(path, problem));
        }
        Ok(plan)
    }

    /// Whether `now`, made from the same arguments, names the same jobs.
    ///
    /// # Errors
    /// If it does not: a scene, a method or the program has changed since.
    pub fn check(&self, now: &Plan, path: &Path) -> Result<(), SuiteError> {
        if self.cells == now.cells && self.renders == now.renders {
            return Ok(());
        }
        let was = self.cells.iter().zip(&now.cells).find(|(a, b)| a != b);
        let problem = format!(
            "a scene, a method or the program is not what it was when this was written ({}); write the workflow again: \
             what did not change is kept",
            was.map_or("the matrix is another".to_owned(), |(a, _)| format!("{} by {}", a.scene, a.variant))
        );
        Err(SuiteError::file(path, problem))
    }
}

/// What the images of a cell depend on, as a hash.
fn render_key(cell: &Cell) -> Result<String, SuiteError> {
    let mut inputs = cell.scene.inputs()?;
    inputs.extend(flat("render", &cell.settings));
    inputs.insert("label".to_owned(), cell.scene_label());
    inputs.insert("seed".to_owned(), cell.seed.to_string());
    inputs.insert("frames".to_owned(), format!("{:?}", cell.frames));
    inputs.insert("code".to_owned(), env!("STRANDBENCH_CODE_RENDER").to_owned());
    Ok(hash::of_map(&inputs))
}

/// What the figures and the page of a cell depend on, as a hash.
fn cell_key(cell: &Cell, render: &str) -> String {
    let mut inputs = match &cell.method.solver {
        Solver::Variant(variant) => flat("recon", variant),
        Solver::Baseline(baseline) => flat("baseline", baseline),
        // A program that cannot be had is the cell's failure, to be told when its turn comes.
        Solver::Outside(outside) => outside
            .inputs()
            .unwrap_or_else(|e| BTreeMap::from([("outside.trouble".to_owned(), e.to_string())])),
    };
    inputs.insert("render".to_owned(), render.to_owned());
    inputs.insert("label".to_owned(), cell.method.label.clone());
    inputs.insert("time limit".to_owned(), format!("{:?}", cell.time_limit_s));
    for (stage, code) in [
        ("reconstruct", env!("STRANDBENCH_CODE_RECONSTRUCT")),
        ("baseline", env!("STRANDBENCH_CODE_BASELINE")),
        ("outside", env!("STRANDBENCH_CODE_OUTSIDE")),
        ("score", env!("STRANDBENCH_CODE_SCORE")),
        ("report", env!("STRANDBENCH_CODE_REPORT")),
    ] {
        inputs.insert(format!("code {stage}"), code.to_owned());
    }
    hash::of_map(&inputs)
}

/// The frames of a moving scene in parts of at most `most`.
fn parts(cell: &Cell, most: u32) -> Result<Vec<String>, SuiteError> {
    cell.frame_count()?;
    let Some(motion) = &cell.scene.spec().motion else { return Ok(Vec::new()) };
    let fault = |problem: String| SuiteError::Scene { scene: cell.scene.name.clone(), problem };
    let indices = cell.frames.unwrap_or_default().indices(motion.frames).map_err(fault)?;
    if indices.len() <= most as usize {
        return Ok(Vec::new());
    }
    Ok(indices.chunks(most.max(1) as usize).map(|c| format!("{}..{}", c[0], c[c.len() - 1] + 1)).collect())
}

/// The note of a job.
fn note(out: &Path, name: &str) -> PathBuf {
    out.join(JOBS).join(format!("{name}.json"))
}

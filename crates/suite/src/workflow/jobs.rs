//! The jobs: each does a part of a run and leaves a note.

use super::{CellStep, Plan, RenderStep, note};
use crate::cell::{Outcome, catch};
use crate::lock::Hold;
use crate::sequence::{ALL_FRAMES, Frames, render_part};
use crate::stage::{Progress, read_json, read_record};
use crate::{Cell, Cost, Lock, SuiteError, render_cell, run_cell};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;
use strandbench_io::atomic_write;

/// What of a render a job makes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// All of it; of a moving scene what its other jobs have not made.
    Whole,
    /// Of a moving scene, what all frames share: motion and exposure.
    Motion,
    /// Of a moving scene, frames.
    Frames(Frames),
}

impl std::fmt::Display for Part {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Part::Whole => Ok(()),
            Part::Motion => write!(f, ".motion"),
            Part::Frames(frames) => write!(f, ".{}..{}", frames.first, frames.end.unwrap_or(u32::MAX)),
        }
    }
}

fn render_note(key: &str, part: Part) -> String {
    format!("render-{key}{part}")
}

/// Name of the note of a cell.
pub(super) fn cell_note(key: &str) -> String {
    format!("cell-{key}")
}

/// What a render's job leaves.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Rendered {
    key: String,
    /// Why there are no images; the cells that want them fail for the same reason.
    trouble: Option<String>,
}

/// What a cell's job leaves.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Finished {
    pub(super) key: String,
    #[serde(flatten)]
    pub(super) outcome: Outcome,
    /// Key of the scores that the cell ended with; empty if it has none.
    pub(super) scored: String,
    pub(super) costs: BTreeMap<String, Cost>,
    pub(super) reused: Vec<String>,
}

/// Renders a scene, or a part of it, of which `cell` is a cell. A failure is told in the note: it is the row of every cell
/// that wants the images. Returned is why there are no images, if there are none.
///
/// # Errors
/// If the work is cancelled, or a file of the job itself cannot be written.
pub fn render_job(
    step: &RenderStep,
    cell: &Cell,
    part: Part,
    out: &Path,
    progress: &dyn Progress,
) -> Result<Option<String>, SuiteError> {
    let _out = Lock::share(out)?;
    let (scene, folder) = (cell.scene_label(), cell.places(out).render);
    let frames = cell.frames.unwrap_or_default();
    let of_motion = |part: Range<u32>| {
        render_part(&cell.scene, &cell.settings, cell.seed, frames, part, &folder, progress).map(|_| ())
    };
    let work = || -> Result<(), SuiteError> {
        let whole = Lock::part(out, &scene, Hold::Alone, progress)?;
        match part {
            Part::Whole => render_cell(cell, &folder, progress).map(|_| ()),
            Part::Motion => of_motion(0..0),
            Part::Frames(part) => {
                of_motion(0..0)?;
                drop(whole);
                // Others render other frames, nobody changes what all share.
                let _whole = Lock::part(out, &scene, Hold::Shared, progress)?;
                let _part =
                    Lock::part(out, &format!("{scene}{}", Part::Frames(part)), Hold::Alone, progress)?;
                of_motion(part.first..part.end.unwrap_or(u32::MAX))
            }
        }
    };
    let trouble = match catch(|| work().map_err(|e| ("render", e))) {
        Ok(()) => None,
        Err((_, SuiteError::Cancelled)) => return Err(SuiteError::Cancelled),
        Err((_, error)) => Some(error.to_string()),
    };
    let rendered = Rendered { key: step.key.clone(), trouble };
    leave(out, &render_note(&step.key, part), &rendered)?;
    Ok(rendered.trouble)
}

/// Runs a cell whose render's job is done. However it ends is told in the note, and is a row of the report. Returned is how
/// it ended.
///
/// # Errors
/// If the work is cancelled, the render's job is not done, or a file of the job itself cannot be written.
pub fn cell_job(
    step: &CellStep,
    cell: &Cell,
    out: &Path,
    progress: &dyn Progress,
) -> Result<Outcome, SuiteError> {
    let _out = Lock::share(out)?;
    let scene = cell.scene_label();
    let rendered: Rendered = read_json(&note(out, &render_note(&step.render, Part::Whole)))?;
    let _cell = Lock::part(out, &format!("{scene}/{}", cell.method.label), Hold::Alone, progress)?;
    // Images that are there are read; what tries once more to make them is alone with them.
    let hold = if rendered.trouble.is_none() { Hold::Shared } else { Hold::Alone };
    let _render = Lock::part(out, &scene, hold, progress)?;
    let row = run_cell(cell, out, progress)?;
    let scored = match &row.score_dir {
        Some(folder) => read_record(folder)?.key,
        None => String::new(),
    };
    let finished = Finished {
        key: step.key.clone(),
        outcome: row.outcome,
        scored,
        costs: row.costs,
        reused: row.reused,
    };
    leave(out, &cell_note(&step.key), &finished)?;
    Ok(finished.outcome)
}

fn leave(out: &Path, name: &str, value: &impl Serialize) -> Result<(), SuiteError> {
    let path = note(out, name);
    let folder = path.parent().unwrap_or(out);
    std::fs::create_dir_all(folder).map_err(|e| SuiteError::file(folder, e))?;
    let text = serde_json::to_string_pretty(value).map_err(|e| SuiteError::file(&path, e))? + "\n";
    Ok(atomic_write(&path, |w| w.write_all(text.as_bytes()))?)
}

impl Plan {
    /// The render of that key and a cell that wants it, and the cell of that key and its cell.
    ///
    /// # Errors
    /// If there is none; `path` is the plan's.
    pub fn render<'a>(
        &self,
        key: &str,
        cells: &'a [Cell],
        path: &Path,
    ) -> Result<(&RenderStep, &'a Cell), SuiteError> {
        let step = self.renders.iter().find(|r| r.key == key);
        let at = self.cells.iter().position(|c| c.render == key);
        step.zip(at.and_then(|at| cells.get(at))).ok_or_else(|| absent(path, "render", key))
    }

    /// The cell of that key.
    ///
    /// # Errors
    /// If there is none; `path` is the plan's.
    pub fn cell<'a>(
        &self,
        key: &str,
        cells: &'a [Cell],
        path: &Path,
    ) -> Result<(&CellStep, &'a Cell), SuiteError> {
        let at = self.cells.iter().position(|c| c.key == key);
        at.and_then(|at| self.cells.get(at).zip(cells.get(at))).ok_or_else(|| absent(path, "cell", key))
    }
}

fn absent(path: &Path, what: &str, key: &str) -> SuiteError {
    SuiteError::file(path, format!("names no {what} {key}; write the workflow again"))
}

/// The folder that a cell's scores lie in.
pub(super) fn score_dir(cell: &Cell, out: &Path) -> std::path::PathBuf {
    let score = cell.places(out).score;
    if cell.scene.moves() { score.join(ALL_FRAMES) } else { score }
}

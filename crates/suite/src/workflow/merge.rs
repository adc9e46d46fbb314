//! From the cells' folders to the report of a run.

use super::jobs::{Finished, cell_note, score_dir};
use super::{Plan, note};
use crate::cell::{Outcome, Row};
use crate::pool::{Summary, summarise};
use crate::report::PAGE;
use crate::score::{SCORES, ScoreFile};
use crate::stage::{self, Progress, read_json, read_record};
use crate::{Cell, Lock, SuiteError};
use std::path::Path;

/// Writes what [`crate::run_all`] writes, from the notes that the jobs left and the scores in the cells' folders; `cells`
/// are those of the plan.
///
/// # Errors
/// If a cell is missing, or its scores are not those that its job ended with; the text names it. If a file cannot be
/// written.
pub fn merge(
    plan: &Plan,
    cells: &[Cell],
    out: &Path,
    progress: &dyn Progress,
) -> Result<Summary, SuiteError> {
    let _lock = Lock::wait(out, progress)?;
    let mut rows = Vec::new();
    for (step, cell) in plan.cells.iter().zip(cells) {
        let path = note(out, &cell_note(&step.key));
        let named = format!("{} by {}, seed {}", step.scene, step.variant, step.seed);
        if !path.is_file() {
            return Err(SuiteError::file(
                &path,
                format!("the cell {named} is missing: its job has not been done; run the workflow again"),
            ));
        }
        let finished: Finished = read_json(&path)?;
        if finished.key != step.key {
            return Err(SuiteError::file(
                &path,
                format!("is not of {named}; remove it and run the workflow again"),
            ));
        }
        rows.push(row(cell, finished, out).map_err(|e| {
            let problem = format!("the scores of {named} are not those that its job ended with ({e})");
            SuiteError::file(&path, problem + "; remove this file and run the workflow again")
        })?);
        progress.check()?;
    }
    summarise(rows, out)
}

fn row(cell: &Cell, finished: Finished, out: &Path) -> Result<Row, SuiteError> {
    let mut row = Row::empty(cell, finished.outcome);
    (row.costs, row.reused) = (finished.costs, finished.reused);
    if row.outcome == Outcome::Ok {
        let folder = score_dir(cell, out);
        let record = read_record(&folder)?;
        let wrong = |problem: String| SuiteError::file(&folder, problem);
        if record.key != finished.scored {
            return Err(wrong("was made anew from other inputs".to_owned()));
        }
        stage::current("score", &folder, &record.inputs).map_err(wrong)?;
        let file: ScoreFile = read_json(&folder.join(SCORES))?;
        (row.protocol, row.scores) = (file.protocol, file.scores);
        row.report = Some(cell.places(out).report.join(PAGE));
        row.score_dir = Some(folder);
    }
    Ok(row)
}

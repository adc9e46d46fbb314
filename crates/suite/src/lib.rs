//! Scene x variant x seed: running, re-using, failing and reporting. [`run_cell`] is the main job and the page
//! to read first; every stage that it calls reads folders and writes one folder that the next one takes.
//!
//! ```text
//! OUT/<scene>/render/                 frame/  truth/  identity/  radiance/  <camera>.png  render.json
//! OUT/<scene>/<variant>/reconstruct/  estimate/  diagnostics.json
//! OUT/<scene>/<variant>/score/        scores.json  scores.csv  errors.exr  errors_<metric>_<subject>.f32  places_A1.u32
//! OUT/<scene>/<variant>/report/       report.html  report.json  report.csv
//! OUT/index.html, results.json, .csv  all cells of the last run, pooled: figures alone
//! OUT/costs.html, index.json          what they cost; both together
//! OUT/history.sqlite                  all runs, see [`history`]
//! ```
//! A moving scene has such a folder for every frame: see [`sequence`].
//!
//! Each of these folders also holds `stage.json`: its key (a hash of inputs, parameters and code), a hash of
//! every file in it, what it cost, and with which program and machine it was made.

pub mod ablate;
pub mod baselines;
mod cell;
pub mod compare;
pub mod dataset;
mod deadline;
mod error;
mod export;
mod exposure;
pub mod face;
mod field;
mod framing;
pub mod gate;
pub mod hash;
pub mod history;
mod identity;
mod import;
mod lock;
mod machine;
mod method;
pub mod outside;
mod pictures;
mod pool;
mod reconstruct;
mod render;
pub mod report;
mod results;
mod scene_job;
mod score;
pub mod sequence;
mod settings;
mod stage;
pub mod workflow;

pub use cell::{Cell, Outcome, Places, Row};
pub use error::SuiteError;
pub use export::{Export, Exported, MESH_ENDINGS, STRAND_ENDINGS, export};
pub use exposure::{METERED_SHARE, Metered};
pub use import::{Imported, import};
pub use lock::{Hold, LOCK_FILE, Lock};
pub use machine::{Cost, Meter, Provenance};
pub use method::{Method, Solver, variants_table};
pub use pool::{Summary, run_all};
pub use reconstruct::{DIAGNOSTICS, ESTIMATE, reconstruct};
pub use render::{FRAME, RENDER_FILE, RenderFile, TRUTH, read_render_file, render};
pub use results::{CellResult, Line, Results};
pub use scene_job::{SceneJob, all_scenes};
pub use score::{Curve, ERROR_CHANNEL, ERRORS, PLACES, SCORES, ScoreFile, read_curve, read_places, score};
pub use settings::{Part, Setting, render_settings, render_suffix};
pub use stage::{Done, Progress, RECORD_FILE, Record, read_record};
pub use strandbench_baselines::BASELINES;
pub use strandbench_score::{Place, Score};
pub use strandbench_stats::Unit;

use deadline::Deadline;
use std::path::Path;

/// The first stage of a cell, of one frame or of all frames asked for.
///
/// # Errors
/// As [`render`] and [`sequence::render_sequence`]; if frames are asked for of a scene with one pose.
pub fn render_cell(cell: &Cell, out: &Path, progress: &dyn Progress) -> Result<Done, SuiteError> {
    let (scene, settings, seed) = (&cell.scene, &cell.settings, cell.seed);
    if scene.moves() {
        let frames = cell.frames.unwrap_or_default();
        return Ok(sequence::render_sequence(scene, settings, seed, frames, out, progress)?.whole());
    }
    cell.frame_count()?;
    render(scene, settings, seed, out, progress)
}

/// The main job, one frame from scene to score. The scene gives geometry and truth; the renderer makes a frame
/// for the cameras; the method turns the frame, and nothing else, into an estimate; the scorer holds the
/// estimate against the truth; the report shows it. What comes back is a row with every figure, or a row that
/// says which stage failed and why.
///
/// # Errors
/// Only [`SuiteError::Cancelled`] when stopped from outside; every other failure is a row.
pub fn run_cell(cell: &Cell, out: &Path, progress: &dyn Progress) -> Result<Row, SuiteError> {
    work(cell, out, true, progress)
}

/// As [`run_cell`], without a report: for the many cells of a comparison.
///
/// # Errors
/// As [`run_cell`].
pub(crate) fn score_cell(cell: &Cell, out: &Path, progress: &dyn Progress) -> Result<Row, SuiteError> {
    work(cell, out, false, progress)
}

fn work(cell: &Cell, out: &Path, with_report: bool, progress: &dyn Progress) -> Result<Row, SuiteError> {
    let progress = &Deadline::new(progress, cell.time_limit_s);
    let places = cell.places(out);
    let stages = || -> Result<Vec<Done>, (&'static str, SuiteError)> {
        let rendered = render_cell(cell, &places.render, progress).map_err(|e| ("render", e))?;
        if cell.scene.moves() {
            return sequence::after_render(cell, &places, rendered, with_report, progress);
        }

        let reconstructed = cell
            .method
            .reconstruct(&places.render, &places.reconstruct, progress)
            .map_err(|e| ("reconstruct", e))?;

        let (truth, estimate) = (places.render.join(TRUTH), places.reconstruct.join(ESTIMATE));
        let scored =
            score(&truth, &estimate, cell.seed, &places.score, progress).map_err(|e| ("score", e))?;

        let mut done = vec![rendered, reconstructed, scored];
        if with_report {
            done.push(report::report(&places, &cell.method.label, progress).map_err(|e| ("report", e))?);
        }
        Ok(done)
    };
    match cell::catch(stages) {
        Ok(stages) => Row::finished(cell, &places, &stages),
        Err((stage, SuiteError::Cancelled)) => match progress.passed() {
            Some(limit_s) => {
                let message = "--time-limit".to_owned();
                Ok(Row::empty(cell, Outcome::TimedOut { stage: stage.to_owned(), limit_s, message }))
            }
            None => Err(SuiteError::Cancelled),
        },
        Err((stage, SuiteError::OverTime { limit_s, said, .. })) => {
            let message = format!("its time_limit_s{}", error::quoted(&said));
            Ok(Row::empty(cell, Outcome::TimedOut { stage: stage.to_owned(), limit_s, message }))
        }
        Err((stage, error)) => {
            Ok(Row::empty(cell, Outcome::Failed { stage: stage.to_owned(), message: error.to_string() }))
        }
    }
}

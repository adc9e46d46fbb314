//! A moving scene, frame by frame: every frame is a stage's folder of its own, so that an interrupted run goes on
//! where it stopped, and memory does not grow with the number of frames.
//!
//! ```text
//! OUT/<scene>/render/sequence.json              which frames, of what
//! OUT/<scene>/render/motion/, exposure/         the motion of all frames; the light meter's reading
//! OUT/<scene>/render/<frame>/                   frame/  truth/  <camera>.png  render.json
//! OUT/<scene>/<variant>/reconstruct/<frame>/    estimate/  diagnostics.json, or absent.json
//! OUT/<scene>/<variant>/score/<frame>/          scores.json  scores.csv  errors.exr  ...
//! OUT/<scene>/<variant>/score/all/              scores.json  scores.csv  frames.json  frames.csv
//! OUT/<scene>/<variant>/report/                 report.html  frames/  ...
//! ```
//! A `<frame>` is its index in six digits.

mod file;
mod reconstruct;
mod render;
mod rest;
mod score;
mod whole;

pub use file::{Frames, SEQUENCE_FILE, Sequence, SequenceFile, frame_name};
pub use reconstruct::{ABSENT, AbsentFile, reconstruct_sequence};
pub(crate) use render::render_part;
pub use render::render_sequence;
pub use score::{score_sequence, score_sequence_of_any};
pub use whole::{ALL_FRAMES, FRAME_FIGURES, FrameRow, SequenceFigures};

use crate::stage::{Done, Progress};
use crate::{Cell, Places, SuiteError, report};
use std::collections::BTreeMap;

/// The stages of a moving scene after the render, each for all frames before the next.
pub(crate) fn after_render(
    cell: &Cell,
    places: &Places,
    rendered: Done,
    with_report: bool,
    progress: &dyn Progress,
) -> Result<Vec<Done>, (&'static str, SuiteError)> {
    let reconstructed = cell
        .method
        .reconstruct(&places.render, &places.reconstruct, progress)
        .map_err(|e| ("reconstruct", e))?;
    let scored =
        score_sequence(&places.render, &places.reconstruct, cell.seed, None, &places.score, progress)
            .map_err(|e| ("score", e))?;
    let mut done = vec![rendered, reconstructed, scored.whole()];
    if with_report {
        done.push(report::sequence::report(places, &cell.method.label, progress).map_err(|e| ("report", e))?);
    }
    Ok(done)
}

/// The frames of one stage.
#[derive(Clone, Debug, Default)]
pub struct Stages {
    /// One a folder, in order; at least one.
    pub done: Vec<Done>,
}

impl Stages {
    /// All frames as one stage whose folder holds theirs: re-used if nothing had to be done, its cost what the frames
    /// cost together (peak memory is the largest of a frame).
    ///
    /// # Panics
    /// If there is no frame.
    pub fn whole(&self) -> Done {
        let last = self.done.last().expect("a sequence has frames");
        let mut whole = last.clone();
        whole.folder = last.folder.parent().unwrap_or(&last.folder).to_owned();
        whole.reused = self.done.iter().all(|d| d.reused);
        whole.record.cost = self.done.iter().map(|d| d.record.cost).sum();
        whole
    }

    /// Content of all folders by their names, as a hash.
    pub(crate) fn content(&self) -> String {
        let all: BTreeMap<String, String> = self
            .done
            .iter()
            .map(|d| {
                let name = d.folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
                (name, crate::hash::of_map(&d.record.files))
            })
            .collect();
        crate::hash::of_map(&all)
    }
}

//! Every frame against its truth, and all of them together through time.

use super::Stages;
use super::file::{Sequence, frame_name};
use super::reconstruct::ABSENT;
use super::render::MOTION;
use super::whole::Whole;
use crate::reconstruct::ESTIMATE;
use crate::render::TRUTH;
use crate::score::write_scored;
use crate::stage::{self, Progress, read_json, write_json};
use crate::{SuiteError, hash};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use strandbench_types::{Camera, Estimate, StopOnly};

/// Scores every frame below `reconstruct` against its truth in `render` (A, B), and the sequence (C), into folders below
/// `out`. Quantiles and shares of A1, A5 and B7 are taken over the raw errors of all frames; any other figure of the
/// sequence by A and B is its median over frames, an absent answer being the worst. A frame in which nothing can be evaluated (no hair is seen) is left out of A and B, and said in `frames.json`. `seed` drives the
/// nulls alone. `rest` are two variant folders, renders beside them, of the same hair at rest, rendered with other noise: what the
/// answers differ by is the flicker floor of C2.
///
/// # Errors
/// If a frame or its truth cannot be read, the two do not fit, no frame can be evaluated, or the work is cancelled;
/// finished frames then stand. If the renders of `rest` are of other or moving hair, or of the same noise.
pub fn score_sequence(
    render: &Path,
    reconstruct: &Path,
    seed: u64,
    rest: Option<&[PathBuf; 2]>,
    out: &Path,
    progress: &dyn Progress,
) -> Result<Stages, SuiteError> {
    score_answers(render, &Answers::ours(reconstruct), seed, rest, out, progress)
}

/// As [`score_sequence`], of the answers of any program: a folder a frame, named by its index in six digits, as
/// [`strandbench_io::read_any_estimate`] reads one. A frame without a folder, or with an empty one, is absent: an empty
/// answer, which is the worst.
///
/// # Errors
/// As [`score_sequence`], and if no frame has an answer, or one has that the sequence does not have.
pub fn score_sequence_of_any(
    render: &Path,
    estimates: &Path,
    seed: u64,
    rest: Option<&[PathBuf; 2]>,
    out: &Path,
    progress: &dyn Progress,
) -> Result<Stages, SuiteError> {
    let answers = Answers { folder: estimates, gaps: true };
    answers.check(&Sequence::open(render)?)?;
    score_answers(render, &answers, seed, rest, out, progress)
}

fn score_answers(
    render: &Path,
    answers: &Answers<'_>,
    seed: u64,
    rest: Option<&[PathBuf; 2]>,
    out: &Path,
    progress: &dyn Progress,
) -> Result<Stages, SuiteError> {
    let sequence = Sequence::open(render)?;
    let frames = &sequence.file.frames;
    let quiet = StopOnly(progress);
    let motion = hash::of_folder(&render.join(MOTION))?;
    let mut stages = Stages::default();
    progress.begin("frames scored", frames.len() as u64);
    for &index in frames {
        let inputs = BTreeMap::from([
            ("motion".to_owned(), motion.clone()),
            ("truth".to_owned(), hash::of_folder(&sequence.frame_dir(index).join(TRUTH))?),
            ("estimate".to_owned(), answers.hash(index)?),
            ("seed".to_owned(), seed.to_string()),
            ("code".to_owned(), env!("STRANDBENCH_CODE_SCORE").to_owned()),
        ]);
        let done = stage::run("score", &out.join(frame_name(index)), inputs, &quiet, |dir| {
            let truth = sequence.truth(index)?;
            let (estimate, absent) = answers.read(index, &truth.rig.cameras[0])?;
            if !truth.views.iter().any(|v| v.mask.data.contains(&true)) {
                return write_json(&dir.join(ABSENT), &"no camera sees hair: there is nothing to score");
            }
            write_scored(dir, &truth, &estimate, seed, &answers.of(index), &quiet)?;
            match absent {
                Some(reason) => write_json(&dir.join(ABSENT), &reason),
                None => Ok(()),
            }
        })?;
        progress.advance(1);
        stages.done.push(done);
    }
    let floor_mm = rest.map(super::rest::flicker_floor).transpose()?;
    let whole = Whole { sequence: &sequence, answers, scored: &stages, seed, floor_mm };
    let all = whole.score(out, progress)?;
    stages.done.push(all);
    progress.stage_done(&stages.whole());
    Ok(stages)
}

/// Answers to the frames of a sequence.
pub(super) struct Answers<'a> {
    folder: &'a Path,
    /// Whether a frame may be without a folder; else the method is not done with it.
    gaps: bool,
}

/// Why a frame of a folder with gaps has no answer.
const GAP: &str = "there is no answer to this frame";

impl Answers<'_> {
    /// Of a method that leaves a folder for every frame, with an answer or without.
    fn ours(folder: &Path) -> Answers<'_> {
        Answers { folder, gaps: false }
    }

    /// Folder of a frame, which may not be there.
    pub(super) fn of(&self, index: u32) -> PathBuf {
        self.folder.join(frame_name(index))
    }

    fn check(&self, sequence: &Sequence) -> Result<(), SuiteError> {
        let frames = &sequence.file.frames;
        let entries = std::fs::read_dir(self.folder).map_err(|e| SuiteError::file(self.folder, e))?;
        for name in entries.flatten().map(|e| e.file_name().to_string_lossy().into_owned()) {
            let index = (name.len() == 6).then(|| name.parse().ok()).flatten();
            if index.is_some_and(|index: u32| frames.binary_search(&index).is_err()) {
                let problem = format!(
                    "the sequence has no such frame, but {} to {}",
                    frames[0],
                    frames[frames.len() - 1]
                );
                return Err(SuiteError::file(&self.folder.join(name), problem));
            }
        }
        if frames.iter().any(|&index| !self.gap(index)) {
            return Ok(());
        }
        let problem = format!("answers to no frame; an answer lies in {}", self.of(frames[0]).display());
        Err(SuiteError::file(self.folder, problem))
    }

    fn gap(&self, index: u32) -> bool {
        self.gaps && std::fs::read_dir(self.of(index)).map_or(true, |mut entries| entries.next().is_none())
    }

    /// An answer's files but for the method's account of its work, which holds times.
    fn hash(&self, index: u32) -> Result<String, SuiteError> {
        let answer = self.of(index);
        if self.gap(index) {
            return Ok(GAP.to_owned());
        }
        if !answer.is_dir() {
            let remedy = "there is no answer to this frame; `strandbench reconstruct` goes on with it";
            return Err(SuiteError::file(&answer, remedy));
        }
        match (answer.join(ESTIMATE), answer.join(ABSENT)) {
            (estimate, _) if estimate.is_dir() => hash::of_folder(&estimate),
            (_, absent) if absent.is_file() || !self.gaps => hash::of_file(&absent),
            _ => hash::of_folder(&answer),
        }
    }

    /// A frame's estimate, an empty one with the reason if there is none; depth is asked of `reference`.
    pub(super) fn read(
        &self,
        index: u32,
        reference: &Camera,
    ) -> Result<(Estimate, Option<String>), SuiteError> {
        let answer = self.of(index);
        if self.gap(index) {
            return Ok((Estimate::default(), Some(GAP.to_owned())));
        }
        if self.gaps && !answer.join(ABSENT).is_file() {
            let estimate = answer.join(ESTIMATE);
            let folder = if estimate.is_dir() { &estimate } else { &answer };
            return Ok((strandbench_io::read_any_estimate(folder, reference)?, None));
        }
        read_answer(&answer)
    }
}

/// As [`Answers::read`], of a frame's folder that a method of this program left.
pub(super) fn read_answer(answer: &Path) -> Result<(Estimate, Option<String>), SuiteError> {
    let estimate = answer.join(ESTIMATE);
    if estimate.is_dir() {
        return Ok((strandbench_io::read_estimate(&estimate)?, None));
    }
    let file: super::AbsentFile = read_json(&answer.join(ABSENT))?;
    Ok((Estimate::default(), Some(file.reason)))
}

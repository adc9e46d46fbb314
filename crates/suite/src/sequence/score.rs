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
use strandbench_types::{Estimate, StopOnly};

/// Scores every frame below `reconstruct` against its truth in `render` (A, B), and the sequence (C), into folders below
/// `out`. Quantiles and shares of A1, A5 and B7 are taken over the raw errors of all frames; any other figure of the
/// sequence by A and B is its median over frames, an absent answer being the worst. A frame in which nothing can be evaluated (no hair is seen) is left out of A and B, and said in `frames.json`. `seed` drives the
/// nulls alone. `rest` are two folders of the method's answers to the same hair at rest, rendered with two seeds: what they
/// differ by is the flicker floor of C2.
///
/// # Errors
/// If a frame or its truth cannot be read, the two do not fit, no frame can be evaluated, or the work is cancelled;
/// finished frames then stand.
pub fn score_sequence(
    render: &Path,
    reconstruct: &Path,
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
        let answer = reconstruct.join(frame_name(index));
        if !answer.is_dir() {
            let remedy = "there is no answer to this frame; `strandbench reconstruct` goes on with it";
            return Err(SuiteError::file(&answer, remedy));
        }
        let inputs = BTreeMap::from([
            ("motion".to_owned(), motion.clone()),
            ("truth".to_owned(), hash::of_folder(&sequence.frame_dir(index).join(TRUTH))?),
            ("estimate".to_owned(), hash_of_answer(&answer)?),
            ("seed".to_owned(), seed.to_string()),
            ("code".to_owned(), env!("STRANDBENCH_CODE_SCORE").to_owned()),
        ]);
        let done = stage::run("score", &out.join(frame_name(index)), inputs, &quiet, |dir| {
            let truth = sequence.truth(index)?;
            let (estimate, absent) = read_answer(&answer)?;
            if !truth.views.iter().any(|v| v.mask.data.contains(&true)) {
                return write_json(&dir.join(ABSENT), &"no camera sees hair: there is nothing to score");
            }
            write_scored(dir, &truth, &estimate, seed, &answer, &quiet)?;
            match absent {
                Some(reason) => write_json(&dir.join(ABSENT), &reason),
                None => Ok(()),
            }
        })?;
        progress.advance(1);
        stages.done.push(done);
    }
    let floor_mm = rest.map(flicker_floor).transpose()?;
    let whole = Whole { sequence: &sequence, reconstruct, scored: &stages, seed, floor_mm };
    let all = whole.score(out, progress)?;
    stages.done.push(all);
    progress.stage_done(&stages.whole());
    Ok(stages)
}

/// An answer's files but for the method's account of its work, which holds times.
fn hash_of_answer(answer: &Path) -> Result<String, SuiteError> {
    let estimate = answer.join(ESTIMATE);
    if estimate.is_dir() { hash::of_folder(&estimate) } else { hash::of_file(&answer.join(ABSENT)) }
}

/// A frame's estimate, an empty one with the reason if there is none.
pub(super) fn read_answer(answer: &Path) -> Result<(Estimate, Option<String>), SuiteError> {
    let estimate = answer.join(ESTIMATE);
    if estimate.is_dir() {
        return Ok((strandbench_io::read_estimate(&estimate)?, None));
    }
    let file: super::AbsentFile = read_json(&answer.join(ABSENT))?;
    Ok((Estimate::default(), Some(file.reason)))
}

/// The mean over the frames that both folders have of what two answers to hair at rest differ by, mm.
fn flicker_floor(rest: &[PathBuf; 2]) -> Result<f64, SuiteError> {
    let mut floors = Vec::new();
    let entries = std::fs::read_dir(&rest[0]).map_err(|e| SuiteError::file(&rest[0], e))?;
    let mut names: Vec<_> = entries.flatten().map(|e| e.file_name()).collect();
    names.sort_unstable();
    for name in names.iter().filter(|n| rest.iter().all(|r| r.join(n).join(ESTIMATE).is_dir())) {
        let [a, b] = [0, 1].map(|k| read_answer(&rest[k].join(name)));
        let floor = strandbench_score::flicker_floor_mm(&a?.0, &b?.0)
            .map_err(|e| SuiteError::Score { folder: rest[0].join(name), problem: e.to_string() })?;
        floors.extend(floor);
    }
    if floors.is_empty() {
        let problem = format!(
            "and {} have no frame in common to which both answer with strands; reconstruct the same scene at rest \
             with two seeds",
            rest[1].display()
        );
        return Err(SuiteError::file(&rest[0], problem));
    }
    Ok(floors.iter().sum::<f64>() / floors.len() as f64)
}

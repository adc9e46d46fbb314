//! Baselines that are built in: they see a frame folder and their parameters, as every method does.

use crate::reconstruct::{DIAGNOSTICS, ESTIMATE, flat};
use crate::render::FRAME;
use crate::sequence::{ABSENT, AbsentFile, Sequence, Stages, frame_name};
use crate::stage::{self, Done, Progress, write_json};
use crate::{SuiteError, hash};
use std::path::Path;
use strandbench_baselines::{Account, Baseline, BaselineError};
use strandbench_recon::{Diagnostics, StageTime};

/// Lets a baseline answer to a render folder (of one frame or of a sequence) or to a frame folder; every frame by itself.
///
/// # Errors
/// If a frame cannot be read, the baseline has no answer to it, or the work is cancelled; finished frames then stand.
pub(crate) fn reconstruct(
    baseline: &Baseline,
    folder: &Path,
    out: &Path,
    progress: &dyn Progress,
) -> Result<Done, SuiteError> {
    if !Sequence::is(folder) {
        let inner = folder.join(FRAME);
        return one(baseline, if inner.is_dir() { &inner } else { folder }, out, false, progress);
    }
    let sequence = Sequence::open(folder)?;
    let mut stages = Stages::default();
    for &index in &sequence.file.frames {
        let frame = sequence.frame_dir(index).join(FRAME);
        stages.done.push(one(baseline, &frame, &out.join(frame_name(index)), true, progress)?);
    }
    Ok(stages.whole())
}

/// One frame; of a sequence, one without an answer is absent.
fn one(
    baseline: &Baseline,
    frame_dir: &Path,
    out: &Path,
    of_sequence: bool,
    progress: &dyn Progress,
) -> Result<Done, SuiteError> {
    if !frame_dir.is_dir() {
        return Err(SuiteError::file(
            frame_dir,
            "there is no such frame folder; `strandbench render` makes one",
        ));
    }
    let mut inputs = flat("baseline", baseline);
    inputs.insert("frame".into(), hash::of_folder(frame_dir)?);
    inputs.insert("code".into(), env!("STRANDBENCH_CODE_BASELINE").into());
    stage::run("reconstruct", out, inputs, progress, |dir| {
        let (rig, frame) = if of_sequence {
            strandbench_io::read_frame_of_sequence(frame_dir)?
        } else {
            strandbench_io::read_frame(frame_dir)?
        };
        let made = match strandbench_baselines::reconstruct(&rig, &frame, baseline, progress) {
            Ok(made) => made,
            Err(BaselineError::Cancelled(_)) => return Err(SuiteError::Cancelled),
            Err(e) if of_sequence => {
                return write_json(&dir.join(ABSENT), &AbsentFile { reason: e.to_string() });
            }
            Err(e) => {
                return Err(SuiteError::Reconstruct {
                    folder: frame_dir.to_owned(),
                    variant: baseline.name.to_owned(),
                    problem: e.to_string(),
                });
            }
        };
        strandbench_io::write_estimate(&dir.join(ESTIMATE), &made.estimate)?;
        write_json(&dir.join(DIAGNOSTICS), &diagnostics(baseline, made.account))
    })
}

/// The account in the form that reports read.
fn diagnostics(baseline: &Baseline, account: Account) -> Diagnostics {
    Diagnostics {
        stages: account.stages.into_iter().map(|(name, wall_s)| StageTime { name, wall_s }).collect(),
        notes: account.notes,
        parameters: baseline.entries().into_iter().collect(),
        ..Diagnostics::default()
    }
}

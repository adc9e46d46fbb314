//! The method on a sequence: it sees the frames' folders, its parameters, and nothing else.

use super::Stages;
use super::file::{Sequence, frame_name};
use super::quiet::Quiet;
use crate::reconstruct::{DIAGNOSTICS, ESTIMATE, flat};
use crate::render::FRAME;
use crate::stage::{self, Progress, write_json};
use crate::{SuiteError, hash};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;
use strandbench_io::atomic_write;
use strandbench_recon::{Checkpoint, ReconError, SequenceFrame, SequenceReconstructor, Variant};

/// File of a frame without an answer.
pub const ABSENT: &str = "absent.json";

/// What a variant that tracks strands goes on from: the key of the frame after which it was taken, then the checkpoint.
const TRACKED: &str = "tracked.bin";
/// Bytes of a key.
const KEY: usize = 32;

/// `absent.json`: the method had no answer to this frame; it is scored as absent.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AbsentFile {
    /// Why.
    pub reason: String,
}

/// Reconstructs all frames of the sequence in `render` into folders below `out`, in memory that does not grow with their
/// number. Frames whose folders are whole and depend on nothing that changed are kept; the method starts again right before
/// the first that is missing, one that tracks strands from where its checkpoint stands, with the same bits as in one go.
///
/// # Errors
/// If a frame cannot be read, disagrees with the rig, or the work is cancelled; finished frames then stand.
pub fn reconstruct_sequence(
    render: &Path,
    variant: &Variant,
    out: &Path,
    progress: &dyn Progress,
) -> Result<Stages, SuiteError> {
    let sequence = Sequence::open(render)?;
    let frames = &sequence.file.frames;
    let mut hashes = Vec::new();
    for &f in frames {
        let dir = sequence.frame_dir(f).join(FRAME);
        if !dir.is_dir() {
            return Err(SuiteError::file(
                &dir,
                "this frame is missing; `strandbench render` goes on with it",
            ));
        }
        hashes.push(hash::of_folder(&dir)?);
    }
    let (rig, _) = strandbench_io::read_frame_of_sequence(&sequence.frame_dir(frames[0]).join(FRAME))?;
    let refused = |frame: u32, e: ReconError| match e {
        ReconError::Cancelled(_) => SuiteError::Cancelled,
        other => SuiteError::Reconstruct {
            folder: sequence.frame_dir(frame).join(FRAME),
            variant: variant.name.to_owned(),
            problem: other.to_string(),
        },
    };
    let mut method = SequenceReconstructor::new(&rig, variant).map_err(|e| refused(frames[0], e))?;
    let latency = method.latency();
    let tracks = variant.strands.is_some();
    let inputs = |k: usize| -> BTreeMap<String, String> {
        let mut inputs = flat("recon", variant);
        let first = if tracks { 0 } else { k.saturating_sub(1) };
        for n in first..(k + latency + 1).min(frames.len()) {
            inputs.insert(format!("frame {}", frames[n]), hashes[n].clone());
        }
        inputs.insert("code".into(), env!("STRANDBENCH_CODE_RECONSTRUCT").into());
        inputs
    };
    let folder = |k: usize| out.join(frame_name(frames[k]));
    let missing: Vec<usize> =
        (0..frames.len()).filter(|&k| !stage::is_current("reconstruct", &folder(k), &inputs(k))).collect();

    let quiet = Quiet(progress);
    if let (Some(&first), Some(&last)) = (missing.first(), missing.last()) {
        progress.stage_begins("reconstruct", out, &format!("{} of {} frames", missing.len(), frames.len()));
        let mut begin = if tracks { 0 } else { first.saturating_sub(1) };
        let tracked = out.join(TRACKED);
        if tracks
            && let Some((k, checkpoint)) = read_checkpoint(&tracked, frames, inputs)
            && k < first
        {
            method = SequenceReconstructor::resume(&rig, variant, &checkpoint)
                .map_err(|e| refused(frames[k], e))?;
            begin = (k + 1).saturating_sub(method.looks_back());
        }
        let end = (last + latency + 1).min(frames.len());
        progress.begin("frames reconstructed", (end - begin) as u64);
        let keep = |answers: Vec<SequenceFrame>, checkpoint: Option<Checkpoint>| -> Result<(), SuiteError> {
            for a in answers {
                let k = frames.binary_search(&a.frame_index).expect("a frame that was pushed");
                // What lies at the ends of a part of the sequence lacks a neighbour that it has in the whole.
                if missing.contains(&k) {
                    stage::run("reconstruct", &folder(k), inputs(k), &quiet, |dir| write(dir, a))?;
                }
            }
            let Some(c) = checkpoint.filter(|_| tracks) else { return Ok(()) };
            let k = frames.binary_search(&c.frame).expect("a frame that was pushed");
            Ok(atomic_write(&tracked, |w| {
                w.write_all(hash::of_map(&inputs(k)).as_bytes())?;
                w.write_all(&c.to_bytes())
            })?)
        };
        for (k, &index) in frames.iter().enumerate().take(end).skip(begin) {
            let dir = sequence.frame_dir(index).join(FRAME);
            let (own_rig, mut frame) = strandbench_io::read_frame_of_sequence(&dir)?;
            if own_rig != rig {
                let problem = format!("its rig is not that of frame {}; a sequence has one rig", frames[0]);
                return Err(SuiteError::file(&dir, problem));
            }
            frame.index = frames[k];
            let answers = method.push(&frame, &quiet).map_err(|e| refused(index, e))?;
            let checkpoint = if answers.is_empty() { None } else { method.checkpoint() };
            keep(answers, checkpoint)?;
            progress.advance(1);
        }
        keep(method.finish(&quiet).map_err(|e| refused(frames[end - 1], e))?, None)?;
    }
    let mut stages = Stages::default();
    for k in 0..frames.len() {
        let mut done = stage::run("reconstruct", &folder(k), inputs(k), &quiet, |dir| {
            Err(SuiteError::file(dir, "the method gave no answer, not even that there is none"))
        })?;
        done.reused = !missing.contains(&k);
        stages.done.push(done);
    }
    progress.stage_done(&stages.whole());
    Ok(stages)
}

/// The checkpoint in a file and the place of its frame in the sequence, if it is of this variant and these frames.
fn read_checkpoint(
    path: &Path,
    frames: &[u32],
    inputs: impl Fn(usize) -> BTreeMap<String, String>,
) -> Option<(usize, Checkpoint)> {
    let bytes = std::fs::read(path).ok()?;
    let checkpoint = Checkpoint::from_bytes(bytes.get(KEY..)?).ok()?;
    let k = frames.binary_search(&checkpoint.frame).ok()?;
    (bytes[..KEY] == *hash::of_map(&inputs(k)).as_bytes()).then_some((k, checkpoint))
}

fn write(dir: &Path, answer: SequenceFrame) -> Result<(), SuiteError> {
    match answer.outcome {
        Ok(made) => {
            strandbench_io::write_estimate(&dir.join(ESTIMATE), &made.estimate)?;
            write_json(&dir.join(DIAGNOSTICS), &made.diagnostics)
        }
        Err(e) => write_json(&dir.join(ABSENT), &AbsentFile { reason: e.to_string() }),
    }
}

//! The method on a sequence: it sees the frames' folders, its parameters, and nothing else.

use super::Stages;
use super::file::{Sequence, frame_name};
use crate::reconstruct::{DIAGNOSTICS, ESTIMATE, flat};
use crate::render::FRAME;
use crate::stage::{self, Done, Progress, write_json};
use crate::{Cost, Meter, SuiteError, hash};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;
use strandbench_io::atomic_write;
use strandbench_recon::{Checkpoint, ReconError, SequenceFrame, SequenceReconstructor, Variant};
use strandbench_types::StopOnly;

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
    let no_answer = |frame: u32, problem: String| SuiteError::Reconstruct {
        folder: sequence.frame_dir(frame).join(FRAME),
        variant: variant.name.to_owned(),
        problem,
    };
    let refused = |frame: u32, e: ReconError| match e {
        ReconError::Cancelled(_) => SuiteError::Cancelled,
        other => no_answer(frame, other.to_string()),
    };
    let mut method = SequenceReconstructor::new(&rig, variant).map_err(|e| refused(frames[0], e))?;
    let (latency, back) = (method.latency(), method.looks_back());
    let tracks = variant.strands.is_some();
    let inputs = |k: usize| -> BTreeMap<String, String> {
        let mut inputs = flat("recon", variant);
        let first = if tracks { 0 } else { k.saturating_sub(back) };
        for n in first..(k + latency + 1).min(frames.len()) {
            inputs.insert(format!("frame {}", frames[n]), hashes[n].clone());
        }
        inputs.insert("code".into(), env!("STRANDBENCH_CODE_RECONSTRUCT").into());
        inputs
    };
    let folder = |k: usize| out.join(frame_name(frames[k]));
    let mut done: Vec<Result<Done, String>> =
        (0..frames.len()).map(|k| stage::current("reconstruct", &folder(k), &inputs(k))).collect();
    let missing: Vec<usize> = (0..frames.len()).filter(|&k| done[k].is_err()).collect();

    let quiet = StopOnly(progress);
    if let (Some(&first), Some(&last)) = (missing.first(), missing.last()) {
        progress.stage_begins("reconstruct", out, &format!("{} of {} frames", missing.len(), frames.len()));
        let mut begin = if tracks { 0 } else { first.saturating_sub(back) };
        let tracked = out.join(TRACKED);
        if tracks
            && let Some((k, checkpoint)) = read_checkpoint(&tracked, frames, inputs)
            && k < first
        {
            method = SequenceReconstructor::resume(&rig, variant, &checkpoint)
                .map_err(|e| refused(frames[k], e))?;
            begin = (k + 1).saturating_sub(back);
        }
        let end = (last + latency + 1).min(frames.len());
        progress.begin("frames reconstructed", (end - begin) as u64);
        let place = |index: u32| frames.binary_search(&index).expect("a frame that was pushed");
        // What was spent since the last answers came is what the next ones cost.
        let mut spent = Vec::new();
        let mut keep = |answers: Vec<SequenceFrame>, spent: Cost| -> Result<(), SuiteError> {
            let each = spent.part(answers.len());
            for a in answers {
                let k = place(a.frame_index);
                // What lies at the ends of a part of the sequence lacks a neighbour that it has in the whole.
                if let Err(reason) = &done[k] {
                    let (inputs, reason) = (inputs(k), reason.clone());
                    let work = |dir: &Path| write(dir, a);
                    let made =
                        stage::write("reconstruct", &folder(k), inputs, Some(each), reason, &quiet, work)?;
                    done[k] = Ok(made);
                }
            }
            Ok(())
        };
        for &index in &frames[begin..end] {
            let meter = Meter::start();
            let dir = sequence.frame_dir(index).join(FRAME);
            let (own_rig, mut frame) = strandbench_io::read_frame_of_sequence(&dir)?;
            if own_rig != rig {
                let problem = format!("its rig is not that of frame {}; a sequence has one rig", frames[0]);
                return Err(SuiteError::file(&dir, problem));
            }
            frame.index = index;
            let answers = method.push(&frame, &quiet).map_err(|e| refused(index, e))?;
            spent.push(meter.stop());
            if !answers.is_empty() {
                keep(answers, spent.drain(..).sum())?;
                if let Some(c) = method.checkpoint() {
                    write_checkpoint(&tracked, &inputs(place(c.frame)), &c)?;
                }
            }
            progress.advance(1);
        }
        let meter = Meter::start();
        let answers = method.finish(&quiet).map_err(|e| refused(frames[end - 1], e))?;
        spent.push(meter.stop());
        keep(answers, spent.into_iter().sum())?;
    }
    let all = done.into_iter().zip(frames).map(|(done, &index)| {
        done.map_err(|_| {
            no_answer(index, "the method says nothing of this frame, not even that there is no answer".into())
        })
    });
    let stages = Stages { done: all.collect::<Result<_, _>>()? };
    progress.stage_done(&stages.whole());
    Ok(stages)
}

fn write_checkpoint(
    path: &Path,
    inputs: &BTreeMap<String, String>,
    checkpoint: &Checkpoint,
) -> Result<(), SuiteError> {
    Ok(atomic_write(path, |w| {
        w.write_all(hash::of_map(inputs).as_bytes())?;
        w.write_all(&checkpoint.to_bytes())
    })?)
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

//! The flicker floor of C2: what two answers to the same hair at rest differ by.

use super::file::{Sequence, frame_name};
use super::score::read_answer;
use crate::reconstruct::ESTIMATE;
use crate::render::FRAME;
use crate::{SuiteError, hash};
use std::path::{Path, PathBuf};
use strandbench_types::StrandSet;

/// Farther than this, mm, hair has moved or is other hair. What little the solver lets hair creep at rest is below it.
const AT_REST_MM: f32 = 0.05;

/// The mean (mm) over the frames that both folders have of what the answers in `reconstruct` of two variant folders
/// differ by (METRICS.md C2: the same method, another seed, hair at rest). The renders beside them are to be of the same hair, at
/// rest, seen by the same cameras, with other noise; else the figure would be a difference of hair or of nothing.
pub(super) fn flicker_floor(variants: &[PathBuf; 2]) -> Result<f64, SuiteError> {
    let answers = variants.each_ref().map(|v| v.join("reconstruct"));
    let entries = std::fs::read_dir(&answers[0]).map_err(|e| SuiteError::file(&answers[0], e))?;
    let mut common: Vec<u32> = entries
        .flatten()
        .filter_map(|e| e.file_name().to_str()?.parse().ok())
        .filter(|&index| answers.iter().all(|a| a.join(frame_name(index)).join(ESTIMATE).is_dir()))
        .collect();
    common.sort_unstable();
    check(variants, &common)?;
    let mut floors = Vec::new();
    for &index in &common {
        let [a, b] = answers.each_ref().map(|answer| read_answer(&answer.join(frame_name(index))));
        let floor = strandbench_score::flicker_floor_mm(&a?.0, &b?.0).map_err(|e| SuiteError::Score {
            folder: answers[0].join(frame_name(index)),
            problem: e.to_string(),
        })?;
        floors.extend(floor);
    }
    if floors.is_empty() {
        let problem = format!(
            "and {} have no frame in common to which both answer with strands; reconstruct the same scene at rest, \
             rendered once as it is and once with --set render.noise=1",
            answers[1].display()
        );
        return Err(SuiteError::file(&answers[0], problem));
    }
    Ok(floors.iter().sum::<f64>() / floors.len() as f64)
}

/// Refuses renders whose answers differ for another reason than noise.
fn check(variants: &[PathBuf; 2], common: &[u32]) -> Result<(), SuiteError> {
    let Some(&first) = common.first() else { return Ok(()) };
    let renders = variants.each_ref().map(|v| v.join("../render"));
    let [a, b] = [Sequence::open(&renders[0])?, Sequence::open(&renders[1])?];
    let refused = |at: &Path, problem: String| {
        Err(SuiteError::file(
            at,
            format!(
                "{problem}; a flicker floor takes one scene at rest, rendered with the same seed once as it is and \
                 once with --set render.noise=1"
            ),
        ))
    };
    let known = a.pose(first)?.scene;
    for (sequence, variant) in [(&a, &variants[0]), (&b, &variants[1])] {
        for &index in common {
            let scene = sequence.pose(index)?.scene;
            let moved = moved_mm(&known.strands, &scene.strands);
            if moved.is_none_or(|mm| mm > AT_REST_MM) {
                let what = match moved {
                    Some(mm) => format!("is up to {mm:.2} mm from where it is"),
                    None => "is other hair than".to_owned(),
                };
                return refused(
                    variant,
                    format!(
                        "frame {index}: the true hair {what} in frame {first} of {}",
                        variants[0].display()
                    ),
                );
            }
            if scene.calibrated_rig != known.calibrated_rig {
                return refused(
                    variant,
                    format!("frame {index}: cameras stand elsewhere than in {}", variants[0].display()),
                );
            }
        }
    }
    let images = |sequence: &Sequence| hash::of_folder(&sequence.frame_dir(first).join(FRAME));
    if images(&a)? == images(&b)? {
        return refused(
            &variants[1],
            format!("frame {first} has the very images of {}", variants[0].display()),
        );
    }
    Ok(())
}

/// Largest distance between points of the same number; `None` if the strands are not the same ones.
fn moved_mm(a: &StrandSet, b: &StrandSet) -> Option<f32> {
    (a.offsets == b.offsets)
        .then(|| a.points.iter().zip(&b.points).map(|(p, q)| p.distance(*q)).fold(0.0, f32::max))
}

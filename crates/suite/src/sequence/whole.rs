//! The figures of a whole sequence: raw errors of all frames together, and its motion.

use super::Stages;
use super::file::{Sequence, frame_name};
use super::reconstruct::ABSENT;
use super::score::Answers;
use crate::SuiteError;
use crate::score::{Curve, SCORES, ScoreFile, read_curve, scores_csv, write_curves};
use crate::stage::{self, Done, Progress, read_json, write_json};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use strandbench_score::{FrameFigures, Score, ScoreError, SequenceScorer};
use strandbench_types::StopOnly;

/// Folder of the figures of all frames together.
pub const ALL_FRAMES: &str = "all";
/// Figures frame by frame.
pub const FRAME_FIGURES: &str = "frames.json";

/// `frames.json`: what changed from frame to frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SequenceFigures {
    /// One a frame, in order.
    pub frames: Vec<FrameRow>,
}

/// One frame of [`SequenceFigures`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FrameRow {
    /// Index of the frame in the scene.
    pub index: u32,
    /// Why the method has no answer to it.
    pub absent: Option<String>,
    /// Motion figures (C) at this frame.
    pub motion: FrameFigures,
    /// The method's figures (A and B) of this frame by metric; `None` is the worst.
    pub method: BTreeMap<String, Option<f64>>,
}

/// What the figures of the whole sequence are made from.
pub(super) struct Whole<'a> {
    pub sequence: &'a Sequence,
    pub answers: &'a Answers<'a>,
    pub scored: &'a Stages,
    pub seed: u64,
    pub floor_mm: Option<f64>,
}

impl Whole<'_> {
    /// Writes the figures of all frames into a folder below `out`.
    pub fn score(&self, out: &Path, progress: &dyn Progress) -> Result<Done, SuiteError> {
        let Whole { sequence, answers, scored, seed, floor_mm } = *self;
        let frames = &sequence.file.frames;
        let inputs = BTreeMap::from([
            ("frames".to_owned(), scored.content()),
            ("rate".to_owned(), sequence.file.frame_rate_hz.to_string()),
            ("flicker floor".to_owned(), floor_mm.map_or("none".to_owned(), |f| f.to_string())),
            ("code".to_owned(), env!("STRANDBENCH_CODE_SCORE").to_owned()),
        ]);
        stage::run("score", &out.join(ALL_FRAMES), inputs, progress, |dir| {
            let quiet = StopOnly(progress);
            progress.begin("motion scored", frames.len() as u64);
            let refused = |index: u32, e: ScoreError| match e {
                ScoreError::Cancelled(_) => SuiteError::Cancelled,
                other => SuiteError::Score { folder: answers.of(index), problem: other.to_string() },
            };
            let mut rows = Vec::new();
            let mut files: Vec<(PathBuf, ScoreFile)> = Vec::new();
            let mut scorer: Option<SequenceScorer> = None;
            for &index in frames {
                let truth = sequence.truth(index)?;
                let (estimate, absent) = answers.read(index, &truth.rig.cameras[0])?;
                let scorer = match &mut scorer {
                    Some(scorer) => scorer,
                    none => none.insert(SequenceScorer::new(&truth).map_err(|e| refused(index, e))?),
                };
                scorer.push(&truth, &estimate, &quiet).map_err(|e| refused(index, e))?;
                let folder = out.join(frame_name(index));
                let mut row =
                    FrameRow { index, absent, motion: FrameFigures::default(), method: BTreeMap::new() };
                if folder.join(SCORES).is_file() {
                    let file: ScoreFile = read_json(&folder.join(SCORES))?;
                    let own = file.scores.iter().filter(|s| s.subject == "method");
                    row.method = own.map(|s| (s.metric.clone(), s.value)).collect();
                    files.push((folder, file));
                } else {
                    row.absent = Some(read_json(&folder.join(ABSENT))?);
                }
                rows.push(row);
                progress.advance(1);
            }
            let scorer = scorer.expect("a sequence has frames");
            let sheet = scorer.finish(floor_mm).map_err(|e| refused(frames[0], e))?;
            for (row, figures) in rows.iter_mut().zip(&sheet.by_frame) {
                row.motion = figures.clone();
            }
            let Some((_, first)) = files.first() else {
                return Err(SuiteError::Score {
                    folder: out.to_owned(),
                    problem: "no frame shows hair; there is nothing to score".into(),
                });
            };
            let (curves, raw) = pooled(&files, dir)?;
            let mut scores: Vec<Score> = Vec::new();
            for s in &first.scores {
                let own = raw.iter().find(|r| s.metric.starts_with(&format!("{}.", r.0)) && s.subject == r.1);
                let mut whole = over_frames(s, &files);
                if let Some(value) = own.and_then(|r| of_errors(&s.metric, &r.2)) {
                    whole.value = value;
                }
                scores.push(whole);
            }
            scores.extend(sheet.scores);
            let file = ScoreFile {
                protocol: sheet.protocol,
                seed,
                scores,
                curves,
                orientation_by_confidence: Vec::new(),
                worst_region: None,
                dropped_segments: files.iter().map(|(_, f)| f.dropped_segments).sum(),
                grids: Vec::new(),
            };
            let csv = dir.join("scores.csv");
            std::fs::write(&csv, scores_csv(&file.scores)).map_err(|e| SuiteError::file(&csv, e))?;
            let csv = dir.join("frames.csv");
            std::fs::write(&csv, frames_csv(&rows)).map_err(|e| SuiteError::file(&csv, e))?;
            write_json(&dir.join(FRAME_FIGURES), &SequenceFigures { frames: rows })?;
            write_json(&dir.join(SCORES), &file)
        })
    }
}

/// The median over frames of a figure; a frame without a value is worse than any other. Of an even number of frames the
/// worse of the two in the middle.
fn over_frames(like: &Score, files: &[(PathBuf, ScoreFile)]) -> Score {
    let same = |s: &&Score| s.metric == like.metric && s.subject == like.subject;
    let found: Vec<Option<&Score>> = files.iter().map(|(_, f)| f.scores.iter().find(same)).collect();
    let sign = if like.lower_is_better { 1.0 } else { -1.0 };
    let mut values: Vec<f64> =
        found.iter().map(|s| s.and_then(|s| s.value).map_or(f64::INFINITY, |v| sign * v)).collect();
    values.sort_by(f64::total_cmp);
    let middle = values[values.len() / 2];
    let mean = found.iter().map(|s| s.map_or(0.0, |s| s.coverage)).sum::<f64>() / found.len() as f64;
    Score {
        value: middle.is_finite().then_some(sign * middle),
        coverage: mean,
        wanted: found.iter().flatten().map(|s| s.wanted).sum(),
        ..like.clone()
    }
}

/// Metric, subject and ascending errors.
type Raw = (String, String, Vec<f32>);

/// Raw errors of all frames of each subject in one file each, thinned evenly to what one frame has.
fn pooled(files: &[(PathBuf, ScoreFile)], dir: &Path) -> Result<(Vec<Curve>, Vec<Raw>), SuiteError> {
    let mut raw: Vec<Raw> = Vec::new();
    for curve in &files[0].1.curves {
        let mut errors = Vec::new();
        for (folder, file) in files {
            let same = |c: &&Curve| c.metric == curve.metric && c.subject == curve.subject;
            if let Some(c) = file.curves.iter().find(same) {
                errors.extend(read_curve(folder, c)?);
            }
        }
        errors.sort_by(f32::total_cmp);
        let errors = errors.into_iter().skip(files.len() / 2).step_by(files.len()).collect();
        raw.push((curve.metric.clone(), curve.subject.clone(), errors));
    }
    let views: Vec<(&str, &str, &[f32])> =
        raw.iter().map(|(m, s, e)| (m.as_str(), s.as_str(), e.as_slice())).collect();
    Ok((write_curves(dir, &views)?, raw))
}

/// What a quantile or a share of raw errors is over all frames; the inner `None` is an infinite quantile, the outer one
/// a figure that ascending errors do not tell.
fn of_errors(metric: &str, errors: &[f32]) -> Option<Option<f64>> {
    let (_, name) = metric.split_once('.')?;
    let n = errors.len();
    let quantile = |percent: usize| {
        let e = f64::from(*errors.get((n * percent).div_ceil(100).max(1) - 1)?);
        Some(e.is_finite().then_some(e))
    };
    let below = |limit: &str, unit: &str| {
        let limit: f32 = limit.strip_suffix(unit)?.parse().ok()?;
        (n > 0).then(|| errors.partition_point(|&e| e <= limit) as f64 / n as f64)
    };
    match name {
        "median" => quantile(50),
        "p90" => quantile(90),
        "p95" => quantile(95),
        _ => match name.split_once('_') {
            Some(("over", limit)) => below(limit, "mm").map(|s| Some(1.0 - s)),
            Some(("within", limit)) => below(limit, "deg").map(Some),
            _ => None,
        },
    }
}

/// One line a frame: motion figures, then the method's figures.
fn frames_csv(rows: &[FrameRow]) -> String {
    let mut names: Vec<&String> = rows.iter().flat_map(|r| r.method.keys()).collect();
    names.sort_unstable();
    names.dedup();
    let mut text =
        "frame,absent,C1.jitter_mm,C2.regrown_mm,C6.flow_mm,C4.drift_mm,moved_mm,C7.survival".to_owned();
    names.iter().for_each(|n| text.push_str(&format!(",{n}")));
    text.push('\n');
    let number = |v: Option<f64>| v.map_or(String::new(), |v| v.to_string());
    for r in rows {
        let m = &r.motion;
        text.push_str(&format!("{},{}", r.index, u8::from(r.absent.is_some())));
        for v in [m.jitter_mm, m.regrown_mm, m.flow_mm, m.drift_mm, m.moved_mm, m.survival] {
            text.push_str(&format!(",{}", number(v)));
        }
        for n in &names {
            text.push_str(&format!(",{}", number(r.method.get(*n).copied().flatten())));
        }
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn score(value: Option<f64>, lower_is_better: bool) -> Score {
        Score {
            subject: "method".into(),
            metric: "m".into(),
            value,
            unit: "mm".into(),
            lower_is_better,
            coverage: f64::from(u8::from(value.is_some())),
            wanted: 10,
        }
    }

    fn of(values: &[Option<f64>], lower_is_better: bool) -> Score {
        let files: Vec<(PathBuf, ScoreFile)> = values
            .iter()
            .map(|&v| {
                let file = ScoreFile { scores: vec![score(v, lower_is_better)], ..ScoreFile::default() };
                (PathBuf::new(), file)
            })
            .collect();
        over_frames(&score(None, lower_is_better), &files)
    }

    #[test]
    fn quantiles_and_shares_are_those_of_the_raw_errors() {
        let e = [0.5, 1.0, 3.0, 12.0, f32::INFINITY];
        assert_eq!(of_errors("A1.median", &e), Some(Some(3.0)));
        assert_eq!(of_errors("A1.p90", &e), Some(None));
        assert_eq!(of_errors("A1.over_10mm", &e), Some(Some(0.4)));
        assert_eq!(of_errors("A5.within_20deg", &e), Some(Some(0.8)));
        for other in ["A1.over_1px", "A1.mad", "A1.within_1mm.cc", "A1.rim.median", "A1"] {
            assert_eq!(of_errors(other, &e), None, "{other}");
        }
        assert_eq!(of_errors("A1.median", &[]), None);
    }

    #[test]
    fn the_median_over_frames_counts_an_absent_frame_as_the_worst() {
        let s = of(&[Some(1.0), None, Some(3.0)], true);
        assert_eq!((s.value, s.wanted), (Some(3.0), 30));
        assert!((s.coverage - 2.0 / 3.0).abs() < 1e-12);
        assert_eq!(of(&[Some(0.9), None, Some(0.3)], false).value, Some(0.3));
        assert_eq!(of(&[Some(1.0), None], true).value, None);
        assert_eq!(of(&[Some(1.0), Some(2.0)], true).value, Some(2.0));
        assert_eq!(of(&[Some(1.0), Some(2.0)], false).value, Some(1.0));
    }
}

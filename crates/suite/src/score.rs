//! An estimate's folder against a truth's folder.

use crate::stage::{self, Done, Progress, write_json};
use crate::{SuiteError, hash};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;
use strandbench_score::{
    ConfidenceBin, ErrorCurve, Place, Score, ScoreError, ScoreSheet, StrandGrid, StrandSheet, WorstRegion,
};
use strandbench_types::{Estimate, Plane, StopOnly, Truth};

/// File with every figure.
pub const SCORES: &str = "scores.json";
/// File with the signed depth error per pixel.
pub const ERRORS: &str = "errors.exr";
/// Channel of [`ERRORS`]: z_est - z_true in mm; NaN where not wanted, +inf where wanted and absent.
pub const ERROR_CHANNEL: &str = "depth_error_mm";

/// File with the pixels over which A1 is taken: little-endian 32-bit unsigned integers, three for each pixel (its row-major index,
/// the strand and the clump that it shows, see [`Place`]; `numpy.fromfile(path, "<u4").reshape(-1, 3)`). Their
/// errors are those of [`ERRORS`] at the same pixel.
pub const PLACES: &str = "places_A1.u32";

/// `scores.json`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScoreFile {
    /// Protocol version and content hash.
    pub protocol: String,
    /// Seed of the nulls.
    pub seed: u64,
    /// Figures in the protocol's order.
    pub scores: Vec<Score>,
    /// Where the raw errors of each subject are.
    pub curves: Vec<Curve>,
    /// B7 of the method by tenths of its confidence, least sure first.
    pub orientation_by_confidence: Vec<ConfidenceBin>,
    /// Where the method's depth is worst.
    pub worst_region: Option<WorstRegion>,
    /// Segments of true strands too short to measure, left out.
    pub dropped_segments: u64,
    /// Precision and recall of strands over distance and angle; empty if the method grew none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub grids: Vec<StrandGrid>,
}

/// Raw errors of one subject: a file of little-endian 32-bit floats, ascending, +inf for an absent answer
/// (`numpy.fromfile(path, "<f4")`).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Curve {
    /// `A1` (|depth error|, mm), `A5` or `B7` (axial error, degrees).
    pub metric: String,
    /// `method`, a null or the ceiling.
    pub subject: String,
    /// File name beside `scores.json`.
    pub file: String,
    /// Number of errors, absent answers included.
    pub wanted: usize,
}

/// Scores `estimate_dir` against `truth_dir` into `out`: `scores.json`, `scores.csv`, `errors.exr` and the raw
/// error curves. `seed` drives the nulls alone.
///
/// # Errors
/// If a folder cannot be read, the two do not fit, nothing can be evaluated, or the work is cancelled; `out` is
/// then untouched.
pub fn score(
    truth_dir: &Path,
    estimate_dir: &Path,
    seed: u64,
    out: &Path,
    progress: &dyn Progress,
) -> Result<Done, SuiteError> {
    for (dir, remedy) in [
        (truth_dir, "there is no such truth folder; `strandbench render` makes one"),
        (estimate_dir, "there is no such estimate folder; `strandbench reconstruct` makes one"),
    ] {
        if !dir.is_dir() {
            return Err(SuiteError::file(dir, remedy));
        }
    }
    let inputs = BTreeMap::from([
        ("truth".to_owned(), hash::of_folder(truth_dir)?),
        ("estimate".to_owned(), hash::of_folder(estimate_dir)?),
        ("seed".to_owned(), seed.to_string()),
        ("code".to_owned(), env!("STRANDBENCH_CODE_SCORE").to_owned()),
    ]);
    stage::run("score", out, inputs, progress, |dir| {
        let truth = strandbench_io::read_truth(truth_dir)?;
        let estimate = strandbench_io::read_any_estimate(estimate_dir, &truth.rig.cameras[0])?;
        write_scored(dir, &truth, &estimate, seed, estimate_dir, progress)
    })
}

/// Scores envelope and orientation, and strands if there are any, into `dir`; `named` stands in errors.
pub(crate) fn write_scored(
    dir: &Path,
    truth: &Truth,
    estimate: &Estimate,
    seed: u64,
    named: &Path,
    progress: &dyn Progress,
) -> Result<(), SuiteError> {
    let refused = |e: ScoreError| match e {
        ScoreError::Cancelled(_) => SuiteError::Cancelled,
        other => SuiteError::Score { folder: named.to_owned(), problem: other.to_string() },
    };
    if estimate.strands.is_none() {
        let sheet = strandbench_score::score(truth, estimate, seed, progress).map_err(refused)?;
        return write_sheet(dir, &sheet, None, seed);
    }
    // Side by side, for each has stretches on one thread; the strands, which take far longer, tell the progress.
    let (sheet, strands) = rayon::join(
        || strandbench_score::score(truth, estimate, seed, &StopOnly(progress)),
        || strandbench_score::score_strands(truth, estimate, seed, progress),
    );
    write_sheet(dir, &sheet.map_err(refused)?, Some(strands.map_err(refused)?), seed)
}

fn write_sheet(
    dir: &Path,
    sheet: &ScoreSheet,
    strands: Option<StrandSheet>,
    seed: u64,
) -> Result<(), SuiteError> {
    let mut raw: Vec<(&str, &str, &[f32])> = Vec::new();
    raw.extend(sheet.depth_error_curves.iter().map(|(subject, e)| ("A1", subject.as_str(), e.as_slice())));
    for (metric, all) in [("A5", &sheet.axis_error_curves), ("B7", &sheet.line_error_curves)] {
        raw.extend(all.iter().map(|c: &ErrorCurve| (metric, c.subject.as_str(), c.errors_deg.as_slice())));
    }
    let curves = write_curves(dir, &raw)?;
    let mut scores = sheet.scores.clone();
    let mut grids = Vec::new();
    if let Some(strands) = strands {
        scores.extend(strands.scores);
        grids = strands.grids;
    }
    let csv = dir.join("scores.csv");
    std::fs::write(&csv, scores_csv(&scores)).map_err(|e| SuiteError::file(&csv, e))?;
    let file = ScoreFile {
        protocol: sheet.protocol.clone(),
        seed,
        scores,
        curves,
        orientation_by_confidence: sheet.orientation_by_confidence.clone(),
        worst_region: sheet.worst_region,
        dropped_segments: sheet.dropped_segments,
        grids,
    };
    write_json(&dir.join(SCORES), &file)?;
    let places = sheet.places.iter().flat_map(|p| [p.pixel, p.strand, p.clump]);
    let path = dir.join(PLACES);
    std::fs::write(&path, places.flat_map(u32::to_le_bytes).collect::<Vec<u8>>())
        .map_err(|e| SuiteError::file(&path, e))?;
    strandbench_io::write_exr(&dir.join(ERRORS), &[(ERROR_CHANNEL, &sheet.depth_error_mm)])?;
    Ok(())
}

/// Writes raw errors (metric, subject, ascending values), a file each.
pub(crate) fn write_curves(dir: &Path, raw: &[(&str, &str, &[f32])]) -> Result<Vec<Curve>, SuiteError> {
    let mut curves = Vec::new();
    for &(metric, subject, errors) in raw {
        let file = format!("errors_{metric}_{subject}.f32");
        let bytes: Vec<u8> = errors.iter().flat_map(|e| e.to_le_bytes()).collect();
        let path = dir.join(&file);
        std::fs::write(&path, bytes).map_err(|e| SuiteError::file(&path, e))?;
        let (metric, subject) = (metric.to_owned(), subject.to_owned());
        curves.push(Curve { metric, subject, file, wanted: errors.len() });
    }
    Ok(curves)
}

/// Reads the signed depth error per pixel.
pub(crate) fn read_error_map(score_dir: &Path) -> Result<Plane<f32>, SuiteError> {
    let path = score_dir.join(ERRORS);
    let mut channels = strandbench_io::read_exr(&path)?;
    let at = channels.iter().position(|(name, _)| name == ERROR_CHANNEL);
    let at = at.ok_or_else(|| SuiteError::file(&path, format!("has no channel {ERROR_CHANNEL}")))?;
    Ok(channels.swap_remove(at).1)
}

/// Reads the pixels over which A1 is taken, in reading order, with each one's |error| in mm (+inf where unanswered).
///
/// # Errors
/// If a file is missing or damaged, or they do not fit each other.
pub fn read_places(score_dir: &Path) -> Result<Vec<(Place, f32)>, SuiteError> {
    let path = score_dir.join(PLACES);
    let bytes = std::fs::read(&path).map_err(|e| SuiteError::file(&path, e))?;
    let errors = read_error_map(score_dir)?;
    if !bytes.len().is_multiple_of(12) {
        return Err(SuiteError::file(
            &path,
            format!("holds {} bytes, not twelve for each pixel", bytes.len()),
        ));
    }
    let number = |b: &[u8]| u32::from_le_bytes([b[0], b[1], b[2], b[3]]);
    let place = |b: &[u8]| {
        let place = Place { pixel: number(b), strand: number(&b[4..]), clump: number(&b[8..]) };
        let error = errors.data.get(place.pixel as usize).filter(|e| !e.is_nan()).ok_or_else(|| {
            SuiteError::file(&path, format!("names pixel {}, which {ERRORS} has no error for", place.pixel))
        })?;
        Ok((place, error.abs()))
    };
    bytes.chunks_exact(12).map(place).collect()
}

/// Reads one subject's raw errors.
///
/// # Errors
/// If the file is missing or its length is not what `scores.json` says.
pub fn read_curve(score_dir: &Path, curve: &Curve) -> Result<Vec<f32>, SuiteError> {
    let path = score_dir.join(&curve.file);
    let bytes = std::fs::read(&path).map_err(|e| SuiteError::file(&path, e))?;
    if bytes.len() != curve.wanted * 4 {
        let problem = format!("holds {} bytes, not four for each of {} errors", bytes.len(), curve.wanted);
        return Err(SuiteError::file(&path, problem));
    }
    Ok(bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect())
}

/// The columns that [`scores_csv`] writes for each figure.
pub(crate) const CSV_COLUMNS: &str = "metric,subject,unit,value,coverage,wanted";

/// One line a figure; an absent value is an empty field.
pub(crate) fn scores_csv(scores: &[Score]) -> String {
    let mut text = format!("{CSV_COLUMNS}\n");
    for s in scores {
        text.push_str(&csv_line(s));
        text.push('\n');
    }
    text
}

pub(crate) fn csv_line(s: &Score) -> String {
    let value = s.value.map_or(String::new(), |v| v.to_string());
    let text = [&s.metric, &s.subject, &s.unit].map(|t| csv_text(t)).join(",");
    format!("{text},{value},{},{}", s.coverage, s.wanted)
}

/// A text as a CSV field (RFC 4180).
pub(crate) fn csv_text(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

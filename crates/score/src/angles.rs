//! A5 and B7: lines in space and in the image.

use crate::ScoreError;
use crate::regions::Regions;
use crate::rows::Rows;
use crate::sheet::{ConfidenceBin, ErrorCurve, ScoreSheet};
use crate::stats::{percentile, share_within, sorted};
use crate::subject::Subject;
use glam::DVec3;
use std::f64::consts::PI;
use strandbench_types::Truth;

/// Angle between two lines in space, degrees in [0, 90]; neither may be zero. The arctangent keeps full
/// precision where acos|t·g| would lose half of it.
pub(crate) fn between_axes_deg(a: DVec3, b: DVec3) -> f64 {
    a.cross(b).length().atan2(a.dot(b).abs()).to_degrees()
}

/// Angle between two lines in the image, degrees in [0, 90].
pub(crate) fn between_lines_deg(a: f64, b: f64) -> f64 {
    let d = (a - b).rem_euclid(PI);
    d.min(PI - d).to_degrees()
}

/// A5 errors in degrees over the hair pixels that have a true direction; +inf where absent.
pub(crate) fn axis_errors(truth: &Truth, regions: &Regions, s: &Subject) -> Result<Vec<f64>, ScoreError> {
    let true_axis = |i: u32| truth.views[0].orientation_3d.data[i as usize].as_dvec3();
    let wanted = regions.hair.iter().filter(|&&i| true_axis(i) != DVec3::ZERO);
    let at = |&i: &u32| match s.axis[i as usize] {
        DVec3::ZERO => f64::INFINITY,
        axis => between_axes_deg(axis, true_axis(i)),
    };
    some(wanted.map(at).collect(), "direction in space")
}

/// B7 errors in degrees over the hair pixels that have a true line; +inf where absent.
pub(crate) fn line_errors(truth: &Truth, regions: &Regions, s: &Subject) -> Result<Vec<f64>, ScoreError> {
    some(wanted_lines(truth, regions).map(|(i, line)| line_error(s, i, line)).collect(), "line in the image")
}

fn wanted_lines(truth: &Truth, regions: &Regions) -> impl Iterator<Item = (usize, f64)> {
    let true_line = |i: usize| f64::from(truth.views[0].orientation_2d.data[i]);
    regions.hair.iter().map(move |&i| (i as usize, true_line(i as usize))).filter(|(_, line)| !line.is_nan())
}

fn line_error(s: &Subject, i: usize, true_line: f64) -> f64 {
    if s.line[i].is_nan() { f64::INFINITY } else { between_lines_deg(s.line[i], true_line) }
}

fn some(errors: Vec<f64>, what: &str) -> Result<Vec<f64>, ScoreError> {
    if errors.is_empty() {
        return Err(ScoreError::Input(format!("no hair pixel of the reference view has a true {what}")));
    }
    Ok(errors)
}

/// Adds all of A5 and B7 for one subject, and its raw errors to the sheet.
pub(crate) fn score(
    truth: &Truth,
    regions: &Regions,
    s: &Subject,
    rows: &mut Rows,
    sheet: &mut ScoreSheet,
) -> Result<(), ScoreError> {
    let curve = |ascending: &[f64]| ErrorCurve {
        subject: s.name.to_owned(),
        errors_deg: ascending.iter().map(|&e| e as f32).collect(),
    };
    let axes = sorted(axis_errors(truth, regions, s)?);
    rows.angles(s.name, "A5", &axes);
    sheet.axis_error_curves.push(curve(&axes));
    let lines = sorted(line_errors(truth, regions, s)?);
    rows.angles(s.name, "B7", &lines);
    sheet.line_error_curves.push(curve(&lines));
    if s.name == "method" {
        sheet.orientation_by_confidence = by_confidence(truth, regions, s);
    }
    Ok(())
}

/// The answered pixels in ten bins of equal size by strength (ties in reading order), least sure first.
fn by_confidence(truth: &Truth, regions: &Regions, s: &Subject) -> Vec<ConfidenceBin> {
    if s.strength.is_empty() {
        return Vec::new();
    }
    let mut answered: Vec<(f64, usize, f64)> = wanted_lines(truth, regions)
        .map(|(i, line)| (s.strength[i], i, line_error(s, i, line)))
        .filter(|(_, _, e)| e.is_finite())
        .collect();
    answered.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let n = answered.len();
    (0..10)
        .map(|k| (k, &answered[n * k / 10..n * (k + 1) / 10]))
        .filter(|(_, bin)| !bin.is_empty())
        .map(|(k, bin)| {
            let ascending = sorted(bin.iter().map(|b| b.2).collect());
            ConfidenceBin {
                decile: k as u32 + 1,
                strength: (bin[0].0, bin[bin.len() - 1].0),
                pixels: bin.len() as u64,
                median_deg: percentile(&ascending, 50),
                within: [10.0, 20.0, 30.0].map(|deg| share_within(&ascending, deg)),
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_have_no_sign_and_wrap() {
        let deg = |a: f64, b: f64| between_lines_deg(a.to_radians(), b.to_radians());
        assert!((deg(1.0, 179.0) - 2.0).abs() < 1e-12);
        assert!((deg(0.0, 180.0)).abs() < 1e-12);
        assert!((deg(10.0, 100.0) - 90.0).abs() < 1e-12);
        assert!((deg(-80.0, 95.0) - 5.0).abs() < 1e-12);
        let t = DVec3::new(1.0, 2.0, 3.0);
        assert_eq!((between_axes_deg(t, -2.0 * t), between_axes_deg(t, t)), (0.0, 0.0));
        assert!((between_axes_deg(DVec3::X, DVec3::NEG_Y) - 90.0).abs() < 1e-12);
        let tiny = 1e-9f64;
        assert!((between_axes_deg(DVec3::X, DVec3::new(1.0, tiny, 0.0)) - tiny.to_degrees()).abs() < 1e-20);
    }
}

//! The truth of a frame, as an answer and as maps.

use super::calibration::write_colmap;
use super::{Source, opencv_json, write_text};
use crate::SuiteError;
use std::path::Path;
use strandbench_types::{Estimate, OrientationField, Plane, ViewTruth};

/// Writes the truth into a folder: as an answer (`depth.exr`, `orientation.exr`, `orientation_3d.exr`, `strands.hair`),
/// which scores 100 %, each camera's maps below `views/`, and the rig as it really is.
pub(super) fn write(source: &Source, index: u32, dir: &Path) -> Result<(), SuiteError> {
    let truth = source.truth(index)?;
    for (camera, view) in truth.rig.cameras.iter().zip(&truth.views) {
        let path = dir.join("views").join(format!("{}.exr", camera.name));
        super::make_parent(&path)?;
        write_view(&path, view)?;
    }
    write_colmap(&dir.join("colmap"), &truth.rig)?;
    write_text(&dir.join("opencv.json"), &opencv_json(&truth.rig))?;
    let answer = Estimate {
        depth: Some(truth.views[0].depth_50.clone()),
        orientation: Some(field(&truth.views[0])),
        orientation_3d: Some(truth.views[0].orientation_3d.clone()),
        strands: Some(truth.strands),
        ..Estimate::default()
    };
    Ok(strandbench_io::write_estimate(dir, &answer)?)
}

fn write_view(path: &Path, v: &ViewTruth) -> Result<(), SuiteError> {
    let mask = v.mask.map(|&m| if m { 1.0 } else { 0.0 });
    let channels: [(&str, &Plane<f32>); 6] = [
        ("depth_50_mm", v.depth_50.raw()),
        ("depth_05_mm", v.depth_05.raw()),
        ("depth_first_mm", v.depth_first.raw()),
        ("coverage", &v.coverage),
        ("mask", &mask),
        ("orientation_2d_rad", &v.orientation_2d),
    ];
    Ok(strandbench_io::write_exr(path, &channels)?)
}

/// The lines as Luo et al. write them, exp(2iΘ); zero without hair.
fn field(v: &ViewTruth) -> OrientationField {
    let part = |f: fn(f64) -> f64| {
        v.orientation_2d.map(|&a| if a.is_finite() { f(2.0 * f64::from(a)) as f32 } else { 0.0 })
    };
    OrientationField { re: part(f64::cos), im: part(f64::sin) }
}

//! Rigs as JSON that people and other programs can read: K, R and t spelled out.

use crate::error::{IoError, Result};
use glam::{DMat3, DVec2, DVec3};
use serde::{Deserialize, Serialize};
use std::path::Path;
use strandbench_types::{Camera, Rig};

const FORMAT: &str = "strandbench-rig";
const VERSION: u32 = 1;
const CONVENTION: &str = "x_cam = R x_world + t, mm; OpenCV axes: +x right, +y down, +z forward; pixel = K x_cam / z; \
     the top-left pixel's centre is (0.5, 0.5); no distortion; camera 0 is the reference; near and far along its +z";

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RigFile {
    format: String,
    version: u32,
    #[serde(default)]
    convention: String,
    near_mm: f64,
    far_mm: f64,
    frame_rate_hz: f64,
    exposure_s: f64,
    cameras: Vec<CameraFile>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct CameraFile {
    name: String,
    width: u32,
    height: u32,
    /// Rows.
    #[serde(rename = "K")]
    k: [[f64; 3]; 3],
    /// Rows.
    #[serde(rename = "R")]
    r: [[f64; 3]; 3],
    t_mm: [f64; 3],
}

/// Refuses a format or version that this code does not write.
pub(crate) fn check_version(path: &Path, (format, version): (&str, u32), want: (&str, u32)) -> Result<()> {
    if (format, version) == want {
        return Ok(());
    }
    Err(IoError::new(
        path,
        format!(
            "format {format:?} version {version}, but this program reads {:?} version {}; write the folder again",
            want.0, want.1
        ),
    ))
}

/// Refuses what could not be written as a rig, and camera names that cannot name files.
pub(crate) fn check_rig(path: &Path, rig: &Rig) -> Result<()> {
    rig.validate().map_err(|e| IoError::new(path, format!("{e}; correct the rig")))?;
    if !(rig.frame_rate_hz.is_finite() && rig.exposure_s.is_finite()) {
        return Err(IoError::new(path, "frame_rate_hz or exposure_s is not finite; correct the rig"));
    }
    let names: Vec<String> = rig.cameras.iter().map(|c| c.name.to_ascii_lowercase()).collect();
    for (c, low) in rig.cameras.iter().zip(&names) {
        let plain = |b: u8| b.is_ascii_alphanumeric() || matches!(b, b'-' | b'_' | b'.');
        let fit = !c.name.is_empty()
            && c.name.len() <= 100
            && !c.name.starts_with('.')
            && c.name.bytes().all(plain);
        if !fit {
            return Err(IoError::new(
                path,
                format!(
                    "camera name {:?} cannot name a file; use letters, digits, - _ . and no leading dot",
                    c.name
                ),
            ));
        }
        let clash = ["", "_mask", "_truth"].iter().map(|s| format!("{low}{s}"));
        if clash.map(|f| names.iter().filter(|n| **n == f).count()).sum::<usize>() > 1 {
            return Err(IoError::new(
                path,
                format!("files of camera {:?} would overwrite another camera's; rename one", c.name),
            ));
        }
    }
    Ok(())
}

/// Writes a rig, atomically, as [`parse_rig`] reads it.
///
/// # Errors
/// If the rig is not valid, a camera's name cannot name a file, or the file cannot be written.
pub fn write_rig(path: &Path, rig: &Rig) -> Result<()> {
    check_rig(path, rig)?;
    crate::atomic::atomic_write(path, |w| w.write_all(encode_rig(rig).as_bytes()))
}

pub(crate) fn encode_rig(rig: &Rig) -> String {
    let rows = |m: &DMat3| m.transpose().to_cols_array_2d();
    let cameras = rig.cameras.iter().map(|c| CameraFile {
        name: c.name.clone(),
        width: c.width,
        height: c.height,
        k: [[c.focal_px.x, 0.0, c.principal_px.x], [0.0, c.focal_px.y, c.principal_px.y], [0.0, 0.0, 1.0]],
        r: rows(&c.camera_from_world),
        t_mm: c.translation_mm.to_array(),
    });
    let file = RigFile {
        format: FORMAT.into(),
        version: VERSION,
        convention: CONVENTION.into(),
        near_mm: rig.near_mm,
        far_mm: rig.far_mm,
        frame_rate_hz: rig.frame_rate_hz,
        exposure_s: rig.exposure_s,
        cameras: cameras.collect(),
    };
    serde_json::to_string_pretty(&file).expect("plain data") + "\n"
}

/// Parses a rig; `path` is for messages only.
///
/// # Errors
/// Names the file, the line or camera, and the remedy.
pub fn parse_rig(path: &Path, bytes: &[u8]) -> Result<Rig> {
    let file: RigFile = serde_json::from_slice(bytes)
        .map_err(|e| IoError::new(path, format!("not a rig: {e}; correct the file or write it again")))?;
    check_version(path, (&file.format, file.version), (FORMAT, VERSION))?;
    let mut cameras = Vec::with_capacity(file.cameras.len());
    for c in file.cameras {
        let [[fx, skew, cx], [zero, fy, cy], last] = c.k;
        if skew != 0.0 || zero != 0.0 || last != [0.0, 0.0, 1.0] {
            return Err(IoError::new(
                path,
                format!("camera {}: K must be [[fx,0,cx],[0,fy,cy],[0,0,1]]; skew is not supported", c.name),
            ));
        }
        cameras.push(Camera {
            name: c.name,
            width: c.width,
            height: c.height,
            focal_px: DVec2::new(fx, fy),
            principal_px: DVec2::new(cx, cy),
            camera_from_world: DMat3::from_cols_array_2d(&c.r).transpose(),
            translation_mm: DVec3::from_array(c.t_mm),
        });
    }
    let rig = Rig {
        cameras,
        near_mm: file.near_mm,
        far_mm: file.far_mm,
        frame_rate_hz: file.frame_rate_hz,
        exposure_s: file.exposure_s,
    };
    check_rig(path, &rig)?;
    Ok(rig)
}

#[cfg(test)]
pub(crate) mod tests;

//! The estimate folder: what a method returns, from this program or from any other.

use crate::atomic::{atomic_write, check_folder, merge_folder};
use crate::error::{IoError, Result};
use crate::exr::{pick, read_exr, write_exr};
use crate::mesh::{parse_ply_mesh, write_mesh};
use crate::read::{read_all, read_exact_hair, write_strands};
use crate::rig_json::check_version;
use crate::strand_ids::{encode_strand_ids, parse_strand_ids};
use glam::Vec3;
use serde::{Deserialize, Serialize};
use std::path::Path;
use strandbench_types::{DepthMap, Estimate, OrientationField, Plane};

const FORMAT: &str = "strandbench-estimate";
const VERSION: u32 = 1;
pub(crate) const MANIFEST: &str = "estimate.json";
const DEPTH: &str = "depth.exr";
const ORIENTATION: &str = "orientation.exr";
const ORIENTATION_3D: &str = "orientation_3d.exr";
const ENVELOPE: &str = "envelope.ply";
/// Strands of an estimate folder.
pub const STRANDS: &str = "strands.hair";
/// Identities of the strands of an estimate folder, one a strand.
pub const STRAND_IDS: &str = "strand_ids.bin";
pub(crate) const PARTS: [&str; 6] = [DEPTH, ORIENTATION, ORIENTATION_3D, ENVELOPE, STRANDS, STRAND_IDS];

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct EstimateFile {
    format: String,
    version: u32,
    holds: Vec<String>,
}

/// Splits a raster of vectors into rasters of their coordinates.
pub(crate) fn split(p: &Plane<Vec3>) -> [Plane<f32>; 3] {
    [p.map(|v| v.x), p.map(|v| v.y), p.map(|v| v.z)]
}

/// Joins rasters of one size.
pub(crate) fn join([x, y, z]: &[Plane<f32>; 3]) -> Plane<Vec3> {
    let data = x.data.iter().zip(&y.data).zip(&z.data).map(|((&x, &y), &z)| Vec3::new(x, y, z)).collect();
    Plane::from_vec(x.width, x.height, data)
}

/// Writes an estimate: `depth.exr` (Z: mm along the reference camera's +z, NaN where absent),
/// `orientation.exr` (re, im), `orientation_3d.exr` (X, Y, Z; zero where absent), `envelope.ply`,
/// `strands.hair` (mm, world) and `strand_ids.bin` ([`parse_strand_ids`]), each only if present, and
/// `estimate.json`, which lists them. Other files of an existing folder stay.
///
/// # Errors
/// If strands, their identities or the envelope are not valid (named), or a file cannot be written.
pub fn write_estimate(dir: &Path, estimate: &Estimate) -> Result<()> {
    let e = estimate;
    let has = [
        e.depth.is_some(),
        e.orientation.is_some(),
        e.orientation_3d.is_some(),
        e.envelope.is_some(),
        e.strands.is_some(),
        e.strand_ids.is_some(),
    ];
    e.validate_strand_ids().map_err(|m| IoError::new(&dir.join(STRAND_IDS), format!("not written: {m}")))?;
    let holds = PARTS.iter().zip(has).filter(|(_, has)| *has).map(|(p, _)| (*p).to_owned()).collect();
    let file = EstimateFile { format: FORMAT.into(), version: VERSION, holds };
    merge_folder(
        dir,
        |name| PARTS.contains(&name),
        |tmp| {
            if let Some(depth) = &e.depth {
                write_exr(&tmp.join(DEPTH), &[("Z", depth.raw())])?;
            }
            if let Some(o) = &e.orientation {
                write_exr(&tmp.join(ORIENTATION), &[("re", &o.re), ("im", &o.im)])?;
            }
            if let Some(o) = &e.orientation_3d {
                let [x, y, z] = split(o);
                write_exr(&tmp.join(ORIENTATION_3D), &[("X", &x), ("Y", &y), ("Z", &z)])?;
            }
            if let Some(mesh) = &e.envelope {
                write_mesh(&tmp.join(ENVELOPE), mesh)?;
            }
            if let Some(strands) = &e.strands {
                write_strands(&tmp.join(STRANDS), strands)?;
            }
            if let Some(ids) = &e.strand_ids {
                atomic_write(&tmp.join(STRAND_IDS), |w| w.write_all(&encode_strand_ids(ids)))?;
            }
            let text = serde_json::to_string_pretty(&file).expect("plain data") + "\n";
            atomic_write(&tmp.join(MANIFEST), |w| w.write_all(text.as_bytes()))
        },
    )
}

/// Reads an estimate folder; whatever file is missing is absent from the estimate. `estimate.json` is optional,
/// so that other programs need not write it; where it is, it must list exactly what there is.
///
/// # Errors
/// If a file that is there cannot be read, `estimate.json` disagrees with the folder, or the folder holds none
/// of them.
pub fn read_estimate(dir: &Path) -> Result<Estimate> {
    check_folder(dir)?;
    let there = |part: &str| dir.join(part).exists();
    if there(MANIFEST) {
        check_manifest(dir, there)?;
    } else if !PARTS.iter().any(|p| there(p)) {
        return Err(IoError::new(
            dir,
            format!("the folder holds no estimate; give at least one of {}", PARTS.join(", ")),
        ));
    }
    let mut e = Estimate::default();
    if there(DEPTH) {
        let path = dir.join(DEPTH);
        let [z] = pick(&path, read_exr(&path)?, ["Z"])?;
        e.depth = Some(DepthMap::from_raw(z));
    }
    if there(ORIENTATION) {
        let path = dir.join(ORIENTATION);
        let [re, im] = finite(&path, pick(&path, read_exr(&path)?, ["re", "im"])?)?;
        e.orientation = Some(OrientationField { re, im });
    }
    if there(ORIENTATION_3D) {
        let path = dir.join(ORIENTATION_3D);
        e.orientation_3d = Some(join(&finite(&path, pick(&path, read_exr(&path)?, ["X", "Y", "Z"])?)?));
    }
    if there(ENVELOPE) {
        let path = dir.join(ENVELOPE);
        e.envelope = Some(parse_ply_mesh(&read_all(&path)?).map_err(|f| f.in_file(&path))?);
    }
    if there(STRANDS) {
        e.strands = Some(read_exact_hair(&dir.join(STRANDS))?);
    }
    if there(STRAND_IDS) {
        let path = dir.join(STRAND_IDS);
        e.strand_ids = Some(parse_strand_ids(&read_all(&path)?).map_err(|f| f.in_file(&path))?);
        e.validate_strand_ids().map_err(|m| IoError::new(&path, format!("{m}; write the folder again")))?;
    }
    Ok(e)
}

fn check_manifest(dir: &Path, there: impl Fn(&str) -> bool) -> Result<()> {
    let path = dir.join(MANIFEST);
    let file: EstimateFile = serde_json::from_slice(&read_all(&path)?)
        .map_err(|e| IoError::new(&path, format!("not an estimate: {e}; correct or remove the file")))?;
    check_version(&path, (&file.format, file.version), (FORMAT, VERSION))?;
    if let Some(unknown) = file.holds.iter().find(|h| !PARTS.contains(&h.as_str())) {
        return Err(IoError::new(&path, format!("{unknown:?} is not one of {}", PARTS.join(", "))));
    }
    for part in PARTS {
        let listed = file.holds.iter().any(|h| h == part);
        if listed != there(part) {
            let fault = if listed { "is listed but not there" } else { "is there but not listed" };
            return Err(IoError::new(&path, format!("{part} {fault}; write the folder again")));
        }
    }
    Ok(())
}

fn finite<const N: usize>(path: &Path, planes: [Plane<f32>; N]) -> Result<[Plane<f32>; N]> {
    for p in &planes {
        if let Some(i) = p.data.iter().position(|v| !v.is_finite()) {
            return Err(IoError::new(
                path,
                format!(
                    "pixel ({}, {}) is not finite; write zero where there is no answer",
                    i % p.width,
                    i / p.width
                ),
            ));
        }
    }
    Ok(planes)
}

#[cfg(test)]
mod tests;

//! The truth folder.

use crate::atomic::{atomic_write, check_folder, merge_folder};
use crate::error::{IoError, Result};
use crate::estimate::{join, split};
use crate::exr::{pick, read_exr, write_exr};
use crate::mesh::{parse_ply_mesh, write_mesh};
use crate::read::{read_all, read_exact_hair, write_strands};
use crate::rig_json::{check_rig, encode_rig, parse_rig};
use crate::visibility::{encode_visibility, parse_visibility};
use rayon::prelude::*;
use std::path::Path;
use strandbench_types::{DepthMap, Rig, Truth, ViewTruth};

const RIG: &str = "truth_rig.json";
const STRANDS: &str = "strands.hair";
const VISIBILITY: &str = "visibility.bin";
const HEAD: &str = "head.ply";
pub(crate) const SUFFIX: &str = "_truth.exr";

/// Channels of `<name>_truth.exr`.
const CHANNELS: [&str; 10] = [
    "depth_first_mm",
    "depth_05_mm",
    "depth_50_mm",
    "coverage",
    "mask",
    "orientation_2d_rad",
    "orientation_agreement",
    "orientation_3d.X",
    "orientation_3d.Y",
    "orientation_3d.Z",
];

/// Writes the truth: `truth_rig.json`, per camera `<name>_truth.exr` (channels `depth_first_mm`, `depth_05_mm`,
/// `depth_50_mm`, `coverage`, `mask`, `orientation_2d_rad`, `orientation_agreement`, `orientation_3d.X/.Y/.Z`),
/// `strands.hair` (exact points and radii), `visibility.bin`, `head.ply`. Other files of an existing folder stay.
///
/// # Errors
/// If views, sizes, strands or visibility disagree, or a file cannot be written.
pub fn write_truth(dir: &Path, truth: &Truth) -> Result<()> {
    check_rig(dir, &truth.rig)?;
    check(dir, truth)?;
    merge_folder(
        dir,
        |name| [STRANDS, VISIBILITY, HEAD].contains(&name) || name.ends_with(SUFFIX),
        |tmp| {
            write_views(tmp, truth)?;
            write_strands(&tmp.join(STRANDS), &truth.strands)?;
            let bytes = encode_visibility(&truth.visibility);
            atomic_write(&tmp.join(VISIBILITY), |w| w.write_all(&bytes))?;
            if let Some(head) = &truth.head {
                write_mesh(&tmp.join(HEAD), head)?;
            }
            Ok(())
        },
    )
}

/// Reads a truth folder, bit for bit what was written.
///
/// # Errors
/// Names the missing or inconsistent file.
pub fn read_truth(dir: &Path) -> Result<Truth> {
    let (rig, views) = read_views(dir)?;
    let strands = read_exact_hair(&dir.join(STRANDS))?;
    let path = dir.join(VISIBILITY);
    let visibility = parse_visibility(&read_all(&path)?).map_err(|e| e.in_file(&path))?;
    let path = dir.join(HEAD);
    let head = if path.exists() {
        Some(parse_ply_mesh(&read_all(&path)?).map_err(|e| e.in_file(&path))?)
    } else {
        None
    };
    let truth = Truth { rig, views, strands, visibility, head };
    check(dir, &truth)?;
    Ok(truth)
}

/// Writes `truth_rig.json` and each camera's `<name>_truth.exr`.
pub(crate) fn write_views(tmp: &Path, truth: &Truth) -> Result<()> {
    truth
        .rig
        .cameras
        .par_iter()
        .zip(&truth.views)
        .try_for_each(|(camera, view)| write_view(&tmp.join(format!("{}{SUFFIX}", camera.name)), view))?;
    atomic_write(&tmp.join(RIG), |w| w.write_all(encode_rig(&truth.rig).as_bytes()))
}

/// Reads what [`write_views`] wrote.
pub(crate) fn read_views(dir: &Path) -> Result<(Rig, Vec<ViewTruth>)> {
    check_folder(dir)?;
    let path = dir.join(RIG);
    let rig = parse_rig(&path, &read_all(&path)?)?;
    let views = rig
        .cameras
        .par_iter()
        .map(|c| read_view(&dir.join(format!("{}{SUFFIX}", c.name)), (c.width as usize, c.height as usize)))
        .collect::<Result<Vec<_>>>()?;
    Ok((rig, views))
}

fn write_view(path: &Path, view: &ViewTruth) -> Result<()> {
    let mask = view.mask.map(|&m| f32::from(u8::from(m)));
    let [x, y, z] = split(&view.orientation_3d);
    let planes = [
        view.depth_first.raw(),
        view.depth_05.raw(),
        view.depth_50.raw(),
        &view.coverage,
        &mask,
        &view.orientation_2d,
        &view.orientation_agreement,
        &x,
        &y,
        &z,
    ];
    let channels: Vec<_> = CHANNELS.into_iter().zip(planes).collect();
    write_exr(path, &channels)
}

fn read_view(path: &Path, (w, h): (usize, usize)) -> Result<ViewTruth> {
    let planes = pick(path, read_exr(path)?, CHANNELS)?;
    let size = planes[0].size();
    if size != (w, h) {
        return Err(IoError::new(
            path,
            format!("{}x{} pixels, but {RIG} says {w}x{h}; render again", size.0, size.1),
        ));
    }
    let [first, p05, p50, coverage, mask, orientation_2d, orientation_agreement, x, y, z] = planes;
    if let Some(i) = mask.data.iter().position(|&m| m != 0.0 && m != 1.0) {
        return Err(IoError::new(path, format!("channel mask: pixel {i} is {}, not 0 or 1", mask.data[i])));
    }
    Ok(ViewTruth {
        depth_first: DepthMap::from_raw(first),
        depth_05: DepthMap::from_raw(p05),
        depth_50: DepthMap::from_raw(p50),
        coverage,
        mask: mask.map(|&m| m == 1.0),
        orientation_2d,
        orientation_agreement,
        orientation_3d: join(&[x, y, z]),
    })
}

/// What parts of a truth must have in common.
pub(crate) fn check(dir: &Path, truth: &Truth) -> Result<()> {
    let bad = |fault: String| Err(IoError::new(dir, format!("{fault}; make the truth again")));
    let (views, cameras) = (truth.views.len(), truth.rig.cameras.len());
    if views != cameras {
        return bad(format!("{views} views of {cameras} cameras"));
    }
    for (c, v) in truth.rig.cameras.iter().zip(&truth.views) {
        let sizes = [
            v.depth_first.size(),
            v.depth_05.size(),
            v.depth_50.size(),
            v.coverage.size(),
            v.mask.size(),
            v.orientation_2d.size(),
            v.orientation_agreement.size(),
            v.orientation_3d.size(),
        ];
        let want = (c.width as usize, c.height as usize);
        if let Some(s) = sizes.iter().find(|s| **s != want) {
            return bad(format!("camera {} is {want:?} px but a raster of its truth is {s:?} px", c.name));
        }
    }
    let v = &truth.visibility;
    let strands = v.offsets.len().saturating_sub(1);
    if strands != truth.strands.len() && !(v.offsets.is_empty() && v.seen_by.is_empty()) {
        return bad(format!("visibility of {strands} strands, but there are {}", truth.strands.len()));
    }
    let ascending = v.offsets.first().is_none_or(|&o| o == 0) && v.offsets.windows(2).all(|w| w[0] <= w[1]);
    if !ascending || v.offsets.last().map_or(0, |&o| o as usize) != v.seen_by.len() {
        return bad(format!("visibility offsets do not divide {} samples", v.seen_by.len()));
    }
    let beyond = if cameras >= 32 { 0 } else { u32::MAX << cameras };
    if let Some(i) = v.seen_by.iter().position(|s| s & beyond != 0) {
        return bad(format!("visibility sample {i} is seen by a camera beyond the {cameras} there are"));
    }
    Ok(())
}

#[cfg(test)]
mod tests;

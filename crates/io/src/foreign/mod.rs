//! Answers of other programs, in the formats that they write, as an estimate.

mod maps;
mod points;
mod units;

pub use maps::{parse_npy, parse_pfm};

use crate::atomic::check_folder;
use crate::error::{FormatError, IoError, Result};
use crate::estimate::{MANIFEST, PARTS, read_estimate};
use crate::mesh::read_mesh;
use crate::options::{ImportOptions, ImportReport};
use crate::ply::parse_ply;
use crate::ply_strands::{positions, vertices};
use crate::read::{ending, parse_strands, read_all};
use crate::strands::{Radii, RawStrands};
use glam::Vec3;
use std::path::{Path, PathBuf};
use strandbench_types::{Camera, DepthMap, Estimate, StrandSet};
use units::{UNITS, Units};

/// Files that answer for the depth, any one of them.
const DEPTHS: [&str; 4] = ["depth.exr", "depth.npy", "depth.pfm", "depth.png"];
/// Files that answer for the surface, any one of them.
const MESHES: [&str; 3] = ["envelope.ply", "mesh.ply", "mesh.obj"];
/// A cloud of points, drawn into the reference camera as a depth map.
const POINTS: &str = "points.ply";
/// Files that answer for the strands, any one of them.
const STRANDS: [&str; 5] = ["strands.hair", "strands.data", "strands.ply", "strands.obj", "strands.tfx"];

/// Most strands that an answer may have: seven times a full head of hair.
pub const MAX_ANSWER_STRANDS: usize = 1_000_000;
/// Most length of all strands together that an answer may have, mm: 100 km, twice a full head of long hair.
pub const MAX_ANSWER_LENGTH_MM: f64 = 1e8;
/// Fibre radius of strands whose file states none, mm; no score depends on it.
const RADIUS_MM: f32 = 0.04;

/// Reads the answer of any program: what [`read_estimate`] reads, and beside or instead of it
///
/// | file | meaning |
/// |---|---|
/// | `depth.npy`, `.pfm`, `.png` | depth along the reference camera's +z, a value a pixel; not finite, zero or less is no answer; a `.png` has 16 bits |
/// | `mesh.ply`, `mesh.obj` | the surface; without a depth map its first hit along the ray of each pixel's centre is the depth |
/// | `points.ply` | points; each is a disc of `point_radius_px` about its image, the nearest counts |
/// | `strands.data`, `.ply`, `.obj`, `.tfx` | strands, root first; those without length are left out |
/// | `units.json` | unit and frame of all of them, where they are not millimetres in the world |
///
/// `units.json` may say `mm_per_unit` (1), `frame` (`world`, or `reference-camera`: +x right, +y down, +z forward),
/// `depth_png_mm_per_unit` (which a `.png` needs) and `point_radius_px` (1). A folder with `estimate.json` is one of this
/// program and is read as such. `reference` is the camera that depth is asked of.
///
/// # Errors
/// Names the file and the remedy: nothing to read, two files for one thing, a map that is not of the camera's size, a
/// coordinate that is not finite, more than [`MAX_ANSWER_STRANDS`] strands or [`MAX_ANSWER_LENGTH_MM`] of them.
pub fn read_any_estimate(dir: &Path, reference: &Camera) -> Result<Estimate> {
    check_folder(dir)?;
    let there = |name: &&str| dir.join(name).exists();
    if there(&MANIFEST) {
        let estimate = read_estimate(dir)?;
        check_sizes(dir, &estimate, reference)?;
        return Ok(estimate);
    }
    let one = |names: &[&'static str], what: &str| -> Result<Option<PathBuf>> {
        let found: Vec<&str> = names.iter().copied().filter(|n| there(n)).collect();
        match found[..] {
            [] => Ok(None),
            [name] => Ok(Some(dir.join(name))),
            [a, b, ..] => {
                let fault = format!("{a} and {b} both answer for the {what}; keep the one that is meant");
                Err(IoError::new(dir, fault))
            }
        }
    };
    let depth = one(&[&DEPTHS[..], &[POINTS]].concat(), "depth")?;
    let mesh = one(&MESHES, "surface")?;
    let strands = one(&STRANDS, "strands")?;
    let ours = PARTS.iter().any(there);
    if !ours && depth.is_none() && mesh.is_none() && strands.is_none() {
        return Err(nothing(dir));
    }
    let units = Units::read(dir)?;
    let mut e = if ours { read_estimate(dir)? } else { Estimate::default() };
    let name = |path: &Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    if let Some(path) = mesh.filter(|p| name(p) != "envelope.ply") {
        e.envelope = Some(read_mesh(&path)?);
    }
    if let Some(path) = strands.filter(|p| name(p) != "strands.hair") {
        e.strands = Some(read_strands(&path)?);
    }
    units.place(dir, &mut e, reference)?;
    if let Some(strands) = &e.strands {
        check_strands(dir, strands)?;
    }
    match depth {
        Some(path) if name(&path) == POINTS => {
            let radius_px = units.point_radius_px(dir)?;
            let points = read_points(&path, |p| units.point(p, reference))?;
            e.depth = Some(points::depth_of_points(reference, &points, radius_px));
        }
        Some(path) if name(&path) == "depth.exr" => {
            if let Some(depth) = e.depth.take() {
                let mm = units.mm_per_unit as f32;
                e.depth =
                    Some(if mm == 1.0 { depth } else { DepthMap::from_raw(depth.raw().map(|z| z * mm)) });
            }
        }
        Some(path) => e.depth = Some(maps::read_depth(&path, &units)?),
        // The folder's own envelope never answered for the depth; a mesh from outside does.
        None if !dir.join("envelope.ply").exists() => {
            if let Some(mesh) = &e.envelope {
                let depth = DepthMap::of_mesh(reference, mesh);
                e.depth = Some(depth.map_err(|fault| IoError::new(dir, fault))?);
            }
        }
        None => {}
    }
    check_sizes(dir, &e, reference)?;
    Ok(e)
}

fn nothing(dir: &Path) -> IoError {
    let mut found: Vec<String> = std::fs::read_dir(dir)
        .map(|entries| entries.flatten().map(|e| e.file_name().to_string_lossy().into_owned()).collect())
        .unwrap_or_default();
    found.sort_unstable();
    let more = found.len().saturating_sub(5);
    found.truncate(5);
    let found = match (found.is_empty(), more) {
        (true, _) => "is empty".to_owned(),
        (false, 0) => format!("has only {}", found.join(", ")),
        (false, more) => format!("has only {} and {more} more", found.join(", ")),
    };
    let known = [&DEPTHS[..], &MESHES, &[POINTS], &STRANDS, &PARTS[1..3]].concat().join(", ");
    IoError::new(dir, format!("the folder holds no estimate: it {found}; give at least one of {known}"))
}

/// Refuses maps of another size than the reference camera's image.
fn check_sizes(dir: &Path, e: &Estimate, reference: &Camera) -> Result<()> {
    let want = (reference.width as usize, reference.height as usize);
    let depth = DEPTHS.iter().find(|n| dir.join(n).exists()).unwrap_or(&"depth");
    let sizes = [
        (*depth, e.depth.as_ref().map(DepthMap::size)),
        (PARTS[1], e.orientation.as_ref().map(|o| o.size())),
        (PARTS[2], e.orientation_3d.as_ref().map(|o| o.size())),
    ];
    match sizes.iter().find(|(_, size)| size.is_some_and(|s| s != want)) {
        Some((name, Some((w, h)))) => {
            let fault = format!(
                "{w}x{h} pixels, but the reference camera {} has {}x{}; answer for that camera, a value a pixel",
                reference.name, want.0, want.1
            );
            Err(IoError::new(&dir.join(name), fault))
        }
        _ => Ok(()),
    }
}

/// Strands in file units, exactly where the file has them, less those without length.
fn read_strands(path: &Path) -> Result<StrandSet> {
    let place = |raw: RawStrands| {
        let radius_mm = matches!(raw.radii, Radii::Unstated).then_some(RADIUS_MM);
        raw.placed(&ImportOptions { radius_mm, ..ImportOptions::default() }, &mut ImportReport::default())
    };
    let raw = parse_strands(&read_all(path)?, &ending(path), None);
    raw.and_then(place).map_err(|e| e.in_file(path))
}

fn check_strands(dir: &Path, strands: &StrandSet) -> Result<()> {
    let path = dir.join(STRANDS.iter().find(|n| dir.join(n).exists()).unwrap_or(&"strands"));
    if strands.len() > MAX_ANSWER_STRANDS {
        let fault = format!("{} strands, more than {MAX_ANSWER_STRANDS}; thin them evenly", strands.len());
        return Err(IoError::new(&path, fault));
    }
    let length: f64 = (0..strands.len()).map(|i| strands.length_mm(i)).sum();
    if length.is_nan() || length > MAX_ANSWER_LENGTH_MM {
        let fault = format!(
            "{:.0} km of strands, more than {:.0} km; state their unit as mm_per_unit in {UNITS}, or thin them",
            length / 1e6,
            MAX_ANSWER_LENGTH_MM / 1e6
        );
        return Err(IoError::new(&path, fault));
    }
    Ok(())
}

/// The points of a PLY, placed; a mesh's vertices are not taken for points.
fn read_points(path: &Path, place: impl Fn(Vec3) -> Vec3) -> Result<Vec<Vec3>> {
    let in_file = |e: FormatError| e.in_file(path);
    let ply = parse_ply(&read_all(path)?, |element, property| {
        element == "vertex" && matches!(property, "x" | "y" | "z")
    })
    .map_err(in_file)?;
    if ply.element("face").is_some_and(|f| f.count > 0) {
        return Err(IoError::new(path, "has faces: it is a mesh and no cloud of points; name it mesh.ply"));
    }
    let points: Vec<Vec3> =
        positions(vertices(&ply).map_err(in_file)?).map_err(in_file)?.into_iter().map(place).collect();
    match points.iter().position(|p| !p.is_finite()) {
        Some(i) => Err(IoError::new(path, format!("point {i} is not finite; write the file without it"))),
        None if points.is_empty() => Err(IoError::new(path, "has no points; write the file again")),
        None => Ok(points),
    }
}

#[cfg(test)]
mod tests;

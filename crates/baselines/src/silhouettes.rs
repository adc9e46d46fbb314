//! The visual hull of all masks: the largest surface that the silhouettes allow.

use crate::account::Clock;
use crate::lattice::{Lattice, MOST_NODES};
use crate::{BaselineError, Reconstruction};
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use strandbench_types::{Camera, DepthMap, Estimate, Frame, HullRays, Monitor, Plane, Rig, TriMesh};

/// Numbers of the visual hull.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VisualHull {
    /// Edge of the cells of the mesh, mm. The depth does not depend on it.
    pub cell_mm: f64,
}

impl VisualHull {
    /// Cells of a few pixels.
    pub const DEFAULT: VisualHull = VisualHull { cell_mm: 4.0 };

    pub(crate) fn fault(&self) -> Option<(&'static str, &'static str)> {
        let holds = self.cell_mm >= 0.05 && self.cell_mm <= 1000.0;
        (!holds).then_some(("cell_mm", "a number from 0.05 to 1000"))
    }
}

/// Distance (px) that stands for a camera that does not see a point.
const UNSEEN_PX: f64 = 1e3;

pub(crate) fn reconstruct(
    rig: &Rig,
    frame: &Frame,
    p: &VisualHull,
    monitor: &dyn Monitor,
) -> Result<Reconstruction, BaselineError> {
    let mut clock = Clock::new(monitor);
    let cameras = rig.cameras.len();
    if cameras < 2 {
        return Err(BaselineError::Cameras { cameras, wanted: "two or more".into() });
    }
    let masks: Vec<&Plane<bool>> = frame.masks.iter().collect();
    let reference = &rig.cameras[0];
    let (w, h) = masks[0].size();
    let rays = HullRays::new(rig, &masks);
    // Front, and the first and last corner of the box that its ray spans.
    let spans = clock.stage("hull", || {
        let one = |i: usize| {
            let pixel = DVec2::new((i % w) as f64 + 0.5, (i / w) as f64 + 0.5);
            let span = masks[0].data[i].then(|| rays.along(pixel)).flatten()?;
            let last = span.inside_mm.last().copied().unwrap_or(span.front_mm);
            let ends = [span.front_mm, last].map(|z| reference.unproject(pixel, z));
            Some((span.front_mm, ends))
        };
        Ok((0..w * h).into_par_iter().map(one).collect::<Vec<_>>())
    })?;
    let front = spans.iter().map(|s| s.map_or(f32::NAN, |(z, _)| z as f32)).collect();
    let depth = DepthMap::from_raw(Plane::from_vec(w, h, front));
    if depth.answered() == 0 {
        return Err(BaselineError::NoHull { frame: frame.index });
    }
    let ends: Vec<DVec3> = spans.iter().flatten().flat_map(|(_, ends)| *ends).collect();
    let mesh = clock.stage("mesh", || mesh(rig, &masks, &ends, p.cell_mm))?;
    clock.note(format!("{} triangles", mesh.triangles.len()));
    let estimate = Estimate { depth: Some(depth), envelope: Some(mesh), ..Estimate::default() };
    Ok(Reconstruction { estimate, account: clock.account() })
}

/// The surface of the hull around points, closed at the ends of the working volume: where the least of the cameras'
/// distances to their silhouettes is zero.
fn mesh(rig: &Rig, masks: &[&Plane<bool>], around: &[DVec3], cell_mm: f64) -> Result<TriMesh, BaselineError> {
    let low = around.iter().fold(DVec3::INFINITY, |a, &b| a.min(b)) - 2.0 * cell_mm;
    let high = around.iter().fold(DVec3::NEG_INFINITY, |a, &b| a.max(b)) + 2.0 * cell_mm;
    let cells = ((high - low) / cell_mm).ceil();
    let nodes = (cells.x + 1.0) * (cells.y + 1.0) * (cells.z + 1.0);
    if nodes.is_nan() || nodes > MOST_NODES as f64 {
        return Err(BaselineError::TooManyNodes { nodes: nodes as u64, cell_mm, limit: MOST_NODES });
    }
    let lattice = Lattice { origin: low, cell_mm, size: cells.to_array().map(|c| c as usize + 1) };
    let distances: Vec<Plane<f64>> = masks.par_iter().map(|m| inside_px(m)).collect();
    let reference = &rig.cameras[0];
    let values: Vec<f64> = (0..lattice.count())
        .into_par_iter()
        .map(|i| {
            let at = lattice.node(i);
            let z = reference.to_camera(at).z;
            let ends = (z - rig.near_mm).min(rig.far_mm - z) * reference.focal_px.x / z.max(1.0);
            let of = |(c, d): (&Camera, &Plane<f64>)| match c.project(at) {
                Some((q, _)) if c.contains(q) => bilinear(d, q),
                _ => UNSEEN_PX,
            };
            // The surface's larger values lie outside.
            -rig.cameras.iter().zip(&distances).map(of).fold(ends, f64::min)
        })
        .collect();
    Ok(lattice.surface(&values, 0.0))
}

fn bilinear(d: &Plane<f64>, q: DVec2) -> f64 {
    let x = (q.x - 0.5).clamp(0.0, (d.width - 1) as f64);
    let y = (q.y - 0.5).clamp(0.0, (d.height - 1) as f64);
    let (cx, cy) = ((x as usize).min(d.width.max(2) - 2), (y as usize).min(d.height.max(2) - 2));
    let (a, b) = (x - cx as f64, y - cy as f64);
    let at = |i: usize, j: usize| *d.at((cx + i).min(d.width - 1), (cy + j).min(d.height - 1));
    let top = at(0, 0) + a * (at(1, 0) - at(0, 0));
    let bottom = at(0, 1) + a * (at(1, 1) - at(0, 1));
    top + b * (bottom - top)
}

/// Distance of each pixel's centre to the mask's edge, px, positive inside; the edge runs half a pixel from the centres
/// on both sides.
fn inside_px(mask: &Plane<bool>) -> Plane<f64> {
    let (to_hair, to_rest) = (distance_to(mask, true), distance_to(mask, false));
    let data = mask.data.iter().zip(to_hair.iter().zip(&to_rest));
    let signed =
        data.map(|(&hair, (a, b))| if hair { b.min(UNSEEN_PX) - 0.5 } else { 0.5 - a.min(UNSEEN_PX) });
    Plane::from_vec(mask.width, mask.height, signed.collect())
}

/// Distance of each pixel to the nearest one of a kind, px (Felzenszwalb and Huttenlocher 2012: the lower envelope of
/// parabolas, along columns and then along rows).
fn distance_to(mask: &Plane<bool>, kind: bool) -> Vec<f64> {
    let (w, h) = mask.size();
    const FAR: f64 = 1e12;
    let mut squared: Vec<f64> = mask.data.iter().map(|&m| if m == kind { 0.0 } else { FAR }).collect();
    for x in 0..w {
        let column: Vec<f64> = (0..h).map(|y| squared[y * w + x]).collect();
        for (y, v) in envelope(&column).into_iter().enumerate() {
            squared[y * w + x] = v;
        }
    }
    for row in squared.chunks_mut(w) {
        let made = envelope(row);
        row.copy_from_slice(&made);
    }
    squared.into_iter().map(f64::sqrt).collect()
}

/// min over j of values[j] + (i - j)².
fn envelope(values: &[f64]) -> Vec<f64> {
    let mut apexes: Vec<usize> = Vec::new();
    let mut starts: Vec<f64> = Vec::new();
    let height = |j: usize| values[j] + (j * j) as f64;
    for j in 0..values.len() {
        let mut start = f64::NEG_INFINITY;
        while let (Some(&k), Some(&from)) = (apexes.last(), starts.last()) {
            start = (height(j) - height(k)) / (2.0 * (j - k) as f64);
            if start > from {
                break;
            }
            apexes.pop();
            starts.pop();
            start = f64::NEG_INFINITY;
        }
        apexes.push(j);
        starts.push(start);
    }
    let mut k = 0;
    (0..values.len())
        .map(|i| {
            while k + 1 < starts.len() && starts[k + 1] <= i as f64 {
                k += 1;
            }
            let off = i as f64 - apexes[k] as f64;
            values[apexes[k]] + off * off
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_are_those_of_brute_force() {
        let (w, h) = (23, 17);
        let mask =
            Plane::from_vec(w, h, (0..w * h).map(|i| (i * 7919 + i / 5) % 11 < 2).collect::<Vec<bool>>());
        for kind in [true, false] {
            for (i, d) in distance_to(&mask, kind).into_iter().enumerate() {
                let to = |j: usize| {
                    DVec2::new((i % w) as f64, (i / w) as f64)
                        .distance(DVec2::new((j % w) as f64, (j / w) as f64))
                };
                let want = (0..w * h).filter(|&j| mask.data[j] == kind).map(to).fold(f64::INFINITY, f64::min);
                assert!((d - want).abs() < 1e-9, "{i}: {d} for {want}");
            }
        }
        let none = distance_to(&Plane::filled(4, 3, false), true);
        assert!(none.iter().all(|d| *d >= 1e5));
    }
}

//! Screened Poisson surface reconstruction after Kazhdan and Hoppe 2013, on a regular grid.
//!
//! The indicator χ minimises ∫ |∇χ - V|² + (α / h) Σ a_s χ(s)², with V the oriented samples' smoothed normal field, a_s
//! the area that a sample stands for and h the cell's edge: their point weight α over the mean area, made independent of
//! the resolution by their factor of 2 a level. Trilinear elements; borders are free (Neumann), so that an open surface
//! may leave the box. A sample is smoothed over a cell of the grid on which it has neighbours enough, which is what
//! their octree does where samples are sparse.

mod grid;

use crate::BaselineError;
use crate::lattice::{Lattice, MOST_NODES};
use glam::DVec3;
use grid::{Multigrid, halvings};
use rayon::prelude::*;
use strandbench_solve::deform::PointTree;
use strandbench_types::{Monitor, TriMesh};

/// Neighbours from whose distance the density of samples is taken.
const DENSITY_NEIGHBOURS: usize = 12;
/// Residual at which the solver stops, of the right side.
const TOLERANCE: f64 = 1e-4;
/// Most steps of the solver.
const MOST_STEPS: usize = 60;
/// Cells between the samples' box and the grid's border.
const MARGIN_CELLS: f64 = 8.0;

/// A point of the surface with its outward normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Oriented {
    /// Position, mm.
    pub position: DVec3,
    /// Unit normal.
    pub normal: DVec3,
}

/// How the surface is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoissonOptions {
    /// Edge of a cell, mm.
    pub cell_mm: f64,
    /// Point weight α.
    pub screening: f64,
    /// Samples that a cell's face should have where a sample is smoothed over it.
    pub samples_per_node: f64,
}

/// What came out beside the surface.
#[derive(Clone, Debug)]
pub struct Solved {
    /// The surface on which χ has its mean over the samples; nothing is trimmed.
    pub mesh: TriMesh,
    /// Area that each sample stands for, mm².
    pub area_mm2: Vec<f64>,
    /// Root mean square of χ - iso over the samples, in units of the jump of 1 across the surface.
    pub residual: f64,
    /// Nodes of the grid.
    pub nodes: usize,
    /// Steps of the solver.
    pub steps: usize,
}

/// The surface of oriented samples.
///
/// # Errors
/// If there are fewer samples than a density can be taken from, the grid would be too large, a number is not finite, or
/// the work is cancelled.
pub fn poisson(
    samples: &[Oriented],
    options: &PoissonOptions,
    monitor: &dyn Monitor,
) -> Result<Solved, BaselineError> {
    let fine = samples.iter().all(|s| s.position.is_finite() && s.normal.is_finite());
    if samples.len() <= DENSITY_NEIGHBOURS || !fine {
        return Err(BaselineError::FewPatches { found: samples.len(), wanted: DENSITY_NEIGHBOURS + 1 });
    }
    let h = options.cell_mm;
    let (lattice, halved) = lattice_around(samples, h)?;
    let area_mm2 = areas(samples, h);
    let rhs = divergence(&lattice, halved, samples, &area_mm2, options.samples_per_node);
    let screened: Vec<(DVec3, f64)> =
        samples.iter().zip(&area_mm2).map(|(s, a)| (s.position, options.screening / h * a)).collect();
    monitor.check()?;
    let mut multigrid = Multigrid::new(&lattice, halved, &screened)?;
    let stop = || Ok(monitor.check()?);
    let (chi, steps, _) = multigrid.solve(&rhs, TOLERANCE, MOST_STEPS, &stop)?;
    let at: Vec<f64> = samples
        .par_iter()
        .map(|s| {
            let (node, weights) = lattice.around(s.position);
            lattice.blend(&chi, node, &weights)
        })
        .collect();
    let n = at.len() as f64;
    let iso = at.iter().sum::<f64>() / n;
    let residual = (at.iter().map(|v| (v - iso).powi(2)).sum::<f64>() / n).sqrt();
    monitor.check()?;
    let mesh = lattice.surface(&chi, iso);
    Ok(Solved { mesh, area_mm2, residual, nodes: lattice.count(), steps })
}

/// A lattice around the samples that can be halved as often as the second value says.
fn lattice_around(samples: &[Oriented], h: f64) -> Result<(Lattice, usize), BaselineError> {
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for s in samples {
        low = low.min(s.position);
        high = high.max(s.position);
    }
    let margin = DVec3::splat(MARGIN_CELLS * h) + 0.05 * (high - low);
    let cells = ((high - low + 2.0 * margin) / h).ceil();
    let nodes = (cells.x + 1.0) * (cells.y + 1.0) * (cells.z + 1.0);
    if nodes.is_nan() || nodes > MOST_NODES as f64 {
        return Err(BaselineError::TooManyNodes { nodes: nodes as u64, cell_mm: h, limit: MOST_NODES });
    }
    let cells = cells.to_array().map(|c| c as usize);
    let halved = halvings(cells);
    let step = 1usize << halved;
    let size = cells.map(|c| c.next_multiple_of(step) + 1);
    Ok((Lattice { origin: low - margin, cell_mm: h, size }, halved))
}

/// Area that each sample stands for: that of the disc up to its last neighbour over the number of neighbours.
fn areas(samples: &[Oriented], h: f64) -> Vec<f64> {
    let points: Vec<DVec3> = samples.iter().map(|s| s.position).collect();
    let tree = PointTree::new(&points);
    points
        .par_iter()
        .map(|&p| {
            let mut near = [(0.0, 0); DENSITY_NEIGHBOURS + 1];
            tree.k_nearest(p, &mut near);
            let area = std::f64::consts::PI * near[DENSITY_NEIGHBOURS].0 / DENSITY_NEIGHBOURS as f64;
            area.max(1e-3 * h * h)
        })
        .collect()
}

/// ∫ V·∇B of every node's function B.
fn divergence(
    lattice: &Lattice,
    halved: usize,
    samples: &[Oriented],
    area_mm2: &[f64],
    samples_per_node: f64,
) -> Vec<f64> {
    let level_of = |area: f64| {
        let cell = (samples_per_node * area).sqrt();
        (0..halved).find(|&l| lattice.cell_mm * (1u64 << l) as f64 >= cell).unwrap_or(halved)
    };
    let levels: Vec<usize> = area_mm2.iter().map(|&a| level_of(a)).collect();
    let mut rhs = vec![0.0; lattice.count()];
    for axis in 0..3 {
        let mut field: Vec<f64> = Vec::new();
        for l in (0..=halved).rev() {
            let grid = lattice.coarser(l);
            let mut own = vec![0.0; grid.count()];
            if !field.is_empty() {
                grid.prolong_add(&field, &mut own);
            }
            for ((s, a), _) in samples.iter().zip(area_mm2).zip(&levels).filter(|(_, of)| **of == l) {
                let (node, weights) = grid.around(s.position);
                let value = s.normal[axis] * a / grid.cell_mm.powi(3);
                for (k, w) in weights.iter().enumerate() {
                    own[grid.corner(node, k)] += w * value;
                }
            }
            field = own;
        }
        for other in 0..3 {
            field = along(lattice, &field, other, other == axis);
        }
        rhs.par_iter_mut().zip(&field).for_each(|(r, f)| *r += f);
    }
    rhs
}

/// One axis of ∫ B_i B_j, or of ∫ B_i' B_j, applied to values.
fn along(lattice: &Lattice, values: &[f64], axis: usize, derivative: bool) -> Vec<f64> {
    let n = lattice.size[axis];
    let stride: usize = lattice.size[..axis].iter().product();
    let h = lattice.cell_mm;
    (0..values.len())
        .into_par_iter()
        .map(|i| {
            let c = i / stride % n;
            let before = if c > 0 { values[i - stride] } else { 0.0 };
            let after = if c + 1 < n { values[i + stride] } else { 0.0 };
            // B_i rises over the cell before and falls over the one after; an end has only one of them.
            let cells = f64::from(u8::from(c > 0) + u8::from(c + 1 < n));
            if derivative {
                let own = f64::from(i8::from(c > 0) - i8::from(c + 1 < n));
                0.5 * (before - after + own * values[i])
            } else {
                h / 6.0 * (before + after + 2.0 * cells * values[i])
            }
        })
        .collect()
}

/// Leaves out triangles to whose corners `keep` says no, and vertices that no triangle is left of.
pub(crate) fn trim(mesh: &TriMesh, keep: impl Fn([usize; 3]) -> bool) -> TriMesh {
    let triangles: Vec<[u32; 3]> =
        mesh.triangles.iter().filter(|t| keep(t.map(|i| i as usize))).copied().collect();
    let mut place = vec![u32::MAX; mesh.vertices.len()];
    let mut vertices = Vec::new();
    let triangles = triangles
        .into_iter()
        .map(|t| {
            t.map(|i| {
                let p = &mut place[i as usize];
                if *p == u32::MAX {
                    *p = vertices.len() as u32;
                    vertices.push(mesh.vertices[i as usize]);
                }
                *p
            })
        })
        .collect();
    TriMesh { vertices, triangles }
}

#[cfg(test)]
mod tests;

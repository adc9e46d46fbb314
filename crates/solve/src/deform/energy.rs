//! The energy of a deformation graph, its gradient and Gauss-Newton matrix, and its minimisation.
//!
//! With v a carried point, c its target and n the target's normal,
//!
//! E = φ Σ (α_point |v - c|² + α_plane (n·(v - c))²) + α_rigid Σ_nodes rigid + α_smooth Σ_(i,j) smooth
//!
//! over both directions of every edge. Rigid is Sumner et al. 2007, Eq. 4 (columns of A orthogonal and of unit
//! length), smooth is their Eq. 6: |A_i (g_j - g_i) + g_i + b_i - (g_j + b_j)|².
//!
//! Unknown 12 i + 3 c + a is row a of column c of A_i for c < 3 and of b_i for c = 3.

mod linearise;
mod minimise;

use super::graph::{DeformationGraph, Skinning};
use crate::sparse::{Cholesky, SparseError};
use glam::{DMat3, DVec3};
use rayon::prelude::*;

const N: usize = 12;

/// Where a carried point should be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aim {
    /// Target c, mm.
    pub point: DVec3,
    /// Unit normal n of the target; zero for none.
    pub normal: DVec3,
}

/// Factors of the energy's terms.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weights {
    /// φ, over all fit terms.
    pub fit: f64,
    /// α_point.
    pub point: f64,
    /// α_plane.
    pub plane: f64,
    /// α_rigid.
    pub rigid: f64,
    /// α_smooth.
    pub smooth: f64,
}

/// Energy before and after a minimisation, and its steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Descent {
    /// Energy at the start.
    pub before: f64,
    /// Energy at the end, never above `before`.
    pub after: f64,
    /// Systems solved.
    pub steps: usize,
}

/// A graph, the points that it carries, and the sparse system between them.
#[derive(Debug)]
pub struct Deformer {
    /// The graph in its present state.
    pub graph: DeformationGraph,
    points: Vec<DVec3>,
    skin: Skinning,
    /// Points that a node carries, indexed [touch_starts[node]..touch_starts[node + 1]].
    touching: Vec<u32>,
    touch_starts: Vec<usize>,
    /// All neighbours of a node, ascending.
    neighbours: Vec<Vec<u32>>,
    solver: Cholesky,
    values: Vec<f64>,
    gradient: Vec<f64>,
}

impl Deformer {
    /// Joins a graph and the points that it carries at rest.
    ///
    /// # Errors
    /// If the system's factor does not fit in memory.
    ///
    /// # Panics
    /// If the skinning is not of these points, or nodes that carry a point together are not joined.
    pub fn new(graph: DeformationGraph, points: Vec<DVec3>, skin: Skinning) -> Result<Deformer, SparseError> {
        assert_eq!(skin.len(), points.len(), "skinning of these points");
        let n = graph.len();
        let mut touch_starts = vec![0usize; n + 1];
        skin.nodes.iter().for_each(|&j| touch_starts[j as usize + 1] += 1);
        for i in 0..n {
            touch_starts[i + 1] += touch_starts[i];
        }
        let mut touching = vec![0u32; skin.nodes.len()];
        let mut next = touch_starts.clone();
        for (slot, &j) in skin.nodes.iter().enumerate() {
            touching[next[j as usize]] = (slot / skin.k) as u32;
            next[j as usize] += 1;
        }
        let mut neighbours = vec![Vec::new(); n];
        for &(a, b) in &graph.edges {
            neighbours[a as usize].push(b);
            neighbours[b as usize].push(a);
        }
        neighbours.iter_mut().for_each(|l| l.sort_unstable());
        let (mut starts, mut rows) = (vec![0], Vec::new());
        for (j, list) in neighbours.iter().enumerate() {
            for c in 0..N {
                rows.extend(j * N + c..(j + 1) * N);
                for &i in list.iter().filter(|&&i| i as usize > j) {
                    rows.extend(i as usize * N..(i as usize + 1) * N);
                }
                starts.push(rows.len());
            }
        }
        let (values, gradient) = (vec![0.0; rows.len()], vec![0.0; n * N]);
        let solver = Cholesky::new(starts, rows)?;
        Ok(Deformer { graph, points, skin, touching, touch_starts, neighbours, solver, values, gradient })
    }

    /// Points at rest, mm.
    pub fn points(&self) -> &[DVec3] {
        &self.points
    }

    /// How the points depend on the nodes.
    pub fn skin(&self) -> &Skinning {
        &self.skin
    }

    /// Replaces the points at rest; their nodes and weights stay.
    pub fn set_points(&mut self, points: Vec<DVec3>) {
        assert_eq!(points.len(), self.points.len(), "as many points as before");
        self.points = points;
    }

    /// Where the points are now, mm.
    pub fn carried(&self) -> Vec<DVec3> {
        self.graph.carry_all(&self.skin, &self.points)
    }

    /// The energy at the present state. `aims` holds one entry a point.
    pub fn energy(&self, aims: &[Option<Aim>], w: &Weights) -> f64 {
        assert_eq!(aims.len(), self.points.len(), "one aim a point");
        let fit = |i: usize| {
            let Some(aim) = aims[i] else { return 0.0 };
            let e = self.graph.carry(&self.skin, i, self.points[i]).0 - aim.point;
            w.fit * (w.point * e.length_squared() + w.plane * e.dot(aim.normal).powi(2))
        };
        // Chunks of fixed size, added in order: the sum does not depend on threads.
        let chunk = 1024;
        let sums: Vec<f64> = (0..self.points.len().div_ceil(chunk))
            .into_par_iter()
            .map(|c| (c * chunk..((c + 1) * chunk).min(self.points.len())).map(fit).sum())
            .collect();
        let g = &self.graph;
        let rigid: f64 =
            g.linear.iter().map(|a| rigid_terms(*a).iter().map(|(r, _)| r * r).sum::<f64>()).sum();
        let smooth: f64 = g
            .edges
            .iter()
            .map(|&(i, j)| {
                let (i, j) = (i as usize, j as usize);
                self.smooth_residual(i, j).length_squared() + self.smooth_residual(j, i).length_squared()
            })
            .sum();
        sums.iter().sum::<f64>() + w.rigid * rigid + w.smooth * smooth
    }

    fn smooth_residual(&self, i: usize, j: usize) -> DVec3 {
        let g = &self.graph;
        g.linear[i] * (g.rest[j] - g.rest[i]) + g.rest[i] + g.offset[i] - g.rest[j] - g.offset[j]
    }
}

/// Residuals of the rigidity term and their derivatives by the nine entries of A, column by column.
fn rigid_terms(a: DMat3) -> [(f64, [f64; 9]); 6] {
    let columns = [a.x_axis, a.y_axis, a.z_axis];
    let mut all = [(0.0, [0.0; 9]); 6];
    for (k, (p, q)) in [(0, 1), (0, 2), (1, 2)].into_iter().enumerate() {
        all[k].0 = columns[p].dot(columns[q]);
        for r in 0..3 {
            all[k].1[3 * p + r] = columns[q][r];
            all[k].1[3 * q + r] = columns[p][r];
        }
    }
    for p in 0..3 {
        all[3 + p].0 = 1.0 - columns[p].length_squared();
        for r in 0..3 {
            all[3 + p].1[3 * p + r] = -2.0 * columns[p][r];
        }
    }
    all
}

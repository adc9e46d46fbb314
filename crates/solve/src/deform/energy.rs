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

    /// Half the gradient of the energy, Jᵀr, indexed `[unknown]`, and the lower triangle of half its Gauss-Newton
    /// matrix, JᵀJ, in the solver's pattern.
    pub fn linearise(&mut self, aims: &[Option<Aim>], w: &Weights) -> (&[f64], &[f64]) {
        assert_eq!(aims.len(), self.points.len(), "one aim a point");
        let mut values = std::mem::take(&mut self.values);
        let mut gradient = std::mem::take(&mut self.gradient);
        let errors: Vec<DVec3> = (0..self.points.len())
            .into_par_iter()
            .map(|i| {
                let at = |aim: Aim| self.graph.carry(&self.skin, i, self.points[i]).0 - aim.point;
                aims[i].map_or(DVec3::ZERO, at)
            })
            .collect();
        let starts = self.solver.column_starts();
        let mut columns = Vec::with_capacity(self.graph.len());
        let mut rest = values.as_mut_slice();
        for j in 0..self.graph.len() {
            let (own, others) = rest.split_at_mut(starts[(j + 1) * N] - starts[j * N]);
            columns.push(own);
            rest = others;
        }
        columns
            .into_par_iter()
            .zip(gradient.par_chunks_mut(N))
            .enumerate()
            .for_each(|(j, (out, gradient))| self.column(j, aims, &errors, w, out, gradient));
        (self.values, self.gradient) = (values, gradient);
        (&self.gradient, &self.values)
    }

    /// The pattern of [`Deformer::linearise`]'s matrix: column starts and rows.
    pub fn pattern(&self) -> (&[usize], &[usize]) {
        (self.solver.column_starts(), self.solver.rows())
    }

    /// Columns of node j: its own block and those of the neighbours after it.
    fn column(
        &self,
        j: usize,
        aims: &[Option<Aim>],
        errors: &[DVec3],
        w: &Weights,
        out: &mut [f64],
        gradient: &mut [f64],
    ) {
        let g = &self.graph;
        let later = self.neighbours[j].partition_point(|&i| (i as usize) < j);
        let below = &self.neighbours[j][later..];
        // Indexed [block][row][column]; block 0 is node j's own.
        let mut blocks = vec![[[0.0f64; N]; N]; below.len() + 1];
        gradient.fill(0.0);
        let block_of = |i: usize| {
            if i == j {
                return 0;
            }
            1 + below.binary_search(&(i as u32)).expect("nodes that carry a point together are joined")
        };
        let weighted = |i: usize, weight: f64, at: DVec3| {
            let d = (at - g.rest[i]) * weight;
            [d.x, d.y, d.z, weight]
        };
        for &s in &self.touching[self.touch_starts[j]..self.touch_starts[j + 1]] {
            let s = s as usize;
            let Some(aim) = aims[s] else { continue };
            let n = aim.normal;
            let m =
                (DMat3::IDENTITY * w.point + DMat3::from_cols(n * n.x, n * n.y, n * n.z) * w.plane) * w.fit;
            let own = self.skin.of(s).find(|p| p.0 == j).map_or(0.0, |p| p.1);
            let h = weighted(j, own, self.points[s]);
            let pull = m * errors[s];
            for c in 0..4 {
                for a in 0..3 {
                    gradient[3 * c + a] += h[c] * pull[a];
                }
            }
            for (i, weight) in self.skin.of(s).filter(|p| p.0 >= j) {
                let hi = weighted(i, weight, self.points[s]);
                let block = &mut blocks[block_of(i)];
                for ci in 0..4 {
                    for cj in 0..4 {
                        let f = hi[ci] * h[cj];
                        for a in 0..3 {
                            for b in 0..3 {
                                block[3 * ci + a][3 * cj + b] += f * m.col(b)[a];
                            }
                        }
                    }
                }
            }
        }
        for &n in &self.neighbours[j] {
            let n = n as usize;
            let to = g.rest[n] - g.rest[j];
            let h = [to.x, to.y, to.z, 1.0];
            let back = [-to.x, -to.y, -to.z, 1.0];
            let (out_r, in_r) = (self.smooth_residual(j, n), self.smooth_residual(n, j));
            for c in 0..4 {
                for a in 0..3 {
                    gradient[3 * c + a] += w.smooth * h[c] * out_r[a];
                    for d in 0..4 {
                        blocks[0][3 * c + a][3 * d + a] += w.smooth * h[c] * h[d];
                    }
                }
            }
            for a in 0..3 {
                gradient[9 + a] -= w.smooth * in_r[a];
                blocks[0][9 + a][9 + a] += w.smooth;
            }
            if n > j {
                let block = &mut blocks[block_of(n)];
                for c in 0..4 {
                    for a in 0..3 {
                        block[9 + a][3 * c + a] -= w.smooth * h[c];
                        block[3 * c + a][9 + a] -= w.smooth * back[c];
                    }
                }
            }
        }
        for (r, row) in rigid_terms(g.linear[j]) {
            for p in 0..9 {
                gradient[p] += w.rigid * r * row[p];
                for q in 0..9 {
                    blocks[0][p][q] += w.rigid * row[p] * row[q];
                }
            }
        }
        let mut next = out.iter_mut();
        for c in 0..N {
            let own = blocks[0][c..].iter();
            for row in own.chain(blocks[1..].iter().flatten()) {
                *next.next().expect("the pattern has a place for every entry") = row[c];
            }
        }
    }

    /// Levenberg-Marquardt steps towards fixed aims: at most `steps` systems accepted, fewer once the energy falls
    /// by less than `tolerance` of itself.
    ///
    /// # Errors
    /// If the system stays singular under damping: numbers that are not finite.
    pub fn minimise(
        &mut self,
        aims: &[Option<Aim>],
        w: &Weights,
        steps: usize,
        tolerance: f64,
    ) -> Result<Descent, SparseError> {
        let before = self.energy(aims, w);
        let mut result = Descent { before, after: before, steps: 0 };
        let mut damping = FIRST_DAMPING;
        for _ in 0..steps {
            self.linearise(aims, w);
            let diagonal: Vec<usize> =
                (0..self.gradient.len()).map(|i| self.solver.column_starts()[i]).collect();
            let largest = diagonal.iter().fold(0.0f64, |m, &d| m.max(self.values[d]));
            let undamped: Vec<f64> = diagonal.iter().map(|&d| self.values[d]).collect();
            let state = (self.graph.linear.clone(), self.graph.offset.clone());
            let mut accepted = None;
            while damping < LAST_DAMPING {
                for (&d, &v) in diagonal.iter().zip(&undamped) {
                    self.values[d] = v + damping * (v + largest * 1e-6);
                }
                let mut step: Vec<f64> = self.gradient.iter().map(|g| -g).collect();
                let solved = self.solver.solve(&self.values, &mut step);
                result.steps += 1;
                if solved.is_ok() {
                    // What the linear model promises; below rounding there is nothing left to gain.
                    let promised: f64 = -step.iter().zip(&self.gradient).map(|(d, g)| d * g).sum::<f64>();
                    if promised <= ROUNDING * result.after {
                        return Ok(result);
                    }
                    self.step(&step);
                    let now = self.energy(aims, w);
                    if now <= result.after {
                        accepted = Some(now);
                        damping = (damping * 0.1).max(FIRST_DAMPING);
                        break;
                    }
                    (self.graph.linear, self.graph.offset) = state.clone();
                } else if damping * 10.0 >= LAST_DAMPING {
                    solved?;
                }
                damping *= 10.0;
            }
            let Some(now) = accepted else { break };
            let gain = result.after - now;
            result.after = now;
            if gain <= tolerance * now {
                break;
            }
        }
        Ok(result)
    }

    fn step(&mut self, delta: &[f64]) {
        for (i, d) in delta.chunks_exact(N).enumerate() {
            let column = |c: usize| DVec3::new(d[3 * c], d[3 * c + 1], d[3 * c + 2]);
            self.graph.linear[i] += DMat3::from_cols(column(0), column(1), column(2));
            self.graph.offset[i] += column(3);
        }
    }
}

const FIRST_DAMPING: f64 = 1e-9;
const LAST_DAMPING: f64 = 1e6;
/// Share of the energy that rounding of its thousands of terms can hide.
const ROUNDING: f64 = 1e-12;

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

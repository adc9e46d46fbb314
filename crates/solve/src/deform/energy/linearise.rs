//! The gradient and the Gauss-Newton matrix, node by node.

use super::{Aim, Deformer, N, Weights, rigid_terms};
use glam::{DMat3, DVec3};
use rayon::prelude::*;

impl Deformer {
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
}

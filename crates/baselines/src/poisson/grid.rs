//! Trilinear finite elements on a regular grid: the operator of the screened Poisson equation and its multigrid.

use glam::DVec3;
use rayon::prelude::*;
use strandbench_solve::Cholesky;

use crate::lattice::Lattice;

/// Damping of the Jacobi sweeps: the operator's eigenvalues over its diagonal reach 1.5.
const DAMPING: f64 = 0.9;
/// Sweeps before and after each coarse correction.
const SWEEPS: usize = 2;
/// Cells along the longest edge at which a grid is solved directly.
const COARSEST: usize = 12;
/// Most grids.
const MOST_LEVELS: usize = 8;

/// A sample's place in a grid: the first of its cell's eight nodes, their weights, and the sample's screening weight.
#[derive(Clone, Copy, Debug)]
pub(super) struct Held {
    node: usize,
    weights: [f64; 8],
    screening: f64,
}

/// One grid of the hierarchy.
pub(super) struct Level {
    pub lattice: Lattice,
    held: Vec<Held>,
    /// Diagonal of the stiffness plus row sums of the screening, which bound its eigenvalues.
    diagonal: Vec<f64>,
}

/// How many times a lattice is halved before it is solved directly.
pub(super) fn halvings(cells: [usize; 3]) -> usize {
    let longest = cells.into_iter().max().unwrap_or(1);
    (0..MOST_LEVELS - 1).find(|l| longest >> l <= COARSEST).unwrap_or(MOST_LEVELS - 1)
}

/// Mass (times 6 / h) and stiffness (times h) of one axis between node `i` of `n` and its neighbour at `d`.
fn one_axis(i: usize, n: usize, d: isize) -> Option<(f64, f64)> {
    let j = i as isize + d;
    if j < 0 || j >= n as isize {
        return None;
    }
    let end = i == 0 || i + 1 == n;
    Some(match (d, end) {
        (0, false) => (4.0, 2.0),
        (0, true) => (2.0, 1.0),
        _ => (1.0, -1.0),
    })
}

impl Level {
    fn new(lattice: Lattice, samples: &[(DVec3, f64)]) -> Level {
        let held: Vec<Held> = samples
            .iter()
            .map(|&(p, screening)| {
                let (node, weights) = lattice.around(p);
                Held { node, weights, screening }
            })
            .collect();
        let [nx, ny, nz] = lattice.size;
        let h = lattice.cell_mm;
        let mut diagonal = vec![0.0; lattice.count()];
        diagonal.par_chunks_mut(nx * ny).enumerate().for_each(|(z, plane)| {
            for (i, v) in plane.iter_mut().enumerate() {
                let axes = [one_axis(i % nx, nx, 0), one_axis(i / nx, ny, 0), one_axis(z, nz, 0)];
                *v = stencil(axes) * h;
            }
        });
        for s in &held {
            for (k, w) in s.weights.iter().enumerate() {
                diagonal[lattice.corner(s.node, k)] += s.screening * w;
            }
        }
        Level { lattice, held, diagonal }
    }

    /// The operator applied to `u`.
    fn apply(&self, u: &[f64], out: &mut [f64]) {
        let [nx, ny, nz] = self.lattice.size;
        let (h, plane) = (self.lattice.cell_mm, nx * ny);
        out.par_chunks_mut(plane).enumerate().for_each(|(z, out)| {
            for y in 0..ny {
                let inner_row = z > 0 && z + 1 < nz && y > 0 && y + 1 < ny;
                let row = z * plane + y * nx;
                for x in 0..nx {
                    let i = row + x;
                    out[y * nx + x] = h * if inner_row && x > 0 && x + 1 < nx {
                        let pair = |j: usize| u[j - 1] + u[j + 1];
                        let sides = pair(i - nx) + pair(i + nx) + pair(i - plane) + pair(i + plane);
                        let corners = [i - nx - plane, i + nx - plane, i + plane - nx, i + plane + nx];
                        let mut edges = 0.0;
                        let mut tips = 0.0;
                        for j in corners {
                            edges += u[j];
                            tips += pair(j);
                        }
                        (8.0 / 3.0) * u[i] - (sides + edges) / 6.0 - tips / 12.0
                    } else {
                        self.at_border([x, y, z], u)
                    };
                }
            }
        });
        for s in &self.held {
            let value = self.lattice.blend(u, s.node, &s.weights) * s.screening;
            for (k, w) in s.weights.iter().enumerate() {
                out[self.lattice.corner(s.node, k)] += w * value;
            }
        }
    }

    fn at_border(&self, [x, y, z]: [usize; 3], u: &[f64]) -> f64 {
        let [nx, ny, nz] = self.lattice.size;
        let mut sum = 0.0;
        for dz in -1..=1isize {
            for dy in -1..=1isize {
                for dx in -1..=1isize {
                    let axes = [one_axis(x, nx, dx), one_axis(y, ny, dy), one_axis(z, nz, dz)];
                    if axes.iter().all(Option::is_some) {
                        let at = |c: usize, d: isize| (c as isize + d) as usize;
                        sum += stencil(axes) * u[self.lattice.index([at(x, dx), at(y, dy), at(z, dz)])];
                    }
                }
            }
        }
        sum
    }
}

/// Entry of the stiffness matrix over h from the axes' masses and stiffnesses; 0 where an axis has no neighbour.
fn stencil(axes: [Option<(f64, f64)>; 3]) -> f64 {
    let [Some((mx, kx)), Some((my, ky)), Some((mz, kz))] = axes else { return 0.0 };
    (kx * my * mz + mx * ky * mz + mx * my * kz) / 36.0
}

/// The operator on a lattice and on its coarser ones.
pub(super) struct Multigrid {
    pub levels: Vec<Level>,
    coarsest: Cholesky,
    values: Vec<f64>,
}

impl Multigrid {
    /// The operator ∫ ∇a·∇b + Σ w a(s) b(s) of `samples` (position, w); `lattice` can be halved `halvings` times.
    pub fn new(
        lattice: &Lattice,
        halvings: usize,
        samples: &[(DVec3, f64)],
    ) -> Result<Multigrid, strandbench_solve::SparseError> {
        let levels: Vec<Level> = (0..=halvings).map(|l| Level::new(lattice.coarser(l), samples)).collect();
        let last = &levels[halvings];
        let n = last.lattice.count();
        let (mut starts, mut rows, mut values) = (vec![0], Vec::new(), Vec::new());
        let (mut unit, mut column) = (vec![0.0; n], vec![0.0; n]);
        for c in 0..n {
            unit[c] = 1.0;
            last.apply(&unit, &mut column);
            unit[c] = 0.0;
            for (r, v) in column.iter().enumerate().skip(c).filter(|(r, v)| *r == c || **v != 0.0) {
                rows.push(r);
                values.push(*v);
            }
            starts.push(rows.len());
        }
        Ok(Multigrid { coarsest: Cholesky::new(starts, rows)?, values, levels })
    }

    /// Solves for a right side by conjugate gradients with one V-cycle as the preconditioner, until the residual is
    /// `tolerance` of the right side. Returns the solution, the number of steps and the residual reached.
    pub fn solve(
        &mut self,
        rhs: &[f64],
        tolerance: f64,
        most_steps: usize,
        stop: &dyn Fn() -> Result<(), crate::BaselineError>,
    ) -> Result<(Vec<f64>, usize, f64), crate::BaselineError> {
        let n = rhs.len();
        let (mut x, mut r) = (vec![0.0; n], rhs.to_vec());
        let whole = dot(rhs, rhs).sqrt();
        if whole == 0.0 {
            return Ok((x, 0, 0.0));
        }
        let mut z = self.cycle(0, &r)?;
        let mut p = z.clone();
        let mut rz = dot(&r, &z);
        let mut ap = vec![0.0; n];
        let mut left = 1.0;
        for step in 0..most_steps {
            stop()?;
            self.levels[0].apply(&p, &mut ap);
            let alpha = rz / dot(&p, &ap);
            add(&mut x, alpha, &p);
            add(&mut r, -alpha, &ap);
            left = dot(&r, &r).sqrt() / whole;
            if left <= tolerance || step + 1 == most_steps {
                return Ok((x, step + 1, left));
            }
            z = self.cycle(0, &r)?;
            let next = dot(&r, &z);
            let beta = next / rz;
            rz = next;
            p.par_iter_mut().zip(&z).for_each(|(p, z)| *p = z + beta * *p);
        }
        Ok((x, most_steps, left))
    }

    /// A symmetric V-cycle from zero.
    fn cycle(&mut self, l: usize, rhs: &[f64]) -> Result<Vec<f64>, strandbench_solve::SparseError> {
        if l + 1 == self.levels.len() {
            let mut x = rhs.to_vec();
            self.coarsest.solve(&self.values, &mut x)?;
            return Ok(x);
        }
        let level = &self.levels[l];
        let mut x: Vec<f64> = rhs.par_iter().zip(&level.diagonal).map(|(b, d)| DAMPING * b / d).collect();
        let mut au = vec![0.0; x.len()];
        let sweep = |x: &mut [f64], au: &mut [f64]| {
            level.apply(x, au);
            x.par_iter_mut()
                .zip(&*au)
                .zip(rhs.par_iter().zip(&level.diagonal))
                .for_each(|((x, a), (b, d))| *x += DAMPING * (b - a) / d);
        };
        for _ in 1..SWEEPS {
            sweep(&mut x, &mut au);
        }
        level.apply(&x, &mut au);
        au.par_iter_mut().zip(rhs).for_each(|(a, b)| *a = b - *a);
        let coarse = level.lattice.restrict(&au);
        let correction = self.cycle(l + 1, &coarse)?;
        let level = &self.levels[l];
        level.lattice.prolong_add(&correction, &mut x);
        let sweep = |x: &mut [f64], au: &mut [f64]| {
            level.apply(x, au);
            x.par_iter_mut()
                .zip(&*au)
                .zip(rhs.par_iter().zip(&level.diagonal))
                .for_each(|((x, a), (b, d))| *x += DAMPING * (b - a) / d);
        };
        for _ in 0..SWEEPS {
            sweep(&mut x, &mut au);
        }
        Ok(x)
    }
}

fn add(x: &mut [f64], factor: f64, y: &[f64]) {
    x.par_iter_mut().zip(y).for_each(|(x, y)| *x += factor * y);
}

/// Sums over fixed pieces, so that the number of threads changes nothing.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    const PIECE: usize = 1 << 14;
    let parts: Vec<f64> = a
        .par_chunks(PIECE)
        .zip(b.par_chunks(PIECE))
        .map(|(a, b)| a.iter().zip(b).map(|(a, b)| a * b).sum())
        .collect();
    parts.into_iter().sum()
}

#[cfg(test)]
mod tests;

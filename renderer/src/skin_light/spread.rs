//! Gaussians on a mesh: heat flow by implicit steps.

use rayon::prelude::*;
use strandbench_types::TriMesh;

/// Implicit steps of one Gaussian: their sum of exponential kernels has its variance exactly and most of its shape.
const STEPS: u32 = 4;
/// Residual at which a step is solved, relative to its right side.
const RESIDUAL: f64 = 1e-7;
const MOST_ITERATIONS: u32 = 500;

/// A mesh's masses and conductances.
pub(super) struct Sheet {
    /// A third of the area around each vertex, mm²; 0 where there is none.
    pub mass: Vec<f64>,
    starts: Vec<u32>,
    /// Neighbour and conductance.
    edges: Vec<(u32, f64)>,
}

impl Sheet {
    /// Conductances are half the sums of the cotangents of opposite angles (Pinkall and Polthier 1993), those of obtuse
    /// pairs cut off at 0, so that light never becomes negative.
    pub fn new(mesh: &TriMesh) -> Sheet {
        let n = mesh.vertices.len();
        let mut mass = vec![0.0; n];
        let mut ends: Vec<(u32, u32, f64)> = Vec::with_capacity(mesh.triangles.len() * 6);
        for t in &mesh.triangles {
            let p = t.map(|k| mesh.vertices[k as usize].as_dvec3());
            let twice = (p[1] - p[0]).cross(p[2] - p[0]).length();
            if twice <= 1e-12 {
                continue;
            }
            for k in 0..3 {
                mass[t[k] as usize] += twice / 6.0;
                let (a, b) = ((k + 1) % 3, (k + 2) % 3);
                let half_cot = 0.5 * (p[a] - p[k]).dot(p[b] - p[k]) / twice;
                ends.push((t[a], t[b], half_cot));
                ends.push((t[b], t[a], half_cot));
            }
        }
        // Stable, so that sums are the same on every run.
        ends.sort_by_key(|e| (e.0, e.1));
        let mut starts = vec![0u32; n + 1];
        let mut edges: Vec<(u32, f64)> = Vec::with_capacity(ends.len() / 2);
        let mut i = 0;
        while i < ends.len() {
            let (a, b, _) = ends[i];
            let same = ends[i..].iter().take_while(|e| (e.0, e.1) == (a, b)).count();
            // Flat vertices next to slivers may have any conductance: none beyond that of a square's worth.
            let sum: f64 = ends[i..i + same].iter().map(|e| e.2).sum();
            edges.push((b, sum.clamp(0.0, 1e3)));
            starts[a as usize + 1] += 1;
            i += same;
        }
        for k in 1..=n {
            starts[k] += starts[k - 1];
        }
        Sheet { mass, starts, edges }
    }

    /// Spreads values per area, indexed [vertex], by a Gaussian of this variance along each direction of the surface,
    /// mm². The sum of value times mass stays.
    pub fn spread(&self, values: &mut [[f64; 3]], variance_mm2: f64) {
        let step = 0.5 * variance_mm2 / f64::from(STEPS);
        let channels: Vec<Vec<f64>> = (0..3usize)
            .into_par_iter()
            .map(|c| {
                let mut u: Vec<f64> = values.iter().map(|v| v[c]).collect();
                (0..STEPS).for_each(|_| self.step(&mut u, step));
                u
            })
            .collect();
        for (i, v) in values.iter_mut().enumerate() {
            *v = std::array::from_fn(|c| channels[c][i]);
        }
    }

    /// (M + dt L) x, where vertices without mass keep what they have.
    fn apply(&self, x: &[f64], dt: f64, out: &mut [f64]) {
        for (i, o) in out.iter_mut().enumerate() {
            let (mut sum, m) = (0.0, self.mass[i]);
            if m > 0.0 {
                for &(k, w) in &self.edges[self.starts[i] as usize..self.starts[i + 1] as usize] {
                    sum += w * (x[i] - x[k as usize]);
                }
            }
            *o = (if m > 0.0 { m } else { 1.0 }) * x[i] + dt * sum;
        }
    }

    /// One implicit step by conjugate gradients, preconditioned by the diagonal, from the values before.
    fn step(&self, u: &mut [f64], dt: f64) {
        let n = u.len();
        let weight = |i: usize| if self.mass[i] > 0.0 { self.mass[i] } else { 1.0 };
        let diagonal: Vec<f64> = (0..n)
            .map(|i| {
                let around = &self.edges[self.starts[i] as usize..self.starts[i + 1] as usize];
                weight(i) + dt * around.iter().map(|e| e.1).sum::<f64>()
            })
            .collect();
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
        let right: Vec<f64> = (0..n).map(|i| weight(i) * u[i]).collect();
        let mut product = vec![0.0; n];
        self.apply(u, dt, &mut product);
        let mut r: Vec<f64> = right.iter().zip(&product).map(|(b, a)| b - a).collect();
        let mut z: Vec<f64> = r.iter().zip(&diagonal).map(|(r, d)| r / d).collect();
        let mut p = z.clone();
        let mut rz = dot(&r, &z);
        let enough = RESIDUAL * RESIDUAL * dot(&right, &right);
        for _ in 0..MOST_ITERATIONS {
            if dot(&r, &r) <= enough {
                break;
            }
            self.apply(&p, dt, &mut product);
            let along = rz / dot(&p, &product);
            for i in 0..n {
                u[i] += along * p[i];
                r[i] -= along * product[i];
                z[i] = r[i] / diagonal[i];
            }
            let next = dot(&r, &z);
            let turn = next / rz;
            rz = next;
            for i in 0..n {
                p[i] = z[i] + turn * p[i];
            }
        }
    }
}

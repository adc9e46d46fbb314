//! Per-vertex detail of the template along its normals (5.3).

use crate::StrandParameters;
use crate::surface::FrameSurface;
use glam::DVec3;
use rayon::prelude::*;
use strandbench_solve::{Cholesky, SparseError};
use strandbench_types::Camera;

/// Step in which a vertex searches for the surface along its normal, mm.
const SEARCH_STEP_MM: f64 = 1.0;

/// Weight that holds the displacement of vertices that see no surface at zero, against a unit weight of the surface.
const HOLD: f64 = 1e-3;

/// Displacements along normals: those d that minimise
/// Σ_seen (d_i - t_i)² + λ Σ_edges (d_i - d_j)² + ε Σ d_i², a linear system with the mesh's pattern.
#[derive(Debug)]
pub(super) struct DetailSolver {
    solver: Cholesky,
    smoothness: f64,
    reach_mm: f64,
}

impl DetailSolver {
    pub fn new(
        points: usize,
        triangles: &[[u32; 3]],
        p: &StrandParameters,
    ) -> Result<DetailSolver, SparseError> {
        let mut below = vec![Vec::new(); points];
        for t in triangles {
            for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
                below[a.min(b) as usize].push(a.max(b) as usize);
            }
        }
        let (mut starts, mut rows) = (vec![0], Vec::new());
        for (i, list) in below.iter_mut().enumerate() {
            list.sort_unstable();
            list.dedup();
            rows.push(i);
            rows.extend(list.iter());
            starts.push(rows.len());
        }
        let solver = Cholesky::new(starts, rows)?;
        let (smoothness, reach_mm) = (f64::from(p.detail_smoothness), f64::from(p.detail_mm));
        Ok(DetailSolver { solver, smoothness, reach_mm })
    }

    pub fn solve(
        &mut self,
        camera: &Camera,
        surface: &FrameSurface,
        points: &[DVec3],
        normals: &[DVec3],
    ) -> Result<Vec<f64>, SparseError> {
        let wanted: Vec<Option<f64>> = points
            .par_iter()
            .zip(normals)
            .map(|(&at, &n)| hit_along_normal(camera, surface, at, n, self.reach_mm))
            .collect();
        let (starts, rows) = (self.solver.column_starts(), self.solver.rows());
        let mut values = vec![0.0; rows.len()];
        let mut displacement = vec![0.0; points.len()];
        for (i, t) in wanted.iter().enumerate() {
            values[starts[i]] += HOLD + if t.is_some() { 1.0 } else { 0.0 };
            displacement[i] = t.unwrap_or(0.0);
            for k in starts[i] + 1..starts[i + 1] {
                values[k] -= self.smoothness;
                values[starts[i]] += self.smoothness;
                values[starts[rows[k]]] += self.smoothness;
            }
        }
        self.solver.solve(&values, &mut displacement)?;
        Ok(displacement)
    }
}

/// Signed distance along `n` at which the line through `at` meets the envelope, the nearer of both sides, up to `reach`.
fn hit_along_normal(camera: &Camera, surface: &FrameSurface, at: DVec3, n: DVec3, reach: f64) -> Option<f64> {
    // Depth of the line's point below the envelope seen at its pixel; changes sign where they meet.
    let below = |s: f64| {
        let (q, z) = camera.project(at + n * s)?;
        Some(z - surface.depth_at(q, f32::INFINITY)?)
    };
    let here = below(0.0)?;
    let mut sides = [(here, 0.0); 2];
    let steps = (reach / SEARCH_STEP_MM).ceil() as usize;
    for k in 1..=steps {
        for (side, (last, from)) in sides.iter_mut().enumerate() {
            let sign = if side == 0 { 1.0 } else { -1.0 };
            let s = sign * (k as f64 * SEARCH_STEP_MM).min(reach);
            let Some(now) = below(s) else { continue };
            // A jump of the depth map is no surface.
            let steep = (now - *last).abs() > 4.0 * SEARCH_STEP_MM;
            if (now <= 0.0) != (*last <= 0.0) && !steep {
                return Some(*from + (s - *from) * *last / (*last - now));
            }
            (*last, *from) = (now, s);
        }
    }
    None
}

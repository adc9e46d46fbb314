//! Free space: what the cameras see to be empty, in front of the first hair or skin on their rays.

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use strandbench_types::{Camera, TriMesh, Truth};

/// What is nearer to a camera's plane than this is not drawn, mm.
const NEAR_MM: f64 = 1.0;

/// Depth up to which each camera's rays are free, indexed [camera][pixel], mm; infinite where they meet nothing.
pub(crate) struct FreeSpace<'a> {
    cameras: &'a [Camera],
    until_mm: Vec<Vec<f64>>,
}

impl<'a> FreeSpace<'a> {
    pub fn new(truth: &'a Truth) -> FreeSpace<'a> {
        let of_camera = |(camera, view): (&Camera, &strandbench_types::ViewTruth)| {
            let mut until = match &truth.head {
                Some(head) => depth_of(camera, head),
                None => vec![f64::INFINITY; view.mask.data.len()],
            };
            for (i, z) in until.iter_mut().enumerate() {
                if let Some(first) = view.depth_first.get_index(i) {
                    *z = z.min(f64::from(first));
                }
            }
            until
        };
        let cameras = &truth.rig.cameras;
        let until_mm = cameras.par_iter().zip(&truth.views).map(of_camera).collect();
        FreeSpace { cameras, until_mm }
    }

    /// Whether some camera sees that there is nothing at `p`.
    pub fn holds(&self, p: DVec3) -> bool {
        self.cameras.iter().zip(&self.until_mm).any(|(c, until)| {
            c.project(p).is_some_and(|(uv, z)| {
                c.contains(uv) && z < until[uv.y as usize * c.width as usize + uv.x as usize]
            })
        })
    }
}

/// Depth of the mesh at each pixel's centre, mm; infinite where it does not cover it. Triangles that reach
/// behind the camera are left out.
fn depth_of(camera: &Camera, mesh: &TriMesh) -> Vec<f64> {
    let (w, h) = (camera.width as usize, camera.height as usize);
    let mut depth = vec![f64::INFINITY; w * h];
    let corners: Vec<Option<(DVec2, f64)>> = mesh
        .vertices
        .iter()
        .map(|v| camera.project(v.as_dvec3()).filter(|(uv, z)| *z > NEAR_MM && uv.is_finite()))
        .collect();
    for t in &mesh.triangles {
        let [Some(a), Some(b), Some(c)] = t.map(|i| corners[i as usize]) else { continue };
        let area = (b.0 - a.0).perp_dot(c.0 - a.0);
        if area == 0.0 || !area.is_finite() {
            continue;
        }
        let (lo, hi) = (a.0.min(b.0).min(c.0), a.0.max(b.0).max(c.0));
        let pixels = |lo: f64, hi: f64, n: usize| {
            let first = (lo - 0.5).ceil().clamp(0.0, n as f64) as usize;
            let last = (hi - 0.5).floor().clamp(-1.0, n as f64 - 1.0);
            first..(last + 1.0) as usize
        };
        for y in pixels(lo.y, hi.y, h) {
            for x in pixels(lo.x, hi.x, w) {
                let p = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
                let u = (c.0 - b.0).perp_dot(p - b.0) / area;
                let v = (a.0 - c.0).perp_dot(p - c.0) / area;
                let weights = [u, v, 1.0 - u - v];
                if weights.iter().all(|&k| k >= 0.0) {
                    // 1/z is linear in the image.
                    let z = 1.0 / (weights[0] / a.1 + weights[1] / b.1 + weights[2] / c.1);
                    let at = &mut depth[y * w + x];
                    *at = at.min(z);
                }
            }
        }
    }
    depth
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn a_slanted_square_is_drawn_at_its_depth() {
        let camera = Camera::look_at("c", (20, 10), 15.0, DVec3::ZERO, DVec3::Z, DVec3::Y);
        // The plane z = 100 + x, over x and y in -40..40.
        let at = |x: f32, y: f32| Vec3::new(x, y, 100.0 + x);
        let mesh = TriMesh {
            vertices: vec![at(-40.0, -40.0), at(40.0, -40.0), at(-40.0, 40.0), at(40.0, 40.0)],
            triangles: vec![[0, 1, 2], [1, 2, 3]],
        };
        let depth = depth_of(&camera, &mesh);
        let mut drawn = 0;
        for (i, &z) in depth.iter().enumerate() {
            let p = DVec2::new((i % 20) as f64 + 0.5, (i / 20) as f64 + 0.5);
            let d = camera.ray_direction(p);
            let want = 100.0 / (1.0 - d.x);
            let hit = d * want;
            let inside = hit.x.abs() < 40.0 && hit.y.abs() < 40.0;
            assert!(
                if inside { (z - want).abs() < 1e-9 } else { z.is_infinite() },
                "pixel {i}: {z} for {want}"
            );
            drawn += usize::from(inside);
        }
        assert!((20..200).contains(&drawn), "{drawn} pixels");
    }
}

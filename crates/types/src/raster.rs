//! Meshes as depth maps.

use crate::{Camera, DepthMap, Plane, TriMesh};
use glam::{DVec2, DVec3};
use rayon::prelude::*;

/// Rows that one task fills.
const BAND: usize = 16;
/// Most tests of a pixel against a triangle: some ten seconds of two processors.
const MAX_TESTS: u64 = 4_000_000_000;

impl DepthMap {
    /// Depth of the first triangle, seen from either side, on the ray through each pixel's centre.
    ///
    /// # Errors
    /// If the triangles cover so many pixels one behind the other that it would take minutes.
    pub fn of_mesh(camera: &Camera, mesh: &TriMesh) -> Result<DepthMap, String> {
        let (w, h) = (camera.width as usize, camera.height as usize);
        let corners: Vec<DVec3> = mesh.vertices.iter().map(|v| camera.to_camera(v.as_dvec3())).collect();
        let triangles: Vec<([DVec3; 3], [usize; 4])> = mesh
            .triangles
            .iter()
            .map(|t| t.map(|i| corners[i as usize]))
            .filter_map(|t| Some((t, bounds(camera, &t)?)))
            .collect();
        let tests: u64 = triangles.iter().map(|(_, [x0, x1, y0, y1])| ((x1 - x0) * (y1 - y0)) as u64).sum();
        if tests > MAX_TESTS {
            return Err(format!(
                "the mesh's triangles cover the image {} times over; simplify the mesh",
                tests / (w * h) as u64
            ));
        }
        let mut raw = Plane::filled(w, h, f32::NAN);
        raw.data.par_chunks_mut(BAND * w).enumerate().for_each(|(band, rows)| {
            let (top, bottom) = (band * BAND, band * BAND + rows.len() / w);
            for (t, [x0, x1, y0, y1]) in &triangles {
                for y in (*y0).max(top)..(*y1).min(bottom) {
                    for x in *x0..*x1 {
                        let ray = (DVec2::new(x as f64 + 0.5, y as f64 + 0.5) - camera.principal_px)
                            / camera.focal_px;
                        if let Some(z) = hit(t, ray.extend(1.0)) {
                            let old = &mut rows[(y - top) * w + x];
                            *old = old.min(z as f32);
                        }
                    }
                }
            }
        });
        Ok(DepthMap::from_raw(raw))
    }
}

/// Columns and rows that may see a triangle; the whole image for one that reaches the camera's plane.
fn bounds(camera: &Camera, t: &[DVec3; 3]) -> Option<[usize; 4]> {
    let (w, h) = (f64::from(camera.width), f64::from(camera.height));
    if t.iter().all(|c| c.z <= 0.0) {
        return None;
    }
    if t.iter().any(|c| c.z < 1.0) {
        return Some([0, camera.width as usize, 0, camera.height as usize]);
    }
    let px = t.map(|c| camera.focal_px * c.truncate() / c.z + camera.principal_px);
    let (lo, hi) = (px[0].min(px[1]).min(px[2]), px[0].max(px[1]).max(px[2]));
    let span = |lo: f64, hi: f64, n: f64| {
        ((lo - 1.0).floor().clamp(0.0, n) as usize, (hi + 1.0).ceil().clamp(0.0, n) as usize)
    };
    let ((x0, x1), (y0, y1)) = (span(lo.x, hi.x, w), span(lo.y, hi.y, h));
    (x0 < x1 && y0 < y1).then_some([x0, x1, y0, y1])
}

/// Depth at which the ray from the origin, whose z is 1, meets a triangle in front; edges belong to it (Möller and
/// Trumbore 1997, in the form of signed volumes, which the triangles on both sides of an edge compute alike).
fn hit(t: &[DVec3; 3], ray: DVec3) -> Option<f64> {
    let [a, b, c] = *t;
    let sides = [ray.dot(b.cross(c)), ray.dot(c.cross(a)), ray.dot(a.cross(b))];
    if !(sides.iter().all(|s| *s >= 0.0) || sides.iter().all(|s| *s <= 0.0)) {
        return None;
    }
    let sum = sides[0] + sides[1] + sides[2];
    let z = (sides[0] * a.z + sides[1] * b.z + sides[2] * c.z) / sum;
    (z.is_finite() && z > 0.0).then_some(z)
}

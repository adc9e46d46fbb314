//! Points as depth in the reference camera.

use glam::{DVec2, Vec3};
use strandbench_types::{Camera, DepthMap, Plane};

/// Depth of the nearest point among those whose image lies within `radius_px` of each pixel's centre.
pub(super) fn depth_of_points(camera: &Camera, points: &[Vec3], radius_px: f64) -> DepthMap {
    let (w, h) = (camera.width as usize, camera.height as usize);
    let mut raw = Plane::filled(w, h, f32::NAN);
    for p in points {
        let Some((at, z)) = camera.project(p.as_dvec3()) else { continue };
        let span = |c: f64, n: usize| {
            let from = (c - 0.5 - radius_px).ceil().clamp(0.0, n as f64) as usize;
            from..((c - 0.5 + radius_px).floor() + 1.0).clamp(from as f64, n as f64) as usize
        };
        for y in span(at.y, h) {
            for x in span(at.x, w) {
                let off = DVec2::new(x as f64 + 0.5, y as f64 + 0.5) - at;
                if off.length_squared() <= radius_px * radius_px {
                    let old = raw.at_mut(x, y);
                    *old = old.min(z as f32);
                }
            }
        }
    }
    DepthMap::from_raw(raw)
}

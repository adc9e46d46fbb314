//! Which pixels of a view can see anything at all; the others are background without tracing a ray.

use glam::{DVec2, Vec3};
use strandbench_scenes::Scene;
use strandbench_types::Camera;

/// A mask that covers every pixel that a segment or triangle may touch, and some more.
pub(crate) struct Footprint {
    width: usize,
    covered: Vec<bool>,
}

impl Footprint {
    /// All pixels, for cameras whose rays do not all leave one point.
    pub fn everything(width: usize, height: usize) -> Footprint {
        Footprint { width, covered: vec![true; width * height] }
    }

    pub fn of(scene: &Scene, camera: &Camera) -> Footprint {
        let (width, height) = (camera.width as usize, camera.height as usize);
        let mut f = Footprint { width, covered: vec![false; width * height] };
        let strands = &scene.strands;
        let place = |p: Vec3, radius: f32| -> Option<(DVec2, f64)> {
            let c = camera.to_camera(p.as_dvec3());
            let radius = f64::from(radius);
            // Close to the camera's plane a projection bounds nothing.
            if c.z < 4.0 * radius + 1.0 {
                return None;
            }
            let xy = DVec2::new(c.x, c.y) / c.z;
            // A sphere's outline reaches farther the more oblique it is seen.
            let pad = radius / c.z * camera.focal_px.max_element() * (1.0 + xy.length_squared()) * 1.5 + 0.1;
            Some((camera.focal_px * xy + camera.principal_px, pad))
        };
        for i in 0..strands.len() {
            let range = strands.range(i);
            let mut last = place(strands.points[range.start], strands.radii_mm[range.start]);
            for k in range.start + 1..range.end {
                let next = place(strands.points[k], strands.radii_mm[k]);
                if !f.mark(&[last, next], height) {
                    return f;
                }
                last = next;
            }
        }
        for s in &scene.surfaces {
            for t in &s.mesh.triangles {
                if !f.mark(&t.map(|v| place(s.mesh.vertices[v as usize], 0.0)), height) {
                    return f;
                }
            }
        }
        f
    }

    /// Covers the box around the corners; all pixels, and false, if one is too close to the camera to say.
    fn mark(&mut self, corners: &[Option<(DVec2, f64)>], height: usize) -> bool {
        let (mut lo, mut hi) = (DVec2::MAX, DVec2::MIN);
        for c in corners {
            match c {
                Some((p, pad)) => {
                    lo = lo.min(*p - *pad);
                    hi = hi.max(*p + *pad);
                }
                None => {
                    self.covered.fill(true);
                    return false;
                }
            }
        }
        let (w, h) = (self.width as f64, height as f64);
        if hi.x < 0.0 || hi.y < 0.0 || lo.x >= w || lo.y >= h {
            return true;
        }
        let range = |a: f64, b: f64, n: f64| (a.max(0.0) as usize, b.min(n - 1.0) as usize);
        let ((x0, x1), (y0, y1)) = (range(lo.x, hi.x, w), range(lo.y, hi.y, h));
        for y in y0..=y1 {
            self.covered[y * self.width + x0..=y * self.width + x1].fill(true);
        }
        true
    }

    #[inline]
    pub fn covers(&self, x: usize, y: usize) -> bool {
        self.covered[y * self.width + x]
    }
}

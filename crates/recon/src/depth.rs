//! Depth labels and where they fall in the other views.

use glam::DVec3;
use strandbench_types::{Camera, Rig};

/// Labels 0..n, uniform in inverse depth from near (0) to far (n - 1): equal steps of disparity for parallel
/// cameras.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthLabels {
    near_mm: f64,
    far_mm: f64,
    footprint_mm: f64,
    count: usize,
}

impl DepthLabels {
    /// `count` labels, at least two, over the rig's working volume.
    pub fn new(rig: &Rig, count: usize) -> DepthLabels {
        assert!(count >= 2, "{count} labels span no range");
        let focal = rig.cameras[0].focal_px;
        let footprint_mm = ((rig.near_mm * rig.far_mm) / (focal.x * focal.y)).sqrt();
        DepthLabels { near_mm: rig.near_mm, far_mm: rig.far_mm, footprint_mm, count }
    }

    /// Number of labels.
    pub fn count(&self) -> usize {
        self.count
    }

    /// 1/depth of a label, also between labels, 1/mm.
    pub fn inverse_mm(&self, label: f64) -> f64 {
        let t = label / (self.count - 1) as f64;
        (1.0 - t) / self.near_mm + t / self.far_mm
    }

    /// Depth of a label, also between labels, mm along +z of the reference.
    pub fn depth_mm(&self, label: f64) -> f64 {
        1.0 / self.inverse_mm(label)
    }

    /// Depth between neighbouring labels at √(near · far), mm.
    pub fn step_mm(&self) -> f64 {
        (self.far_mm - self.near_mm) / (self.count - 1) as f64
    }

    /// The same step in widths of a reference pixel at that depth, z / f: the unit in which Eq. 3 takes
    /// |D - D'|. Between neighbouring pixels a difference of 1 is a slope of 45 degrees.
    pub fn step_footprints(&self) -> f64 {
        self.step_mm() / self.footprint_mm
    }
}

/// P_i(p, D) of Eq. 5: projections of the points of one reference ray into one other view.
///
/// A point at depth z of the ray is A + zB in the other camera; times w = 1/z that is Aw + B, which projects
/// to the same pixel.
#[derive(Clone, Copy, Debug)]
pub struct Epipolar {
    a: DVec3,
    rotation: glam::DMat3,
    reference_focal: glam::DVec2,
    reference_principal: glam::DVec2,
    focal: glam::DVec2,
    principal: glam::DVec2,
}

impl Epipolar {
    /// The pair of a reference camera and another.
    pub fn new(reference: &Camera, other: &Camera) -> Epipolar {
        Epipolar {
            a: other.to_camera(reference.centre_mm()),
            rotation: other.camera_from_world * reference.camera_from_world.transpose(),
            reference_focal: reference.focal_px,
            reference_principal: reference.principal_px,
            focal: other.focal_px,
            principal: other.principal_px,
        }
    }

    /// Pixel positions in the other view, divided by `scale`, of the points at inverse depths `inverse_mm`
    /// (1/mm) on the ray through pixel (x, y); NaN behind the other camera.
    pub fn project(
        &self,
        (x, y): (f64, f64),
        scale: f64,
        inverse_mm: &[f32],
        us: &mut [f32],
        vs: &mut [f32],
    ) {
        let xy = (glam::DVec2::new(x, y) - self.reference_principal) / self.reference_focal;
        let b = self.rotation * DVec3::new(xy.x, xy.y, 1.0);
        // Columns of K applied beforehand: u = (a_u w + b_u) / (a_z w + b_z).
        let column = |v: DVec3| {
            let u = (self.focal.x * v.x + self.principal.x * v.z) / scale;
            let w = (self.focal.y * v.y + self.principal.y * v.z) / scale;
            (u as f32, w as f32, v.z as f32)
        };
        walk(column(self.a), column(b), inverse_mm, us, vs);
    }
}

crate::simd::simd_fn! {
    fn walk(a: (f32, f32, f32), b: (f32, f32, f32), inverse_mm: &[f32], us: &mut [f32], vs: &mut [f32]) {
        for ((w, u), v) in inverse_mm.iter().zip(us).zip(vs) {
            let z = a.2 * w + b.2;
            let r = if z > 1e-6 { 1.0 / z } else { f32::NAN };
            *u = (a.0 * w + b.0) * r;
            *v = (a.1 * w + b.1) * r;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec2;

    fn rig() -> Rig {
        let at = |name: &str, x: f64, y: f64| {
            Camera::look_at(name, (640, 480), 1400.0, DVec3::new(x, y, 900.0), DVec3::ZERO, DVec3::NEG_Y)
        };
        Rig {
            cameras: vec![at("c", 0.0, 0.0), at("l", -120.0, 10.0), at("t", 5.0, 150.0)],
            near_mm: 700.0,
            far_mm: 1000.0,
            frame_rate_hz: 100.0,
            exposure_s: 0.001,
        }
    }

    #[test]
    fn labels_span_the_volume_evenly_in_inverse_depth() {
        let d = DepthLabels::new(&rig(), 151);
        assert!((d.depth_mm(0.0) - 700.0).abs() < 1e-9 && (d.depth_mm(150.0) - 1000.0).abs() < 1e-9);
        let (a, b, c) = (d.inverse_mm(10.0), d.inverse_mm(11.0), d.inverse_mm(12.0));
        assert!((a - 2.0 * b + c).abs() < 1e-15);
        assert!((d.step_mm() - 2.0).abs() < 1e-12);
        assert!((d.step_footprints() - 2.0 / (700_000f64.sqrt() / 1400.0)).abs() < 1e-12);
        // The step at the geometric mean depth, by differentiation: dz = z² dw.
        assert!(((a - b) * 700.0 * 1000.0 - 2.0).abs() < 1e-9);
    }

    #[test]
    fn walking_a_ray_is_unprojecting_and_projecting() {
        let rig = rig();
        let d = DepthLabels::new(&rig, 9);
        let w: Vec<f32> = (0..9).map(|k| d.inverse_mm(f64::from(k)) as f32).collect();
        for other in &rig.cameras[1..] {
            let e = Epipolar::new(&rig.cameras[0], other);
            let (mut us, mut vs) = (vec![0.0; 9], vec![0.0; 9]);
            e.project((100.5, 333.25), 4.0, &w, &mut us, &mut vs);
            for k in 0..9 {
                let p = rig.cameras[0].unproject(DVec2::new(100.5, 333.25), d.depth_mm(k as f64));
                let (q, _) = other.project(p).unwrap();
                assert!((f64::from(us[k]) * 4.0 - q.x).abs() < 1e-3, "{} for {}", us[k] * 4.0, q.x);
                assert!((f64::from(vs[k]) * 4.0 - q.y).abs() < 1e-3);
            }
        }
        let away = DVec3::new(0.0, 0.0, 2000.0);
        let turned =
            Camera::look_at("b", (640, 480), 1400.0, DVec3::new(9.0, 0.0, 900.0), away, DVec3::NEG_Y);
        let (mut us, mut vs) = (vec![0.0; 9], vec![0.0; 9]);
        Epipolar::new(&rig.cameras[0], &turned).project((320.0, 240.0), 1.0, &w, &mut us, &mut vs);
        let behind = turned.project(rig.cameras[0].unproject(DVec2::new(320.0, 240.0), 800.0)).is_none();
        assert!(behind && us.iter().all(|u| u.is_nan()), "behind the camera is nowhere");
    }
}

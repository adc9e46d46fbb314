//! Camera rays: pinhole or thin lens, still or moving.

use glam::{DVec2, DVec3, Vec3};
use strandbench_scenes::{Lens, RigMotion, rotation};
use strandbench_types::Camera;

/// A camera's rays, in f64 until they reach the scene.
pub(crate) struct RayMaker {
    eye: DVec3,
    base: DVec3,
    per_x: DVec3,
    per_y: DVec3,
    /// The camera's axes in the world.
    x: DVec3,
    y: DVec3,
    z: DVec3,
    lens: Option<Lens>,
    /// Shift (mm) and turn (radians about its direction) over the whole exposure.
    shift: DVec3,
    turn: DVec3,
    centre: DVec3,
    radius: f64,
}

/// A ray that starts where it may first meet the scene.
pub(crate) struct CameraRay {
    pub origin: Vec3,
    pub direction: Vec3,
    /// Distance from where the ray leaves the camera to `origin`, mm.
    pub start: f64,
    /// Depth where the ray leaves the camera, mm along +z of the camera's stated pose.
    pub depth_at_start: f64,
    /// Depth per distance along the ray.
    pub depth_per_t: f64,
}

impl RayMaker {
    /// `around` is a sphere that holds the scene.
    pub fn new(
        camera: &Camera,
        lens: Option<Lens>,
        motion: &RigMotion,
        exposure_s: f64,
        (centre, radius): (Vec3, f32),
    ) -> RayMaker {
        let base = camera.ray_direction(DVec2::ZERO);
        let axes = camera.camera_from_world.transpose();
        RayMaker {
            eye: camera.centre_mm(),
            base,
            per_x: camera.ray_direction(DVec2::X) - base,
            per_y: camera.ray_direction(DVec2::Y) - base,
            x: axes.x_axis,
            y: axes.y_axis,
            z: axes.z_axis,
            lens: lens.filter(|l| l.aperture_radius_mm > 0.0),
            shift: DVec3::from_array(motion.velocity_mm_s) * exposure_s,
            turn: DVec3::from_array(motion.turn_deg_s.map(f64::to_radians)) * exposure_s,
            centre: centre.as_dvec3(),
            radius: f64::from(radius),
        }
    }

    /// Whether every ray leaves one point, at one time.
    pub fn is_pinhole(&self) -> bool {
        self.lens.is_none() && self.is_still()
    }

    fn is_still(&self) -> bool {
        self.shift == DVec3::ZERO && self.turn == DVec3::ZERO
    }

    /// The ray through a pinhole.
    #[inline]
    pub fn ray(&self, x: f64, y: f64) -> CameraRay {
        self.cast(self.eye, self.base + self.per_x * x + self.per_y * y, 0.0)
    }

    /// The ray through the middle of a pixel, and the greatest tangent of an angle between it and another through the
    /// pixel's square.
    pub fn beam(&self, (x, y): (usize, usize)) -> (CameraRay, f32) {
        let (x, y) = (x as f64, y as f64);
        let through = |x: f64, y: f64| self.base + self.per_x * x + self.per_y * y;
        let middle = through(x + 0.5, y + 0.5);
        let tangent = |corner: DVec3| corner.cross(middle).length() / corner.dot(middle);
        let corners = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)];
        let spread = corners.map(|(i, j)| tangent(through(x + i, y + j))).into_iter().fold(0.0, f64::max);
        (self.ray(x + 0.5, y + 0.5), spread as f32)
    }

    /// The ray through a point of the lens (`u[0]`, `u[1]`) at a time of the exposure (`u[2]`), uniform in [0, 1).
    pub fn lens_ray(&self, x: f64, y: f64, u: [f32; 3]) -> CameraRay {
        let through = self.base + self.per_x * x + self.per_y * y;
        let (mut from, mut toward) = (DVec3::ZERO, through);
        if let Some(lens) = self.lens {
            let at = disk(u) * lens.aperture_radius_mm;
            from = self.x * at.x + self.y * at.y;
            toward = through * lens.focus_mm - from;
        }
        let mut eye = self.eye;
        if !self.is_still() {
            let time = f64::from(u[2]) - 0.5;
            let turned = rotation(self.turn * time);
            (from, toward) = (turned * from, turned * toward);
            eye += self.shift * time;
        }
        let from = eye + from;
        self.cast(from, toward, (from - self.eye).dot(self.z))
    }

    #[inline]
    fn cast(&self, from: DVec3, toward: DVec3, depth_at_start: f64) -> CameraRay {
        let inv = 1.0 / toward.length();
        let d = toward * inv;
        // A pinhole's unnormalised direction has depth 1.
        let depth_per_t = if self.is_pinhole() { inv } else { d.dot(self.z) };
        let start = ((self.centre - from).dot(d) - self.radius).max(0.0);
        CameraRay {
            origin: (from + d * start).as_vec3(),
            direction: d.as_vec3().normalize(),
            start,
            depth_at_start,
            depth_per_t,
        }
    }
}

/// A point of the unit disk, of equal area for equal parts of the square (Shirley and Chiu 1997).
fn disk(u: [f32; 3]) -> DVec2 {
    let (a, b) = (2.0 * f64::from(u[0]) - 1.0, 2.0 * f64::from(u[1]) - 1.0);
    if a == 0.0 && b == 0.0 {
        return DVec2::ZERO;
    }
    let quarter = std::f64::consts::FRAC_PI_4;
    let (r, angle) = if a.abs() > b.abs() { (a, quarter * b / a) } else { (b, quarter * (2.0 - a / b)) };
    DVec2::new(libm::cos(angle), libm::sin(angle)) * r
}

#[cfg(test)]
mod tests {
    use super::*;

    fn maker(lens: Option<Lens>, motion: RigMotion) -> (Camera, RayMaker) {
        let camera = Camera::look_at(
            "c",
            (64, 48),
            500.0,
            DVec3::new(30.0, -20.0, 900.0),
            DVec3::new(5.0, 2.0, 1.0),
            DVec3::NEG_Y,
        );
        let maker = RayMaker::new(&camera, lens, &motion, 0.01, (Vec3::ZERO, 200.0));
        (camera, maker)
    }

    /// Where a ray reaches a depth of the stated pose.
    fn at_depth(ray: &CameraRay, depth: f64) -> DVec3 {
        let t = (depth - ray.depth_at_start) / ray.depth_per_t - ray.start;
        ray.origin.as_dvec3() + ray.direction.as_dvec3() * t
    }

    #[test]
    fn points_of_the_disk_are_even() {
        let (n, mut inner, mut moment) = (400, 0, DVec2::ZERO);
        for i in 0..n * n {
            let at = |k: usize| (k as f32 + 0.5) / n as f32;
            let p = disk([at(i % n), at(i / n), 0.0]);
            assert!(p.length() < 1.0);
            inner += usize::from(p.length_squared() < 0.5);
            moment += p * p;
        }
        let n2 = (n * n) as f64;
        assert!((inner as f64 / n2 - 0.5).abs() < 3e-3);
        assert!((moment / n2 - 0.25).abs().max_element() < 1e-3, "{moment}");
    }

    #[test]
    fn the_circle_of_confusion_is_that_of_a_thin_lens() {
        let lens = Lens { aperture_radius_mm: 4.0, focus_mm: 800.0 };
        let (camera, maker) = maker(Some(lens), RigMotion::default());
        for (depth, px) in [
            (800.0f64, DVec2::new(10.3, 40.2)),
            (1000.0, DVec2::new(32.0, 24.0)),
            (650.0, DVec2::new(60.5, 3.5)),
        ] {
            let mut radius = 0.0f64;
            for i in 0..2000u32 {
                let u = [(i as f32 * 0.618_034).fract(), (i as f32 * 0.754_878).fract(), 0.0];
                let hit = at_depth(&maker.lens_ray(px.x, px.y, u), depth);
                let (seen, z) = camera.project(hit).unwrap();
                assert!((z - depth).abs() < 1e-3);
                radius = radius.max((seen - px).length());
            }
            // Focal length (px) times aperture times the difference of the inverse depths.
            let want = 500.0 * 4.0 * (1.0 / depth - 1.0 / lens.focus_mm).abs();
            // The largest of 2000 points of a disk is within 1 % of its edge; rays are f32 over 700 mm.
            assert!(radius <= want + 2e-4 && radius >= 0.985 * want, "depth {depth}: {radius} px, {want} px");
        }
    }

    #[test]
    fn a_moving_camera_is_at_its_stated_pose_in_the_middle_of_the_exposure() {
        let motion = RigMotion { velocity_mm_s: [300.0, -50.0, 20.0], turn_deg_s: [10.0, -40.0, 5.0] };
        let (camera, moving) = maker(None, motion);
        let still = maker(None, RigMotion::default()).1;
        let middle = moving.lens_ray(12.0, 30.0, [0.1, 0.9, 0.5]);
        let pinhole = still.ray(12.0, 30.0);
        assert!(at_depth(&middle, 900.0).distance(at_depth(&pinhole, 900.0)) < 1e-3);
        // At the ends of the exposure of 10 ms a far point is where the moved camera projects it.
        for (u, time) in [(0.0f32, -0.005f64), (0.75, 0.0025)] {
            let p = at_depth(&moving.lens_ray(12.0, 30.0, [0.5, 0.5, u]), 870.0);
            let turn = rotation(DVec3::from_array(motion.turn_deg_s.map(f64::to_radians)) * time);
            let eye = camera.centre_mm() + DVec3::from_array(motion.velocity_mm_s) * time;
            let camera_from_world = camera.camera_from_world * turn.transpose();
            let moved =
                Camera { camera_from_world, translation_mm: -(camera_from_world * eye), ..camera.clone() };
            let (seen, _) = moved.project(p).unwrap();
            assert!((seen - DVec2::new(12.0, 30.0)).length() < 1e-3, "{seen}");
        }
    }
}

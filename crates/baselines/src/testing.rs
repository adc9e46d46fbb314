//! Shapes with a drawn texture, seen by four cameras: exact images for the tests.

use glam::{DVec2, DVec3};
use strandbench_types::{Camera, Frame, Plane, Rig};

pub(crate) const DISTANCE_MM: f64 = 900.0;
pub(crate) const BASELINE_MM: f64 = 150.0;

/// What is looked at.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Shape {
    /// A ball around the origin, radius in mm.
    Ball(f64),
    /// A square through the origin with a normal and half an edge, mm.
    Square(DVec3, f64),
}

impl Shape {
    /// Parameter of the first hit of a ray, mm along a direction whose camera depth is 1.
    pub fn hit(self, from: DVec3, direction: DVec3) -> Option<f64> {
        match self {
            Shape::Ball(r) => {
                let (a, b, c) =
                    (direction.length_squared(), from.dot(direction), from.length_squared() - r * r);
                let d = b * b - a * c;
                (d >= 0.0).then(|| (-b - d.sqrt()) / a)
            }
            Shape::Square(n, half) => {
                let t = -from.dot(n) / direction.dot(n);
                let p = from + direction * t;
                (p.abs().max_element() <= half && t > 0.0).then_some(t)
            }
        }
    }

    pub fn normal(self, at: DVec3) -> DVec3 {
        match self {
            Shape::Ball(_) => at.normalize(),
            Shape::Square(n, _) => n,
        }
    }
}

/// Reference in the middle, one to the left, the right and above, all aimed at the origin.
pub(crate) fn rig((width, height): (u32, u32), focal_px: f64) -> Rig {
    let camera = |name: &str, x: f64, y: f64| {
        let eye = DVec3::new(x, y, DISTANCE_MM);
        Camera::look_at(name, (width, height), focal_px, eye, DVec3::ZERO, DVec3::NEG_Y)
    };
    Rig {
        cameras: vec![
            camera("center", 0.0, 0.0),
            camera("left", -BASELINE_MM, 0.0),
            camera("right", BASELINE_MM, 0.0),
            camera("top", 0.0, BASELINE_MM),
        ],
        near_mm: 500.0,
        far_mm: 1300.0,
        frame_rate_hz: 1.0,
        exposure_s: 0.01,
    }
}

/// Brightness of a point: waves of 6 to 23 mm in all directions, between 0.1 and 0.9.
fn texture(p: DVec3) -> f64 {
    let waves = [
        (DVec3::new(0.9, 0.3, 0.4), 0.3),
        (DVec3::new(-0.4, 0.8, 0.2), 1.7),
        (DVec3::new(0.2, -0.5, 0.9), 2.9),
        (DVec3::new(0.55, 0.6, -0.3), 4.0),
        (DVec3::new(-0.3, 0.15, 0.2), 5.2),
    ];
    0.5 + 0.08 * waves.iter().map(|(k, phase)| (k.dot(p) + phase).sin()).sum::<f64>()
}

/// The shape's images, the mean of sixteen rays a pixel, and masks by the rays through the centres.
pub(crate) fn frame(rig: &Rig, shape: Shape) -> Frame {
    let (mut images, mut masks) = (Vec::new(), Vec::new());
    for c in &rig.cameras {
        let (w, h) = (c.width as usize, c.height as usize);
        let colour = |p: DVec2| {
            let d = c.ray_direction(p);
            shape.hit(c.centre_mm(), d).map_or(0.0, |t| texture(c.centre_mm() + d * t))
        };
        let image = (0..w * h).map(|i| {
            let corner = DVec2::new((i % w) as f64, (i / w) as f64);
            let sub = |k: usize| corner + DVec2::new((k % 4) as f64 + 0.5, (k / 4) as f64 + 0.5) * 0.25;
            ((0..16).map(|k| colour(sub(k))).sum::<f64>() / 16.0) as f32
        });
        images.push(Plane::from_vec(w, h, image.collect()));
        let mask = (0..w * h).map(|i| {
            let centre = DVec2::new((i % w) as f64 + 0.5, (i / w) as f64 + 0.5);
            shape.hit(c.centre_mm(), c.ray_direction(centre)).is_some()
        });
        masks.push(Plane::from_vec(w, h, mask.collect()));
    }
    Frame { index: 0, images, masks }
}

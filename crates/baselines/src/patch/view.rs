//! Views at the level of the image pyramid that patches are matched at.

use glam::{DMat3, DVec2, DVec3};
use strandbench_types::{Camera, Frame, Plane, Rig};

/// Share of a view's hair pixels that are darker than what is shown as white.
const WHITE_SHARE: f64 = 0.995;

/// A view of the frame.
#[derive(Clone, Debug)]
pub(super) struct View {
    /// The camera at the level's resolution.
    pub camera: Camera,
    /// The optical centre, mm.
    pub centre: DVec3,
    /// Homogeneous pixel position from a vector in the world that starts at the centre.
    pub pixel_from_world: DMat3,
    /// The image with a display gamma, 1 at the hair's white.
    pub image: Plane<f32>,
    /// Hair.
    pub mask: Plane<bool>,
}

impl View {
    /// All views of a frame, halved `level` times.
    pub fn all(rig: &Rig, frame: &Frame, level: usize) -> Vec<View> {
        let one = |c: usize| {
            let (mut image, mut mask) = (display(&frame.images[c], &frame.masks[c]), frame.masks[c].clone());
            let mut camera = rig.cameras[c].clone();
            for _ in 0..level {
                (image, mask) = (halve(&image), halve_mask(&mask));
                camera.focal_px *= 0.5;
                camera.principal_px *= 0.5;
            }
            (camera.width, camera.height) = (image.width as u32, image.height as u32);
            let (f, p) = (camera.focal_px, camera.principal_px);
            let k = DMat3::from_cols(DVec3::X * f.x, DVec3::Y * f.y, DVec3::new(p.x, p.y, 1.0));
            let pixel_from_world = k * camera.camera_from_world;
            View { centre: camera.centre_mm(), pixel_from_world, camera, image, mask }
        };
        (0..rig.cameras.len()).map(one).collect()
    }

    /// Whether a point's image is hair.
    pub fn shows(&self, at: DVec3) -> bool {
        self.camera.project(at).is_some_and(|(p, _)| self.is_hair(p))
    }

    /// Whether the pixel at a position is hair.
    pub fn is_hair(&self, p: DVec2) -> bool {
        self.camera.contains(p) && *self.mask.at(p.x as usize, p.y as usize)
    }

    /// Unit vector from a point to the camera.
    pub fn towards(&self, at: DVec3) -> DVec3 {
        (self.centre - at).normalize()
    }

    /// Size of a pixel at a point, mm.
    pub fn footprint_mm(&self, at: DVec3) -> f64 {
        self.camera.to_camera(at).z / self.camera.focal_px.x
    }
}

/// Linear light as a display would show it, white at the hair's brightest but for glints.
fn display(image: &Plane<f32>, mask: &Plane<bool>) -> Plane<f32> {
    let mut hair: Vec<f32> =
        image.data.iter().zip(&mask.data).filter(|(_, m)| **m).map(|(v, _)| *v).collect();
    hair.sort_unstable_by(f32::total_cmp);
    let last = hair.len().saturating_sub(1);
    let white = hair.get((last as f64 * WHITE_SHARE) as usize).copied().unwrap_or(1.0).max(1e-6);
    image.map(|v| libm::powf((v / white).clamp(0.0, 1.0), 1.0 / 2.2))
}

/// Half the resolution, weights 1 3 3 1 along both axes.
fn halve(image: &Plane<f32>) -> Plane<f32> {
    const WEIGHTS: [f32; 4] = [0.125, 0.375, 0.375, 0.125];
    let (w, h) = image.size();
    let (nw, nh) = (w.div_ceil(2), h.div_ceil(2));
    let at = |c: usize, k: usize, n: usize| (2 * c + k).saturating_sub(1).min(n - 1);
    let mut out = Plane::filled(nw, nh, 0.0f32);
    for y in 0..nh {
        for x in 0..nw {
            let mut sum = 0.0;
            for (j, wy) in WEIGHTS.iter().enumerate() {
                for (i, wx) in WEIGHTS.iter().enumerate() {
                    sum += wx * wy * image.at(at(x, i, w), at(y, j, h));
                }
            }
            *out.at_mut(x, y) = sum;
        }
    }
    out
}

/// Half the resolution; hair where half of the pixels are.
fn halve_mask(mask: &Plane<bool>) -> Plane<bool> {
    let (w, h) = mask.size();
    let mut out = Plane::filled(w.div_ceil(2), h.div_ceil(2), false);
    for y in 0..out.height {
        for x in 0..out.width {
            let of = [(0, 0), (1, 0), (0, 1), (1, 1)];
            let hair = of.iter().filter(|(i, j)| *mask.at((2 * x + i).min(w - 1), (2 * y + j).min(h - 1)));
            *out.at_mut(x, y) = hair.count() >= 2;
        }
    }
    out
}

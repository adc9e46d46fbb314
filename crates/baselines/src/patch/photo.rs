//! Photometric consistency of a patch between views (section 2 of the paper).

use super::view::View;
use glam::{DVec2, DVec3};

/// Largest window, samples along an edge.
pub(super) const MOST_WINDOW: usize = 15;
/// Variance of a window (in units of the display's white squared) below which it has no texture: what rounding to eight
/// bits leaves.
const FLAT_VARIANCE: f32 = 1.0 / (255.0 * 255.0 * 12.0);

/// Samples of a patch in one view, of mean 0 and sum of squares 1.
#[derive(Clone, Debug)]
pub(super) struct Texture {
    values: [f32; MOST_WINDOW * MOST_WINDOW],
    count: usize,
}

/// A patch's window in its reference view: pixels around `pixel`, which fixes the viewing ray.
#[derive(Clone, Debug)]
pub(super) struct Window<'a> {
    views: &'a [View],
    pub reference: usize,
    pub pixel: DVec2,
    radius: i32,
    texture: Texture,
}

impl<'a> Window<'a> {
    /// `None` where the window leaves the image or has no texture.
    pub fn new(views: &'a [View], reference: usize, pixel: DVec2, window_px: usize) -> Option<Window<'a>> {
        let radius = (window_px / 2) as i32;
        let texture = sample(&views[reference], radius, |i, j| {
            DVec3::new(pixel.x + f64::from(i), pixel.y + f64::from(j), 1.0)
        })?;
        Some(Window { views, reference, pixel, radius, texture })
    }

    /// Normalised cross-correlation with another view of the patch with its centre on the ray through the window's
    /// centre; `None` where the patch leaves that view or has no texture in it.
    ///
    /// The pixels of the window are carried over by the homography of the patch's plane: the point of the plane on the
    /// ray o + t d has t = n·(c - o) / n·d, and its image in the other view is linear in d after multiplying by n·d.
    pub fn ncc(&self, other: usize, centre: DVec3, normal: DVec3) -> Option<f32> {
        let (from, to) = (&self.views[self.reference], &self.views[other]);
        let shift = to.pixel_from_world * (from.centre - to.centre);
        let scale = normal.dot(centre - from.centre);
        let image = |d: DVec3| shift * normal.dot(d) + to.pixel_from_world * d * scale;
        // Both signs are negative for a patch that faces the camera.
        let d = from.camera.ray_direction(self.pixel);
        let step = |p: DVec2| from.camera.ray_direction(self.pixel + p) - d;
        let (q, qx, qy) = (image(d), image(step(DVec2::X)), image(step(DVec2::Y)));
        let sign = -1.0;
        let (q, qx, qy) = (q * sign, qx * sign, qy * sign);
        let there = sample(to, self.radius, |i, j| q + qx * f64::from(i) + qy * f64::from(j))?;
        let n = there.count;
        Some(self.texture.values[..n].iter().zip(&there.values[..n]).map(|(a, b)| a * b).sum())
    }
}

/// Bilinear samples at homogeneous positions.
fn sample(view: &View, radius: i32, at: impl Fn(i32, i32) -> DVec3) -> Option<Texture> {
    let image = &view.image;
    let (w, h) = (image.width, image.height);
    // A projective map of a square lies within its corners' images.
    let inside = |i: i32, j: i32| {
        let q = at(i, j);
        let (x, y) = (q.x / q.z - 0.5, q.y / q.z - 0.5);
        q.z > 0.0 && x >= 0.0 && y >= 0.0 && x < (w - 1) as f64 && y < (h - 1) as f64
    };
    if ![(-1, -1), (1, -1), (-1, 1), (1, 1)].iter().all(|(i, j)| inside(i * radius, j * radius)) {
        return None;
    }
    let mut t = Texture { values: [0.0; MOST_WINDOW * MOST_WINDOW], count: 0 };
    for j in -radius..=radius {
        for i in -radius..=radius {
            let q = at(i, j);
            let inverse = 1.0 / q.z;
            let (x, y) = ((q.x * inverse - 0.5) as f32, (q.y * inverse - 0.5) as f32);
            let (cx, cy) = ((x as usize).min(w - 2), (y as usize).min(h - 2));
            let (a, b) = (x - cx as f32, y - cy as f32);
            let k = cy * w + cx;
            let top = image.data[k] + a * (image.data[k + 1] - image.data[k]);
            let bottom = image.data[k + w] + a * (image.data[k + w + 1] - image.data[k + w]);
            t.values[t.count] = top + b * (bottom - top);
            t.count += 1;
        }
    }
    let n = t.count as f32;
    let values = &mut t.values[..t.count];
    let mean = values.iter().sum::<f32>() / n;
    values.iter_mut().for_each(|v| *v -= mean);
    let sum: f32 = values.iter().map(|v| v * v).sum();
    if sum <= FLAT_VARIANCE * n {
        return None;
    }
    let inverse = 1.0 / sum.sqrt();
    values.iter_mut().for_each(|v| *v *= inverse);
    Some(t)
}

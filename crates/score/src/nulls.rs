//! The subjects that a method has to beat, and the ceiling that it cannot pass.

use crate::depth::pixel_centre;
use crate::hull::{Hull, NULL_KEY};
use crate::regions::Regions;
use crate::subject::{Subject, Surface};
use crate::visible;
use glam::{DMat3, DVec2, DVec3};
use rayon::prelude::*;
use std::f64::consts::PI;
use strandbench_rng::Rng;
use strandbench_types::{Camera, Truth};

/// Half of the box over which N2's hull is smoothed before its normals are taken, px.
const SMOOTH_PX: usize = 8;

/// N0, N1, N2, NC and C in this order. Their directions are made in the reference camera's frame, so that
/// moving the world moves them along.
pub(crate) fn all(truth: &Truth, regions: &Regions, hull: &Hull, seed: u64) -> [Subject; 5] {
    let rig = &truth.rig;
    let mut middles: Vec<f64> = hull.iter().flatten().map(|h| h.middle).collect();
    middles.sort_unstable_by(f64::total_cmp);
    let constant = match middles.len() {
        0 => 0.5 * (rig.near_mm + rig.far_mm),
        n => middles[(n - 1) / 2],
    };
    let maker = Maker { truth, regions, camera: &rig.cameras[0] };
    let depth = |pick: fn(&crate::hull::HullRay) -> f64| -> Vec<f64> {
        hull.iter().map(|h| h.as_ref().map_or(constant, pick)).collect()
    };
    let (random, front) = (depth(|h| h.random), depth(|h| h.front));
    let random_line = |i: u32, _: usize| isotropic(&mut Rng::keyed(&[seed, NULL_KEY, 1, u64::from(i)]));
    let principal = maker.camera.camera_from_world * principal_direction(truth);
    let draped = draped(maker.camera, truth.views[0].mask.size(), &regions.hair, &front);
    [
        maker.subject("N0", &random, random_line),
        maker.subject("N1", &random, |_, _| principal),
        maker.subject("N2", &front, |_, k| draped[k]),
        maker.subject("NC", &vec![constant; hull.len()], |_, _| DVec3::Y),
        ceiling(truth),
    ]
}

/// A direction drawn uniformly from the sphere.
pub(crate) fn isotropic(rng: &mut Rng) -> DVec3 {
    let (z, (s, c)) = (2.0 * rng.f64() - 1.0, (2.0 * PI * rng.f64()).sin_cos());
    let r = (1.0 - z * z).sqrt();
    DVec3::new(r * c, r * s, z)
}

struct Maker<'a> {
    truth: &'a Truth,
    regions: &'a Regions,
    camera: &'a Camera,
}

impl Maker<'_> {
    /// A subject from depths per hair pixel and a direction (camera frame) per pixel and rank in the mask.
    fn subject(
        &self,
        name: &'static str,
        depths: &[f64],
        direction: impl Fn(u32, usize) -> DVec3 + Sync,
    ) -> Subject {
        let pixels = self.truth.views[0].mask.data.len();
        let world_from_camera = self.camera.camera_from_world.transpose();
        let of_pixel = |(k, &i): (usize, &u32)| {
            let d = direction(i, k);
            (world_from_camera * d, image_line(self.camera, pixel_centre(i, self.camera.width), d))
        };
        let lines: Vec<(DVec3, f64)> = self.regions.hair.par_iter().enumerate().map(of_pixel).collect();
        let mut s = Subject {
            name,
            depth: vec![f32::NAN; pixels],
            axis: vec![DVec3::ZERO; pixels],
            line: vec![f64::NAN; pixels],
            strength: Vec::new(),
            surface: Surface::Depth,
        };
        for (k, &i) in self.regions.hair.iter().enumerate() {
            let i = i as usize;
            s.depth[i] = depths[k] as f32;
            (s.axis[i], s.line[i]) = lines[k];
        }
        s
    }
}

/// Directions of hair that hangs down the hull: the image's downward direction laid into the tangent
/// plane of the smoothed hull front; camera frame, per pixel of `hair` in an image of `(w, h)`.
pub(crate) fn draped(camera: &Camera, (w, h): (usize, usize), hair: &[u32], front: &[f64]) -> Vec<DVec3> {
    let (sum, count) = integrals(hair, front, w, h);
    let smooth = |x: i64, y: i64| {
        let r = SMOOTH_PX as i64;
        let clip = |v: i64, n: usize| v.clamp(0, n as i64) as usize;
        let (x0, x1, y0, y1) = (clip(x - r, w), clip(x + r + 1, w), clip(y - r, h), clip(y + r + 1, h));
        let at = |t: &[f64]| {
            t[y1 * (w + 1) + x1] - t[y0 * (w + 1) + x1] - t[y1 * (w + 1) + x0] + t[y0 * (w + 1) + x0]
        };
        let n = at(&count);
        (n > 0.5).then(|| at(&sum) / n)
    };
    let point = |x: i64, y: i64| {
        let z = smooth(x, y)?;
        let xy = (DVec2::new(x as f64 + 0.5, y as f64 + 0.5) - camera.principal_px) / camera.focal_px;
        Some(DVec3::new(xy.x, xy.y, 1.0) * z)
    };
    let of_pixel = |&i: &u32| {
        let (x, y) = ((i as usize % w) as i64, (i as usize / w) as i64);
        let across = |dx: i64, dy: i64| Some(point(x + dx, y + dy)? - point(x - dx, y - dy)?);
        let normal =
            across(1, 0).zip(across(0, 1)).map_or(DVec3::NEG_Z, |(u, v)| v.cross(u).normalize_or_zero());
        let down = DVec3::Y - normal * normal.y;
        if down.length() > 1e-3 {
            down.normalize()
        } else {
            (DVec3::Z - normal * normal.z).normalize_or(DVec3::Y)
        }
    };
    hair.par_iter().map(of_pixel).collect()
}

/// Summed-area tables of the depths (relative to their first) and of the mask, (w + 1) x (h + 1).
fn integrals(hair: &[u32], front: &[f64], w: usize, h: usize) -> (Vec<f64>, Vec<f64>) {
    let mut sum = vec![0.0; (w + 1) * (h + 1)];
    let mut count = sum.clone();
    for (k, &i) in hair.iter().enumerate() {
        let at = (i as usize / w + 1) * (w + 1) + i as usize % w + 1;
        sum[at] = front[k];
        count[at] = 1.0;
    }
    for t in [&mut sum, &mut count] {
        for y in 1..=h {
            for x in 1..=w {
                let at = y * (w + 1) + x;
                t[at] += t[at - 1] + t[at - w - 1] - t[at - w - 2];
            }
        }
    }
    (sum, count)
}

/// Angle in [0, π) of the image of a line with direction `d` (camera frame) seen at `pixel`; NaN for a line
/// along the ray. It depends on the ray alone, not on the depth.
pub(crate) fn image_line(camera: &Camera, pixel: DVec2, d: DVec3) -> f64 {
    let ray = (pixel - camera.principal_px) / camera.focal_px;
    let v = camera.focal_px * (d.truncate() - ray * d.z);
    if v == DVec2::ZERO { f64::NAN } else { v.y.atan2(v.x).rem_euclid(PI) }
}

/// Principal axis of all fibre segments weighted by their length, world, unit: one line for the whole scene.
pub(crate) fn principal_direction(truth: &Truth) -> DVec3 {
    let mut m = DMat3::ZERO;
    for strand in truth.strands.iter() {
        for w in strand.windows(2) {
            let d = (w[1] - w[0]).as_dvec3();
            let length = d.length();
            if length > 0.0 {
                m += DMat3::from_cols(d * d.x, d * d.y, d * d.z) * (1.0 / length);
            }
        }
    }
    // Squaring multiplies the ratio of the eigenvalues with itself; 40 times leaves the largest alone.
    for _ in 0..40 {
        let scale = m.to_cols_array().iter().fold(0.0, |a: f64, v| a.max(v.abs()));
        if scale == 0.0 {
            return DVec3::Y;
        }
        m *= 1.0 / scale;
        m = m * m;
    }
    let longest = |a: DVec3, b: DVec3| if b.length_squared() > a.length_squared() { b } else { a };
    longest(longest(m.x_axis, m.y_axis), m.z_axis).normalize_or(DVec3::Y)
}

/// The truth where a second camera could have confirmed it: pixels in whose 3x3 surroundings at least half of
/// the strand samples that the reference camera sees are seen by another camera too.
fn ceiling(truth: &Truth) -> Subject {
    let (w, h) = truth.views[0].mask.size();
    let camera = &truth.rig.cameras[0];
    // Samples per pixel: seen by the reference, and of these seen again.
    let mut counts = vec![(0i64, 0i64); w * h];
    for s in visible::samples(truth) {
        if let Some((p, _)) = camera.project(s.position).filter(|(p, _)| camera.contains(*p)) {
            let c = &mut counts[p.y as usize * w + p.x as usize];
            *c = (c.0 + 1, c.1 + i64::from(s.again));
        }
    }
    let confirmed = |i: usize| {
        let (x, y) = (i % w, i / w);
        let mut sum = (0, 0);
        for v in y.saturating_sub(1)..(y + 2).min(h) {
            for u in x.saturating_sub(1)..(x + 2).min(w) {
                let c = counts[v * w + u];
                sum = (sum.0 + c.0, sum.1 + c.1);
            }
        }
        sum.0 > 0 && 2 * sum.1 >= sum.0
    };
    let mut s = Subject { name: "C", ..Subject::truth(truth) };
    for i in 0..w * h {
        if !confirmed(i) {
            s.depth[i] = f32::NAN;
            s.axis[i] = DVec3::ZERO;
            s.line[i] = f64::NAN;
        }
    }
    s
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn image_of_a_line_is_the_derivative_of_the_projection(
            u in 0.0..64.0f64, v in 0.0..48.0f64, z in 300.0..900.0f64,
            x in -1.0..1.0f64, y in -1.0..1.0f64, w in -1.0..1.0f64,
        ) {
            let mut camera = Camera::look_at("c", (64, 48), 90.0, DVec3::ZERO, DVec3::Z, DVec3::Y);
            camera.focal_px.y = 120.0;
            let (p, d) = (camera.unproject(DVec2::new(u, v), z), DVec3::new(x, y, w));
            let step = camera.project(p + d * 1e-3).unwrap().0 - camera.project(p - d * 1e-3).unwrap().0;
            prop_assume!(step.length() > 1e-5);
            let off = (image_line(&camera, DVec2::new(u, v), d) - step.y.atan2(step.x)).rem_euclid(PI);
            prop_assert!(off.min(PI - off) < 1e-5, "{off}");
        }
    }
}

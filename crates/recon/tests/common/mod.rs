//! Analytic surfaces with painted streaks, seen by Luo's upside-down T of four cameras.
#![allow(dead_code)]

use glam::{DVec2, DVec3};
use strandbench_rng::Rng;
use strandbench_types::{Camera, Frame, Plane, Rig};

/// A surface whose streaks run mostly along world y.
#[derive(Clone, Copy, Debug)]
pub enum Shape {
    /// A square of half-width `half_mm` through the origin with unit normal `normal`.
    Square { normal: DVec3, half_mm: f64 },
    /// A sphere about the origin.
    Sphere { radius_mm: f64 },
    /// A rounded square of half-width `half_mm` with waves 50 to 110 mm long, which cannot slide over itself.
    Relief { half_mm: f64 },
}

/// How far a point lies in front of the relief, mm along z.
fn above_relief(p: DVec3) -> f64 {
    let waves = 8.0 * (p.x / 14.0).sin() * (p.y / 18.0).cos() + 4.0 * (p.x / 8.0 + p.y / 11.0).sin();
    p.z - waves + (p.x * p.x + p.y * p.y) / 300.0
}

/// Streak texture.
#[derive(Clone, Copy, Debug)]
pub struct Streaks {
    pub seed: u64,
    /// Width of the finest streaks, mm.
    pub width_mm: f64,
    /// How far streaks swing sideways, mm.
    pub wave_mm: f64,
}

/// Cameras at 900 mm around the reference, `baseline_mm` to the left, right and top, looking at the origin.
pub fn rig((width, height): (u32, u32), focal_px: f64, baseline_mm: f64) -> Rig {
    let eyes = [(0.0, 0.0), (-baseline_mm, 0.0), (baseline_mm, 0.0), (0.0, baseline_mm)];
    let cameras = eyes.iter().enumerate().map(|(i, &(x, y))| {
        let eye = DVec3::new(x, y, 900.0);
        Camera::look_at(&format!("c{i}"), (width, height), focal_px, eye, DVec3::ZERO, DVec3::NEG_Y)
    });
    Rig { cameras: cameras.collect(), near_mm: 760.0, far_mm: 960.0, frame_rate_hz: 100.0, exposure_s: 0.001 }
}

/// Depth along the camera's +z at which the ray through `pixel` meets the surface, mm.
pub fn depth(shape: Shape, camera: &Camera, pixel: DVec2) -> Option<f64> {
    let (o, d) = (camera.centre_mm(), camera.ray_direction(pixel));
    match shape {
        Shape::Square { normal, half_mm } => {
            let z = -o.dot(normal) / d.dot(normal);
            let p = o + d * z;
            (p.x.abs().max(p.y.abs()) <= half_mm).then_some(z)
        }
        Shape::Sphere { radius_mm } => {
            let (a, b, c) = (d.dot(d), o.dot(d), o.dot(o) - radius_mm * radius_mm);
            let root = b * b - a * c;
            (root >= 0.0).then(|| (-b - root.sqrt()) / a)
        }
        Shape::Relief { half_mm } => {
            // Slopes stay below 1.2 and rays within 20 degrees of z, so that the height along a ray falls throughout.
            let (mut near, mut far) = ((o.z - 60.0) / -d.z, (o.z + 90.0) / -d.z);
            for _ in 0..50 {
                let middle = 0.5 * (near + far);
                if above_relief(o + d * middle) > 0.0 { near = middle } else { far = middle }
            }
            let p = o + d * near;
            (p.x.abs().max(p.y.abs()) <= half_mm).then_some(near)
        }
    }
}

fn lattice(seed: u64, octave: u64, i: i64, j: i64) -> f64 {
    Rng::keyed(&[seed, octave, i as u64, j as u64]).f64()
}

fn noise(seed: u64, octave: u64, x: f64, y: f64) -> f64 {
    let (i, j) = (x.floor(), y.floor());
    let smooth = |v: f64| v * v * (3.0 - 2.0 * v);
    let (u, v) = (smooth(x - i), smooth(y - j));
    let at = |a: i64, b: i64| lattice(seed, octave, i as i64 + a, j as i64 + b);
    (at(0, 0) * (1.0 - u) + at(1, 0) * u) * (1.0 - v) + (at(0, 1) * (1.0 - u) + at(1, 1) * u) * v
}

/// Brightness of the surface at a point, 0..1.
pub fn brightness(shape: Shape, streaks: Streaks, p: DVec3) -> f64 {
    let (across, along) = match shape {
        Shape::Square { .. } | Shape::Relief { .. } => (p.x, p.y),
        Shape::Sphere { radius_mm } => (p.x.atan2(p.z) * radius_mm, (p.y / radius_mm).asin() * radius_mm),
    };
    let across =
        across + streaks.wave_mm * (along / 17.0 + 2.0 * noise(streaks.seed, 9, across / 20.0, 0.5)).sin();
    let mut sum = 0.0;
    for (octave, (scale, weight)) in [(1.0, 0.4), (2.3, 0.35), (6.1, 0.25)].into_iter().enumerate() {
        let w = streaks.width_mm * scale;
        sum += weight * noise(streaks.seed, octave as u64, across / w, along / (w * 15.0));
    }
    (sum * sum * 1.6).min(1.0)
}

/// What the four cameras see, with `sub` x `sub` samples a pixel and keyed masks.
pub fn frame(rig: &Rig, shape: Shape, streaks: Streaks, sub: usize) -> Frame {
    let (mut images, mut masks) = (Vec::new(), Vec::new());
    for camera in &rig.cameras {
        let (w, h) = (camera.width as usize, camera.height as usize);
        let mut image = Plane::filled(w, h, 0.0f32);
        let mut mask = Plane::filled(w, h, false);
        for y in 0..h {
            for x in 0..w {
                let (mut light, mut hits) = (0.0, 0usize);
                for s in 0..sub * sub {
                    let offset = DVec2::new((s % sub) as f64 + 0.5, (s / sub) as f64 + 0.5) / sub as f64;
                    let pixel = DVec2::new(x as f64, y as f64) + offset;
                    if let Some(z) = depth(shape, camera, pixel) {
                        light += brightness(shape, streaks, camera.unproject(pixel, z));
                        hits += 1;
                    }
                }
                *image.at_mut(x, y) = (light / (sub * sub) as f64) as f32;
                *mask.at_mut(x, y) = 2 * hits >= sub * sub;
            }
        }
        images.push(image);
        masks.push(mask);
    }
    Frame { index: 0, images, masks }
}

/// Sorted |depth error| in mm over mask pixels at least `margin_px` inside the mask, absent ones infinite.
pub fn errors_mm(
    rig: &Rig,
    shape: Shape,
    mask: &Plane<bool>,
    got: &strandbench_types::DepthMap,
    margin_px: usize,
) -> Vec<f64> {
    let (w, h) = mask.size();
    let m = margin_px as isize;
    let inside = |x: isize, y: isize| {
        x >= 0 && y >= 0 && x < w as isize && y < h as isize && *mask.at(x as usize, y as usize)
    };
    let mut all = Vec::new();
    for y in 0..h {
        for x in 0..w {
            let near = (-m..=m).flat_map(|j| (-m..=m).map(move |i| (i, j)));
            if !near.clone().all(|(i, j)| inside(x as isize + i, y as isize + j)) {
                continue;
            }
            if let Some(want) = depth(shape, &rig.cameras[0], DVec2::new(x as f64 + 0.5, y as f64 + 0.5)) {
                all.push(got.get(x, y).map_or(f64::INFINITY, |z| (f64::from(z) - want).abs()));
            }
        }
    }
    all.sort_unstable_by(f64::total_cmp);
    all
}

/// The value below which `share` of sorted values lie.
pub fn quantile(sorted: &[f64], share: f64) -> f64 {
    sorted[((sorted.len() - 1) as f64 * share).round() as usize]
}

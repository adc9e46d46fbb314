//! A truth for any strands, by splatting them into each camera at 4 x 4 sub-pixels: what each sub-pixel meets first.

use glam::{DVec2, DVec3, Vec3};
use strandbench_types::{
    Camera, DepthMap, Plane, Rig, StrandSet, Truth, VISIBILITY_STEP_MM, ViewTruth, Visibility,
};

/// Sub-pixels along a pixel's side.
const SUB: usize = 4;

/// Distance of splats along a strand, mm.
const STEP_MM: f64 = 0.2;

/// Luo's four cameras, the reference first: in front of the hair's middle, a baseline (mm) apart.
pub fn four_cameras(
    middle: DVec3,
    distance_mm: f64,
    baseline_mm: f64,
    size: (u32, u32),
    focal_px: f64,
) -> Vec<Camera> {
    [(0.0, 0.0), (-1.0, 0.0), (1.0, 0.0), (0.0, 1.0)]
        .iter()
        .enumerate()
        .map(|(i, (x, y))| {
            let eye = middle + DVec3::new(x * baseline_mm, y * baseline_mm, distance_mm);
            Camera::look_at(&format!("c{i}"), size, focal_px, eye, middle, DVec3::NEG_Y)
        })
        .collect()
}

struct Buffer {
    width: usize,
    depth: Vec<f32>,
    sample: Vec<u32>,
}

fn splat(camera: &Camera, strands: &StrandSet, offsets: &[u32], radius_mm: f64) -> Buffer {
    let width = camera.width as usize * SUB;
    let n = width * camera.height as usize * SUB;
    let mut b = Buffer { width, depth: vec![f32::INFINITY; n], sample: vec![u32::MAX; n] };
    for s in 0..strands.len() {
        let count = offsets[s + 1] - offsets[s];
        if count == 0 {
            continue;
        }
        let (mut arc, points) = (0.0, strands.strand(s));
        for w in points.windows(2) {
            let (p, q) = (w[0].as_dvec3(), w[1].as_dvec3());
            let length = f64::from(w[0].distance(w[1]));
            let steps = (length / STEP_MM).ceil().max(1.0);
            for k in 0..steps as usize {
                let u = (k as f64 + 0.5) / steps;
                let Some((uv, z)) = camera.project(p.lerp(q, u)) else { continue };
                if !camera.contains(uv) {
                    continue;
                }
                let i = ((arc + u * length) / f64::from(VISIBILITY_STEP_MM)) as u32;
                let sample = offsets[s] + i.min(count - 1);
                let radius = radius_mm * camera.focal_px.x / z * SUB as f64;
                disc(uv * SUB as f64, radius, (width, camera.height as usize * SUB), |at| {
                    if (z as f32) < b.depth[at] {
                        b.depth[at] = z as f32;
                        b.sample[at] = sample;
                    }
                });
            }
            arc += length;
        }
    }
    b
}

/// Each sub-pixel of an image whose centre is within `radius` of `middle`, and the one that holds `middle`.
fn disc(middle: DVec2, radius: f64, (width, height): (usize, usize), mut each: impl FnMut(usize)) {
    let (x, y) = (middle.x as usize, middle.y as usize);
    let reach = radius.ceil() as usize;
    for j in y.saturating_sub(reach)..(y + reach + 1).min(height) {
        for i in x.saturating_sub(reach)..(x + reach + 1).min(width) {
            let centre = DVec2::new(i as f64 + 0.5, j as f64 + 0.5);
            if (i, j) == (x, y) || centre.distance_squared(middle) <= radius * radius {
                each(j * width + i);
            }
        }
    }
}

fn view(camera: &Camera, b: &Buffer) -> ViewTruth {
    let (w, h) = (camera.width as usize, camera.height as usize);
    let (mut first, mut half) = (vec![f32::NAN; w * h], vec![f32::NAN; w * h]);
    for i in 0..w * h {
        let (x, y) = (i % w * SUB, i / w * SUB);
        let mut z: Vec<f32> = (0..SUB * SUB)
            .map(|k| b.depth[(y + k / SUB) * b.width + x + k % SUB])
            .filter(|z| z.is_finite())
            .collect();
        z.sort_by(f32::total_cmp);
        first[i] = z.first().copied().unwrap_or(f32::NAN);
        half[i] = z.get(SUB * SUB / 2 - 1).copied().unwrap_or(f32::NAN);
    }
    let hair = |yes: f32, no: f32| {
        Plane::from_vec(w, h, half.iter().map(|z| if z.is_nan() { no } else { yes }).collect())
    };
    let map = |z: &[f32]| DepthMap::from_raw(Plane::from_vec(w, h, z.to_vec()));
    ViewTruth {
        depth_first: map(&first),
        depth_05: map(&first),
        depth_50: map(&half),
        coverage: hair(1.0, 0.0),
        mask: hair(1.0, 0.0).map(|&c| c > 0.5),
        orientation_2d: hair(1.5, f32::NAN),
        orientation_agreement: hair(1.0, 0.0),
        orientation_3d: hair(1.0, 0.0).map(|&c| Vec3::Y * c),
    }
}

/// The truth of strands before these cameras, each hiding what is behind it to `radius_mm` from its middle; lines in its
/// maps are not true.
pub fn truth(strands: StrandSet, cameras: Vec<Camera>, near_mm: f64, far_mm: f64, radius_mm: f64) -> Truth {
    let mut offsets = vec![0u32];
    for s in 0..strands.len() {
        offsets.push(offsets[s] + Visibility::samples_on(strands.length_mm(s)) as u32);
    }
    let mut seen_by = vec![0u32; offsets[strands.len()] as usize];
    let mut views = Vec::new();
    for (c, camera) in cameras.iter().enumerate() {
        let b = splat(camera, &strands, &offsets, radius_mm);
        // One sub-pixel of 16 is more than a twentieth of a pixel.
        b.sample.iter().filter(|s| **s != u32::MAX).for_each(|&s| seen_by[s as usize] |= 1 << c);
        views.push(view(camera, &b));
    }
    let rig = Rig { cameras, near_mm, far_mm, frame_rate_hz: 100.0, exposure_s: 0.001 };
    Truth { rig, views, strands, visibility: Visibility { offsets, seen_by }, head: None }
}

// The half millimetres of strand that two cameras see, moved, each a strand of its own.
pub fn visible_layer(t: &Truth, by: Vec3) -> StrandSet {
    let mut out = StrandSet::new();
    for (k, points) in t.strands.iter().enumerate() {
        let first = t.visibility.offsets[k] as usize;
        let (mut arc, mut sample) = (0.0, 0);
        for w in points.windows(2) {
            let length = w[0].distance(w[1]);
            while first + sample < t.visibility.offsets[k + 1] as usize {
                let s = (sample as f32 + 0.5) * VISIBILITY_STEP_MM;
                if s > arc + length {
                    break;
                }
                if t.visibility.seen_by[first + sample].count_ones() >= 2 {
                    let d = (w[1] - w[0]) / length;
                    let p = w[0] + d * (s - arc) + by;
                    out.push(&[p - d * 0.25, p + d * 0.25], 0.04);
                }
                sample += 1;
            }
            arc += length;
        }
    }
    out
}

/// Bounds of the strands: lowest and highest corner.
pub fn bounds(strands: &StrandSet) -> (DVec3, DVec3) {
    strands.points.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(lo, hi), p| {
        (lo.min(p.as_dvec3()), hi.max(p.as_dvec3()))
    })
}

/// Centre of the image, px.
pub fn middle(camera: &Camera) -> DVec2 {
    camera.principal_px
}

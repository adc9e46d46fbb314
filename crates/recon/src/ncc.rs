//! The image cost that section 6 compares with: negative normalised cross-correlation of windows.

use crate::cost::{balance, count_inside};
use crate::depth::{DepthLabels, Epipolar};
use crate::grid::{Grid, Volume};
use crate::pyramid::PyramidLevel;
use crate::{ReconError, simd};
use rayon::prelude::*;
use strandbench_types::{Monitor, Silent};

/// One level of a view's image, with a border of nothing: (intensity, hair) per pixel.
#[derive(Clone, Debug)]
pub struct ImageSampler {
    width: usize,
    height: usize,
    texels: Vec<[f32; 2]>,
}

impl ImageSampler {
    /// Takes a level of a pyramid.
    pub fn new(level: &PyramidLevel) -> ImageSampler {
        let (width, height) = level.image.size();
        let stride = width + 3;
        let mut texels = vec![[0.0; 2]; stride * (height + 3)];
        for y in 0..height + 3 {
            for x in 0..stride {
                // The border continues the image but is not hair.
                let (u, v) = (x.saturating_sub(1).min(width - 1), y.saturating_sub(1).min(height - 1));
                let inside = x == u + 1 && y == v + 1;
                let i = v * width + u;
                let hair = if inside && level.is_hair(i) { 1.0 } else { 0.0 };
                texels[y * stride + x] = [level.image.data[i], hair];
            }
        }
        ImageSampler { width, height, texels }
    }
}

simd::simd_fn! {
    /// Intensity and share of hair at each position.
    fn sample(sampler: &ImageSampler, us: &[f32], vs: &[f32], image: &mut [f32], hair: &mut [f32]) {
        let stride = sampler.width + 3;
        let (right, bottom) = (sampler.width as f32 + 1.0, sampler.height as f32 + 1.0);
        for (((u, v), image), hair) in us.iter().zip(vs).zip(image).zip(hair) {
            let fx = (u + 0.5).max(0.0).min(right);
            let fy = (v + 0.5).max(0.0).min(bottom);
            let (x, y) = (fx as i32 as usize, fy as i32 as usize);
            let (sx, sy) = (fx - x as f32, fy - y as f32);
            let i = y * stride + x;
            let (top, low) = (&sampler.texels[i..i + 2], &sampler.texels[i + stride..i + stride + 2]);
            let mix = |c: usize| {
                (top[0][c] * (1.0 - sx) + top[1][c] * sx) * (1.0 - sy)
                    + (low[0][c] * (1.0 - sx) + low[1][c] * sx) * sy
            };
            (*image, *hair) = (mix(0), mix(1));
        }
    }
}

/// Sums over hair pixels of a window that NCC needs, indexed by label.
struct Sums {
    n: Vec<f32>,
    a: Vec<f32>,
    b: Vec<f32>,
    aa: Vec<f32>,
    bb: Vec<f32>,
    ab: Vec<f32>,
}

simd::simd_fn! {
    /// Adds one pixel of the window: `own` of the reference, `other` and `hair` of the view for each label.
    fn add_pixel(s: &mut Sums, own: f32, other: &[f32], hair: &[f32]) {
        let k = other.len();
        let (n, a, b) = (&mut s.n[..k], &mut s.a[..k], &mut s.b[..k]);
        let (aa, bb, ab) = (&mut s.aa[..k], &mut s.bb[..k], &mut s.ab[..k]);
        let hair = &hair[..k];
        for l in 0..k {
            let w = if hair[l] >= 0.5 { 1.0f32 } else { 0.0 };
            let v = other[l];
            n[l] += w;
            a[l] += w * own;
            b[l] += w * v;
            aa[l] += w * own * own;
            bb[l] += w * v * v;
            ab[l] += w * own * v;
        }
    }
}

/// Contrast (variance) below which a window is flat and correlates with nothing; images are 0..1.
const FLAT: f32 = 1e-8;

simd::simd_fn! {
    /// Adds -NCC to the costs, or `absent` where less than half of the window is hair in the view, for labels
    /// whose point the view has in its image (`inside` above 0).
    fn finish(s: &Sums, wanted: f32, absent: f32, inside: &[f32], costs: &mut [f32]) {
        let k = costs.len();
        let inside = &inside[..k];
        let (n, a, b) = (&s.n[..k], &s.a[..k], &s.b[..k]);
        let (aa, bb, ab) = (&s.aa[..k], &s.bb[..k], &s.ab[..k]);
        for l in 0..k {
            let r = 1.0 / n[l].max(1.0);
            let (ma, mb) = (a[l] * r, b[l] * r);
            let (va, vb) = (aa[l] * r - ma * ma, bb[l] * r - mb * mb);
            let cov = ab[l] * r - ma * mb;
            let ncc = if va > FLAT && vb > FLAT { cov / (va * vb).sqrt() } else { 0.0 };
            let cost = if 2.0 * n[l] < wanted { absent } else { -ncc.clamp(-1.0, 1.0) };
            costs[l] += if inside[l] > 0.0 { cost } else { 0.0 };
        }
    }
}

/// The sum over views of -NCC at one level, in [-1, 1] each; windows face the reference camera: all of a
/// window's pixels are projected at its centre's depth label. Views whose image does not reach the centre's
/// point are left out as in [`crate::cost::orientation_volume`].
///
/// # Errors
/// If cancelled.
pub fn ncc_volume(
    grid: &Grid,
    image: &[f32],
    views: &[(Epipolar, ImageSampler)],
    depths: &DepthLabels,
    radius_px: usize,
    absent: f32,
    monitor: &dyn Monitor,
) -> Result<Volume, ReconError> {
    let labels = depths.count();
    let inverse: Vec<f32> = (0..labels).map(|k| depths.inverse_mm(k as f64) as f32).collect();
    let scale = (1usize << grid.level) as f64;
    // Means of hair keep the sums small, so that variances do not cancel in f32.
    let hair: Vec<f32> = image.iter().zip(&grid.active).filter(|(_, a)| **a).map(|(v, _)| *v).collect();
    let mean = (hair.iter().map(|v| f64::from(*v)).sum::<f64>() / hair.len().max(1) as f64) as f32;
    let mut volume = Volume::zeros(grid, labels);
    for (epipolar, sampler) in views {
        // Samples of a band of rows and of the rows that their windows reach, indexed [pixel * labels + label].
        const BAND: usize = 8;
        let (w, h, r) = (grid.width, grid.height, radius_px);
        let bands = volume.data.par_chunks_mut(BAND * w * labels).enumerate();
        bands.try_for_each(|(band, costs)| {
            monitor.check()?;
            let first = band * BAND;
            let rows = costs.len() / (w * labels);
            let (top, bottom) = (first.saturating_sub(r), (first + rows + r).min(h));
            let mut other = vec![0.0f32; (bottom - top) * w * labels];
            let mut seen = vec![0.0f32; (bottom - top) * w * labels];
            let (mut us, mut vs) = (vec![0.0f32; labels], vec![0.0f32; labels]);
            for i in (0..(bottom - top) * w).filter(|i| grid.active[top * w + i]) {
                epipolar.project(grid.centre_px(i % w, top + i / w), scale, &inverse, &mut us, &mut vs);
                let range = i * labels..(i + 1) * labels;
                sample(sampler, &us, &vs, &mut other[range.clone()], &mut seen[range.clone()]);
                for v in &mut other[range] {
                    *v -= mean;
                }
            }
            let zeros = || vec![0.0f32; labels];
            let mut inside = zeros();
            let mut sums = Sums { n: zeros(), a: zeros(), b: zeros(), aa: zeros(), bb: zeros(), ab: zeros() };
            for i in (0..rows * w).filter(|i| grid.active[first * w + i]) {
                let (x, y) = (i % w, first + i / w);
                for v in [&mut sums.n, &mut sums.a, &mut sums.b, &mut sums.aa, &mut sums.bb, &mut sums.ab] {
                    v.fill(0.0);
                }
                let mut wanted = 0.0;
                for v in y.saturating_sub(r)..(y + r + 1).min(h) {
                    for u in x.saturating_sub(r)..(x + r + 1).min(w) {
                        if grid.active[v * w + u] {
                            wanted += 1.0;
                            let j = ((v - top) * w + u) * labels;
                            let own = image[v * w + u] - mean;
                            add_pixel(&mut sums, own, &other[j..j + labels], &seen[j..j + labels]);
                        }
                    }
                }
                epipolar.project(grid.centre_px(x, y), scale, &inverse, &mut us, &mut vs);
                inside.fill(0.0);
                count_inside(sampler.width as f32, sampler.height as f32, &us, &vs, &mut inside);
                finish(&sums, wanted, absent, &inside, &mut costs[i * labels..(i + 1) * labels]);
            }
            monitor.advance(rows as u64);
            Ok::<(), ReconError>(())
        })?;
    }
    let state = || (vec![0.0f32; labels], vec![0.0f32; labels], vec![0.0f32; labels]);
    volume.fill(grid, &Silent, state, |(us, vs, seen), x, y, costs| {
        seen.fill(0.0);
        for (epipolar, sampler) in views {
            epipolar.project(grid.centre_px(x, y), scale, &inverse, us, vs);
            count_inside(sampler.width as f32, sampler.height as f32, us, vs, seen);
        }
        balance(views.len() as f32, absent, seen, costs);
    })?;
    Ok(volume)
}

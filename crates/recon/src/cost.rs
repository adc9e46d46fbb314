//! The data term before aggregation: Eq. 5 and 6 at one level.

use crate::depth::{DepthLabels, Epipolar};
use crate::grid::{Grid, Volume};
use crate::pyramid::PyramidLevel;
use crate::{ReconError, simd};
use strandbench_types::{Monitor, OrientationField};

/// One level of another view's field, made ready for sampling: (Re O, Im O, hair, 0) per pixel with a border
/// that repeats the outermost pixels, one before and two after.
#[derive(Clone, Debug)]
pub struct Sampler {
    width: usize,
    height: usize,
    texels: Vec<[f32; 4]>,
}

impl Sampler {
    /// Takes a field and its level of the pyramid, whose weight says what is hair.
    pub fn new(field: &OrientationField, level: &PyramidLevel) -> Sampler {
        let (width, height) = field.size();
        let stride = width + 3;
        let mut texels = vec![[0.0; 4]; stride * (height + 3)];
        for y in 0..height + 3 {
            for x in 0..stride {
                let i = y.saturating_sub(1).min(height - 1) * width + x.saturating_sub(1).min(width - 1);
                if level.is_hair(i) {
                    texels[y * stride + x] = [field.re.data[i], field.im.data[i], 1.0, 0.0];
                }
            }
        }
        Sampler { width, height, texels }
    }
}

simd::simd_fn! {
    /// Adds 1 to `seen` for each position inside an image of `width` x `height`.
    pub(crate) fn count_inside(width: f32, height: f32, us: &[f32], vs: &[f32], seen: &mut [f32]) {
        for ((u, v), seen) in us.iter().zip(vs).zip(seen) {
            let inside = *u >= 0.0 && *u <= width && *v >= 0.0 && *v <= height;
            *seen += if inside { 1.0 } else { 0.0 };
        }
    }
}

simd::simd_fn! {
    /// Scales the summed costs of the views that have the point in their image to all `views`; `absent` a view
    /// where none has.
    pub(crate) fn balance(views: f32, absent: f32, seen: &[f32], costs: &mut [f32]) {
        for (seen, cost) in seen.iter().zip(costs) {
            *cost = if *seen > 0.0 { *cost * (views / *seen) } else { absent * views };
        }
    }
}

simd::simd_fn! {
    /// Adds c(O_ref, O_i(P_i)) of one view to the costs of all labels of a pixel, where the view has the point
    /// in its image. O_i is interpolated bilinearly as a complex number; of the share of the sample that lies
    /// outside the hair, the cost is `absent` instead.
    fn add_view(sampler: &Sampler, own: (f32, f32), absent: f32, us: &[f32], vs: &[f32], costs: &mut [f32]) {
        let stride = sampler.width + 3;
        let (width, height) = (sampler.width as f32, sampler.height as f32);
        let (right, bottom) = (sampler.width as f32 + 1.0, sampler.height as f32 + 1.0);
        // -Re{O* O'} = -(re re' + im im'); absent (1 - hair).
        let weights = [-own.0, -own.1, -absent, 0.0];
        for ((u, v), cost) in us.iter().zip(vs).zip(costs) {
            // Texel (1, 1) is pixel (0, 0), whose centre is (0.5, 0.5). `max` turns NaN into 0: the border.
            let fx = (u + 0.5).max(0.0).min(right);
            let fy = (v + 0.5).max(0.0).min(bottom);
            let (x, y) = (fx as i32 as usize, fy as i32 as usize);
            let (sx, sy) = (fx - x as f32, fy - y as f32);
            let i = y * stride + x;
            let (top, low) = (&sampler.texels[i..i + 2], &sampler.texels[i + stride..i + stride + 2]);
            let (w00, w10) = ((1.0 - sx) * (1.0 - sy), sx * (1.0 - sy));
            let (w01, w11) = ((1.0 - sx) * sy, sx * sy);
            let mut sample = [0.0f32; 4];
            for c in 0..4 {
                sample[c] = (w00 * top[0][c] + w10 * top[1][c]) + (w01 * low[0][c] + w11 * low[1][c]);
            }
            let sum = absent + (sample[0] * weights[0] + sample[1] * weights[1] + sample[2] * weights[2]);
            let inside = *u >= 0.0 && *u <= width && *v >= 0.0 && *v <= height;
            *cost += if inside { sum } else { 0.0 };
        }
    }
}

/// e_d^(l) of Eq. 5 before aggregation. `own` is O_ref^(l) on the grid; views are sampled at the grid's level.
/// The reference's own term, -|O_ref|² at every depth, is left out: it changes no minimum. A view whose image
/// does not reach the point can say nothing of it: the sum is that of the others, scaled to the number of
/// views (the paper is silent; counted as a cost, it drives hair at the border of an image to wrong depths).
///
/// # Errors
/// If cancelled.
pub fn orientation_volume(
    grid: &Grid,
    own: &[(f32, f32)],
    views: &[(Epipolar, Sampler)],
    depths: &DepthLabels,
    absent: f32,
    monitor: &dyn Monitor,
) -> Result<Volume, ReconError> {
    let labels = depths.count();
    let inverse: Vec<f32> = (0..labels).map(|k| depths.inverse_mm(k as f64) as f32).collect();
    let scale = (1usize << grid.level) as f64;
    let mut volume = Volume::zeros(grid, labels);
    let state = || (vec![0.0f32; labels], vec![0.0f32; labels], vec![0.0f32; labels]);
    volume.fill(grid, monitor, state, |(us, vs, seen), x, y, costs| {
        seen.fill(0.0);
        for (epipolar, sampler) in views {
            epipolar.project(grid.centre_px(x, y), scale, &inverse, us, vs);
            add_view(sampler, own[y * grid.width + x], absent, us, vs, costs);
            count_inside(sampler.width as f32, sampler.height as f32, us, vs, seen);
        }
        balance(views.len() as f32, absent, seen, costs);
    })?;
    Ok(volume)
}

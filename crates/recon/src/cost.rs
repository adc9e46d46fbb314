//! The data term before aggregation: Eq. 5 and 6 at one level.

use crate::depth::{DepthLabels, Epipolar};
use crate::grid::{Grid, Volume};
use crate::pyramid::PyramidLevel;
use crate::{ReconError, simd};
use strandbench_types::{Monitor, OrientationField};

/// One level of another view's field, made ready for sampling: (Re O, Im O, hair, 0) per pixel with a border
/// of zeros, one pixel before and two after.
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
        for y in 0..height {
            for x in 0..width {
                let i = y * width + x;
                if level.is_hair(i) {
                    texels[(y + 1) * stride + x + 1] = [field.re.data[i], field.im.data[i], 1.0, 0.0];
                }
            }
        }
        Sampler { width, height, texels }
    }
}

simd::simd_fn! {
    /// Adds c(O_ref, O_i(P_i)) of one view to the costs of all labels of a pixel. O_i is interpolated
    /// bilinearly as a complex number; of the share of the sample that lies outside the image or the hair,
    /// the cost is `absent` instead.
    fn add_view(sampler: &Sampler, own: (f32, f32), absent: f32, us: &[f32], vs: &[f32], costs: &mut [f32]) {
        let stride = sampler.width + 3;
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
            *cost += absent + (sample[0] * weights[0] + sample[1] * weights[1] + sample[2] * weights[2]);
        }
    }
}

/// e_d^(l) of Eq. 5 before aggregation. `own` is O_ref^(l) on the grid; views are sampled at the grid's level.
/// The reference's own term, -|O_ref|² at every depth, is left out: it changes no minimum.
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
    let state = || (vec![0.0f32; labels], vec![0.0f32; labels]);
    volume.fill(grid, monitor, state, |(us, vs), x, y, costs| {
        for (epipolar, sampler) in views {
            epipolar.project(grid.centre_px(x, y), scale, &inverse, us, vs);
            add_view(sampler, own[y * grid.width + x], absent, us, vs, costs);
        }
    })?;
    Ok(volume)
}

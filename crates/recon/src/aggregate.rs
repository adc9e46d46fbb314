//! Bilateral aggregation of costs and filtering of depth (Eq. 7, 8, 10).

use crate::grid::{Grid, Volume};
use crate::simd::simd_fn;
use crate::{Parameters, ReconError};
use rayon::prelude::*;
use strandbench_types::Monitor;

/// The weights of Eq. 7 on one level, over a square window of half-width ⌈window_sigmas σ_p⌉; hair pixels of
/// the grid alone take part.
#[derive(Clone, Debug)]
pub struct Bilateral<'a> {
    grid: &'a Grid,
    guide: &'a [(f32, f32)],
    radius: usize,
    /// -1 / (2 σ_d²).
    range: f32,
    /// -‖p - p'‖² / (2 σ_p²), indexed [dy + radius][dx + radius].
    proximity: Vec<f32>,
}

impl<'a> Bilateral<'a> {
    /// Weights guided by O_ref^(l) on the grid.
    pub fn new(grid: &'a Grid, guide: &'a [(f32, f32)], p: &Parameters) -> Bilateral<'a> {
        let radius = (p.window_sigmas * p.sigma_p_px).ceil() as usize;
        let r = radius as isize;
        let spread = -0.5 / (p.sigma_p_px * p.sigma_p_px);
        let proximity =
            (-r..=r).flat_map(|y| (-r..=r).map(move |x| (x * x + y * y) as f32 * spread)).collect();
        Bilateral { grid, guide, radius, range: -0.5 / (p.sigma_d * p.sigma_d), proximity }
    }

    /// Collects (pixel, weight / Z) of the window of pixel (x, y).
    pub fn window(&self, x: usize, y: usize, out: &mut Vec<(usize, f32)>) {
        out.clear();
        let (g, r) = (self.grid, self.radius);
        let (re, im) = self.guide[y * g.width + x];
        let (x0, x1) = (x.saturating_sub(r), (x + r + 1).min(g.width));
        let mut total = 0.0f32;
        for v in y.saturating_sub(r)..(y + r + 1).min(g.height) {
            let proximity = &self.proximity[(v + r - y) * (2 * r + 1)..];
            for u in x0..x1 {
                let i = v * g.width + u;
                if g.active[i] {
                    let (dr, di) = (self.guide[i].0 - re, self.guide[i].1 - im);
                    let w = libm::expf((dr * dr + di * di) * self.range + proximity[u + r - x]);
                    total += w;
                    out.push((i, w));
                }
            }
        }
        for (_, w) in out.iter_mut() {
            *w /= total;
        }
    }

    /// Eq. 8: costs averaged over each pixel's window.
    ///
    /// # Errors
    /// If cancelled.
    pub fn aggregate(&self, raw: &Volume, monitor: &dyn Monitor) -> Result<Volume, ReconError> {
        let mut volume = Volume::zeros(self.grid, raw.labels);
        volume.fill(self.grid, monitor, Vec::new, |taps, x, y, costs| {
            self.window(x, y, taps);
            weighted_sum(&raw.data, raw.labels, taps, costs);
        })?;
        Ok(volume)
    }

    /// Eq. 10: values averaged over each pixel's window; values of pixels without hair stay.
    ///
    /// # Errors
    /// If cancelled.
    pub fn smooth(&self, values: &[f32], monitor: &dyn Monitor) -> Result<Vec<f32>, ReconError> {
        let mut out = values.to_vec();
        out.par_chunks_mut(self.grid.width)
            .enumerate()
            .try_for_each(|(y, row)| {
                monitor.check()?;
                let mut taps = Vec::new();
                for (x, value) in row.iter_mut().enumerate() {
                    if self.grid.active[y * self.grid.width + x] {
                        self.window(x, y, &mut taps);
                        *value = taps.iter().map(|&(i, w)| w * values[i]).sum();
                    }
                }
                Ok(())
            })
            .map(|()| out)
    }
}

/// Labels whose sums are held in registers at a time.
const BLOCK: usize = 32;

simd_fn! {
    fn weighted_sum(data: &[f32], labels: usize, taps: &[(usize, f32)], out: &mut [f32]) {
        let mut first = 0;
        while first + BLOCK <= labels {
            let mut acc = [0.0f32; BLOCK];
            for &(pixel, w) in taps {
                let start = pixel * labels + first;
                let costs = &data[start..start + BLOCK];
                for k in 0..BLOCK {
                    acc[k] += w * costs[k];
                }
            }
            out[first..first + BLOCK].copy_from_slice(&acc);
            first += BLOCK;
        }
        for k in first..labels {
            out[k] = taps.iter().map(|&(pixel, w)| w * data[pixel * labels + k]).sum();
        }
    }
}

simd_fn! {
    /// out += scale · values.
    pub(crate) fn add_scaled(out: &mut [f32], values: &[f32], scale: f32) {
        for (o, v) in out.iter_mut().zip(values) {
            *o += scale * v;
        }
    }
}

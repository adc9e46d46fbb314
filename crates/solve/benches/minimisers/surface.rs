//! A labelling problem as stereo on hair makes them: a dome with wisps and a lock in front, seen through costs
//! that are ambiguous, noisy and, in places, blind.

use strandbench_rng::Rng;
use strandbench_solve::GridProblem;

/// Arrays of a [`GridProblem`] and the labels behind them.
pub struct Surface {
    /// Grid width.
    pub width: usize,
    /// Grid height.
    pub height: usize,
    /// Number of labels.
    pub labels: usize,
    /// Data costs, indexed [pixel * labels + label].
    pub unary: Vec<f32>,
    /// Weights of the edges to the right.
    pub weight_right: Vec<f32>,
    /// Weights of the edges down.
    pub weight_down: Vec<f32>,
    /// Pixels that take part.
    pub active: Vec<bool>,
    /// True label of each pixel.
    pub truth: Vec<f32>,
}

impl Surface {
    /// The problem that these arrays state.
    pub fn problem(&self) -> GridProblem<'_> {
        GridProblem {
            width: self.width,
            height: self.height,
            labels: self.labels,
            unary: &self.unary,
            weight_right: &self.weight_right,
            weight_down: &self.weight_down,
            active: &self.active,
        }
    }
}

/// Noise that is smooth over `cell` pixels, in [-1, 1].
fn smooth_noise(key: &[u64], cell: f32, x: f32, y: f32) -> f32 {
    let (u, v) = (x / cell, y / cell);
    let (iu, iv) = (u.floor(), v.floor());
    let fade = |t: f32| t * t * (3.0 - 2.0 * t);
    let (fu, fv) = (fade(u - iu), fade(v - iv));
    let at = |i: f32, j: f32| {
        let mut k = key.to_vec();
        k.extend([i as i64 as u64, j as i64 as u64]);
        Rng::keyed(&k).range(-1.0, 1.0)
    };
    let lerp = |a: f32, b: f32, t: f32| a + (b - a) * t;
    lerp(lerp(at(iu, iv), at(iu + 1.0, iv), fu), lerp(at(iu, iv + 1.0), at(iu + 1.0, iv + 1.0), fu), fv)
}

/// A problem with data costs of up to about `contrast` per pixel and smoothness weights of up to `lambda`, both
/// directions of an edge together; about 40 % of the pixels are active.
pub fn surface(width: usize, height: usize, labels: usize, contrast: f32, lambda: f32, seed: u64) -> Surface {
    let n = width * height;
    let (w, h) = (width as f32, height as f32);
    let scale = labels as f32 / 128.0;
    let pitch = w / 640.0;
    let angle = |x: f32, y: f32| {
        1.5 * smooth_noise(&[seed, 1], 80.0 * pitch, x, y) + 0.5 * smooth_noise(&[seed, 2], 6.0, x, y)
    };
    let mut out = Surface {
        width,
        height,
        labels,
        unary: vec![0.0; n * labels],
        weight_right: vec![0.0; n],
        weight_down: vec![0.0; n],
        active: vec![false; n],
        truth: vec![0.0; n],
    };
    for p in 0..n {
        let (x, y) = ((p % width) as f32, (p / width) as f32);
        let (dx, dy) = ((x - 0.5 * w) / (0.31 * w), (y - 0.5 * h) / (0.42 * h));
        let r2 = dx * dx + dy * dy;
        out.active[p] = r2 + 0.15 * smooth_noise(&[seed, 3], 25.0 * pitch, x, y) < 1.0;
        let dome = 100.0 - 70.0 * (1.0 - r2.min(1.0)).sqrt();
        let wisp = 3.0 * smooth_noise(&[seed, 4], 12.0 * pitch, x + 0.3 * y, 0.15 * y);
        let lock = if smooth_noise(&[seed, 5], 70.0 * pitch, x, 0.4 * y) > 0.25 { -12.0 } else { 0.0 };
        out.truth[p] = ((dome + wisp + lock) * scale).clamp(0.0, labels as f32 - 1.0);
        let gauss = |a: f32, b: f32| (-(a - b) * (a - b) / (2.0 * 0.25)).exp();
        let here = angle(x, y);
        out.weight_right[p] = lambda * gauss(here, angle(x + 1.0, y));
        out.weight_down[p] = lambda * gauss(here, angle(x, y + 1.0));
        if !out.active[p] {
            continue;
        }
        let blind = smooth_noise(&[seed, 6], 15.0 * pitch, x, y) > 0.45;
        let dip = if blind { 0.1 } else { 0.6 + 0.3 * smooth_noise(&[seed, 7], 5.0, x, y) };
        let waves: Vec<[f32; 3]> = (0..5u64)
            .map(|k| {
                let mut rng = Rng::keyed(&[seed, 8, k]);
                let period = rng.range(9.0, 40.0) * scale;
                let phase = 3.0 * smooth_noise(&[seed, 9, k], 7.0, x, y);
                [std::f32::consts::TAU / period, phase, 0.07 + 0.05 * smooth_noise(&[seed, 10, k], 9.0, x, y)]
            })
            .collect();
        let mut rng = Rng::keyed(&[seed, 11, p as u64]);
        for l in 0..labels {
            let off = (l as f32 - out.truth[p]) / scale;
            let mut c = 1.0 - dip * (-off * off / (2.0 * 9.0)).exp();
            for [k, phase, amplitude] in &waves {
                c += amplitude * (k * l as f32 + phase).sin();
            }
            out.unary[p * labels + l] = contrast * (c + rng.range(-0.05, 0.05)).max(0.0);
        }
    }
    out
}

//! From raw errors to rows.

use super::bands::{BANDS_HZ, Series, responses};
use super::flicker::Flicker;
use super::sheet::FrameFigures;
use crate::Score;
use crate::rows::{Asked, Rows};
use crate::stats::{percentile, sorted};

/// √6 √(8/π): mean length of the second difference of independent noise of standard deviation 1 in each of three
/// coordinates.
const NOISE: f64 = 2.449_489_742_783_178 * 1.595_769_121_605_731;

/// Raw errors of all frames, and how many were wanted.
#[derive(Default)]
pub(crate) struct Errors {
    values: Vec<f32>,
    wanted: u64,
    sum: f64,
}

impl Errors {
    pub fn add(&mut self, values: Vec<f64>, wanted: u64) {
        self.wanted += wanted.max(values.len() as u64);
        self.sum += values.iter().sum::<f64>();
        self.values.extend(values.iter().map(|&v| v as f32));
    }

    fn asked(&self) -> Asked {
        let answered = self.values.iter().filter(|v| v.is_finite()).count();
        Asked { wanted: self.wanted as usize, answered }
    }

    fn mean(&self) -> f64 {
        if self.values.is_empty() { f64::INFINITY } else { self.sum / self.values.len() as f64 }
    }

    fn percentile(&self, percent: usize) -> f64 {
        percentile(&sorted(self.values.iter().map(|&v| f64::from(v)).collect()), percent)
    }
}

#[derive(Default)]
pub(crate) struct Raw {
    pub jitter: Errors,
    pub flow: Errors,
    pub forth: Errors,
    pub back: Errors,
    /// Points of the first frame that should be followed.
    pub followed_wanted: u64,
}

pub(crate) struct Inputs<'a> {
    pub raw: Raw,
    pub followed: u64,
    pub by_frame: &'a [FrameFigures],
    pub flicker: &'a Flicker,
    pub paths: &'a [Series],
    pub rate_hz: f64,
    pub floor_mm: Option<f64>,
}

pub(crate) fn rows(i: Inputs) -> Vec<Score> {
    let mut rows = Rows::default();
    let mut push = |id: &str, v: f64, asked: Asked| rows.push("method", id, v, asked);
    let frames = i.by_frame.len();
    if frames >= 3 {
        let (j, asked) = (&i.raw.jitter, i.raw.jitter.asked());
        push("C1.jitter.mean", j.mean(), asked);
        push("C1.jitter.median", j.percentile(50), asked);
        push("C1.jitter.p95", j.percentile(95), asked);
        push("C1.acceleration", j.mean() * i.rate_hz * i.rate_hz, asked);
        push("C1.noise_sd", j.mean() / NOISE, asked);
    }
    if frames >= 2 {
        let (forth, back) = (i.raw.forth, i.raw.back);
        let (a, b) = (forth.asked(), back.asked());
        let asked = Asked { wanted: a.wanted + b.wanted, answered: a.answered + b.answered };
        let change = 0.5 * (forth.mean() + back.mean());
        push("C2.regrown.mean", change, asked);
        let both = Errors { values: [forth.values, back.values].concat(), ..Errors::default() };
        push("C2.regrown.median", both.percentile(50), asked);
        if let Some(floor) = i.floor_mm {
            push("C2.above_floor", change - floor, asked);
        }
        let flicker = i.flicker.figures();
        let asked = Asked { wanted: flicker.wanted as usize, answered: flicker.answered as usize };
        push("C3.flicker.p50", flicker.percentile(50), asked);
        push("C3.flicker.p95", flicker.percentile(95), asked);
    }
    let followed = Asked { wanted: i.raw.followed_wanted as usize, answered: i.followed as usize };
    if frames >= 2 {
        let at = |k: usize| i.by_frame[k].drift_mm.unwrap_or(f64::INFINITY);
        push("C4.drift.median", at(frames - 1), followed);
        push("C4.drift.rate", at(frames - 1) * i.rate_hz / (frames - 1) as f64, followed);
        let away = |k: &usize| i.by_frame[*k].moved_mm.unwrap_or(f64::INFINITY);
        let closes =
            (frames / 2..frames).min_by(|a, b| away(a).total_cmp(&away(b))).expect("two frames or more");
        push("C4.loop.median", at(closes), followed);
    }
    let depth = i.flicker.series();
    for (prefix, series) in [("C5.", i.paths), ("C5.depth.", &depth)] {
        let asked =
            Asked { wanted: followed.wanted.max(1), answered: series.len().min(followed.wanted.max(1)) };
        for ((_, band), response) in BANDS_HZ.iter().zip(responses(series, i.rate_hz)) {
            if let Some(r) = response {
                push(&format!("{prefix}log2_gain_{band}"), r.gain.log2(), asked);
                push(&format!("{prefix}lag_{band}"), r.lag_ms, asked);
            }
        }
    }
    if frames >= 2 {
        let (f, asked) = (&i.raw.flow, i.raw.flow.asked());
        push("C6.flow.mean", f.mean(), asked);
        push("C6.flow.median", f.percentile(50), asked);
        push("C6.flow.p90", f.percentile(90), asked);
    }
    for seconds in [1.0, 2.0] {
        let k = (seconds * i.rate_hz).round() as usize;
        if k > 0 && k < frames {
            let share = i.by_frame[k].survival.unwrap_or(0.0);
            push(&format!("C7.survival_{seconds}s"), share, followed);
        }
    }
    rows.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use strandbench_rng::Rng;

    #[test]
    fn noise_of_one_jitters_by_the_constant() {
        let normal = |k: u64| {
            let mut r = Rng::keyed(&[3, k]);
            let (a, b) = (1.0 - r.f64(), r.f64());
            (-2.0 * a.ln()).sqrt() * (std::f64::consts::TAU * b).cos()
        };
        let n = 40_000;
        let length = |i: u64| -> f64 {
            let c: [f64; 3] = std::array::from_fn(|k| {
                let o = k as u64;
                normal(9 * i + o) - 2.0 * normal(9 * i + 3 + o) + normal(9 * i + 6 + o)
            });
            (c[0] * c[0] + c[1] * c[1] + c[2] * c[2]).sqrt()
        };
        let mean = (0..n).map(length).sum::<f64>() / n as f64;
        // The length has a standard deviation of √6 · 0.673; five standard errors.
        assert!((mean - NOISE).abs() < 5.0 * 1.65 / (n as f64).sqrt(), "{mean}");
    }
}

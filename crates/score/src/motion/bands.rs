//! C5: how much of the true motion an estimate follows, and how late, band by band.

use rayon::prelude::*;
use std::f64::consts::{PI, SQRT_2};

/// Centres of the bands, Hz; each reaches from centre / √2 to centre · √2.
pub(crate) const BANDS_HZ: [(f64, &str); 4] = [(1.0, "1hz"), (2.0, "2hz"), (4.0, "4hz"), (8.0, "8hz")];

/// A band in which the true motion's root mean square is less than this has nothing to follow, mm.
const LEAST_MM: f64 = 0.05;

/// One coordinate over time: estimated and true, absent where either was.
pub(crate) type Series = Vec<Option<(f64, f64)>>;

/// What an estimate makes of the true motion in a band.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Response {
    pub gain: f64,
    pub lag_ms: f64,
}

/// Share of the whole motion's root mean square below which a band holds only what leaks into it.
const LEAST_SHARE: f64 = 0.01;

/// Absent frames between answered ones, on the line between them; before the first and after the last, held.
fn filled(s: &Series) -> Option<Vec<(f64, f64)>> {
    let answered: Vec<usize> = (0..s.len()).filter(|&t| s[t].is_some()).collect();
    let at = |t: usize| s[t].expect("answered");
    let (&first, &last) = (answered.first()?, answered.last()?);
    let mut out = vec![at(first); s.len()];
    out[last..].fill(at(last));
    for w in answered.windows(2) {
        let ((x0, y0), (x1, y1)) = (at(w[0]), at(w[1]));
        for (t, v) in out.iter_mut().enumerate().take(w[1]).skip(w[0]) {
            let u = (t - w[0]) as f64 / (w[1] - w[0]) as f64;
            *v = (x0 + u * (x1 - x0), y0 + u * (y1 - y0));
        }
    }
    Some(out)
}

/// Response in each band; `None` where there is no motion, or the sequence holds no whole period of it.
///
/// Both series lose their mean and are weighed by a Hann window. With their Fourier coefficients X and Y at the
/// multiples of 1 / duration in the band, summed over series, the cross spectrum is C = Σ X Y* and the power
/// S = Σ |Y|²; the gain is Σ |C| / Σ S over the band, and the lag is -arg(Σ C) over the mean angular frequency of
/// the true motion in the band, Σ Im(Y' Y*) / Σ S: a bin also holds what leaks into it from beside the band.
pub(crate) fn responses(series: &[Series], rate_hz: f64) -> [Option<Response>; 4] {
    let series: Vec<Vec<(f64, f64)>> = series.iter().filter_map(filled).collect();
    let frames = series.iter().map(Vec::len).max().unwrap_or(0);
    let whole = (series.iter().map(|s| variance(s)).sum::<f64>() / series.len().max(1) as f64).sqrt();
    BANDS_HZ.map(|(centre, _)| {
        let duration = frames as f64 / rate_hz;
        let first = (centre / SQRT_2 * duration).ceil().max(1.0) as usize;
        let last = (centre * SQRT_2 * duration).floor() as usize;
        if last > frames / 2 || first > last || series.is_empty() {
            return None;
        }
        let (mut magnitude, mut power, mut cross, mut weighted) = (0.0, 0.0, (0.0, 0.0), 0.0);
        for k in first..=last {
            let per_series: Vec<[f64; 4]> = series.par_iter().map(|s| bin(s, k, frames)).collect();
            let mut sum = [0.0; 4];
            per_series.iter().for_each(|b| (0..4).for_each(|i| sum[i] += b[i]));
            magnitude += f64::hypot(sum[0], sum[1]);
            power += sum[2];
            cross = (cross.0 + sum[0], cross.1 + sum[1]);
            weighted += sum[3];
        }
        // Under Hann's window a sine of amplitude A leaves (1 + 2/4) A²/4 on its bin and the two beside it.
        let rms = (2.0 * power / series.len() as f64).sqrt();
        if rms <= LEAST_MM.max(LEAST_SHARE * whole) {
            return None;
        }
        // Central differences see sin(ω Δt) / Δt.
        let omega = (weighted / power).clamp(-1.0, 1.0).asin() * rate_hz;
        Some(Response { gain: magnitude / power, lag_ms: -cross.1.atan2(cross.0) / omega * 1000.0 })
    })
}

fn variance(s: &[(f64, f64)]) -> f64 {
    let n = s.len() as f64;
    let mean = s.iter().map(|v| v.1).sum::<f64>() / n;
    s.iter().map(|v| (v.1 - mean).powi(2)).sum::<f64>() / n
}

/// Real and imaginary part of X Y*, |Y|², and the imaginary part of Y' Y* with Y' of half the difference between the
/// next and the last frame; at frequency k / duration, the window's sum being one.
fn bin(s: &[(f64, f64)], k: usize, frames: usize) -> [f64; 4] {
    let window = |t: usize| 0.5 - 0.5 * (2.0 * PI * (t as f64 + 0.5) / frames as f64).cos();
    let (mut sum, mut mean) = (0.0, (0.0, 0.0));
    for (t, v) in s.iter().enumerate() {
        let w = window(t);
        sum += w;
        mean = (mean.0 + w * v.0, mean.1 + w * v.1);
    }
    let (mx, my) = (mean.0 / sum, mean.1 / sum);
    let (mut x, mut y, mut d) = ((0.0, 0.0), (0.0, 0.0), (0.0, 0.0));
    for (t, v) in s.iter().enumerate() {
        let w = window(t) / sum;
        let (sin, cos) = (2.0 * PI * (k * t % frames) as f64 / frames as f64).sin_cos();
        let difference = 0.5 * (s[(t + 1).min(s.len() - 1)].1 - s[t.saturating_sub(1)].1);
        x = (x.0 + w * (v.0 - mx) * cos, x.1 - w * (v.0 - mx) * sin);
        y = (y.0 + w * (v.1 - my) * cos, y.1 - w * (v.1 - my) * sin);
        d = (d.0 + w * difference * cos, d.1 - w * difference * sin);
    }
    [x.0 * y.0 + x.1 * y.1, x.1 * y.0 - x.0 * y.1, y.0 * y.0 + y.1 * y.1, d.1 * y.0 - d.0 * y.1]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn motion(lag_s: f64, gain: f64, frames: usize) -> Vec<Series> {
        let y = |p: usize, t: f64| -> f64 {
            let f = [1.0, 2.0, 4.0, 8.0];
            f.iter().map(|f| 4.0 / f * (2.0 * PI * f * t + p as f64).sin()).sum::<f64>() + 3.0
        };
        (0..5)
            .map(|p| {
                let at = |t: usize| t as f64 / 100.0;
                (0..frames).map(|t| Some((gain * y(p, at(t) - lag_s) - 7.0, y(p, at(t))))).collect()
            })
            .collect()
    }

    #[test]
    fn lag_and_gain_are_what_was_put_in() {
        let all = responses(&motion(0.012, 0.8, 200), 100.0);
        for r in all {
            let r = r.unwrap();
            // Hann's side lobes at one octave or more fall below 1 % of the amplitude.
            assert!((r.lag_ms - 12.0).abs() < 0.3 && (r.gain - 0.8).abs() < 0.01, "{r:?} of {all:?}");
        }
        for r in responses(&motion(0.0, 1.0, 300), 100.0) {
            let r = r.unwrap();
            assert!(r.lag_ms.abs() < 1e-9 && (r.gain - 1.0).abs() < 1e-9, "{r:?}");
        }
    }

    #[test]
    fn no_motion_has_no_response_and_gaps_do_no_harm() {
        let still: Vec<Series> = vec![vec![Some((1.0, 2.0)); 200]; 3];
        assert_eq!(responses(&still, 100.0), [None; 4]);
        assert_eq!(responses(&[], 100.0), [None; 4]);
        assert_eq!(responses(&motion(0.0, 1.0, 50), 100.0)[0], None, "half a period of 1 Hz is none");
        let mut gaps = motion(0.01, 0.9, 200);
        for (p, s) in gaps.iter_mut().enumerate() {
            (0..200).filter(|t| (t * 7 + p) % 5 == 0).for_each(|t| s[t] = None);
        }
        let r = responses(&gaps, 100.0)[1].unwrap();
        assert!((r.lag_ms - 10.0).abs() < 1.0 && (r.gain - 0.9).abs() < 0.05, "{r:?}");
    }
}

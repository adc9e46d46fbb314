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
/// the true motion in the band, arg(Σ Y⁺ Y*) a frame, Y⁺ being Y of the series a frame later: a bin also holds what
/// leaks into it from beside the band.
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
        let (mut magnitude, mut power, mut cross, mut advance) = (0.0, 0.0, (0.0, 0.0), (0.0, 0.0));
        for k in first..=last {
            let per_series: Vec<[f64; 5]> = series.par_iter().map(|s| bin(s, k, frames)).collect();
            let mut sum = [0.0; 5];
            per_series.iter().for_each(|b| (0..5).for_each(|i| sum[i] += b[i]));
            magnitude += f64::hypot(sum[0], sum[1]);
            power += sum[2];
            cross = (cross.0 + sum[0], cross.1 + sum[1]);
            advance = (advance.0 + sum[3], advance.1 + sum[4]);
        }
        // Under Hann's window a sine of amplitude A leaves (1 + 2/4) A²/4 on its bin and the two beside it.
        let rms = (2.0 * power / series.len() as f64).sqrt();
        if rms <= LEAST_MM.max(LEAST_SHARE * whole) {
            return None;
        }
        let omega = advance.1.atan2(advance.0) * rate_hz;
        Some(Response { gain: magnitude / power, lag_ms: -cross.1.atan2(cross.0) / omega * 1000.0 })
    })
}

fn variance(s: &[(f64, f64)]) -> f64 {
    let n = s.len() as f64;
    let mean = s.iter().map(|v| v.1).sum::<f64>() / n;
    s.iter().map(|v| (v.1 - mean).powi(2)).sum::<f64>() / n
}

/// Real and imaginary part of X Y*, |Y|², and real and imaginary part of Y⁺ Y*, Y⁺ being Y of the series a frame later
/// (its last frame twice); at frequency k / duration, the window's sum being one.
fn bin(s: &[(f64, f64)], k: usize, frames: usize) -> [f64; 5] {
    let window = |t: usize| 0.5 - 0.5 * (2.0 * PI * (t as f64 + 0.5) / frames as f64).cos();
    let later = |t: usize| s[(t + 1).min(s.len() - 1)].1;
    let (mut sum, mut mean) = (0.0, (0.0, 0.0));
    for (t, v) in s.iter().enumerate() {
        let w = window(t);
        sum += w;
        mean = (mean.0 + w * v.0, mean.1 + w * v.1);
    }
    let (mx, my) = (mean.0 / sum, mean.1 / sum);
    let (mut x, mut y, mut l) = ((0.0, 0.0), (0.0, 0.0), (0.0, 0.0));
    for (t, v) in s.iter().enumerate() {
        let w = window(t) / sum;
        let (sin, cos) = (2.0 * PI * (k * t % frames) as f64 / frames as f64).sin_cos();
        let turned = |value: f64| (w * value * cos, -w * value * sin);
        for (total, part) in
            [(&mut x, turned(v.0 - mx)), (&mut y, turned(v.1 - my)), (&mut l, turned(later(t) - my))]
        {
            *total = (total.0 + part.0, total.1 + part.1);
        }
    }
    let product = |a: (f64, f64)| [a.0 * y.0 + a.1 * y.1, a.1 * y.0 - a.0 * y.1];
    let ([cross_re, cross_im], [later_re, later_im]) = (product(x), product(l));
    [cross_re, cross_im, y.0 * y.0 + y.1 * y.1, later_re, later_im]
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
    fn lag_is_right_up_to_half_the_frame_rate() {
        // 24 frames a second: 8 Hz turns by two thirds of half a turn from frame to frame.
        let at = |t: usize, late: f64| (2.0 * PI * 8.0 * (t as f64 / 24.0 - late)).sin();
        let s: Series = (0..96).map(|t| Some((at(t, 0.01), at(t, 0.0)))).collect();
        let r = responses(&[s], 24.0)[3].unwrap();
        // A whole number of periods: nothing leaks but from the repeated last frame, which the window leaves a
        // thousandth of.
        assert!((r.lag_ms - 10.0).abs() < 0.01, "{r:?}");
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

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

/// Response in each band; `None` where there is no motion, or the sequence holds no whole period of it.
///
/// Both series lose their mean and are weighed by a Hann window. With their Fourier coefficients X and Y at the
/// multiples of 1 / duration in the band, summed over series, the cross spectrum is C = Σ X Y* and the power
/// S = Σ |Y|²; the gain is Σ |C| / Σ S over the band, and the lag is -arg(Σ C) over the mean angular frequency,
/// frequencies weighing S.
pub(crate) fn responses(series: &[Series], rate_hz: f64) -> [Option<Response>; 4] {
    let frames = series.iter().map(Vec::len).max().unwrap_or(0);
    BANDS_HZ.map(|(centre, _)| {
        let duration = frames as f64 / rate_hz;
        let first = (centre / SQRT_2 * duration).ceil().max(1.0) as usize;
        let last = (centre * SQRT_2 * duration).floor() as usize;
        if last > frames / 2 || first > last || series.is_empty() {
            return None;
        }
        let (mut magnitude, mut power, mut cross, mut weighted) = (0.0, 0.0, (0.0, 0.0), 0.0);
        for k in first..=last {
            let per_series: Vec<(f64, f64, f64)> = series.par_iter().map(|s| bin(s, k, frames)).collect();
            let sum = per_series.iter().fold((0.0, 0.0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1, a.2 + b.2));
            magnitude += f64::hypot(sum.0, sum.1);
            power += sum.2;
            cross = (cross.0 + sum.0, cross.1 + sum.1);
            weighted += sum.2 * 2.0 * PI * k as f64 / duration;
        }
        // Power of a sine of amplitude A is A²/4 of the squared sum of the window's weights.
        let rms = (2.0 * power / series.len() as f64).sqrt();
        if !(rms > LEAST_MM) {
            return None;
        }
        let omega = weighted / power;
        Some(Response { gain: magnitude / power, lag_ms: -cross.1.atan2(cross.0) / omega * 1000.0 })
    })
}

/// Real and imaginary part of X Y*, and |Y|², at frequency k / duration, both scaled by the window's sum.
fn bin(s: &Series, k: usize, frames: usize) -> (f64, f64, f64) {
    let window = |t: usize| 0.5 - 0.5 * (2.0 * PI * (t as f64 + 0.5) / frames as f64).cos();
    let (mut sum, mut mean) = (0.0, (0.0, 0.0));
    for (t, v) in s.iter().enumerate() {
        if let Some((x, y)) = v {
            let w = window(t);
            sum += w;
            mean = (mean.0 + w * x, mean.1 + w * y);
        }
    }
    if sum == 0.0 {
        return (0.0, 0.0, 0.0);
    }
    let (mx, my) = (mean.0 / sum, mean.1 / sum);
    let (mut x, mut y) = ((0.0, 0.0), (0.0, 0.0));
    for (t, v) in s.iter().enumerate() {
        if let Some((a, b)) = v {
            let w = window(t) / sum;
            let (sin, cos) = (2.0 * PI * (k * t % frames) as f64 / frames as f64).sin_cos();
            x = (x.0 + w * (a - mx) * cos, x.1 - w * (a - mx) * sin);
            y = (y.0 + w * (b - my) * cos, y.1 - w * (b - my) * sin);
        }
    }
    (x.0 * y.0 + x.1 * y.1, x.1 * y.0 - x.0 * y.1, y.0 * y.0 + y.1 * y.1)
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
        for r in responses(&motion(0.012, 0.8, 200), 100.0) {
            let r = r.unwrap();
            // Hann's side lobes at one octave or more fall below 1 % of the amplitude.
            assert!((r.lag_ms - 12.0).abs() < 0.3 && (r.gain - 0.8).abs() < 0.01, "{r:?}");
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

//! Special functions in f32 that give the same bits on every machine: what sampling a lobe needs.

use std::f32::consts::{FRAC_2_PI, LN_2, SQRT_2};

/// Sine and cosine of x in radians, absolute error below 2e-7 for |x| < 100.
#[inline(always)]
pub fn sin_cos(x: f32) -> (f32, f32) {
    const MAGIC: f32 = 12_582_912.0;
    let k = (x * FRAC_2_PI + MAGIC) - MAGIC;
    // π/2 in three parts, the first two with trailing zeros, so that k times them is exact.
    let r = ((x - k * 1.570_312_5) - k * 4.837_513e-4) - k * 7.549_79e-8;
    let r2 = r * r;
    let s = r * (1.0 + r2 * (-1.0 / 6.0 + r2 * (1.0 / 120.0 + r2 * (-1.0 / 5040.0 + r2 / 362_880.0))));
    let c = 1.0 + r2 * (-0.5 + r2 * (1.0 / 24.0 + r2 * (-1.0 / 720.0 + r2 / 40_320.0)));
    match (k as i32) & 3 {
        0 => (s, c),
        1 => (c, -s),
        2 => (-s, -c),
        _ => (-c, s),
    }
}

/// Natural logarithm of a positive normal number, error below 2e-7 (absolute near 1, else relative).
#[inline(always)]
pub fn ln(x: f32) -> f32 {
    let bits = x.to_bits();
    let mut exponent = (bits >> 23) as i32 - 127;
    let mut m = f32::from_bits((bits & 0x7f_ffff) | 0x3f80_0000);
    if m > SQRT_2 {
        m *= 0.5;
        exponent += 1;
    }
    let t = (m - 1.0) / (m + 1.0);
    let t2 = t * t;
    let series = 2.0 * t * (1.0 + t2 * (1.0 / 3.0 + t2 * (0.2 + t2 * (1.0 / 7.0 + t2 / 9.0))));
    exponent as f32 * LN_2 + series
}

/// The angle whose sine and cosine are given (cosine not negative), accurate next to ±π/2 too.
#[inline(always)]
pub fn inclination(sin: f32, cos: f32) -> f32 {
    if sin.abs() < cos {
        crate::math::asin(sin)
    } else {
        (std::f32::consts::FRAC_PI_2 - crate::math::asin(cos)).copysign(sin)
    }
}

/// The angle in [-π, π] of a unit vector (x, y), accurate everywhere.
#[inline(always)]
pub fn azimuth(x: f32, y: f32) -> f32 {
    let a = crate::math::asin(if y.abs() < x.abs() { y } else { x });
    if y.abs() >= x.abs() {
        (std::f32::consts::FRAC_PI_2 - a).copysign(y)
    } else if x > 0.0 {
        a
    } else {
        std::f32::consts::PI.copysign(y) - a
    }
}

/// Standard normal deviate below which the probability is `p` in (0, 1): Wichura 1988, algorithm AS 241
/// (PPND7), about seven figures.
#[inline]
pub fn probit(p: f32) -> f32 {
    let q = p - 0.5;
    if q.abs() <= 0.425 {
        let r = 0.180_625 - q * q;
        return q * (((59.109_375 * r + 159.291_13) * r + 50.434_27) * r + 3.387_133)
            / (((67.187_56 * r + 78.757_76) * r + 17.895_17) * r + 1.0);
    }
    let r = (-ln(p.min(1.0 - p).max(f32::MIN_POSITIVE))).sqrt();
    let z = if r <= 5.0 {
        let r = r - 1.6;
        (((0.170_238_21 * r + 1.306_728_5) * r + 2.756_815_4) * r + 1.423_437_3)
            / ((0.120_211_33 * r + 0.737_001_64) * r + 1.0)
    } else {
        let r = r - 5.0;
        (((0.017_337_203 * r + 0.428_682_94) * r + 3.081_226_4) * r + 6.657_905)
            / ((0.012_258_203 * r + 0.241_978_95) * r + 1.0)
    };
    z.copysign(q)
}

/// Probability that a standard normal deviate lies below `z`, relative error below 2e-7 + 1e-7 z² where `z` is
/// negative: exp(-z²/2) times a polynomial in 1 / (1 + 0.3 |z|), fitted to it over |z| < 14 by least squares
/// reweighted towards the smallest greatest relative error (1.5e-7).
#[inline]
pub fn normal_below(z: f32) -> f32 {
    const C: [f32; 8] = [
        0.119_629_29,
        0.120_754_02,
        0.099_913_076,
        0.128_563_14,
        -0.053_686_75,
        0.206_357_15,
        -0.157_205_34,
        0.035_675_348,
    ];
    let t = 1.0 / (1.0 + 0.3 * z.abs());
    let tail = crate::math::exp(-0.5 * z * z) * t * C.iter().rev().fold(0.0, |p, &c| p * t + c);
    if z < 0.0 { tail } else { 1.0 - tail }
}

/// e^-x I_0(x) for x >= 0, relative error below 1e-6 (Abramowitz and Stegun 9.8.1 and 9.8.2).
#[inline]
pub fn bessel_i0_scaled(x: f32) -> f32 {
    const SMALL: [f32; 7] =
        [1.0, 3.515_622_9, 3.089_942_4, 1.206_749_2, 0.265_973_2, 0.036_076_8, 0.004_581_3];
    const LARGE: [f32; 9] = [
        0.398_942_3,
        0.013_285_92,
        0.002_253_19,
        -0.001_575_65,
        0.009_162_81,
        -0.020_577_06,
        0.026_355_37,
        -0.016_476_33,
        0.003_923_77,
    ];
    if x < 3.75 {
        let t = (x / 3.75) * (x / 3.75);
        SMALL.iter().rev().fold(0.0, |p, &c| p * t + c) * crate::math::exp(-x)
    } else {
        let t = 3.75 / x;
        LARGE.iter().rev().fold(0.0, |p, &c| p * t + c) / x.sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sine_cosine_logarithm_and_inclination_keep_their_stated_errors() {
        for i in -100_000..=100_000 {
            let x = i as f32 * 1e-3 + 1.7e-4;
            let (s, c) = sin_cos(x);
            let (ws, wc) = f64::from(x).sin_cos();
            assert!((f64::from(s) - ws).abs() < 2e-7 && (f64::from(c) - wc).abs() < 2e-7, "{x}: {s} {c}");
        }
        for i in 1..200_000 {
            let x = if i % 2 == 0 { i as f32 * 1e-5 } else { (i as f32 * 4e-4 - 40.0).exp() };
            let want = f64::from(x).ln();
            assert!((f64::from(ln(x)) - want).abs() < 2e-7 * want.abs().max(1.0), "ln {x}");
        }
        for i in -9999..=9999 {
            let a = std::f64::consts::FRAC_PI_2 * f64::from(i) / 1e4;
            let got = inclination(a.sin() as f32, a.cos() as f32);
            assert!((f64::from(got) - a).abs() < 7e-7, "{a}: {got}");
        }
    }

    #[test]
    fn probit_inverts_the_error_function_down_to_the_far_tail() {
        for i in 0..=1880 {
            let z = f64::from(i) * 0.01 - 12.8;
            let p = 0.5 * libm::erfc(-z / 2f64.sqrt());
            let near = normal_below(z as f32);
            // z itself is rounded: half a last bit times z, and again in z².
            assert!((f64::from(near) - p).abs() <= (4e-7 + 3e-7 * z * z) * p, "{z}: {near} {p}");
            if z < 4.0 {
                // dz = dp / density; p carries a relative error of 6e-8, and 1 - p an absolute one.
                let density = (-0.5 * z * z).exp() / (2.0 * std::f64::consts::PI).sqrt();
                let slack = 2e-6 * z.abs().max(1.0) + 1.2e-7 * p / density;
                let got = f64::from(probit(p as f32));
                assert!((got - z).abs() < slack, "{z}: {got}, slack {slack}");
            }
        }
    }

    #[test]
    fn bessel_function_agrees_with_its_series_and_its_integral() {
        for i in 0..400 {
            let x = f64::from(i) * f64::from(i) * 0.01;
            // I_0(x) e^-x = 1/π ∫ exp(x (cos t - 1)) dt over [0, π]: the midpoint rule converges spectrally.
            let n = 4000;
            let want: f64 = (0..n)
                .map(|k| {
                    let t = std::f64::consts::PI * (f64::from(k) + 0.5) / f64::from(n);
                    (-2.0 * x * (0.5 * t).sin().powi(2)).exp()
                })
                .sum::<f64>()
                / f64::from(n);
            let got = f64::from(bessel_i0_scaled(x as f32));
            assert!((got - want).abs() < 1e-6 * want, "x {x}: {got}, {want}");
        }
    }
}

//! Longitudinal lobe M_p of d'Eon et al. 2011.

use crate::math::exp;
use crate::special::{bessel_i0_scaled, ln, sin_cos};
use std::f32::consts::PI;

/// How the modified Bessel function I_0 of M_p is computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Bessel {
    /// To float accuracy.
    #[default]
    Exact,
    /// As Mitsuba 3.9.1 does, to compare with it: eleven terms of the power series up to 12 (up to 0.6 % low
    /// there), and beyond, the leading asymptotic term times exp(1/16x), where exp(1/8x) would be right.
    Mitsuba,
}

/// M_p at one variance v: a von Mises-Fisher lobe about the mirror direction, averaged over azimuth;
/// ∫ M cos θ_i dθ_i = 1.
#[derive(Clone, Copy, Debug)]
pub struct Longitudinal {
    v: f32,
    inverse: f32,
    /// 1 / (v (1 - e^(-2/v))).
    norm: f32,
    /// e^(-2/v).
    far: f32,
    bessel: Bessel,
}

impl Longitudinal {
    /// Variance `v` > 0.
    pub(super) fn new(v: f64, bessel: Bessel) -> Longitudinal {
        let far = libm::exp(-2.0 / v);
        Longitudinal {
            v: v as f32,
            inverse: (1.0 / v) as f32,
            norm: (1.0 / (v * (1.0 - far))) as f32,
            far: far as f32,
            bessel,
        }
    }

    /// M at the light's (sin θ_i, cos θ_i) for the camera's (sin θ_o, cos θ_o), per unit of sin θ_i.
    ///
    /// The printed exp(-sin sin / v) I_0(cos cos / v) / (2 v sinh(1/v)) is written with e^-x I_0(x), which
    /// leaves the exponent (cos(θ_i + θ_o) - 1) / v: no large numbers to subtract however narrow the lobe.
    #[inline(always)]
    pub fn value(&self, (sin_i, cos_i): (f32, f32), (sin_o, cos_o): (f32, f32)) -> f32 {
        let (a, b) = (cos_i - cos_o, sin_i + sin_o);
        let decay = exp(-0.5 * (a * a + b * b) * self.inverse);
        if decay == 0.0 {
            return 0.0;
        }
        let x = cos_i * cos_o * self.inverse;
        let bessel = match self.bessel {
            Bessel::Exact => bessel_i0_scaled(x),
            Bessel::Mitsuba => self.mitsuba(x),
        };
        bessel * decay * self.norm
    }

    fn mitsuba(&self, x: f32) -> f32 {
        let narrow = self.inverse > 10.0;
        // Its logarithm of 2 has four digits: 4.7e-5 too small.
        let two = if narrow { exp(-4.718_06e-5) } else { 1.0 };
        if narrow && x > 12.0 {
            return two * exp(1.0 / (16.0 * x)) / (2.0 * PI * x).sqrt();
        }
        let q = 0.25 * x * x;
        let (mut term, mut sum) = (1.0, 1.0);
        for i in 1..=10 {
            term *= q / (i * i) as f32;
            sum += term;
        }
        two * sum * exp(-x)
    }

    /// sin θ_i with density M, from two numbers in [0, 1) (d'Eon et al. 2013).
    #[inline(always)]
    pub fn sample(&self, (sin_o, cos_o): (f32, f32), u: f32, v: f32) -> f32 {
        // Half of the last bit keeps the logarithm finite.
        let u = u + 2.980_232_2e-8;
        // 1 - cos of the angle to the mirror direction.
        let q = (-self.v * ln((u + (1.0 - u) * self.far).max(f32::MIN_POSITIVE))).clamp(0.0, 2.0);
        let sin = (q * (2.0 - q)).max(0.0).sqrt();
        let cos_phi = sin_cos(2.0 * PI * v).1;
        ((q - 1.0) * sin_o + sin * cos_phi * cos_o).clamp(-1.0, 1.0)
    }
}

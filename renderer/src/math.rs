//! Elementary functions in f32 that give the same bits on every machine, and fast.

use std::f32::consts::{FRAC_PI_2, LOG2_E};

/// e^x for x <= 0 (and small positive x), relative error below 4e-7; 0 below -87.
#[inline(always)]
pub fn exp(x: f32) -> f32 {
    if x < -87.0 {
        return 0.0;
    }
    let y = (x * LOG2_E).min(126.0);
    let whole = (y + 12_582_912.0) - 12_582_912.0;
    // Split ln 2 so that the remainder keeps its low bits.
    let f = x - whole * 0.693_359_4 + whole * 2.121_944_4e-4;
    let p = 1.0
        + f * (1.0
            + f * (0.5 + f * (0.166_666_67 + f * (0.041_666_67 + f * (0.008_333_334 + f * 0.001_388_889)))));
    p * f32::from_bits(((whole as i32 + 127) as u32) << 23)
}

/// arccos of x clamped to [-1, 1], absolute error below 5e-7 rad (Abramowitz and Stegun 4.4.46).
#[inline(always)]
pub fn acos(x: f32) -> f32 {
    let a = x.abs().min(1.0);
    const C: [f32; 8] = [
        FRAC_PI_2,
        -0.214_598_8,
        0.088_978_99,
        -0.050_174_303,
        0.030_891_88,
        -0.017_088_126,
        0.006_670_09,
        -0.001_262_491_1,
    ];
    let p = C.iter().rev().fold(0.0, |p, &c| p * a + c);
    let r = (1.0 - a).sqrt() * p;
    if x < 0.0 { std::f32::consts::PI - r } else { r }
}

/// arcsin of x clamped to [-1, 1], absolute error below 5e-7 rad.
#[inline(always)]
pub fn asin(x: f32) -> f32 {
    FRAC_PI_2 - acos(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agree_with_f64_within_the_stated_errors() {
        for i in 0..200_001 {
            let x = i as f32 / 100_000.0 - 1.0;
            assert!((f64::from(acos(x)) - f64::from(x).acos()).abs() < 5e-7, "acos {x}");
            assert!((f64::from(asin(x)) - f64::from(x).asin()).abs() < 5e-7, "asin {x}");
            let e = -87.0 * i as f32 / 200_000.0;
            let want = f64::from(e).exp();
            assert!((f64::from(exp(e)) - want).abs() <= 4e-7 * want, "exp {e}");
        }
        assert_eq!(exp(-100.0), 0.0);
        assert_eq!(acos(1.5), 0.0);
    }
}

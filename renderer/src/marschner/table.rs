//! The azimuthal terms tabulated over (θ_d, φ), so that shading costs one bilinear look-up.

use super::azimuth::{Caustic, CrossSection, Part, Roots};
use rayon::prelude::*;
use std::f64::consts::PI;

/// Steps over φ in [0, π].
pub(super) const PHI_STEPS: usize = 192;
/// Steps over θ_d in [0, π/2].
pub(super) const THETA_STEPS: usize = 128;
/// Index slices of an elliptical fibre.
const ECCENTRIC_SLICES: usize = 9;

/// N_R, N_TT and N_TRT at one (θ_d, φ), absorption kept apart: TT is `weight · exp(-σ length)`, exact for its
/// single path; TRT, the sum of up to three paths and the smoothed caustic, is
/// `weight · exp(-σ mean + σ² variance / 2)`, the second-order expansion of that sum in σ.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct Azimuthal {
    /// N_R.
    pub r: f32,
    /// N_TT without absorption.
    pub tt: f32,
    /// TT's path length, fibre radii.
    pub tt_length: f32,
    /// N_TRT without absorption.
    pub trt: f32,
    /// Mean path length of TRT, fibre radii.
    pub trt_length: f32,
    /// Variance of TRT's path length.
    pub trt_variance: f32,
}

impl Azimuthal {
    /// The terms by direct evaluation in f64; `eta_trt` is the index that TRT sees (η* of an elliptical fibre).
    pub fn direct(
        eta: f64,
        eta_trt: f64,
        cos_theta_d: f64,
        phi: f64,
        caustic: &Caustic,
        roots: Roots,
    ) -> Azimuthal {
        let section = CrossSection::new(eta, cos_theta_d, roots);
        let total = |parts: &[Part]| parts.iter().map(|p| p.weight).sum::<f64>();
        let r = total(&section.parts(0, phi));
        let tt = section.parts(1, phi);
        let trt = CrossSection::new(eta_trt, cos_theta_d, roots).smoothed_trt(phi, caustic);
        let trt_weight = total(&trt);
        let (mut mean, mut variance) = (0.0, 0.0);
        if trt_weight > 0.0 {
            mean = trt.iter().map(|p| p.weight * p.length).sum::<f64>() / trt_weight;
            variance = trt.iter().map(|p| p.weight * (p.length - mean).powi(2)).sum::<f64>() / trt_weight;
        }
        // Outside TT's range the length of its last ray (γ_i = π/2) keeps the interpolation smooth.
        let graze = section.grazing_length();
        Azimuthal {
            r: r as f32,
            tt: total(&tt) as f32,
            tt_length: tt.first().map_or(graze, |p| p.length) as f32,
            trt: trt_weight as f32,
            trt_length: mean as f32,
            trt_variance: variance as f32,
        }
    }

    fn mix(a: &Azimuthal, b: &Azimuthal, t: f32) -> Azimuthal {
        let m = |x: f32, y: f32| x + (y - x) * t;
        Azimuthal {
            r: m(a.r, b.r),
            tt: m(a.tt, b.tt),
            tt_length: m(a.tt_length, b.tt_length),
            trt: m(a.trt, b.trt),
            trt_length: m(a.trt_length, b.trt_length),
            trt_variance: m(a.trt_variance, b.trt_variance),
        }
    }
}

/// The tabulated terms of one fibre type.
#[derive(Clone, Debug)]
pub struct Table {
    /// Indexed [slice][θ_d][φ].
    cells: Vec<Azimuthal>,
    eta_low: f32,
    eta_high: f32,
    slices: usize,
}

impl Table {
    /// Index of refraction `eta`, eccentricity `a` (1 is round), caustic parameters and the way of finding roots.
    pub fn new(eta: f64, a: f64, caustic: &Caustic, roots: Roots) -> Table {
        let (eta_1, eta_2) = eccentric_indices(eta, a);
        let (low, high) = (eta_1.min(eta_2), eta_1.max(eta_2));
        let slices = if high - low < 1e-9 { 1 } else { ECCENTRIC_SLICES };
        let rows = slices * (THETA_STEPS + 1);
        let cells = (0..rows)
            .into_par_iter()
            .flat_map_iter(|row| {
                let (slice, j) = (row / (THETA_STEPS + 1), row % (THETA_STEPS + 1));
                let eta_trt =
                    if slices == 1 { eta } else { low + (high - low) * slice as f64 / (slices - 1) as f64 };
                // At θ_d = 90° every path is closed; the last row stands just before it.
                let theta = (0.5 * PI * j as f64 / THETA_STEPS as f64).min(0.5 * PI - 1e-3);
                (0..=PHI_STEPS).map(move |i| {
                    // Just off the ends, where derivatives vanish by symmetry.
                    let phi = (PI * i as f64 / PHI_STEPS as f64).clamp(1e-6, PI - 1e-6);
                    Azimuthal::direct(eta, eta_trt, theta.cos(), phi, caustic, roots)
                })
            })
            .collect();
        Table { cells, eta_low: low as f32, eta_high: high as f32, slices }
    }

    /// Bilinear look-up at difference angle `theta_d` in [0, π/2] and azimuth `phi` in [0, π]; `eta_star` is
    /// the index that TRT sees, ignored for a round fibre.
    #[inline]
    pub fn lookup(&self, theta_d: f32, phi: f32, eta_star: f32) -> Azimuthal {
        if self.slices == 1 {
            return self.slice(0, theta_d, phi);
        }
        let x = (eta_star - self.eta_low) / (self.eta_high - self.eta_low) * (self.slices - 1) as f32;
        let k = (x.max(0.0) as usize).min(self.slices - 2);
        Azimuthal::mix(
            &self.slice(k, theta_d, phi),
            &self.slice(k + 1, theta_d, phi),
            (x - k as f32).clamp(0.0, 1.0),
        )
    }

    /// Index slices: 1 for a round fibre.
    pub(super) fn slices(&self) -> usize {
        self.slices
    }

    /// The entry at a node, indexed [slice][θ_d][φ].
    pub(super) fn cell(&self, slice: usize, j: usize, i: usize) -> &Azimuthal {
        &self.cells[(slice * (THETA_STEPS + 1) + j) * (PHI_STEPS + 1) + i]
    }

    #[inline]
    fn slice(&self, slice: usize, theta_d: f32, phi: f32) -> Azimuthal {
        let ((j, ty), (i, tx)) = (row(theta_d), column(phi));
        let at = (slice * (THETA_STEPS + 1) + j) * (PHI_STEPS + 1) + i;
        let c = &self.cells[at..at + PHI_STEPS + 3];
        let top = Azimuthal::mix(&c[0], &c[1], tx);
        let bottom = Azimuthal::mix(&c[PHI_STEPS + 1], &c[PHI_STEPS + 2], tx);
        Azimuthal::mix(&top, &bottom, ty)
    }
}

/// Row and place between it and the next of a difference angle in [0, π/2].
#[inline]
pub(super) fn row(theta_d: f32) -> (usize, f32) {
    place(theta_d * (THETA_STEPS as f32 / std::f32::consts::FRAC_PI_2), THETA_STEPS)
}

/// Column and place between it and the next of an azimuth in [0, π].
#[inline]
pub(super) fn column(phi: f32) -> (usize, f32) {
    place(phi * (PHI_STEPS as f32 / std::f32::consts::PI), PHI_STEPS)
}

#[inline]
fn place(x: f32, steps: usize) -> (usize, f32) {
    let i = (x.max(0.0) as usize).min(steps - 1);
    (i, (x - i as f32).clamp(0.0, 1.0))
}

/// The two indices between which η* of an elliptical fibre swings with the half angle φ_h
/// (Marschner et al. 2003, section 5): η*_1 = 2(η-1)a² - η + 2, η*_2 = 2(η-1)/a² - η + 2.
pub fn eccentric_indices(eta: f64, a: f64) -> (f64, f64) {
    (2.0 * (eta - 1.0) * a * a - eta + 2.0, 2.0 * (eta - 1.0) / (a * a) - eta + 2.0)
}

//! The fibre scattering model of Marschner et al. 2003: R, TT and TRT as published, with two corrections.
//!
//! The printed longitudinal Gaussian is normalised over the half angle θ_h, although the outgoing angle spans
//! twice as much: a fibre without absorption would return about twice the light that it gets. It is halved
//! here. The printed path length is replaced by 2 cos γ_t / cos θ_t a crossing, in fibre radii, which is the
//! way that the refracted ray travels. The model is far-field: averaged across the fibre's width.
//!
//! # Energy
//! The published model lacks the paths of more than one inner reflection; `rest` in the optics adds them as a
//! fourth lobe. Share of light in each azimuthal lobe, index 1.55, middle values of Table 1 (the example
//! `fibre` prints this):
//!
//! | θ_d | R | TT | TRT of a cylinder | TRT smoothed | lacking without rest | rest | lacking with rest |
//! |---|---|---|---|---|---|---|---|
//! | 0° | 0.075 | 0.862 | 0.056 | 0.059 | 0.005 | 0.008 | -0.003 |
//! | 30° | 0.086 | 0.843 | 0.061 | 0.054 | 0.017 | 0.010 | 0.007 |
//! | 60° | 0.174 | 0.697 | 0.102 | 0.102 | 0.027 | 0.027 | 0.000 |
//! | 75° | 0.360 | 0.425 | 0.137 | 0.137 | 0.078 | 0.078 | 0.000 |
//! | 85° | 0.688 | 0.104 | 0.068 | 0.068 | 0.141 | 0.141 | 0.000 |
//!
//! What is left is the caustic's replacement, which does not keep TRT's energy where there is a caustic (θ_d
//! below some 50°). The light returned in all differs more, since the far-field form has cos²θ_i / cos²θ_d in
//! it, and shifted lobes reach θ_i where that is not 1; a camera at θ_r gets back from a white furnace
//!
//! | θ_r | Table 1 | with rest | no shift, β_R 1° | with rest |
//! |---|---|---|---|---|
//! | -60° | 0.695 | 0.702 | 0.971 | 0.998 |
//! | -30° | 0.869 | 0.874 | 0.983 | 0.992 |
//! | 0° | 0.951 | 0.956 | 0.995 | 1.003 |
//! | 30° | 1.009 | 1.016 | 0.983 | 0.992 |
//! | 60° | 1.042 | 1.059 | 0.971 | 0.998 |
//! | 80° | 0.939 | 1.003 | 0.874 | 0.979 |
//!
//! S is reciprocal all the same, shifted, elliptical or not: it depends on θ_h, |θ_d|, |φ| and φ_i + φ_r alone.

mod azimuth;
mod fresnel;
mod rest;
mod sampling;
mod table;
mod toward;

pub use azimuth::{Caustic, CrossSection, Part, Roots};
pub use fresnel::{bravais, reflectance};
pub use table::{Azimuthal, Table, eccentric_indices};
pub use toward::Toward;

use crate::math::{acos, asin, exp};
use rest::Rest;
use sampling::Sampler;
use strandbench_scenes::FibreOptics;

/// Directions of light and camera relative to a fibre. The tangent points from root to tip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Angles {
    /// Sine of the light's inclination θ_i: towards the light · tangent.
    pub sin_i: f32,
    /// Sine of the camera's inclination θ_r.
    pub sin_r: f32,
    /// Cosine of the azimuth between light and camera, φ.
    pub cos_phi: f32,
    /// Cosine of twice the half azimuth φ_h from the ellipse's axis; matters to elliptical fibres alone.
    pub cos_2phi_h: f32,
}

/// R, TT, TRT and the rest.
pub const LOBES: usize = 4;

/// Least share of the mean path length that the expansion of absorption may fall to.
const EXPANSION: f64 = 0.75;

/// A fibre type ready for shading.
#[derive(Clone, Debug)]
pub struct Fibre {
    table: Table,
    rest: Option<Rest>,
    sampler: Sampler,
    /// Longitudinal shifts, radians, indexed [lobe] as all that follow.
    shifts: [f32; LOBES],
    /// Longitudinal widths β, radians.
    widths: [f32; LOBES],
    /// 1 / β.
    inverse_widths: [f32; LOBES],
    /// 1 / (2 β²).
    sharpness: [f32; LOBES],
    /// ½ / (β sqrt(2π)).
    peaks: [f32; LOBES],
    /// Shortest way through the fibre that absorption counts, fibre radii.
    shortest: [f32; LOBES],
    eta_mean: f32,
    eta_swing: f32,
}

/// The model's factors at one pair of directions, indexed [lobe].
#[derive(Clone, Copy, Debug)]
struct Parts {
    /// M_p.
    m: [f32; LOBES],
    /// N_p without absorption.
    n: [f32; LOBES],
    /// Mean path length, fibre radii.
    length: [f32; LOBES],
    /// Variance of the path length.
    variance: [f32; LOBES],
}

impl Parts {
    /// Share of the light that absorption leaves to a lobe. Many lobes vanish in most directions: ask for those
    /// that do not.
    #[inline(always)]
    fn passed(&self, p: usize, absorption_rgb: [f32; 3]) -> [f32; 3] {
        match p {
            0 => [1.0; 3],
            1 => absorption_rgb.map(|sigma| exp(-sigma * self.length[1])),
            _ => absorption_rgb.map(|sigma| {
                // The second-order expansion must not turn back up for strong absorption.
                let way = sigma * self.length[p];
                exp((0.5 * sigma * sigma * self.variance[p] - way).min(-(EXPANSION as f32) * way))
            }),
        }
    }
}

impl Fibre {
    /// Tabulates the model.
    ///
    /// # Errors
    /// Names the parameter that is out of its range.
    pub fn new(optics: &FibreOptics, roots: Roots) -> Result<Fibre, String> {
        let within = |name: &str, value: f32, low: f32, high: f32| {
            if value >= low && value <= high {
                Ok(f64::from(value))
            } else {
                Err(format!("fibre optics: {name} is {value}; it must lie in {low}..{high}"))
            }
        };
        let eta = within("index", optics.index, 1.05, 3.0)?;
        let a = within("eccentricity", optics.eccentricity, 0.7, 1.4)?;
        let shift = within("shift_r_deg", optics.shift_r_deg, -30.0, 30.0)?.to_radians();
        let width = within("width_r_deg", optics.width_r_deg, 0.1, 60.0)?.to_radians();
        let caustic = Caustic {
            glint_scale: within("glint_scale", optics.glint_scale, 0.0, 100.0)?,
            width: within("caustic_width_deg", optics.caustic_width_deg, 0.5, 90.0)?.to_radians(),
            fade_range: within("fade_range", optics.fade_range, 1e-3, 10.0)?,
            limit: within("caustic_limit", optics.caustic_limit, 0.0, 2.0)?,
        };
        let (e1, e2) = eccentric_indices(eta, a);
        if e1.min(e2) < 1.05 {
            return Err(format!(
                "fibre optics: eccentricity {a} with index {eta} gives an index of {:.2} below 1.05",
                e1.min(e2)
            ));
        }
        // Table 1: α_TT = -α_R / 2, α_TRT = -3 α_R / 2; β_TT = β_R / 2, β_TRT = 2 β_R.
        let shifts = [shift, -0.5 * shift, -1.5 * shift, -2.5 * shift];
        let widths = [width, 0.5 * width, 2.0 * width, 2.0 * width];
        let norm = (2.0 * std::f64::consts::PI).sqrt();
        let table = Table::new(eta, a, &caustic, roots);
        let rest = optics.rest.then(|| Rest::new(eta, roots, caustic.width));
        let sampler = Sampler::new(&table, rest.as_ref(), &shifts, &widths);
        // θ_d = 0 and |h| = 1: 2 cos γ_t a crossing.
        let crossing = |eta: f64| 2.0 * (1.0 - 1.0 / (eta * eta)).sqrt();
        let (all, trt) = (crossing(eta), crossing(e1.min(e2)));
        Ok(Fibre {
            table,
            rest,
            sampler,
            shifts: shifts.map(|s| s as f32),
            widths: widths.map(|b| b as f32),
            inverse_widths: widths.map(|b| (1.0 / b) as f32),
            sharpness: widths.map(|b| (0.5 / (b * b)) as f32),
            peaks: widths.map(|b| (0.5 / (b * norm)) as f32),
            // TRT and the rest pass at most what the limit of their expansion in σ lets.
            shortest: [0.0, all as f32, (EXPANSION * 2.0 * trt) as f32, (EXPANSION * 3.0 * all) as f32],
            eta_mean: (0.5 * (e1 + e2)) as f32,
            eta_swing: (0.5 * (e1 - e2)) as f32,
        })
    }

    /// The longitudinal terms at half angle θ_h, each with integral ½ over θ_h.
    #[inline]
    pub fn longitudinal(&self, theta_h: f32) -> [f32; LOBES] {
        std::array::from_fn(|p| {
            let d = theta_h - self.shifts[p];
            self.peaks[p] * exp(-d * d * self.sharpness[p])
        })
    }

    /// ∫ N_p dφ of R, TT, TRT and rest over all azimuths at a difference angle in [0, π/2], no absorption: the
    /// share of light that takes the lobe.
    pub fn azimuthal_energies(&self, theta_d: f32) -> [f32; LOBES] {
        self.sampler.energy(theta_d)
    }

    #[inline(always)]
    fn parts(&self, theta_h: f32, theta_d: f32, phi: f32, eta_star: f32) -> Parts {
        let n = self.table.lookup(theta_d, phi, eta_star);
        let rest = self.rest.as_ref().map_or(Default::default(), |r| r.lookup(theta_d, phi));
        Parts {
            m: self.longitudinal(theta_h),
            n: [n.r, n.tt, n.trt, rest.weight],
            length: [0.0, n.tt_length, n.trt_length, rest.length],
            variance: [0.0, 0.0, n.trt_variance, rest.variance],
        }
    }

    /// S(ω_i, ω_r) in linear RGB, per steradian: the radiance averaged across the fibre's width is
    /// ∫ S L_i cos θ_i dω_i. `absorption_rgb` is σ_a per fibre radius.
    #[inline]
    pub fn scatter(&self, angles: &Angles, absorption_rgb: [f32; 3]) -> [f32; 3] {
        let lobes = self.scatter_lobes(angles, absorption_rgb);
        std::array::from_fn(|c| lobes.iter().map(|l| l[c]).sum())
    }

    /// The parts R, TT, TRT and rest of [`Fibre::scatter`]; the rest is 0 unless the optics ask for it.
    #[inline(always)]
    pub fn scatter_lobes(&self, angles: &Angles, absorption_rgb: [f32; 3]) -> [[f32; 3]; LOBES] {
        let (si, sr) = (angles.sin_i.clamp(-1.0, 1.0), angles.sin_r.clamp(-1.0, 1.0));
        let (ti, tr) = (asin(si), asin(sr));
        // cos²θ_d by the half-angle formula.
        let cos_2d = si * sr + ((1.0 - si * si) * (1.0 - sr * sr)).max(0.0).sqrt();
        let cos2_d = (0.5 * (1.0 + cos_2d)).max(1e-4);
        let eta_star = self.eta_mean + angles.cos_2phi_h * self.eta_swing;
        let parts = self.parts(0.5 * (ti + tr), 0.5 * (tr - ti).abs(), acos(angles.cos_phi), eta_star);
        let inv = 1.0 / cos2_d;
        std::array::from_fn(|p| parts.passed(p, absorption_rgb).map(|t| parts.m[p] * parts.n[p] * inv * t))
    }
}

#[cfg(test)]
mod tests;

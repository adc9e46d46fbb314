//! A fibre seen from one direction: value, density, and sampling of directions to the light.
//!
//! A lobe is chosen by the energy that it returns to this camera, absorption included; θ_h is drawn from the
//! lobe's Gaussian, cut where θ_i would leave [-π/2, π/2]; the azimuth from the lobe's table at the θ_d that
//! follows. The density of that is, per steradian,
//! Σ_p P_p M_p(θ_h) / Z_p · N_p(θ_d, φ) / E_p(θ_d) / cos θ_i
//! with the share Z_p of the Gaussian that is left by the cut and E_p = ∫ N_p dφ. M_p has the Jacobian
//! dθ_h = dθ_i / 2 in its normalisation.

use super::{Fibre, LOBES};
use crate::fibre::{FibrePoint, Frame, Scattered};
use crate::math::exp;
use crate::special::{azimuth, inclination, normal_below, probit, sin_cos};
use glam::Vec3;
use std::f32::consts::FRAC_PI_2;

/// Standard deviations beyond which a Gaussian's cut is below the resolution of f32.
const UNCUT: f32 = 5.6;

/// A lobe's share is at least this part of what would bound its weight by 3 (for three channels).
const DEFENCE: f32 = 0.2;

/// One lobe's share and its cut Gaussian.
#[derive(Clone, Copy, Debug, Default)]
struct Lobe {
    /// Probability of being chosen.
    share: f32,
    /// `share / Z`.
    scale: f32,
    /// Probability below the cut's lower end, in the tail that keeps its relative accuracy.
    below: f32,
    /// Z: what the cut leaves.
    left: f32,
    /// Ends of the cut in standard deviations.
    ends: [f32; 2],
    /// The Gaussian is turned round where the cut leaves its upper tail alone.
    turned: bool,
}

/// See the module's text.
#[derive(Clone, Debug)]
pub struct Toward<'a> {
    fibre: &'a Fibre,
    frame: Frame,
    theta_r: f32,
    absorption: [f32; 3],
    /// Cosine and sine of twice the major axis' azimuth.
    axis: (f32, f32),
    lobes: [Lobe; LOBES],
    /// Sum of the shares before they were made to sum to one.
    #[cfg(test)]
    total: f32,
}

/// Value without cos θ_i, and density times cos θ_i.
struct Value {
    rgb: [f32; 3],
    density: f32,
}

impl Fibre {
    /// The fibre at a point as seen from a unit direction.
    #[inline]
    pub fn toward(&self, at: &FibrePoint, to_camera: Vec3) -> Toward<'_> {
        let frame = Frame::new(at, to_camera);
        let theta_r = inclination(frame.sin, frame.cos);
        let axis = if self.eta_swing == 0.0 {
            (1.0, 0.0)
        } else {
            let (x, y) = (at.major.dot(frame.toward), at.major.dot(frame.side));
            let l2 = x * x + y * y;
            if l2 > 1e-12 { ((x * x - y * y) / l2, 2.0 * x * y / l2) } else { (1.0, 0.0) }
        };
        let mut t = Toward {
            fibre: self,
            frame,
            theta_r,
            absorption: at.absorption_rgb,
            axis,
            lobes: [Lobe::default(); LOBES],
            #[cfg(test)]
            total: 0.0,
        };
        t.choose();
        t
    }
}

#[cfg(test)]
impl Toward<'_> {
    /// What no weight exceeds.
    ///
    /// A lobe's value over its density is Z_p E_p(θ_d) cos²θ_i / cos²θ_d times what absorption lets through, at
    /// most 3 times the mean channel that its share counts; so its weight is at most 3 / DEFENCE times the sum
    /// of the shares before they are made to sum to one. TRT of an elliptical fibre is drawn from the mean of
    /// 9 slices, any of which is at most 9 times the mean.
    pub(crate) fn weight_bound(&self) -> f32 {
        let slices = if self.fibre.sampler.trt_differs { 9.0 } else { 1.0 };
        3.0 / DEFENCE * self.total * slices
    }

    /// The same with one lobe alone to draw from, as its density says too; `None` if it is empty.
    pub(crate) fn drawing_from(mut self, p: usize) -> Option<Self> {
        for (k, lobe) in self.lobes.iter_mut().enumerate() {
            let alone = k == p && lobe.share > 0.0;
            (lobe.share, lobe.scale) = if alone { (1.0, 1.0 / lobe.left) } else { (0.0, 0.0) };
        }
        (self.lobes[p].share > 0.0).then_some(self)
    }
}

impl Toward<'_> {
    fn choose(&mut self) {
        let f = self.fibre;
        let returned = f.sampler.returned(self.theta_r);
        let lobes = if f.rest.is_some() { LOBES } else { LOBES - 1 };
        let mut total = 0.0;
        let passed = self.absorption.map(|s| f.shortest.map(|way| exp(-s * way)));
        for p in 0..lobes {
            let ends = [-FRAC_PI_2, FRAC_PI_2]
                .map(|e| (0.5 * (self.theta_r + e) - f.shifts[p]) * f.inverse_widths[p]);
            let lobe = &mut self.lobes[p];
            *lobe = if ends[0] < -UNCUT && ends[1] > UNCUT {
                Lobe { left: 1.0, ends, ..Lobe::default() }
            } else {
                let turned = ends[0] > 0.0;
                let [a, b] = if turned { [-ends[1], -ends[0]] } else { ends };
                let below = normal_below(a);
                Lobe { below, left: normal_below(b) - below, ends: [a, b], turned, ..Lobe::default() }
            };
            if lobe.left > 0.0 {
                let passed = (passed[0][p] + passed[1][p] + passed[2][p]) / 3.0;
                let (mean, greatest) = returned[p];
                lobe.share = mean.max(DEFENCE * lobe.left * greatest) * passed;
                total += lobe.share;
            }
        }
        #[cfg(test)]
        {
            self.total = total;
        }
        if total > 0.0 {
            for lobe in &mut self.lobes {
                lobe.share /= total;
                lobe.scale = if lobe.share > 0.0 { lobe.share / lobe.left } else { 0.0 };
            }
        }
    }

    /// Value of the lobes from `from` on, and density of all.
    #[inline(always)]
    fn at(&self, theta_i: f32, (sin_i, cos_i): (f32, f32), phi: f32, cos_2phi_h: f32, from: usize) -> Value {
        let f = self.fibre;
        let theta_d = 0.5 * (self.theta_r - theta_i).abs();
        // |half vector|² needs no difference of near numbers where cos θ_d vanishes.
        let (c, s) = (cos_i + self.frame.cos, sin_i + self.frame.sin);
        let cos2_d = (0.25 * (c * c + s * s)).max(1e-8);
        let eta_star = f.eta_mean + f.eta_swing * cos_2phi_h;
        let parts = f.parts(0.5 * (theta_i + self.theta_r), theta_d, phi, eta_star);
        let energy = f.sampler.energy(theta_d);
        let (mut rgb, mut density) = ([0.0; 3], 0.0);
        for p in 0..LOBES {
            if parts.m[p] == 0.0 {
                continue;
            }
            let n = if p == 2 && f.sampler.trt_differs {
                f.sampler.node_value(p, theta_d, phi)
            } else {
                parts.n[p]
            };
            if n > 0.0 && energy[p] > 0.0 {
                density += self.lobes[p].scale * parts.m[p] * n / energy[p];
            }
            let product = parts.m[p] * parts.n[p] / cos2_d;
            if product > 0.0 && p >= from {
                let passed = parts.passed(p, self.absorption);
                for (v, t) in rgb.iter_mut().zip(passed) {
                    *v += product * t;
                }
            }
        }
        Value { rgb, density }
    }

    /// Cosine of φ_i + φ_r, the azimuths measured from the major axis.
    #[inline(always)]
    fn cos_2phi_h(&self, (x, y): (f32, f32)) -> f32 {
        x * self.axis.0 + y * self.axis.1
    }

    #[inline]
    fn direction(&self, to_light: Vec3, from: usize) -> (Value, f32) {
        let (sin, cos, flat) = self.frame.split(to_light);
        let phi = azimuth(flat.0, flat.1).abs();
        (self.at(inclination(sin, cos), (sin, cos), phi, self.cos_2phi_h(flat), from), cos)
    }

    /// S · cos θ_i, linear RGB, per steradian.
    #[inline]
    pub fn eval(&self, to_light: Vec3) -> [f32; 3] {
        let (v, cos) = self.direction(to_light, 0);
        v.rgb.map(|x| x * cos)
    }

    /// The part of [`Toward::eval`] that has been inside the fibre: all lobes but R.
    #[inline]
    pub fn depolarised(&self, to_light: Vec3) -> [f32; 3] {
        let (v, cos) = self.direction(to_light, 1);
        v.rgb.map(|x| x * cos)
    }

    /// S · cos θ_i, and the density of [`Toward::sample`] per steradian.
    #[inline]
    pub fn eval_pdf(&self, to_light: Vec3) -> ([f32; 3], f32) {
        let (v, cos) = self.direction(to_light, 0);
        (v.rgb.map(|x| x * cos), v.density / cos.max(1e-12))
    }

    /// Draws a direction from four numbers in [0, 1).
    #[inline]
    pub fn sample(&self, u: [f32; 4]) -> Option<Scattered> {
        let mut before = 0.0;
        let mut chosen = None;
        for (p, lobe) in self.lobes.iter().enumerate() {
            if lobe.share > 0.0 {
                chosen = Some(p);
                before += lobe.share;
                if u[0] < before {
                    break;
                }
            }
        }
        let p = chosen?;
        let (f, lobe) = (self.fibre, &self.lobes[p]);
        // Half of the last bit keeps the deviate finite at both ends.
        let below = (lobe.below + (u[1] + 2.980_232_2e-8) * lobe.left).min(0.999_999_94);
        let z = probit(below).clamp(lobe.ends[0], lobe.ends[1]);
        let z = if lobe.turned { -z } else { z };
        let theta_i = (2.0 * (f.shifts[p] + f.widths[p] * z) - self.theta_r).clamp(-FRAC_PI_2, FRAC_PI_2);
        let (sin, cos) = sin_cos(theta_i);
        let cos = cos.max(1e-6);
        let phi = f.sampler.azimuth(p, 0.5 * (self.theta_r - theta_i).abs(), u[2], u[3])?;
        let (sin_phi, cos_phi) = sin_cos(phi);
        let flat = (cos_phi, sin_phi);
        let v = self.at(theta_i, (sin, cos), phi.abs(), self.cos_2phi_h(flat), 0);
        if v.density <= 0.0 {
            return None;
        }
        Some(Scattered {
            to_light: self.frame.join(sin, cos, flat),
            weight_rgb: v.rgb.map(|x| x * (cos * cos / v.density)),
            pdf: v.density / cos,
        })
    }
}

//! A fibre seen at one point from one direction: value, density, and sampling of directions to the light.

use super::{Fibre, LOBES};
use crate::fibre::{FibrePoint, Frame, Scattered};
use crate::math::exp;
use crate::special::{azimuth, inclination, sin_cos};
use glam::Vec3;
use std::f32::consts::PI;

/// See the module's text.
#[derive(Clone, Debug)]
pub struct Toward<'a> {
    fibre: &'a Fibre,
    frame: Frame,
    /// The camera's (sin, cos) of inclination as each lobe sees it through its tilt.
    tilted: [(f32, f32); LOBES],
    /// Azimuth at which a smooth fibre sends R, TT and TRT, from the camera's.
    centres: [f32; 3],
    /// A_p, linear RGB.
    attenuation: [[f32; 3]; LOBES],
    /// Probability of each lobe.
    shares: [f32; LOBES],
}

/// Unpolarised reflectance of a dielectric of index `eta` > 1, from outside.
#[inline]
fn fresnel(cos_i: f32, eta: f32) -> f32 {
    let cos_t = (1.0 - (1.0 - cos_i * cos_i).max(0.0) / (eta * eta)).sqrt();
    let s = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    let p = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    0.5 * (s * s + p * p)
}

impl Fibre {
    /// The fibre at a point as seen from a unit direction. The offset h = sin γ of the point across the fibre is
    /// that of the normal against the camera direction.
    #[inline]
    pub fn toward(&self, at: &FibrePoint, to_camera: Vec3) -> Toward<'_> {
        let frame = Frame::new(at, to_camera);
        let (_, _, (x, y)) = frame.split(at.normal);
        // A normal turned away from the camera (round-off at the silhouette) is one at the silhouette.
        let (x, h) = if x > 0.0 { (x, -y) } else { (0.0, 1f32.copysign(-y)) };
        let (s, c) = (frame.sin, frame.cos.max(1e-6));
        // Bravais index and the refracted ray.
        let eta_prime = (self.eta * self.eta - s * s).sqrt() / c;
        let sin_t = h / eta_prime;
        let cos_t = (1.0 - sin_t * sin_t).max(0.0).sqrt();
        let cos_theta_t = (1.0 - s * s / (self.eta * self.eta)).sqrt();
        let crossing = 2.0 * cos_t / cos_theta_t;
        let f = fresnel(c * x, self.eta);
        let attenuation = at.absorption_rgb.map(|sigma| {
            let t = exp(-sigma * crossing);
            let tt = (1.0 - f) * (1.0 - f) * t;
            let trt = tt * f * t;
            [f, tt, trt, trt * f * t / (1.0 - f * t).max(1e-20)]
        });
        let attenuation = std::array::from_fn(|p| attenuation.map(|a| a[p]));
        let means = attenuation.map(|a: [f32; 3]| a[0] + a[1] + a[2]);
        let total: f32 = means.iter().sum();
        let (gamma, gamma_t) = (inclination(h, x), crate::math::asin(sin_t));
        let turn = |(sin_a, cos_a): (f32, f32)| {
            (frame.sin * cos_a + frame.cos * sin_a, (frame.cos * cos_a - frame.sin * sin_a).abs())
        };
        let [r, tt, trt] = self.tilts.map(turn);
        Toward {
            fibre: self,
            frame,
            tilted: [r, tt, trt, (frame.sin, frame.cos)],
            centres: [-2.0 * gamma, 2.0 * gamma_t - 2.0 * gamma + PI, 4.0 * gamma_t - 2.0 * gamma],
            attenuation,
            shares: if total > 0.0 { means.map(|m| m / total) } else { [0.0; LOBES] },
        }
    }
}

#[cfg(test)]
impl Toward<'_> {
    /// The same with one lobe alone to draw from, as its density says too; `None` if it is empty.
    pub(crate) fn drawing_from(mut self, p: usize) -> Option<Self> {
        let there = self.shares[p] > 0.0;
        self.shares = std::array::from_fn(|k| if k == p { 1.0 } else { 0.0 });
        there.then_some(self)
    }
}

impl Toward<'_> {
    /// A_R, A_TT, A_TRT and A of the residual, linear RGB.
    pub fn attenuation(&self) -> [[f32; 3]; LOBES] {
        self.attenuation
    }

    /// M_p N_p of each lobe, which together with A_p gives the value.
    #[inline(always)]
    fn lobes(&self, sin_i: f32, cos_i: f32, phi: f32) -> [f32; LOBES] {
        std::array::from_fn(|p| {
            let m = self.fibre.longitudinal[p].value((sin_i, cos_i), self.tilted[p]);
            if m == 0.0 {
                0.0
            } else if p < 3 {
                m * self.fibre.logistic.density(phi - self.centres[p])
            } else {
                m * (0.5 / PI)
            }
        })
    }

    #[inline(always)]
    fn weigh(&self, lobes: &[f32; LOBES]) -> ([f32; 3], f32) {
        let mut rgb = [0.0; 3];
        let mut pdf = 0.0;
        for (p, l) in lobes.iter().enumerate() {
            pdf += self.shares[p] * l;
            for (c, v) in rgb.iter_mut().enumerate() {
                *v += self.attenuation[p][c] * l;
            }
        }
        (rgb, pdf)
    }

    /// The parts R, TT, TRT and residual of [`Toward::eval`].
    pub fn eval_lobes(&self, to_light: Vec3) -> [[f32; 3]; LOBES] {
        let (sin, cos, (x, y)) = self.frame.split(to_light);
        let lobes = self.lobes(sin, cos, azimuth(x, y));
        std::array::from_fn(|p| self.attenuation[p].map(|a| a * lobes[p]))
    }

    /// f(ω_i, ω_r) cos θ_i, linear RGB, per steradian.
    #[inline]
    pub fn eval(&self, to_light: Vec3) -> [f32; 3] {
        self.eval_pdf(to_light).0
    }

    /// The part of [`Toward::eval`] that has been inside the fibre: all lobes but R.
    #[inline]
    pub fn depolarised(&self, to_light: Vec3) -> [f32; 3] {
        let [_, tt, trt, rest] = self.eval_lobes(to_light);
        std::array::from_fn(|c| tt[c] + trt[c] + rest[c])
    }

    /// The same, and the density of [`Toward::sample`] per steradian.
    #[inline]
    pub fn eval_pdf(&self, to_light: Vec3) -> ([f32; 3], f32) {
        let (sin, cos, (x, y)) = self.frame.split(to_light);
        self.weigh(&self.lobes(sin, cos, azimuth(x, y)))
    }

    /// Draws a direction from four numbers in [0, 1).
    #[inline]
    pub fn sample(&self, u: [f32; 4]) -> Option<Scattered> {
        let mut before = 0.0;
        let mut chosen = None;
        for (p, &share) in self.shares.iter().enumerate() {
            if share > 0.0 {
                chosen = Some(p);
                before += share;
                if u[0] < before {
                    break;
                }
            }
        }
        let p = chosen?;
        let sin = self.fibre.longitudinal[p].sample(self.tilted[p], u[1], u[2]);
        let cos = ((1.0 - sin) * (1.0 + sin)).max(0.0).sqrt();
        let u = u[3] + 2.980_232_2e-8;
        let phi = if p < 3 { self.centres[p] + self.fibre.logistic.sample(u) } else { (2.0 * u - 1.0) * PI };
        let (sin_phi, cos_phi) = sin_cos(phi);
        let (rgb, pdf) = self.weigh(&self.lobes(sin, cos, phi));
        if pdf <= 0.0 {
            return None;
        }
        Some(Scattered {
            to_light: self.frame.join(sin, cos, (cos_phi, sin_phi)),
            weight_rgb: rgb.map(|x| x / pdf),
            pdf,
        })
    }
}

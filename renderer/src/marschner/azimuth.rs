//! Azimuthal scattering N_p of a dielectric cylinder (Marschner et al. 2003, section 5.2), evaluated directly.

use super::fresnel::{bravais, reflectance};
use std::f64::consts::PI;

/// How the paths that leave at a given azimuth are found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Roots {
    /// Snell's law itself.
    #[default]
    Exact,
    /// The paper's cubic φ̂(p, γ_i) (Eq. 10), which keeps the energy but distorts the shape of TRT.
    Cubic,
}

impl From<strandbench_scenes::OpticsRoots> for Roots {
    fn from(roots: strandbench_scenes::OpticsRoots) -> Roots {
        match roots {
            strandbench_scenes::OpticsRoots::Exact => Roots::Exact,
            strandbench_scenes::OpticsRoots::Cubic => Roots::Cubic,
        }
    }
}

/// The caustic's parameters (Table 1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Caustic {
    /// k_G.
    pub glint_scale: f64,
    /// w_c, radians.
    pub width: f64,
    /// Δη'.
    pub fade_range: f64,
    /// Δh_M.
    pub limit: f64,
}

/// One part of N_p: its value without absorption and the length of its way inside, in fibre radii.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Part {
    /// Share of the light per radian of azimuth.
    pub weight: f64,
    /// Path length inside the fibre over the fibre's radius: p · 2 cos γ_t / cos θ_t.
    pub length: f64,
}

/// A fibre's cross-section at one difference angle.
#[derive(Clone, Copy, Debug)]
pub struct CrossSection {
    eta_prime: f64,
    eta_second: f64,
    cos_theta_t: f64,
    roots: Roots,
}

impl CrossSection {
    /// Index of refraction and cosine of θ_d.
    pub fn new(eta: f64, cos_theta_d: f64, roots: Roots) -> CrossSection {
        let (eta_prime, eta_second) = bravais(eta, cos_theta_d);
        let sin2 = (1.0 - cos_theta_d * cos_theta_d).max(0.0);
        CrossSection { eta_prime, eta_second, cos_theta_t: (1.0 - sin2 / (eta * eta)).sqrt(), roots }
    }

    /// η'(θ_d).
    pub fn eta_prime(&self) -> f64 {
        self.eta_prime
    }

    fn sin_cos_t(&self, h: f64) -> (f64, f64) {
        let s = h / self.eta_prime;
        (s, (1.0 - s * s).max(0.0).sqrt())
    }

    /// Exit azimuth φ(p, γ_i) before wrapping, and its derivative by γ_i.
    pub(super) fn exit(&self, p: u32, gamma: f64) -> (f64, f64) {
        let pf = f64::from(p);
        match self.roots {
            Roots::Exact => {
                let (sin_t, cos_t) = self.sin_cos_t(gamma.sin());
                (
                    2.0 * pf * sin_t.asin() - 2.0 * gamma + pf * PI,
                    2.0 * pf * gamma.cos() / (self.eta_prime * cos_t) - 2.0,
                )
            }
            Roots::Cubic => {
                let c = (1.0 / self.eta_prime).asin();
                let (a, b) = (6.0 * pf * c / PI - 2.0, 8.0 * pf * c / PI.powi(3));
                (a * gamma - b * gamma.powi(3) + pf * PI, a - 3.0 * b * gamma * gamma)
            }
        }
    }

    /// γ_i at which the exit azimuth of TRT turns back (the caustic); `None` where it does not.
    fn turning(&self) -> Option<f64> {
        match self.roots {
            // 3 h_c² = 4 - η'²
            Roots::Exact => {
                let h2 = (4.0 - self.eta_prime * self.eta_prime) / 3.0;
                (h2 > 0.0).then(|| h2.sqrt().min(1.0).asin())
            }
            Roots::Cubic => {
                let c = (1.0 / self.eta_prime).asin();
                let g2 = (12.0 * c / PI - 2.0) / (48.0 * c / PI.powi(3));
                (g2 > 0.0).then(|| g2.sqrt().min(0.5 * PI))
            }
        }
    }

    /// Exit azimuth of TRT's caustic, unwrapped; `None` where there is none.
    pub fn caustic_azimuth(&self) -> Option<f64> {
        self.turning().map(|g| self.exit(2, g).0)
    }

    /// Fresnel reflectance at the entry, and at every inner reflection of the same path.
    pub(super) fn reflectance(&self, gamma: f64) -> f64 {
        reflectance(gamma.cos(), self.eta_prime, self.eta_second)
    }

    /// Attenuation without absorption A(p, h): reflectance for p = 0, (1-F)² F^(p-1) else.
    pub(super) fn attenuation(&self, p: u32, gamma: f64) -> f64 {
        let f = self.reflectance(gamma);
        if p == 0 { f } else { (1.0 - f).powi(2) * f.powi(p as i32 - 1) }
    }

    pub(super) fn length(&self, p: u32, gamma: f64) -> f64 {
        let (_, cos_t) = self.sin_cos_t(gamma.sin());
        f64::from(p) * 2.0 * cos_t / self.cos_theta_t
    }

    /// Length of the path that grazes the fibre's edge and is refracted once, fibre radii.
    pub fn grazing_length(&self) -> f64 {
        self.length(1, 0.5 * PI)
    }

    /// All γ_i in [-π/2, π/2] that leave at azimuth `phi` (any branch).
    fn solve(&self, p: u32, phi: f64) -> Vec<f64> {
        let turn = if p == 2 { self.turning() } else { None };
        let mut ends = vec![-0.5 * PI];
        ends.extend(turn.map(|g| [-g, g]).into_iter().flatten());
        ends.push(0.5 * PI);
        let mut found = Vec::new();
        for w in ends.windows(2) {
            let (fa, fb) = (self.exit(p, w[0]).0, self.exit(p, w[1]).0);
            let (lo, hi) = (fa.min(fb), fa.max(fb));
            let first = ((lo - phi) / (2.0 * PI)).ceil() as i64;
            let last = ((hi - phi) / (2.0 * PI)).floor() as i64;
            for k in first..=last {
                let target = phi + 2.0 * PI * k as f64;
                found.push(self.root(p, target, (w[0], w[1]), fb > fa));
            }
        }
        found
    }

    /// γ_i at which the unwrapped exit azimuth is `target`, between ends where it is monotone: Newton's method,
    /// halving the bracket instead wherever a step would leave it or hardly shorten it.
    fn root(&self, p: u32, target: f64, (mut a, mut b): (f64, f64), rising: bool) -> f64 {
        let mut gamma = 0.5 * (a + b);
        for k in 0..80 {
            let (phi, slope) = self.exit(p, gamma);
            if (phi < target) == rising {
                a = gamma
            } else {
                b = gamma
            }
            let newton = gamma - (phi - target) / slope;
            let next = if newton > a && newton < b && k % 4 != 3 { newton } else { 0.5 * (a + b) };
            if (next - gamma).abs() < 1e-15 {
                return next;
            }
            gamma = next;
        }
        gamma
    }

    /// N_p(φ) as a list of parts, without the caustic's smoothing: Σ A(p, h) / (2 |dφ/dh|) (Eq. 8).
    pub fn parts(&self, p: u32, phi: f64) -> Vec<Part> {
        self.solve(p, phi)
            .into_iter()
            .map(|gamma| {
                let slope = self.exit(p, gamma).1 / gamma.cos().max(1e-12);
                Part {
                    weight: self.attenuation(p, gamma) / (2.0 * slope.abs()).max(1e-12),
                    length: self.length(p, gamma),
                }
            })
            .collect()
    }

    /// N_TRT with the caustic removed and replaced by a smooth one (section 5.2.2).
    pub fn smoothed_trt(&self, phi: f64, c: &Caustic) -> Vec<Part> {
        let (phi_c, gamma_c, delta_h, t) = match self.turning() {
            Some(g) => {
                let h = g.sin();
                // φ''(h) by central differences of dφ/dh.
                let slope = |h: f64| {
                    let g = h.clamp(-1.0, 1.0).asin();
                    self.exit(2, g).1 / g.cos().max(1e-9)
                };
                let e = 1e-4_f64.min(0.5 * (1.0 - h));
                let bend = ((slope(h + e) - slope(h - e)) / (2.0 * e)).abs();
                (self.exit(2, g).0, g, c.limit.min(2.0 * (2.0 * c.width / bend.max(1e-12)).sqrt()), 1.0)
            }
            None => {
                let x = ((self.eta_prime - 2.0) / c.fade_range.max(1e-9)).clamp(0.0, 1.0);
                (0.0, 0.0, c.limit, 1.0 - x * x * (3.0 - 2.0 * x))
            }
        };
        let away = |a: f64| {
            let d = (a + PI).rem_euclid(2.0 * PI) - PI;
            (-0.5 * (d / c.width).powi(2)).exp()
        };
        let (plus, minus) = (away(phi - phi_c), away(phi + phi_c));
        let keep = (1.0 - t * plus) * (1.0 - t * minus);
        let mut parts = self.parts(2, phi);
        for p in &mut parts {
            p.weight *= keep;
        }
        let peak = 1.0 / (c.width * (2.0 * PI).sqrt());
        parts.push(Part {
            weight: t * c.glint_scale * self.attenuation(2, gamma_c) * delta_h * peak * (plus + minus),
            length: self.length(2, gamma_c),
        });
        parts
    }
}

//! The fibre scattering model of Chiang, Bitterli, Tappan and Burley 2016: near field, with the parameters of
//! Mitsuba 3's `hair`.
//!
//! R, TT, TRT and everything after them are each the product of a longitudinal lobe M_p (d'Eon et al. 2011,
//! energy conserving at every roughness), an attenuation A_p and an azimuthal lobe N_p, a trimmed logistic about
//! the azimuth at which a smooth fibre would send the ray that enters at offset h. What the paths of p >= 3
//! carry, geometric series included, leaves at any azimuth alike. Eval holds no further cosine: the M_p are
//! normalised over cos θ dθ.
//!
//! Only the fibre's camera side depends on h, so the model is not reciprocal for one h: exchanging light and
//! camera exchanges the points of entry and exit.

mod longitudinal;
mod toward;

pub use longitudinal::{Bessel, Longitudinal};
pub use toward::Toward;

use std::f32::consts::PI;
use strandbench_scenes::FibreOptics;

/// R, TT, TRT and the residual.
pub const LOBES: usize = 4;

/// The parameters, named as Mitsuba's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameters {
    /// β_m in 0.01..1.
    pub longitudinal_roughness: f32,
    /// β_n in 0.01..1.
    pub azimuthal_roughness: f32,
    /// Tilt α of the scales in degrees; positive moves R towards the tip, so hair has a negative one.
    pub scale_tilt_deg: f32,
    /// Index of refraction of the fibre.
    pub int_ior: f32,
    /// Index of refraction around it.
    pub ext_ior: f32,
    /// How the Bessel function in M_p is computed.
    pub bessel: Bessel,
}

impl Default for Parameters {
    /// Roughness and indices as Mitsuba's defaults, the tilt with the sign of hair.
    fn default() -> Parameters {
        Parameters {
            longitudinal_roughness: 0.3,
            azimuthal_roughness: 0.3,
            scale_tilt_deg: -2.0,
            int_ior: 1.55,
            ext_ior: 1.000_277,
            bessel: Bessel::Exact,
        }
    }
}

impl Parameters {
    /// What a scene's optics say to this model. Without `longitudinal_roughness`, β_m is the one at which R is
    /// as wide as Marschner's β_R: the lobe spreads θ_i by sqrt(v_0) and Marschner's θ_h = (θ_i + θ_r) / 2 by
    /// β_R, so sqrt(v_0) = 2 β_R. Without `scale_tilt_deg`, α is α_R.
    ///
    /// # Errors
    /// If `width_r_deg` is wider than any β_m makes the lobe.
    pub fn of(optics: &FibreOptics) -> Result<Parameters, String> {
        let longitudinal_roughness = match optics.longitudinal_roughness {
            Some(b) => b,
            None => roughness_of_width(optics.width_r_deg)?,
        };
        Ok(Parameters {
            longitudinal_roughness,
            azimuthal_roughness: optics.azimuthal_roughness.unwrap_or(0.3),
            scale_tilt_deg: optics.scale_tilt_deg.unwrap_or(optics.shift_r_deg),
            int_ior: optics.index,
            ext_ior: 1.0,
            bessel: if optics.mitsuba_bessel { Bessel::Mitsuba } else { Bessel::Exact },
        })
    }
}

/// sqrt(v_0) of β_m: 0.726 β + 0.812 β² + 3.7 β²⁰.
fn spread(beta: f64) -> f64 {
    0.726 * beta + 0.812 * beta * beta + 3.7 * beta.powi(20)
}

/// β_m at which R's standard deviation in θ_h is `width_deg`.
fn roughness_of_width(width_deg: f32) -> Result<f32, String> {
    let want = 2.0 * f64::from(width_deg).to_radians();
    let (mut low, mut high) = (0.01, 1.0);
    if !(spread(low)..=spread(high)).contains(&want) {
        return Err(format!(
            "fibre optics: width_r_deg is {width_deg}; the model chiang reaches {:.2}..{:.0}, or give longitudinal_roughness",
            (0.5 * spread(low)).to_degrees(),
            (0.5 * spread(high)).to_degrees()
        ));
    }
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if spread(middle) < want { low = middle } else { high = middle }
    }
    Ok((0.5 * (low + high)) as f32)
}

/// A fibre type ready for shading.
#[derive(Clone, Debug)]
pub struct Fibre {
    eta: f32,
    longitudinal: [Longitudinal; LOBES],
    logistic: Logistic,
    /// Sine and cosine by which R, TT and TRT turn the camera's inclination: -2α, α, 4α.
    tilts: [(f32, f32); 3],
}

impl Fibre {
    /// Prepares the model.
    ///
    /// # Errors
    /// Names the parameter that is out of its range.
    pub fn new(p: &Parameters) -> Result<Fibre, String> {
        let within = |name: &str, value: f32, low: f32, high: f32| {
            if value >= low && value <= high {
                Ok(f64::from(value))
            } else {
                Err(format!("fibre optics: {name} is {value}; it must lie in {low}..{high}"))
            }
        };
        let beta_m = within("longitudinal_roughness", p.longitudinal_roughness, 0.01, 1.0)?;
        let beta_n = within("azimuthal_roughness", p.azimuthal_roughness, 0.01, 1.0)?;
        let alpha = within("scale_tilt_deg", p.scale_tilt_deg, -30.0, 30.0)?.to_radians();
        let outside = within("ext_ior", p.ext_ior, 0.5, 3.0)?;
        let eta = within("index", p.int_ior, 0.5, 10.0)? / outside;
        within("index", eta as f32, 1.05, 3.0)?;
        let v0 = spread(beta_m).powi(2);
        // The logistic's scale (Chiang et al. 2016, section 4.1).
        let s = (std::f64::consts::PI / 8.0).sqrt()
            * (0.265 * beta_n + 1.194 * beta_n * beta_n + 5.372 * beta_n.powi(22));
        Ok(Fibre {
            eta: eta as f32,
            longitudinal: [v0, 0.25 * v0, 4.0 * v0, 4.0 * v0].map(|v| Longitudinal::new(v, p.bessel)),
            logistic: Logistic::new(s),
            tilts: [-2.0 * alpha, alpha, 4.0 * alpha].map(|a| (libm::sin(a) as f32, libm::cos(a) as f32)),
        })
    }

    /// Index of refraction relative to the surroundings.
    pub fn eta(&self) -> f32 {
        self.eta
    }
}

/// A logistic density of scale s, cut at ±π.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Logistic {
    s: f32,
    inverse: f32,
    /// 1 over (s times what the cut leaves).
    norm: f32,
    /// Probability below -π of the uncut one, and of the cut interval.
    below: f32,
    left: f32,
}

impl Logistic {
    fn new(s: f64) -> Logistic {
        let e = libm::exp(-std::f64::consts::PI / s);
        let left = (1.0 - e) / (1.0 + e);
        Logistic {
            s: s as f32,
            inverse: (1.0 / s) as f32,
            norm: (1.0 / (s * left)) as f32,
            below: (e / (1.0 + e)) as f32,
            left: left as f32,
        }
    }

    /// Density at `d` radians from the middle, any branch.
    #[inline(always)]
    fn density(&self, d: f32) -> f32 {
        const MAGIC: f32 = 12_582_912.0;
        let turns = (d * (0.5 / PI) + MAGIC) - MAGIC;
        // 2π in two parts.
        let d = (d - turns * 6.281_25) - turns * 1.935_307_2e-3;
        let e = crate::math::exp(-d.abs() * self.inverse);
        e * self.norm / ((1.0 + e) * (1.0 + e))
    }

    /// A deviate in [-π, π] from `u` in (0, 1).
    #[inline(always)]
    fn sample(&self, u: f32) -> f32 {
        let u = self.below + u * self.left;
        // Both tails with their relative accuracy.
        let upper = (1.0 - u).max(3e-8);
        (self.s * (crate::special::ln(u.max(f32::MIN_POSITIVE)) - crate::special::ln(upper))).clamp(-PI, PI)
    }
}

#[cfg(test)]
mod tests;

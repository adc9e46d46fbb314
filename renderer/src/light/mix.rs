//! Two ways of finding light, and how they share it.

use super::LightSample;
use glam::Vec3;

/// Which of two ways of finding light is used: drawing points on lights, or drawing directions from the
/// scattering function. All give the same image in the mean.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Strategy {
    /// Both, each light weighed by the balance heuristic (Veach and Guibas 1995); lights that are seen under a
    /// small solid angle by points on them alone.
    #[default]
    Both,
    /// Points on lights alone.
    Lights,
    /// Directions of scattering alone.
    Scattering,
}

/// How the two ways share the light at one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mix {
    /// Which ways there are.
    pub strategy: Strategy,
    /// Directions of scattering drawn for each choice of lights, in the mean.
    pub share: f32,
}

impl Mix {
    /// Weight of a point on a light: `light` and `lobe` are the densities of both ways there.
    #[inline]
    pub(super) fn of_light(&self, light: f32, lobe: f32) -> f32 {
        match self.strategy {
            Strategy::Lights => 1.0,
            Strategy::Scattering => 0.0,
            Strategy::Both => light / (light + self.share * lobe),
        }
    }

    /// Estimate of the reflected radiance before shadow, times the weight.
    #[inline(always)]
    pub(super) fn reflected(
        &self,
        s: &LightSample,
        small: bool,
        lobe: impl Fn(Vec3) -> ([f32; 3], f32),
    ) -> [f32; 3] {
        let alone = small || self.strategy == Strategy::Lights;
        let (f, pdf) = lobe(s.direction);
        let weight = if alone { 1.0 } else { self.of_light(s.pdf, pdf) };
        std::array::from_fn(|c| f[c] * s.weight_rgb[c] * weight)
    }
}

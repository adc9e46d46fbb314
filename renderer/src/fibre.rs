//! One fibre's scattering behind a closed choice of models: value, density and sampling for one camera direction.
//!
//! The radiance that leaves the visible point of a fibre is ∫ eval(ω_i) L(ω_i) dω_i over the whole sphere, so
//! `eval` holds the light's cosine. Marschner's model is far-field: it has one value for all points across the
//! fibre, the average of its width. Chiang's takes the offset h from the camera direction and the normal.

use crate::{chiang, marschner};
use glam::Vec3;
use strandbench_scenes::{FibreOptics, OpticsModel};

/// A point on a fibre's surface, as shading sees it. World vectors of unit length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FibrePoint {
    /// Along the fibre, from root to tip.
    pub tangent: Vec3,
    /// Outward, perpendicular to the tangent.
    pub normal: Vec3,
    /// Absorption per fibre radius, linear RGB.
    pub absorption_rgb: [f32; 3],
    /// Major axis of an elliptical fibre, perpendicular to the tangent; anything for a round one.
    pub major: Vec3,
}

/// A direction drawn by [`Toward::sample`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scattered {
    /// Unit direction towards the light.
    pub to_light: Vec3,
    /// `eval / pdf`, linear RGB.
    pub weight_rgb: [f32; 3],
    /// Probability density per steradian.
    pub pdf: f32,
}

/// A fibre type ready for shading.
#[derive(Clone, Debug)]
pub enum FibreModel {
    /// Marschner et al. 2003.
    Marschner(Box<marschner::Fibre>),
    /// Chiang et al. 2016.
    Chiang(Box<chiang::Fibre>),
}

impl FibreModel {
    /// Prepares the model that the optics choose.
    ///
    /// # Errors
    /// Names the parameter that is out of its range, or that the chosen model does not have.
    pub fn new(optics: &FibreOptics) -> Result<FibreModel, String> {
        if let Some(key) = optics.foreign_key() {
            return Err(format!(
                "fibre optics: the chosen model has no parameter {key}; remove it or choose the other model"
            ));
        }
        Ok(match optics.model {
            OpticsModel::Marschner => {
                FibreModel::Marschner(Box::new(marschner::Fibre::new(optics, optics.roots.into())?))
            }
            OpticsModel::Chiang => {
                FibreModel::Chiang(Box::new(chiang::Fibre::new(&chiang::Parameters::of(optics)?)?))
            }
        })
    }

    /// Everything that depends on the camera direction (unit, away from the point), done once.
    #[inline]
    pub fn toward(&self, at: &FibrePoint, to_camera: Vec3) -> Toward<'_> {
        match self {
            FibreModel::Marschner(f) => Toward::Marschner(f.toward(at, to_camera)),
            FibreModel::Chiang(f) => Toward::Chiang(f.toward(at, to_camera)),
        }
    }
}

/// A fibre seen from one direction.
#[derive(Clone, Debug)]
pub enum Toward<'a> {
    /// Marschner et al. 2003.
    Marschner(marschner::Toward<'a>),
    /// Chiang et al. 2016.
    Chiang(chiang::Toward<'a>),
}

impl Toward<'_> {
    /// f(ω_i, ω_r) · cos θ_i in linear RGB, per steradian.
    #[inline]
    pub fn eval(&self, to_light: Vec3) -> [f32; 3] {
        match self {
            Toward::Marschner(t) => t.eval(to_light),
            Toward::Chiang(t) => t.eval(to_light),
        }
    }

    /// The part of [`Toward::eval`] that has been inside the fibre and is taken to have lost its polarisation there:
    /// TT, TRT and the rest.
    #[inline]
    pub fn depolarised(&self, to_light: Vec3) -> [f32; 3] {
        match self {
            Toward::Marschner(t) => t.depolarised(to_light),
            Toward::Chiang(t) => t.depolarised(to_light),
        }
    }

    /// Density of [`Toward::sample`] per steradian.
    #[inline]
    pub fn pdf(&self, to_light: Vec3) -> f32 {
        match self {
            Toward::Marschner(t) => t.eval_pdf(to_light).1,
            Toward::Chiang(t) => t.eval_pdf(to_light).1,
        }
    }

    /// Both at once, for less than the price of two.
    #[inline]
    pub fn eval_pdf(&self, to_light: Vec3) -> ([f32; 3], f32) {
        match self {
            Toward::Marschner(t) => t.eval_pdf(to_light),
            Toward::Chiang(t) => t.eval_pdf(to_light),
        }
    }

    /// Draws a direction from four numbers uniform in [0, 1): the first chooses the lobe, the second and third
    /// drive the inclination and the fourth the azimuth. `None` where the fibre scatters nothing that way.
    #[inline]
    pub fn sample(&self, u: [f32; 4]) -> Option<Scattered> {
        match self {
            Toward::Marschner(t) => t.sample(u),
            Toward::Chiang(t) => t.sample(u),
        }
    }
}

/// The fibre's axes for one camera direction: azimuth 0 is the camera's.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frame {
    /// Root to tip.
    pub along: Vec3,
    /// The camera direction's part across the fibre, made unit.
    pub toward: Vec3,
    /// `along x toward`: azimuth 90°.
    pub side: Vec3,
    /// Sine and cosine of the camera's inclination.
    pub sin: f32,
    pub cos: f32,
}

impl Frame {
    #[inline]
    pub fn new(at: &FibrePoint, to_camera: Vec3) -> Frame {
        let along = at.tangent;
        let sin = to_camera.dot(along).clamp(-1.0, 1.0);
        let flat = to_camera - along * sin;
        // Once more: near the axis the first difference leaves rounding along the fibre.
        let flat = flat - along * along.dot(flat);
        let cos = flat.length();
        // Seen along its axis a fibre has no azimuth: any will do.
        let toward = if cos > 1e-6 {
            flat / cos
        } else {
            (at.normal - along * along.dot(at.normal))
                .try_normalize()
                .unwrap_or_else(|| along.any_orthonormal_vector())
        };
        Frame { along, toward, side: along.cross(toward), sin, cos }
    }

    /// Sine and cosine of a direction's inclination, and its part across the fibre in (toward, side), made unit.
    #[inline]
    pub fn split(&self, direction: Vec3) -> (f32, f32, (f32, f32)) {
        let (x, y) = (direction.dot(self.toward), direction.dot(self.side));
        let cos = (x * x + y * y).sqrt();
        let flat = if cos > 1e-12 { (x / cos, y / cos) } else { (1.0, 0.0) };
        (direction.dot(self.along).clamp(-1.0, 1.0), cos, flat)
    }

    /// The direction of this inclination and azimuth.
    #[inline]
    pub fn join(&self, sin: f32, cos: f32, (x, y): (f32, f32)) -> Vec3 {
        self.along * sin + (self.toward * x + self.side * y) * cos
    }
}

#[cfg(test)]
mod tests;

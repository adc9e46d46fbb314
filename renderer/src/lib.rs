//! A ray tracer for hair fibres and meshes with Marschner shading, and the cameras' imperfections.
//!
//! Fibres are chains of round cones (linear tubes with spherical joints), meshes are triangles, both in one
//! tree of boxes. Paths of light are traced from the camera through fibres and skin up to a stated number of
//! scatterings, with light from rectangles and an environment drawn at every vertex.

pub mod accel;
mod adapt;
pub mod chiang;
pub mod cone;
mod direct;
mod environment;
pub mod fibre;
mod footprint;
mod guide;
mod identity;
mod lens;
mod light;
pub mod marschner;
mod math;
mod path;
mod probe;
mod sampler;
mod scene;
mod sensor;
mod shadows;
mod skin;
mod skin_light;
mod special;
mod tile;
mod vertex;
mod view;

pub use direct::{Direct, Offsets, PointLight};
pub use environment::{Sky, SkySample};
pub use fibre::{FibreModel, FibrePoint, Scattered, Toward};
pub use identity::IdentityPlanes;
pub use light::{Choice, LightSample, Lights, Mix, Strategy};
pub use probe::{NEAR_MM, Probe};
pub use scene::{RenderScene, fibre_tangent};
pub use sensor::{expose, expose_rgb, gain, noise_variance};
pub use skin::{Skin, SkinToward};
pub use skin_light::SkinLight;
pub use vertex::SurfacePoint;

use strandbench_rng::Rng;
use strandbench_types::{Cancelled, Plane, SampleHits};

/// Why a view could not be rendered.
#[derive(Debug, thiserror::Error)]
pub enum RenderError {
    /// The scene cannot be rendered.
    #[error("{0}")]
    Scene(String),
    /// Stopped from outside.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Most scatterings that may be asked for; white fibres absorb nothing, and paths among them do not end by
/// themselves.
const MOST_DEPTH: u32 = 1024;

/// They take 27 CPU seconds for the embedded face before sixteen lights.
const SKIN_PATHS: u32 = 64;

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde's signature")]
fn is_zero(v: &f32) -> bool {
    *v == 0.0
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde's signature")]
fn is_usual(v: &u32) -> bool {
    *v == SKIN_PATHS
}

/// How much work a render does.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Settings {
    /// Rays through each pixel before convergence is looked at; all of them feed the identity buffer.
    pub samples_per_pixel: u32,
    /// Upper limit of rays through a pixel; with [`Settings::sensor_noise`], of samples of each kind.
    pub max_samples_per_pixel: u32,
    /// Standard error of a pixel's radiance, relative to the sensor's full scale, at which it is converged: as
    /// estimated by taking the samples for independent, which overstates it by about a quarter.
    ///
    /// Render noise dominates the sensor's, and the default work is what the time of the main job allows. Of straight
    /// blonde hair at depth 8, whose unmetered mean radiance is 0.053 (0.022 of it direct), 32 rays a pixel leave
    /// an error of 0.004 in direct light, and 16 followed ones of them 0.020 in all; it falls with the root of the
    /// number of rays followed. The example `noise` prints both for any scene.
    pub noise_target: f32,
    /// If above 0, a pixel is converged once the standard error of the mean of its channels, as the sensor weighs them, is at
    /// most this part of the noise that a channel of the sensor has there ([`noise_variance`]; of a colour sensor's, and of
    /// a monochrome one's whose weights sum to 1), and `noise_target` is not looked at. Needs a sensor with noise.
    ///
    /// Cover and shading are then sampled apart: where fibres are seen, or beside it, 64 camera rays or more, up to eight
    /// times `max_samples_per_pixel`, tell how much of the pixel each strand has. What one strand reflects within a pixel
    /// varies little: a few of its hits are lit by lights, at least two, with a shadow ray for each of up to sixteen lights.
    /// Paths start from evenly spaced hits on fibres, and meshes are sampled by themselves; whichever part errs most for what it
    /// costs is sampled further, up to `max_samples_per_pixel`. The error is estimated as of independent samples, times
    /// what stratification was found to gain in the pixels of the tile that are done; as pixels stop where it is low, it is
    /// then somewhat too low. The example `face_noise` compares it with the difference of two seeds.
    #[serde(skip_serializing_if = "is_zero")]
    pub sensor_noise: f32,
    /// Distance, in pixels of the camera that sees the scene largest, of points over meshes where shadows are kept for all views
    /// of a frame; along fibres they are twice as far apart, and where no fibre is within 5 mm four times. From each, stratified shadow
    /// rays (8 on fibres, 16 on meshes) say how much is seen of each of up to sixteen lights, and a hit takes what is interpolated
    /// between its points. A bias: fine shadows are blurred by as much, and what noise is kept is the same in all
    /// views (`face_noise` measures both). 0 keeps none: each hit has shadow rays of its own, as always with an environment,
    /// more lights, or where one of the points sees no light at all.
    #[serde(skip_serializing_if = "is_zero")]
    pub shadow_spacing_px: f32,
    /// Paths from around each vertex of skin for the light below it, at least 4; the same for all views. Only where the
    /// skin's `scatter_mm` is above 0.
    #[serde(skip_serializing_if = "is_usual")]
    pub skin_paths: u32,
    /// Most scatterings of a path between light and camera: 1 is direct light alone (Mitsuba's `max_depth` is one
    /// more). Light of more scatterings is left out.
    pub depth: u32,
    /// One camera ray of so many is followed beyond its first vertex, and counts that many times: light that has
    /// been scattered often varies little. Lowered to a common divisor with the numbers of samples and 16.
    pub indirect_every: u32,
    /// How light is found.
    pub strategy: Strategy,
    /// Largest radiance, relative to the sensor's full scale, of what one followed ray brings from beyond its first
    /// vertex; brighter ones are made darker, which is a bias. 0 switches it off.
    ///
    /// The default takes 27 % (red), 22 % (green) and 13 % (blue) of the mean radiance of straight blonde hair with it.
    /// What it buys: rare paths along which light passes straight through fibres leave single pixels so bright that
    /// stereo fails on them. At the default number of rays the median depth error of that scene is 4.5 mm without
    /// the limit, 2.1 mm at 2, 1.8 mm at 1 and 1.7 mm at 0.5.
    pub clamp: f32,
    /// Draws sampling and the sensor's noise anew where it is not 0, and nothing else: hair, motion, exposure and calibration stay those
    /// of the run's seed. Not looked at by the renderer, whose callers give it [`Settings::noise_seed`].
    pub noise: u64,
}

impl Default for Settings {
    fn default() -> Settings {
        Settings {
            samples_per_pixel: 32,
            max_samples_per_pixel: 32,
            noise_target: 0.04,
            sensor_noise: 0.0,
            shadow_spacing_px: 0.0,
            skin_paths: SKIN_PATHS,
            depth: 8,
            indirect_every: 2,
            strategy: Strategy::Both,
            clamp: 1.0,
            noise: 0,
        }
    }
}

/// Stream of what [`Settings::noise`] draws.
const NOISE: u64 = 0x4E01;

impl Settings {
    /// Seed of sampling and of the sensor's noise in a run with `seed`: this one itself if [`Settings::noise`] is 0.
    pub fn noise_seed(&self, seed: u64) -> u64 {
        match self.noise {
            0 => seed,
            noise => Rng::keyed(&[seed, NOISE, noise]).next_u64(),
        }
    }

    fn validate(&self, pixels: usize) -> Result<(), RenderError> {
        let (first, most) = (self.samples_per_pixel, self.max_samples_per_pixel);
        let fail = |what: String| Err(RenderError::Scene(format!("render settings: {what}")));
        if first == 0 || most > u32::from(u16::MAX) || first > most {
            return fail(format!(
                "samples_per_pixel is {first} and max_samples_per_pixel {most}: the first must be at least 1, the second no smaller and at most 65535"
            ));
        }
        if !(self.noise_target >= 0.0 && self.noise_target.is_finite()) {
            return fail(format!("noise_target is {}; it must not be negative", self.noise_target));
        }
        if !(self.sensor_noise >= 0.0 && self.sensor_noise.is_finite()) {
            return fail(format!("sensor_noise is {}; it must be 0 (off) or positive", self.sensor_noise));
        }
        if self.shadow_spacing_px != 0.0 && !(0.1..=1000.0).contains(&self.shadow_spacing_px) {
            return fail(format!(
                "shadow_spacing_px is {}; it is 0 (off) or lies in 0.1..1000",
                self.shadow_spacing_px
            ));
        }
        if !(4..=65_535).contains(&self.skin_paths) {
            return fail(format!("skin_paths is {}; it lies in 4..65535", self.skin_paths));
        }
        if !(1..=MOST_DEPTH).contains(&self.depth) || !(1..=65_535).contains(&self.indirect_every) {
            return fail(format!(
                "depth is {} and indirect_every {}; the first lies in 1..{MOST_DEPTH}, the second in 1..65535",
                self.depth, self.indirect_every
            ));
        }
        if !(self.clamp >= 0.0 && self.clamp.is_finite()) {
            return fail(format!("clamp is {}; it must be 0 (off) or positive", self.clamp));
        }
        if pixels as u64 * u64::from(first) > u64::from(u32::MAX) {
            return fail(format!(
                "{pixels} pixels times {first} samples are more hits than 32 bits count; use fewer samples_per_pixel"
            ));
        }
        Ok(())
    }
}

/// One rendered view.
#[derive(Clone, Debug)]
pub struct Render {
    /// Mean radiance, linear RGB.
    pub radiance_rgb: Plane<[f32; 3]>,
    /// Variance of the mean of the sensor-weighted radiance.
    pub variance: Plane<f32>,
    /// First hits on hair of the first `samples_per_pixel` rays of each pixel.
    pub hits: SampleHits,
    /// What it took.
    pub stats: Stats,
}

/// Work done for one view.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Stats {
    /// Camera rays traced; rays through pixels that cannot see anything are not.
    pub primary_rays: u64,
    /// Shadow rays.
    pub shadow_rays: u64,
    /// Rays in directions of scattering.
    pub bounce_rays: u64,
    /// Samples whose radiance was not finite, and counted as dark.
    pub not_finite: u64,
    /// Fibre segments that the camera's centre lies inside of; they do not hide anything from it.
    pub fibres_at_eye: u64,
    /// Share of pixels that reached the noise target.
    pub converged: f64,
    /// Wall seconds.
    pub wall_s: f64,
}

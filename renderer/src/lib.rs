//! A ray tracer for hair fibres and meshes with Marschner shading, and the cameras' imperfections.

use strandbench_scenes::{Scene, Sensor};
use strandbench_types::{Cancelled, Monitor, Plane, SampleHits};

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

/// How much work a render does.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Settings {
    /// Rays through each pixel before convergence is looked at; all of them feed the identity buffer.
    pub samples_per_pixel: u32,
    /// Upper limit of rays through a pixel.
    pub max_samples_per_pixel: u32,
    /// Standard error of a pixel's radiance, relative to the sensor's full scale, at which it is converged.
    pub noise_target: f32,
}

impl Default for Settings {
    fn default() -> Settings {
        Settings { samples_per_pixel: 32, max_samples_per_pixel: 128, noise_target: 0.01 }
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
    /// Camera rays.
    pub primary_rays: u64,
    /// Shadow rays.
    pub shadow_rays: u64,
    /// Share of pixels that reached the noise target.
    pub converged: f64,
    /// Wall seconds.
    pub wall_s: f64,
}

/// A scene with its acceleration structure, shared by all views.
pub struct RenderScene<'a> {
    scene: &'a Scene,
}

impl<'a> RenderScene<'a> {
    /// Builds the acceleration structure.
    ///
    /// # Errors
    /// If the strands are invalid or there is nothing to render.
    pub fn new(scene: &'a Scene) -> Result<RenderScene<'a>, RenderError> {
        Ok(RenderScene { scene })
    }

    /// Renders the view of camera `camera` (index in the scene's true rig); same seed, same bits.
    ///
    /// # Errors
    /// If the camera does not exist or the work is cancelled.
    pub fn render(
        &self,
        camera: usize,
        _settings: &Settings,
        _seed: u64,
        _monitor: &dyn Monitor,
    ) -> Result<Render, RenderError> {
        Err(RenderError::Scene(format!("{}: camera {camera} is not built yet", self.scene.name)))
    }
}

/// The linear-light monochrome image (1.0 = full scale) that camera `camera` delivers for a radiance.
pub fn expose(_sensor: &Sensor, _camera: usize, radiance_rgb: &Plane<[f32; 3]>, _seed: u64) -> Plane<f32> {
    radiance_rgb.map(|c| c[0])
}

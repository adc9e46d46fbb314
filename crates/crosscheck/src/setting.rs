//! A small scene for both renderers: strands of one colour, lights, one camera.

use crate::camera::described;
use crate::geometry::with_strands;
use crate::tables::{chiang_optics, marschner_optics};
use crate::{Bundle, CrossError};
use glam::Vec3;
use serde_json::{Value, json};
use strandbench_scenes::{
    AreaLight, FibreOptics, OpticsModel, Pigment, RigMotion, Scene, Sensor, SkinOptics,
};
use strandbench_types::{Camera, Rig, StrandSet};

/// Weights of linear RGB in luminance (Rec. 709).
pub(crate) const LUMINANCE: [f32; 3] = [0.2126, 0.7152, 0.0722];

/// Strands, and how they look.
#[derive(Clone, Debug)]
pub(crate) struct Setting {
    pub strands: StrandSet,
    pub model: OpticsModel,
    pub pigment: Pigment,
    pub camera: Camera,
    pub lights: Vec<AreaLight>,
}

/// A rectangle of 2 `half_mm` by 2 `half_mm` that shines at the origin.
pub(crate) fn light(centre_mm: Vec3, half_mm: f32, radiance_rgb: [f32; 3]) -> AreaLight {
    let towards = -centre_mm.normalize();
    let half_u = towards.cross(Vec3::Y).normalize() * half_mm;
    AreaLight { centre_mm, half_u_mm: half_u, half_v_mm: towards.cross(half_u), radiance_rgb }
}

impl Setting {
    /// The fibres' optics as the reference jobs are told them.
    pub fn told(&self) -> Value {
        let absorption = self.pigment.absorption_rgb();
        match self.model {
            OpticsModel::Chiang => json!({
                "longitudinal_roughness": 0.28f32,
                "azimuthal_roughness": 0.3f32,
                "scale_tilt_deg": -2.0f32,
                "index": 1.55f32,
                "absorption_rgb": absorption,
            }),
            OpticsModel::Marschner => json!({
                "index": 1.55f32,
                "shift_r_deg": -7.5f32,
                "width_r_deg": 7.5f32,
                "glint_scale": 1.0f32,
                "caustic_width_deg": 15.0f32,
                "fade_range": 0.3f32,
                "caustic_limit": 0.5f32,
                "eccentricity": 1.0f32,
                "roots": "exact",
                "absorption_rgb": absorption,
            }),
        }
    }

    fn optics(&self) -> Result<FibreOptics, String> {
        match self.model {
            // Both renderers with one Bessel function: it is compared on its own at level 2.
            OpticsModel::Chiang => chiang_optics(&self.told(), true).map(|o| o.0),
            OpticsModel::Marschner => marschner_optics(&self.told()).map(|o| o.0),
        }
    }

    /// Strands, optics and camera for the reference job.
    pub fn export(&self, name: &str) -> Bundle {
        let model = match self.model {
            OpticsModel::Chiang => "chiang",
            OpticsModel::Marschner => "marschner",
        };
        let flat = |f: fn(&AreaLight) -> [f32; 3]| self.lights.iter().flat_map(f).collect::<Vec<_>>();
        let n = self.lights.len();
        with_strands(Bundle::new(name), &self.strands)
            .with_meta("optics", self.told())
            .with_meta("model", model)
            .with_meta("camera", described(&self.camera))
            .with("light_centre", &[n, 3], flat(|l| l.centre_mm.to_array()))
            .with("light_half_u", &[n, 3], flat(|l| l.half_u_mm.to_array()))
            .with("light_half_v", &[n, 3], flat(|l| l.half_v_mm.to_array()))
            .with("light_radiance", &[n, 3], flat(|l| l.radiance_rgb))
    }

    /// The scene for our renderer.
    pub fn scene(&self) -> Result<Scene, CrossError> {
        let rig = Rig {
            cameras: vec![self.camera.clone()],
            near_mm: 100.0,
            far_mm: 1000.0,
            frame_rate_hz: 25.0,
            exposure_s: 0.001,
        };
        Ok(Scene {
            name: "cross-check".into(),
            strands: self.strands.clone(),
            pigments: vec![self.pigment; self.strands.len()],
            optics: self.optics().map_err(CrossError::Ours)?,
            surfaces: Vec::new(),
            skin: SkinOptics::default(),
            lights: self.lights.clone(),
            environment: None,
            calibrated_rig: rig.clone(),
            rig,
            lens: None,
            motion: RigMotion::default(),
            polarised: Vec::new(),
            sensor: Sensor { response_rgb: LUMINANCE, ..Sensor::default() },
            background_rgb: [0.0; 3],
            head_breadth_mm: 155.0,
        })
    }
}

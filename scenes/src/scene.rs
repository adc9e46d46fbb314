//! A scene ready to render: geometry, optics, lights, rig and sensor.

use crate::face::SkinDetail;
use glam::Vec3;
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use strandbench_types::{Plane, Rig, StrandSet, TriMesh};

/// Melanin concentrations of a fibre (d'Eon et al. 2011; Chiang et al. 2016), dimensionless; the absorption
/// coefficient is per fibre radius.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pigment {
    /// Eumelanin: blonde near 0.3, brown near 1.3, black near 8.
    pub eumelanin: f32,
    /// Pheomelanin: red near 1-2.
    pub pheomelanin: f32,
}

impl Pigment {
    /// Absorption per fibre radius in linear RGB: eumelanin (0.419, 0.697, 1.37) and pheomelanin
    /// (0.187, 0.4, 1.05) times concentration (d'Eon et al. 2011).
    pub fn absorption_rgb(self) -> [f32; 3] {
        const EUMELANIN: [f32; 3] = [0.419, 0.697, 1.37];
        const PHEOMELANIN: [f32; 3] = [0.187, 0.4, 1.05];
        std::array::from_fn(|c| self.eumelanin * EUMELANIN[c] + self.pheomelanin * PHEOMELANIN[c])
    }
}

/// Which scattering model shades the fibres.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum OpticsModel {
    /// Marschner et al. 2003: far field, averaged across the fibre's width.
    #[default]
    Marschner,
    /// Chiang et al. 2016: near field, with the parameters of Mitsuba 3's `hair`.
    Chiang,
}

/// How Marschner's azimuthal terms find the paths that leave at a given azimuth.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum OpticsRoots {
    /// Snell's law itself.
    #[default]
    Exact,
    /// The cubic of Marschner et al. 2003, Eq. 10.
    Cubic,
}

/// Optics of the fibres: a choice of model, and the models' parameters.
///
/// `index`, `shift_r_deg` and `width_r_deg` describe the fibre to both models. The keys from `glint_scale` to
/// `rest` are Marschner's alone, those from `longitudinal_roughness` on Chiang's; a scene that sets a key of
/// the other model is refused.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct FibreOptics {
    /// `"marschner"` (the default) or `"chiang"`.
    pub model: OpticsModel,
    /// Index of refraction relative to what surrounds the fibre, 1.55.
    pub index: f32,
    /// Longitudinal shift of R in degrees, α_R: -10 to -5 (towards the root); TT is -α_R/2, TRT -3α_R/2.
    pub shift_r_deg: f32,
    /// Longitudinal width (standard deviation) of R in degrees, β_R: 5 to 10; TT is β_R/2, TRT 2β_R.
    pub width_r_deg: f32,
    /// Glint scale factor k_G, 0.5 to 5.
    pub glint_scale: f32,
    /// Azimuthal width of the caustic w_c in degrees, 10 to 25.
    pub caustic_width_deg: f32,
    /// Fade range of the caustic merge Δη', 0.2 to 0.4.
    pub fade_range: f32,
    /// Caustic intensity limit Δh_M, 0.5.
    pub caustic_limit: f32,
    /// Eccentricity a (major over minor axis), 0.85 to 1.
    pub eccentricity: f32,
    /// `"exact"` (the default) or `"cubic"`.
    pub roots: OpticsRoots,
    /// Whether the paths of two and more inner reflections (p >= 3), which Marschner et al. leave out, are added
    /// as a fourth lobe.
    pub rest: bool,
    /// Chiang's β_m, in (0, 1]; if absent, the one whose R lobe is as wide as `width_r_deg` says.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub longitudinal_roughness: Option<f32>,
    /// Chiang's β_n, in (0, 1]; if absent 0.3.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub azimuthal_roughness: Option<f32>,
    /// Tilt of the scales α in degrees with the sign that Mitsuba gives it: R moves by 2α towards the *tip*, so
    /// hair has a negative one; if absent, `shift_r_deg`, which is the same quantity.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scale_tilt_deg: Option<f32>,
    /// Whether the Bessel function is approximated as in Mitsuba 3, which is up to 0.6 % off; for comparisons
    /// with it.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub mitsuba_bessel: bool,
}

impl FibreOptics {
    /// The first key that is set to something else than its default although the chosen model does not have it.
    pub fn foreign_key(&self) -> Option<&'static str> {
        let d = FibreOptics::default();
        let marschner = [
            ("glint_scale", self.glint_scale != d.glint_scale),
            ("caustic_width_deg", self.caustic_width_deg != d.caustic_width_deg),
            ("fade_range", self.fade_range != d.fade_range),
            ("caustic_limit", self.caustic_limit != d.caustic_limit),
            ("eccentricity", self.eccentricity != d.eccentricity),
            ("roots", self.roots != d.roots),
            ("rest", self.rest != d.rest),
        ];
        let chiang = [
            ("longitudinal_roughness", self.longitudinal_roughness.is_some()),
            ("azimuthal_roughness", self.azimuthal_roughness.is_some()),
            ("scale_tilt_deg", self.scale_tilt_deg.is_some()),
            ("mitsuba_bessel", self.mitsuba_bessel),
        ];
        let foreign: &[(&'static str, bool)] = match self.model {
            OpticsModel::Marschner => &chiang,
            OpticsModel::Chiang => &marschner,
        };
        foreign.iter().find(|(_, set)| *set).map(|(key, _)| *key)
    }
}

impl Default for FibreOptics {
    /// The middle of the ranges in Marschner et al. 2003, Table 1; a round fibre.
    fn default() -> FibreOptics {
        FibreOptics {
            model: OpticsModel::Marschner,
            index: 1.55,
            shift_r_deg: -7.5,
            width_r_deg: 7.5,
            glint_scale: 1.0,
            caustic_width_deg: 15.0,
            fade_range: 0.3,
            caustic_limit: 0.5,
            eccentricity: 1.0,
            roots: OpticsRoots::Exact,
            rest: false,
            longitudinal_roughness: None,
            azimuthal_roughness: None,
            scale_tilt_deg: None,
            mitsuba_bessel: false,
        }
    }
}

/// A rectangular one-sided emitter.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AreaLight {
    /// Centre, mm, world.
    pub centre_mm: Vec3,
    /// Half of the first edge, mm; light leaves along `half_u_mm x half_v_mm`.
    pub half_u_mm: Vec3,
    /// Half of the second edge, mm.
    pub half_v_mm: Vec3,
    /// Emitted radiance, linear RGB.
    pub radiance_rgb: [f32; 3],
}

/// Light from infinitely far around the scene: radiance on a map of equal steps in azimuth (columns) and
/// inclination (rows), constant within a texel; one texel is a constant environment.
///
/// With the scene's +y up, row 0 is around +y and the last row around -y. The middle of the columns lies towards
/// +z, columns to the right of it turn towards -x, as a viewer inside who looks along +z sees it (the convention of
/// Mitsuba's `envmap`). Cameras do not see it; they see the scene's background.
#[derive(Clone, Debug, PartialEq)]
pub struct Environment {
    /// Radiance, linear RGB.
    pub radiance_rgb: Plane<[f32; 3]>,
    /// By how much the map is turned about +y, degrees; 90 takes what was at +z to +x.
    pub azimuth_deg: f32,
}

impl Environment {
    /// The same radiance from everywhere.
    pub fn constant(radiance_rgb: [f32; 3]) -> Environment {
        Environment { radiance_rgb: Plane::filled(1, 1, radiance_rgb), azimuth_deg: 0.0 }
    }
}

/// Optics of skin: a rough dielectric coat over Lambert's law.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SkinOptics {
    /// Reflectance of the coat at normal incidence; 0 leaves the coat out, and skin is Lambert's law alone.
    pub coat_reflectance: f32,
    /// Roughness α of the coat's GGX distribution.
    pub coat_roughness: f32,
    /// How far light spreads below surfaces with a [`SkinDetail`]: standard deviation of the widest of the Gaussians
    /// that make up the profile of skin (d'Eon et al. 2007), mm; 2.72 is skin as they measured it, and the others scale
    /// with it. 0 leaves light where it enters.
    #[serde(skip_serializing_if = "is_zero")]
    pub scatter_mm: f32,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde's signature")]
fn is_zero(v: &f32) -> bool {
    *v == 0.0
}

impl Default for SkinOptics {
    /// Index of refraction 1.4 (skin); a sheen as wide as on skin without make-up.
    fn default() -> SkinOptics {
        SkinOptics { coat_reflectance: 0.028, coat_roughness: 0.35, scatter_mm: 0.0 }
    }
}

/// A thin lens with a round aperture, the same for every camera.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Lens {
    /// Radius of the aperture, mm.
    pub aperture_radius_mm: f64,
    /// Depth along +z that is in focus, mm.
    pub focus_mm: f64,
}

/// How the rig moves while the shutter is open; the cameras' stated pose is the one in the middle of the
/// exposure.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RigMotion {
    /// Velocity of every camera, mm/s, world axes.
    pub velocity_mm_s: [f64; 3],
    /// Turning of every camera about its own centre: axis (world) times speed, degrees per second.
    pub turn_deg_s: [f64; 3],
}

impl RigMotion {
    /// Whether nothing moves.
    pub fn is_still(&self) -> bool {
        self.velocity_mm_s == [0.0; 3] && self.turn_deg_s == [0.0; 3]
    }
}

/// A solid surface, shaded with a diffuse and a weak specular term.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    /// Geometry, mm, world.
    pub mesh: TriMesh,
    /// Diffuse albedo, linear RGB, where there is no detail.
    pub albedo_rgb: [f32; 3],
    /// What the surface looks like close by, in place of one albedo.
    pub detail: Option<Arc<SkinDetail>>,
}

impl Surface {
    /// A surface of one albedo all over.
    pub fn plain(mesh: TriMesh, albedo_rgb: [f32; 3]) -> Surface {
        Surface { mesh, albedo_rgb, detail: None }
    }
}

/// What a camera does to the light it gets; a zero switches a fault off.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Sensor {
    /// Scene radiance (weighted RGB) that fills the sensor at gain 1.
    pub full_scale_radiance: f32,
    /// Standard deviation of the gain between cameras (relative).
    pub gain_spread: f32,
    /// Full well in electrons: shot noise has variance signal/full_well; 0 switches it off.
    pub full_well_e: f32,
    /// Read noise in electrons (standard deviation); needs `full_well_e`.
    pub read_noise_e: f32,
    /// Relative light loss at the image corner (0.1 = 10 %), quadratic in radius.
    pub vignetting: f32,
    /// Bits of the quantiser; 0 switches it off.
    pub bits: u32,
    /// Weights of linear RGB in the monochrome response.
    pub response_rgb: [f32; 3],
}

impl Default for Sensor {
    fn default() -> Sensor {
        Sensor {
            full_scale_radiance: 1.0,
            gain_spread: 0.03,
            full_well_e: 16_000.0,
            read_noise_e: 15.0,
            vignetting: 0.08,
            bits: 12,
            response_rgb: [0.3, 0.4, 0.3],
        }
    }
}

/// Everything that the renderer and the ground truth need for one frame.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Catalogue name or file stem.
    pub name: String,
    /// Fibres, mm, world, root first.
    pub strands: StrandSet,
    /// Pigment, indexed `[strand]`.
    pub pigments: Vec<Pigment>,
    /// Optics that all fibres share.
    pub optics: FibreOptics,
    /// Head and shoulders; the first is the head.
    pub surfaces: Vec<Surface>,
    /// Optics that all surfaces share.
    pub skin: SkinOptics,
    /// Emitters.
    pub lights: Vec<AreaLight>,
    /// Light from all around, if there is any.
    pub environment: Option<Environment>,
    /// The rig as it is.
    pub rig: Rig,
    /// The rig as calibration believes it to be: what a method is given.
    pub calibrated_rig: Rig,
    /// The cameras' lens; without one they are pinholes.
    pub lens: Option<Lens>,
    /// Motion of the rig during the exposure.
    pub motion: RigMotion,
    /// Which cameras have a polarising filter crossed with those of the lights, indexed `[camera]`; empty if none has.
    pub polarised: Vec<bool>,
    /// The cameras' response and faults.
    pub sensor: Sensor,
    /// Radiance of the background, linear RGB.
    pub background_rgb: [f32; 3],
    /// Head breadth in mm.
    pub head_breadth_mm: f32,
}

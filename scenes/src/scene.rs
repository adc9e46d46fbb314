//! A scene ready to render: geometry, optics, lights, rig and sensor.

use glam::Vec3;
use serde::{Deserialize, Serialize};
use strandbench_types::{Rig, StrandSet, TriMesh};

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

/// Parameters of Marschner et al. 2003, Table 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct FibreOptics {
    /// Index of refraction, 1.55.
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
}

impl Default for FibreOptics {
    /// The middle of the ranges in Marschner et al. 2003, Table 1; a round fibre.
    fn default() -> FibreOptics {
        FibreOptics {
            index: 1.55,
            shift_r_deg: -7.5,
            width_r_deg: 7.5,
            glint_scale: 1.0,
            caustic_width_deg: 15.0,
            fade_range: 0.3,
            caustic_limit: 0.5,
            eccentricity: 1.0,
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

/// A solid surface, shaded with a diffuse and a weak specular term.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    /// Geometry, mm, world.
    pub mesh: TriMesh,
    /// Diffuse albedo, linear RGB.
    pub albedo_rgb: [f32; 3],
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
    /// Emitters.
    pub lights: Vec<AreaLight>,
    /// The rig as it is.
    pub rig: Rig,
    /// The rig as calibration believes it to be: what a method is given.
    pub calibrated_rig: Rig,
    /// The cameras' response and faults.
    pub sensor: Sensor,
    /// Radiance of the background, linear RGB.
    pub background_rgb: [f32; 3],
    /// Head breadth in mm.
    pub head_breadth_mm: f32,
}

//! What a scene file says.

mod check;
mod environment;
mod groom;
mod motion;
mod parse;
mod rig;

pub(crate) use check::{Fault, within};
pub use environment::EnvironmentSpec;
pub use groom::{
    Clumping, Disorder, Family, Fringe, GroomSpec, LengthSpec, MAX_STRANDS, Parting, StyleSpec, WaveSpec,
};
pub use motion::{HeadDrive, MotionSolver, MotionSpec, Swing, WindSpec};
pub(crate) use parse::checked;
pub use parse::parse;
pub use rig::{CalibrationError, LensSpec, LightSpec, RigSpec};

use crate::{FibreOptics, Pigment, Sensor, SkinOptics};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use strandbench_io::ImportOptions;

/// How hard a scene is meant to be for image-based reconstruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Difficulty {
    /// Smooth, ordered hair; one visible surface.
    Easy,
    /// Waves, layers, dark fibres or depth steps.
    Middle,
    /// Curls, crossing wisps, gaps and strong self-shadowing.
    Hard,
}

/// A scene as its TOML file states it. Exactly one of `groom` and `hair_file` is present.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneSpec {
    /// Name; the file's stem where the file gives none.
    #[serde(default)]
    pub name: String,
    /// One line for people.
    #[serde(default)]
    pub description: String,
    /// How hard the scene is meant to be.
    pub difficulty: Difficulty,
    /// What the scene is there to stress.
    pub stresses: String,
    /// Seed of everything random in the scene's geometry; the run's seed is mixed in.
    #[serde(default)]
    pub seed: u64,
    /// Radiance behind the hair, linear RGB.
    #[serde(default)]
    pub background_rgb: [f32; 3],
    /// The head.
    #[serde(default)]
    pub head: HeadSpec,
    /// Procedural hair.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub groom: Option<GroomSpec>,
    /// Hair from a file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hair_file: Option<HairFileSpec>,
    /// Colour of the hair.
    #[serde(default)]
    pub pigment: PigmentSpec,
    /// Optics of the fibres.
    #[serde(default)]
    pub optics: FibreOptics,
    /// Optics of skin.
    #[serde(default)]
    pub skin: SkinOptics,
    /// Cameras.
    #[serde(default)]
    pub rig: RigSpec,
    /// Emitters.
    #[serde(default)]
    pub lights: LightSpec,
    /// Light from all around.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub environment: Option<EnvironmentSpec>,
    /// The cameras' response and faults.
    #[serde(default)]
    pub sensor: Sensor,
    /// How the hair moves; one pose where absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motion: Option<MotionSpec>,
}

/// Which solid surface the hair surrounds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct HeadSpec {
    /// Breadth of the cranium above the ears, mm.
    pub breadth_mm: f32,
    /// Diffuse albedo of the skin, linear RGB.
    pub albedo_rgb: [f32; 3],
    /// Whether the embedded head is part of the scene. Procedural hair always needs it; hair from a file has
    /// its own head or none.
    pub embedded: bool,
    /// A `.ply` or `.obj` head in the hair file's own units, relative to the scene file; only with `hair_file`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mesh_file: Option<PathBuf>,
}

impl Default for HeadSpec {
    fn default() -> HeadSpec {
        HeadSpec { breadth_mm: 155.0, albedo_rgb: [0.3, 0.19, 0.14], embedded: true, mesh_file: None }
    }
}

/// Strands from a file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HairFileSpec {
    /// The file, relative to the scene file.
    pub path: PathBuf,
    /// Units and axes of the file, fibre radius and resampling.
    #[serde(default)]
    pub import: ImportOptions,
    /// Whether hair and head mesh are moved together so that the middle of the hair's box is at the origin,
    /// the point that the rig looks at.
    #[serde(default = "yes")]
    pub centre: bool,
}

fn yes() -> bool {
    true
}

/// Melanin of the hair and how it varies.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PigmentSpec {
    /// Median eumelanin concentration ([`Pigment`]).
    pub eumelanin: f32,
    /// Median pheomelanin concentration.
    pub pheomelanin: f32,
    /// Standard deviation of the logarithm of both between strands.
    pub strand_spread: f32,
    /// The same between tufts: highlights and lowlights.
    pub tuft_spread: f32,
}

impl Default for PigmentSpec {
    /// Dark blonde.
    fn default() -> PigmentSpec {
        PigmentSpec { eumelanin: 0.35, pheomelanin: 0.12, strand_spread: 0.18, tuft_spread: 0.12 }
    }
}

impl PigmentSpec {
    /// The median fibre.
    pub fn median(&self) -> Pigment {
        Pigment { eumelanin: self.eumelanin, pheomelanin: self.pheomelanin }
    }
}

impl SceneSpec {
    /// Real strands on the default rig: centred on the rig's target, with the default pigment, and a head
    /// mesh in the file's units if one is given (no head otherwise). Paths are used as they are.
    pub fn from_hair_file(
        path: impl Into<PathBuf>,
        import: ImportOptions,
        head_mesh: Option<PathBuf>,
    ) -> SceneSpec {
        let path = path.into();
        let name = path.file_stem().map_or_else(|| "hair".into(), |s| s.to_string_lossy().into_owned());
        SceneSpec {
            description: format!("strands of {}", path.display()),
            name,
            difficulty: Difficulty::Middle,
            stresses: "strands from outside".into(),
            seed: 0,
            background_rgb: [0.0; 3],
            head: HeadSpec { embedded: false, mesh_file: head_mesh, ..HeadSpec::default() },
            groom: None,
            hair_file: Some(HairFileSpec { path, import, centre: true }),
            pigment: PigmentSpec::default(),
            optics: FibreOptics::default(),
            skin: SkinOptics::default(),
            rig: RigSpec::default(),
            lights: LightSpec::default(),
            environment: None,
            sensor: Sensor::default(),
            motion: None,
        }
    }

    /// The same scene with another number of procedural strands; the few are spread as the many, so that
    /// tests can be small. Hair from a file is left as it is.
    #[must_use]
    pub fn with_strands(mut self, strands: u32) -> SceneSpec {
        if let Some(groom) = &mut self.groom {
            groom.strands = strands;
        }
        self
    }

    /// The same scene with another fibre radius (mm), procedural or imported.
    #[must_use]
    pub fn with_radius_mm(mut self, radius_mm: f32) -> SceneSpec {
        if let Some(groom) = &mut self.groom {
            groom.radius_mm = radius_mm;
        }
        if let Some(file) = &mut self.hair_file {
            file.import.radius_mm = Some(radius_mm);
        }
        self
    }

    /// The same scene with other baselines (mm) between the reference and the side and top cameras.
    #[must_use]
    pub fn with_baselines_mm(mut self, baseline_x_mm: f64, baseline_y_mm: f64) -> SceneSpec {
        (self.rig.baseline_x_mm, self.rig.baseline_y_mm) = (baseline_x_mm, baseline_y_mm);
        self
    }

    /// The scene as TOML.
    pub fn to_toml(&self) -> String {
        toml::to_string_pretty(self).expect("a scene has no value that TOML cannot hold")
    }
}

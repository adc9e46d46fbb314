//! What a run and its stages can be asked.

use clap::Args as ClapArgs;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use strandbench_suite::Setting;
use strandbench_suite::sequence::Frames;

/// Which scenes.
#[derive(ClapArgs, Debug, Clone, Serialize, Deserialize)]
pub struct SceneArgs {
    /// A scene of the catalogue by name, or a .toml file; may be repeated
    #[arg(long, value_name = "NAME|FILE.toml")]
    pub scene: Vec<String>,
    /// Every scene of the catalogue that does not move; with --frames those that move too
    #[arg(long, conflicts_with = "scene")]
    pub all: bool,
    /// Real strands from a .hair, .data, .ply or .tfx file instead of a scene
    #[arg(long, value_name = "FILE", conflicts_with_all = ["scene", "all"])]
    pub hair: Option<PathBuf>,
    #[command(flatten)]
    pub import: ImportOptionArgs,
    /// Change one value: scene.KEY=VALUE, render.KEY=VALUE or recon.KEY=VALUE; may be repeated
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = parse_setting)]
    pub settings: Vec<Setting>,
    /// Frames of a moving scene: A..B (without B), A.., ..B, or how many [default: all]
    #[arg(long, value_name = "A..B", conflicts_with = "hair")]
    pub frames: Option<Frames>,
    /// Seed of hair, sampling, sensor noise and nulls; may be repeated
    #[arg(long, default_value = "1")]
    pub seed: Vec<u64>,
    /// Where results go
    #[arg(long, default_value = "strandbench-out", value_name = "DIR")]
    pub out: PathBuf,
}

pub(crate) fn parse_setting(text: &str) -> Result<Setting, String> {
    // The option's name is already in clap's own words around this.
    text.parse().map_err(|e: strandbench_suite::SuiteError| match e {
        strandbench_suite::SuiteError::Setting { problem, .. } => problem,
        other => other.to_string(),
    })
}

/// How a hair file becomes millimetres.
#[derive(ClapArgs, Debug, Clone, Serialize, Deserialize)]
#[command(next_help_heading = "Hair files")]
pub struct ImportOptionArgs {
    /// Scale and axes of a published collection: yuksel, yuksel-woman, usc, neuralhaircut
    #[arg(long, value_name = "NAME")]
    pub preset: Option<String>,
    /// Millimetres of one unit of the file
    #[arg(long, value_name = "MM")]
    pub scale_mm: Option<f64>,
    /// Axis of the file that points up: x, -x, y, -y, z, -z
    #[arg(long, value_name = "AXIS", allow_hyphen_values = true)]
    pub up: Option<String>,
    /// Axis of the file that the face looks along
    #[arg(long, value_name = "AXIS", allow_hyphen_values = true)]
    pub forward: Option<String>,
    /// Fibre radius [default for run: 0.04 mm for a full head, the same volume of hair for fewer strands]
    #[arg(long, value_name = "MM")]
    pub radius_mm: Option<f32>,
    /// Longest segment after smooth resampling
    #[arg(long, value_name = "MM")]
    pub max_segment_mm: Option<f32>,
    /// Points of each strand, for a .ply of bare points
    #[arg(long, value_name = "N")]
    pub points_per_strand: Option<u32>,
    /// Head mesh (.ply or .obj) in the units and axes of the hair file
    #[arg(long, value_name = "FILE")]
    pub head: Option<PathBuf>,
}

#[derive(ClapArgs, Debug, Clone, Serialize, Deserialize)]
pub struct RunArgs {
    #[command(flatten)]
    pub scene: SceneArgs,
    /// Variant of the method (see `strandbench variants list`); may be repeated
    #[arg(long, default_value = "luo", value_name = "NAME")]
    pub variant: Vec<String>,
    /// Longest that one scene with one variant may take; beyond it its row says "timed out"
    #[arg(long, value_name = "SECONDS", value_parser = parse_seconds)]
    pub time_limit: Option<f64>,
}

fn parse_seconds(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(s) if s > 0.0 && f64::is_finite(s) => Ok(s),
        _ => Err("expected a positive number of seconds".to_owned()),
    }
}

#[derive(ClapArgs, Debug)]
pub struct RenderArgs {
    #[command(flatten)]
    pub scene: SceneArgs,
}

#[derive(ClapArgs, Debug)]
pub struct ReconstructArgs {
    /// A render folder, or a frame folder (rig.json, frame.json, images, masks)
    pub folder: PathBuf,
    /// Variant of the method
    #[arg(long, default_value = "luo", value_name = "NAME")]
    pub variant: String,
    /// Change one parameter of the method: KEY=VALUE; may be repeated
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = parse_setting)]
    pub settings: Vec<Setting>,
    /// Folder to write [default: ../<variant>/reconstruct beside the render folder]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

#[derive(ClapArgs, Debug)]
pub struct ScoreArgs {
    /// A variant folder, its reconstruct folder, or any estimate folder
    #[arg(required_unless_present = "estimate")]
    pub folder: Option<PathBuf>,
    /// The answer of any program: depth maps, meshes, points or strands
    #[arg(long, value_name = "DIR", conflicts_with = "folder", requires_all = ["truth", "out"])]
    pub estimate: Option<PathBuf>,
    /// The truth folder, or the render folder around it [default: ../render/truth beside the variant folder]
    #[arg(long, value_name = "DIR")]
    pub truth: Option<PathBuf>,
    /// Seed of the nulls [default: the render's]
    #[arg(long)]
    pub seed: Option<u64>,
    /// Of a sequence with strands: two variant folders, each beside its render, of the same hair at rest, one rendered
    /// with --set render.noise=1; what they differ by is the flicker floor that C2 is measured above
    #[arg(long, num_args = 2, value_names = ["DIR", "DIR"])]
    pub rest: Vec<PathBuf>,
    /// Folder to write [default: score in the variant folder]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

#[derive(ClapArgs, Debug)]
pub struct ReportArgs {
    /// A variant folder that holds reconstruct and score
    pub folder: PathBuf,
    /// The render folder [default: ../render beside the variant folder]
    #[arg(long, value_name = "DIR")]
    pub render: Option<PathBuf>,
}

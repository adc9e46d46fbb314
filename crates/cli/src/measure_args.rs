//! What can be asked of the method and of the renderer: ablations, speed, cross-checks.

use crate::stage_args::parse_setting;
use clap::Args as ClapArgs;
use std::path::PathBuf;
use strandbench_suite::Setting;
use strandbench_suite::ablate::Set;
use strandbench_suite::sequence::Frames;

#[derive(ClapArgs, Debug)]
pub struct CrosscheckArgs {
    /// 0 cameras, 1 geometry, 2 scattering, 3 direct light, 4 images; may be repeated [default: 0 to 3]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(0..=4))]
    pub level: Vec<u8>,
    /// More rays, larger grids, larger images
    #[arg(long)]
    pub full: bool,
    /// Where the report goes
    #[arg(long, default_value = "strandbench-out/crosscheck", value_name = "DIR")]
    pub out: PathBuf,
}

#[derive(ClapArgs, Debug)]
pub struct AblateArgs {
    /// Which: see --list; may be repeated
    #[arg(value_name = "NAME", required_unless_present = "list")]
    pub names: Vec<String>,
    /// Print the ablations and what they compare
    #[arg(long)]
    pub list: bool,
    /// small: a few scenes, direct light; full: at least 20 scene-seed cells at the defaults
    #[arg(long = "on", default_value = "small", value_name = "SET", value_parser = <Set as std::str::FromStr>::from_str)]
    pub on: Set,
    /// A scene of the catalogue by name, or a .toml file, instead of a set; may be repeated
    #[arg(long, value_name = "NAME|FILE.toml", conflicts_with = "on")]
    pub scene: Vec<String>,
    /// A scene to tune the weights on, with --scene; without one each variant keeps its own
    #[arg(long, value_name = "NAME|FILE.toml", requires = "scene")]
    pub tune_on: Vec<String>,
    /// Seed of hair, sampling, noise and nulls, with --scene; may be repeated [default: 1]
    #[arg(long, requires = "scene")]
    pub seed: Vec<u64>,
    /// Change one value of all scenes, with --scene: scene.KEY=VALUE or render.KEY=VALUE; may be repeated
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = parse_setting, requires = "scene")]
    pub settings: Vec<Setting>,
    /// Frames of a moving scene, with --scene: A..B (without B)
    #[arg(long, value_name = "A..B", requires = "scene")]
    pub frames: Option<Frames>,
    /// Where results go
    #[arg(long, default_value = "strandbench-out", value_name = "DIR")]
    pub out: PathBuf,
}

/// What to time.
#[derive(ClapArgs, Debug)]
pub struct BenchArgs {
    /// Rays, whole frames at equal noise, or the build of the acceleration structure alone
    #[arg(long, default_value = "all", value_parser = ["build", "rays", "frames", "all"])]
    pub what: String,
    /// Strands of the wavy hair that everything is timed on
    #[arg(long, default_value_t = 50_000, value_name = "N")]
    pub strands: u32,
    /// Segments of each strand
    #[arg(long, default_value_t = 50, value_name = "N")]
    pub segments: u32,
    /// Camera rays of a round
    #[arg(long, default_value_t = 100_000, value_name = "N")]
    pub rays: u32,
    /// Rounds of rays, and images of each kind
    #[arg(long, default_value_t = 5, value_name = "N")]
    pub rounds: u32,
    /// Python with mitsuba and embreex [default: STRANDBENCH_PYTHON, or python3]
    #[arg(long, value_name = "FILE")]
    pub python: Option<PathBuf>,
    /// Embree 4 [default: that of the Python package embreex, or the system's]
    #[arg(long, value_name = "FILE")]
    pub embree: Option<PathBuf>,
    /// Write bench.json and tables as CSV into this folder
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

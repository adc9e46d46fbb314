//! What can be asked of files: catalogues, imports, exports, data sets for others' programs.

use crate::stage_args::ImportOptionArgs;
use clap::{Args as ClapArgs, Subcommand};
use std::path::PathBuf;

#[derive(Subcommand, Debug)]
pub enum DatasetCommand {
    /// Write a render folder's images, masks and calibration (COLMAP, OpenCV, NeRF), head and scalp
    #[command(after_help = "Examples:
  strandbench dataset export strandbench-out/straight-blonde/render my-dataset
  strandbench dataset export strandbench-out/moving-still/render my-dataset --truth

The calibration is the one that a method is given. README.md in the folder says what is what, and how an answer lies.")]
    Export(DatasetArgs),
}

#[derive(ClapArgs, Debug)]
pub struct DatasetArgs {
    /// A render folder
    pub render: PathBuf,
    /// Folder to write; must not be there yet
    pub out: PathBuf,
    /// The truth too, in truth/: depth, strands, the rig as it is
    #[arg(long)]
    pub truth: bool,
    /// Neither head nor scalp, which no built-in method is given
    #[arg(long)]
    pub no_head: bool,
}

#[derive(Subcommand, Debug)]
pub enum BaselinesCommand {
    /// What there is
    List,
    /// Write the programs and a strandbench.toml that runs them
    #[command(after_help = "Example:
  strandbench baselines config baselines
  strandbench run --config baselines/strandbench.toml --variant opencv-sgbm --variant luo

They need Python with NumPy and OpenCV: an environment with both is made in the user's cache folder on first use, unless
--python or STRANDBENCH_PYTHON names a Python that has them.")]
    Config(BaselinesArgs),
}

#[derive(ClapArgs, Debug)]
pub struct BaselinesArgs {
    /// Folder to write into
    #[arg(default_value = "baselines", value_name = "DIR")]
    pub out: PathBuf,
    /// Python with the packages of requirements.txt [default: STRANDBENCH_PYTHON, or an environment made for it]
    #[arg(long, value_name = "FILE")]
    pub python: Option<PathBuf>,
}

#[derive(Subcommand, Debug)]
pub enum ListArgs {
    /// One line each
    List,
    /// One of them, whole
    Show {
        /// Its name.
        name: String,
    },
}

#[derive(ClapArgs, Debug)]
pub struct ImportArgs {
    /// The hair file
    pub file: PathBuf,
    /// What to write: .hair, .data, .ply or .obj
    pub out: PathBuf,
    #[command(flatten)]
    pub options: ImportOptionArgs,
    /// Replace OUT if it is there
    #[arg(long)]
    pub force: bool,
}

#[derive(ClapArgs, Debug)]
pub struct ExportArgs {
    /// A variant folder or any estimate folder; with --truth a render folder
    pub folder: PathBuf,
    /// Folder to write; must not be there yet
    pub out: PathBuf,
    /// Format of the strands
    #[arg(long, default_value = "usda", value_parser = strandbench_suite::STRAND_ENDINGS)]
    pub strands: String,
    /// Format of the envelope (or, with --truth, the head)
    #[arg(long, default_value = "usda", value_parser = strandbench_suite::MESH_ENDINGS)]
    pub envelope: String,
    /// The true strands and the head instead of the method's answer
    #[arg(long)]
    pub truth: bool,
}

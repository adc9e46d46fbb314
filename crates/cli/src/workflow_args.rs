//! A run as a workflow.

use crate::stage_args::RunArgs;
use clap::{Args as ClapArgs, Subcommand};
use std::path::PathBuf;
use strandbench_suite::sequence::Frames;
use strandbench_suite::workflow::Part;

#[derive(Subcommand, Debug)]
pub enum WorkflowCommand {
    /// Write the workflow of a run: its arguments are those of `strandbench run`
    #[command(after_help = "Examples:
  strandbench workflow write --all --seed 1 --seed 2 --variant luo --variant luo-ncc --out results --to flow
  cd flow && snakemake --profile profiles/local --cores 8
  strandbench workflow write --scene moving-straight-blonde --variant luo-strands --frames 0..200 --to flow

README.md in the folder says how to start it here or on a cluster. Stop or kill it as you like and start it again: what is
finished is not repeated. Its results.json, results.csv and index.html are those of `strandbench run`, bit for bit.")]
    Write(Box<WriteArgs>),
    /// Job: render a scene, or a part of a moving one
    Render(RenderJobArgs),
    /// Job: reconstruct, score and report a cell. A cell that fails is a row of the report, not a failed job
    Cell(CellJobArgs),
    /// Job: the report over all cells, from their folders; nothing is worked out anew
    Merge(MergeArgs),
}

#[derive(ClapArgs, Debug)]
pub struct WriteArgs {
    #[command(flatten)]
    pub run: RunArgs,
    /// Folder to write the workflow into
    #[arg(long, value_name = "DIR")]
    pub to: PathBuf,
    /// Worker threads of one job
    #[arg(long, default_value_t = 1, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub job_threads: u16,
    /// Most frames of a moving scene that one job renders
    #[arg(long, default_value_t = 20, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub frames_per_job: u32,
}

#[derive(ClapArgs, Debug)]
pub struct RenderJobArgs {
    /// The workflow's plan.json
    pub plan: PathBuf,
    /// Key of the render
    pub key: String,
    /// Of a moving scene: motion, or frames A..B [default: all of it]
    #[arg(long, value_name = "PART", value_parser = parse_part)]
    pub part: Option<Part>,
}

fn parse_part(text: &str) -> Result<Part, String> {
    match text {
        "motion" => Ok(Part::Motion),
        frames => match frames.parse::<Frames>()? {
            Frames { end: None, .. } => Err("name the frame after the last: A..B".to_owned()),
            frames => Ok(Part::Frames(frames)),
        },
    }
}

#[derive(ClapArgs, Debug)]
pub struct CellJobArgs {
    /// The workflow's plan.json
    pub plan: PathBuf,
    /// Key of the cell
    pub key: String,
}

#[derive(ClapArgs, Debug)]
pub struct MergeArgs {
    /// The workflow's plan.json
    pub plan: PathBuf,
}

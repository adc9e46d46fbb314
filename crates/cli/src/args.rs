//! What can be asked for.

use crate::file_args::{BaselinesCommand, DatasetCommand, ExportArgs, ImportArgs, ListArgs};
use crate::judge_args::{CompareArgs, GateArgs, HistoryArgs};
use crate::measure_args::{AblateArgs, BenchArgs, CrosscheckArgs};
use crate::stage_args::{ReconstructArgs, RenderArgs, ReportArgs, RunArgs, ScoreArgs};
use crate::workflow_args::WorkflowCommand;
use clap::{Args as ClapArgs, Parser, Subcommand};
use std::path::PathBuf;

/// A benchmark for multi-view hair reconstruction: renders hair whose geometry is known, lets a method
/// reconstruct it from the images alone, and scores what comes back.
#[derive(Parser, Debug)]
#[command(
    name = "strandbench",
    version,
    arg_required_else_help = true,
    after_help = "Examples:
  strandbench run                                   the whole job on the default scene
  strandbench run --scene messy-red --variant luo-ncc
  strandbench run --all --out results               every still scene of the catalogue, one table over all
  strandbench run --hair straight.hair --preset yuksel
  strandbench run --set recon.lambda=0.2 --set scene.rig.baseline_x_mm=200
  strandbench scenes list

Results lie in ./strandbench-out/<scene>/<variant>/report/report.html, which any browser opens from disk.
A second run re-uses whatever did not change. `strandbench help <command>` says more about each."
)]
pub struct Args {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
    #[command(flatten)]
    pub common: Common,
}

/// Options of every command.
#[derive(ClapArgs, Debug)]
pub struct Common {
    /// Worker threads; results do not depend on it [default: all processors]
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// Say nothing but errors
    #[arg(long, short, global = true)]
    pub quiet: bool,
    /// Print one JSON document to standard output instead of words
    #[arg(long, global = true)]
    pub json: bool,
    /// Configuration with methods from outside [default: strandbench.toml, where there is one]
    #[arg(long, global = true, value_name = "FILE")]
    pub config: Option<PathBuf>,
}

#[derive(Subcommand, Debug)]
pub enum Command {
    /// The whole job: render, reconstruct, score, report
    #[command(after_help = "Examples:
  strandbench run
  strandbench run --scene straight-blonde --scene curly-blonde --variant luo --variant luo-2cam
  strandbench run --scene my-scene.toml --seed 7
  strandbench run --hair straight.hair --scale-mm 2.5 --up z --forward y --head head.ply --radius-mm 0.04
  strandbench run --set render.samples_per_pixel=16 --set scene.rig.azimuth_deg=180
  strandbench run --scene moving-straight-blonde --variant luo-strands --frames 40..60

A moving scene is rendered, reconstructed and scored frame by frame; interrupted, the same command goes on where it
stopped. Its report has a player.

A method of your own, in any language, is a variant like the others once strandbench.toml names it:
  [method.mine]
  command = \"python3 mine.py {input} {output}\"   # reads a dataset folder, writes depth.npy, mesh.ply, strands.ply ...
  time_limit_s = 600
  memory_limit_mib = 8000

Exit code 0: every cell was scored. 1: at least one failed (its row says why). 130: stopped by Ctrl-C.")]
    Run(RunArgs),
    /// Render a scene: images for the method, truth for the scorer
    Render(RenderArgs),
    /// Reconstruct the frame (or frames) of a render folder; the truth beside it is never read
    #[command(after_help = "Example:
  strandbench reconstruct strandbench-out/straight-blonde/render --variant luo-ncc")]
    Reconstruct(ReconstructArgs),
    /// Score an estimate against a truth
    #[command(after_help = "Examples:
  strandbench score strandbench-out/straight-blonde/luo
  strandbench score my-estimate --truth strandbench-out/straight-blonde/render/truth --out my-scores
  strandbench score --estimate my-answer --truth strandbench-out/straight-blonde/render --out my-scores
  strandbench score out/moving-messy-red/luo-strands --rest out/moving-still/luo-strands out/moving-still+noise=1/luo-strands

An estimate of any program can be scored: a folder with depth.exr, .npy, .pfm or .png, mesh.ply or .obj, points.ply,
strands.hair, .data, .ply, .obj or .tfx, orientation.exr, orientation_3d.exr, whichever it has. What is not there counts
as not answered. Of a sequence the folder holds one of these a frame, 000012/ and so on; a frame that it leaves out is the worst answer. units.json beside them says what is not millimetres in the world; `strandbench dataset export` writes a
README.md with all of it.")]
    Score(ScoreArgs),
    /// The papers' ablations as paired differences with intervals: how much a part of the method buys, and whether the
    /// paper's claim holds
    #[command(after_help = "Examples:
  strandbench ablate --list
  strandbench ablate cameras metric                 six scenes, some minutes each
  strandbench ablate metric --on full               24 scene-seed cells, hours; what it costs is printed first
  strandbench ablate gamma --scene mine.toml --scene curly-brown --tune-on wavy-brown --seed 1 --seed 2

Each arm runs with the weight of smoothness of its variant and with one tuned on scenes kept apart, the same trials for
every arm. What is finished is not repeated: stop with Ctrl-C and give the same command again. The page is
OUT/ablate/NAME-SET/ablation.html, with a table as CSV and JSON and the pictures beside it.

Exit code 0: every cell was scored. 1: at least one failed (it counts as the worst answer). 130: stopped.")]
    Ablate(AblateArgs),
    /// Make the report of a scored variant folder
    #[command(after_help = "Example:
  strandbench report strandbench-out/straight-blonde/luo")]
    Report(ReportArgs),
    /// The catalogue of scenes
    #[command(subcommand)]
    Scenes(ListArgs),
    /// The variants of the method
    #[command(subcommand)]
    Variants(ListArgs),
    /// Speed beside Embree and Mitsuba, where they are installed: same hair, same rays, one run
    #[command(after_help = "Examples:
  strandbench bench
  strandbench bench --what rays --strands 50000 --python venv/bin/python --out bench
  strandbench bench --what build --strands 100000 --segments 100

Needs nothing to time this program alone. Embree comes with the Python package embreex, or is libembree4 of the
system; Mitsuba is the Python package mitsuba, whose LLVM variant needs libLLVM 19. What is missing is left out
and said. Close other programs: ratios bear a busy machine, seconds do not.")]
    Bench(BenchArgs),
    /// Convert a hair file: resample, place in millimetres, count, draw
    #[command(after_help = "Example:
  strandbench import straight.hair straight-mm.ply --preset yuksel

Reads .hair, .data, .ply and .tfx; writes .hair, .data, .ply or .obj by OUT's ending, and a picture beside it.")]
    Import(ImportArgs),
    /// Renders as a folder that any program can use: images, masks, calibration
    #[command(subcommand)]
    Dataset(DatasetCommand),
    /// Methods of the field that are run as programs of their own
    #[command(subcommand)]
    Baselines(BaselinesCommand),
    /// Strands and envelopes of a finished folder, or its truth, in formats that other programs open
    #[command(after_help = "Examples:
  strandbench export strandbench-out/moving-still/luo-strands animation
  strandbench export strandbench-out/straight-blonde/luo envelope --envelope obj
  strandbench export strandbench-out/moving-still/render truth --truth --strands ply

A sequence becomes a file a frame; with .usda an index beside them plays as one animation in any program that reads
USD. Millimetres, +y up.")]
    Export(ExportArgs),
    /// Two variants or two earlier results, scene by scene: differences with intervals
    #[command(after_help = "Examples:
  strandbench run --all --variant luo --variant luo-ncc
  strandbench compare luo-ncc luo                    two variants of that run
  strandbench compare before after --markdown        two run folders, for a pull request
  strandbench compare luo luo-fast --fail-if inferior --margin A1.median=0.1

A difference is B less A, the mean over scenes; its 95 % interval comes from a bootstrap over scenes, clumps and
strands. p is exact by flipping signs, and corrected for the number of primary metrics; all others are exploratory.
A failed cell is the worst answer and is never dropped.

Exit code 0: the rule of --fail-if does not apply. 1: it does, or nothing could be compared.")]
    Compare(CompareArgs),
    /// For CI: does a run still give what the committed reference says?
    #[command(after_help = "Examples:
  strandbench gate                                   run the plan, compare every figure with the reference
  strandbench gate --accept                          the changes are wanted: write them as the new reference
  strandbench gate --run results                     hold an earlier run against it
  strandbench gate --fresh 6                         six fresh seeds a scene: nothing lost beyond the plan's margins?
  strandbench gate --fresh 20 --a-a 2000             how often that fails though nothing changed

Any change beyond its tolerance fails, improvements included, until it is accepted. So does a missing or failed cell,
another protocol, and a run that evaluated nothing.

Exit code 0: the gate is open. 1: it is shut.")]
    Gate(GateArgs),
    /// What earlier runs into a folder measured, as a table, a page with charts, or CSV
    #[command(after_help = "Examples:
  strandbench history
  strandbench history --metric A1.median --metric A1.p90 --scene straight-blonde
  strandbench history --csv > history.csv

Every run and every ablation adds to history.sqlite in its folder, which any program that knows SQLite can read.")]
    History(HistoryArgs),
    /// The matrix of a run as a Snakemake workflow, for a cluster or many processes: the same report, bit for bit
    #[command(subcommand)]
    Workflow(WorkflowCommand),
    /// The renderer against other programs: Mitsuba 3, Embree, and a second writing of the fibre model
    #[command(after_help = "Examples:
  strandbench crosscheck                            cameras, geometry, scattering, direct light: a minute
  strandbench crosscheck --level 4                  images, by their statistics: some minutes
  strandbench crosscheck --level 1 --full           two million rays

Makes a Python environment with Mitsuba in the user's cache folder on first use (or takes the Python named in
STRANDBENCH_PYTHON, if it has it). Without Python, every check is ignored, with the reason, and none passes; where
the environment variable CI is set that is an error. DRJIT_LIBLLVM_PATH names libLLVM 19 or 22 for faster images.

Exit code 0: no check failed. 1: at least one did.")]
    Crosscheck(CrosscheckArgs),
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_definition_is_consistent() {
        Args::command().debug_assert();
    }

    /// The command lines of a page of blocks, each cut at the shell's signs.
    fn recorded(page: &str) -> Vec<Vec<String>> {
        let lines = page.lines().filter_map(|l| l.strip_prefix("$ strandbench "));
        lines
            .map(|l| {
                let own = l.split(['|', '>', ';', '&']).next().unwrap_or_default();
                ["strandbench"].into_iter().chain(own.split_whitespace()).map(str::to_owned).collect()
            })
            .collect()
    }

    #[test]
    fn every_command_has_a_section_whose_recorded_command_lines_are_still_understood() {
        let page = include_str!("../../../reports/commands.md");
        let lines = recorded(page);
        for line in &lines {
            Args::try_parse_from(line).unwrap_or_else(|e| panic!("{line:?}: {e}"));
        }
        let own = Args::command();
        let sections: Vec<&str> = page.lines().filter_map(|l| l.strip_prefix("## ")).collect();
        for command in own.get_subcommands().map(clap::Command::get_name) {
            assert!(sections.contains(&command), "reports/commands.md has no section {command}");
            let shown = lines.iter().any(|l| l[1] == command);
            assert!(shown, "reports/commands.md shows no output of {command}: cargo xtask readme");
        }
        for section in sections {
            assert!(own.find_subcommand(section).is_some(), "there is no command {section}");
        }
    }

    #[test]
    fn axes_may_be_negative_and_settings_are_checked() {
        let args = Args::try_parse_from(["s", "run", "--hair", "a.hair", "--up", "-z", "--set", "lambda=1"])
            .unwrap();
        let Command::Run(run) = args.command else { panic!("run") };
        assert_eq!(run.scene.import.up.as_deref(), Some("-z"));
        assert_eq!((&run.scene.seed[..], run.variant.as_slice()), (&[1][..], &["luo".to_owned()][..]));
        assert!(Args::try_parse_from(["s", "run", "--set", "lambda"]).is_err());
        assert!(Args::try_parse_from(["s", "run", "--all", "--hair", "a.hair"]).is_err());
        assert!(Args::try_parse_from(["s", "run", "--threads", "0"]).is_err());
    }
}

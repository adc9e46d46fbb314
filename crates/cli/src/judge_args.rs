//! What can be asked of results: comparing, gating, looking back.

use clap::{Args as ClapArgs, ValueEnum};
use std::path::PathBuf;

/// Two results, scene by scene.
#[derive(ClapArgs, Debug)]
pub struct CompareArgs {
    /// The baseline: a variant of the last run in --results, or a run folder, index.json or CSV; PATH:VARIANT names one of several
    pub a: String,
    /// The other, in the same words
    pub b: String,
    /// The folder of the run whose variants A and B name
    #[arg(long, default_value = "strandbench-out", value_name = "DIR")]
    pub results: PathBuf,
    /// Where compare.html, compare.md and compare.json go [default: compare/A-B in --results]
    #[arg(long, value_name = "DIR")]
    pub to: Option<PathBuf>,
    /// Compare the cells that both have instead of refusing unequal sets; the others are named
    #[arg(long)]
    pub allow_unequal: bool,
    /// What counts as no loss on a primary metric, in its unit (shares 0 to 1): METRIC=VALUE; may be repeated
    #[arg(long, value_name = "METRIC=VALUE", value_parser = parse_margin)]
    pub margin: Vec<(String, f64)>,
    /// Take every seed for an observation of its own; else the seeds of a scene are averaged
    #[arg(long)]
    pub seeds_apart: bool,
    /// When the exit code is 1
    #[arg(long, value_enum, default_value = "worse", value_name = "RULE")]
    pub fail_if: FailIfArg,
    /// Print Markdown for a pull request instead of a table
    #[arg(long, conflicts_with = "json")]
    pub markdown: bool,
    /// Resamples of the bootstrap
    #[arg(long, default_value_t = 10_000, value_name = "N")]
    pub resamples: u32,
    /// Seed of the bootstrap
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
}

/// When a comparison fails.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum FailIfArg {
    /// A primary metric is worse at 5 % after Holm, or B failed where A answered
    Worse,
    /// A primary metric differs at 5 % after Holm, either way, or one side alone failed
    Different,
    /// A primary metric is not shown to lose less than its --margin, or B failed where A answered
    Inferior,
    /// Never
    Never,
}

fn parse_margin(text: &str) -> Result<(String, f64), String> {
    let (metric, value) = text.split_once('=').ok_or("expected METRIC=VALUE, for example A1.median=0.1")?;
    match value.parse::<f64>() {
        Ok(v) if v >= 0.0 && v.is_finite() => Ok((metric.to_owned(), v)),
        _ => Err(format!("{value} is not zero or a positive number")),
    }
}

/// What earlier runs measured.
#[derive(ClapArgs, Debug)]
pub struct HistoryArgs {
    /// The folder of the runs
    #[arg(long, default_value = "strandbench-out", value_name = "DIR")]
    pub results: PathBuf,
    /// Metrics; may be repeated [default: A1.median; with --csv all]
    #[arg(long, value_name = "ID")]
    pub metric: Vec<String>,
    /// Scenes; may be repeated [default: all]
    #[arg(long, value_name = "NAME")]
    pub scene: Vec<String>,
    /// Variants; may be repeated [default: all]
    #[arg(long, value_name = "NAME")]
    pub variant: Vec<String>,
    /// Print CSV
    #[arg(long, conflicts_with = "json")]
    pub csv: bool,
    /// The page with the charts [default: history.html in --results]
    #[arg(long, value_name = "FILE")]
    pub page: Option<PathBuf>,
}

/// Whether anything changed since the reference was accepted.
#[derive(ClapArgs, Debug)]
pub struct GateArgs {
    /// What to run, and how far figures may move
    #[arg(long, default_value = "reports/gate.toml", value_name = "FILE.toml")]
    pub plan: PathBuf,
    /// The committed reference
    #[arg(long, default_value = "reports/gate.csv", value_name = "FILE.csv")]
    pub reference: PathBuf,
    /// Hold these earlier results (a run folder, index.json or CSV) against it instead of running the plan
    #[arg(long, value_name = "PATH", conflicts_with_all = ["fresh", "a_a"])]
    pub run: Option<PathBuf>,
    /// Where the plan is run
    #[arg(long, default_value = "strandbench-out/gate", value_name = "DIR")]
    pub out: PathBuf,
    /// Write what was found as the new reference, if every cell was scored
    #[arg(long, conflicts_with_all = ["fresh", "a_a"])]
    pub accept: bool,
    /// The statistical gate: N seeds that nobody has seen for every scene, held against the plan's margins
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(2..=1000))]
    pub fresh: Option<u16>,
    /// First of the fresh seeds [default: from the clock; printed]
    #[arg(long, value_name = "SEED", requires = "fresh")]
    pub first_seed: Option<u64>,
    /// Measure the statistical gate's false alarms: split the N fresh seeds at random, this many times
    #[arg(long, value_name = "ROUNDS", requires = "fresh", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub a_a: Option<u32>,
}

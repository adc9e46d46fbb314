//! `strandbench bench`.

use crate::measure_args::BenchArgs;
use crate::print::{out, outln};
use crate::progress::Show;
use anyhow::{Result, anyhow};
use strandbench_bench::{BenchError, Options, What};
use strandbench_suite::SuiteError;

/// Runs the benchmarks and prints the tables.
pub fn run(args: &BenchArgs, threads: Option<u16>, show: &Show, json: bool) -> Result<bool> {
    let what = What::NAMES.iter().find(|(name, _)| *name == args.what);
    let (_, what) = what.ok_or_else(|| anyhow!("--what {}: unknown", args.what))?;
    let options = Options {
        what: *what,
        strands: args.strands as usize,
        segments: args.segments as usize,
        rays: args.rays as usize,
        rounds: args.rounds as usize,
        threads: threads.map_or_else(rayon::current_num_threads, usize::from),
        python: args.python.clone(),
        embree: args.embree.clone(),
    };
    let report = strandbench_bench::run(&options, show, &|line| show.say(line)).map_err(|e| match e {
        BenchError::Cancelled(_) => anyhow::Error::new(SuiteError::Cancelled),
        other => other.into(),
    })?;
    if let Some(folder) = &args.out {
        report.write(folder)?;
    }
    if json {
        outln!("{}", serde_json::to_string_pretty(&report)?);
    } else if !show.quiet() {
        out!("{}", report.table());
    }
    Ok(true)
}

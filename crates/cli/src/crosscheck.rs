//! The cross-check: a call, its report, and words about it.

use crate::commands::print_json;
use crate::measure_args::CrosscheckArgs;
use crate::print::outln;
use crate::progress::Show;
use anyhow::{Context, Result};
use strandbench_crosscheck::{Options, Size, Verdict, as_json, run, write_report};

/// Runs the levels asked for; `false` if a gate failed.
pub fn crosscheck(args: &CrosscheckArgs, show: &Show, json: bool) -> Result<bool> {
    let mut levels = if args.level.is_empty() { vec![0, 1, 2, 3] } else { args.level.clone() };
    levels.sort_unstable();
    levels.dedup();
    let options = Options {
        levels,
        size: if args.full { Size::Full } else { Size::Quick },
        out: args.out.clone(),
        python: None,
        required: std::env::var_os("CI").is_some(),
    };
    let outcome = run(&options, show)?;
    show.clear();
    let page = write_report(&outcome, &args.out).context("writing the report")?;
    let failed = outcome.count(|v| *v == Verdict::Failed);
    if json {
        print_json(&as_json(&outcome))?;
        return Ok(failed == 0);
    }
    if !show.quiet() {
        for gate in outcome.gates() {
            outln!("{gate}");
            if gate.verdict == Verdict::Failed && !gate.note.is_empty() {
                outln!("        {}", gate.note);
            }
        }
    }
    match &outcome.missing {
        Some(reason) => show.say(&format!("ignored, nothing was compared: {reason}")),
        None => show.say(&format!(
            "{} gates passed, {failed} failed; report: {}",
            outcome.count(|v| *v == Verdict::Passed),
            page.display()
        )),
    }
    Ok(failed == 0)
}

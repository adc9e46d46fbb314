//! The gate for CI.

use super::print_json;
use crate::judge_args::GateArgs;
use crate::print::{errln, outln};
use crate::progress::Show;
use anyhow::{Result, bail};
use serde_json::json;
use strandbench_suite::gate::{Change, Plan, a_a, accept, fresh, hold};
use strandbench_suite::{Lock, Results, run_all};

/// Changes that are printed; the JSON has all.
const SHOWN: usize = 20;

pub(super) fn gate(args: &GateArgs, show: &Show, json: bool) -> Result<bool> {
    let plan = Plan::read(&args.plan)?;
    if let Some(n) = args.fresh {
        return statistical(args, &plan, n.into(), show, json);
    }
    // Read first: a reference that cannot be read must not cost a run.
    let reference = if args.accept { Vec::new() } else { Results::read(&args.reference)? };
    let now = match &args.run {
        Some(run) => Results::read(run)?,
        None => run_plan(args, &plan, &plan.seeds, show)?,
    };
    if args.accept {
        let lines = accept(&now, &args.reference)?;
        if json {
            return print_json(&json!({ "accepted": args.reference, "figures": lines }));
        }
        outln!("{}: {lines} figures accepted; review and commit it", args.reference.display());
        return Ok(true);
    }
    let held = hold(&reference, &now, &plan);
    if json {
        print_json(&serde_json::to_value(&held)?)?;
    } else if !show.quiet() {
        let (better, worse): (Vec<&Change>, Vec<&Change>) = held.changes.iter().partition(|c| c.better);
        outln!(
            "{} figures of {} cells held: {} worse, {} better, {} other faults",
            held.figures,
            held.cells,
            worse.len(),
            better.len(),
            held.faults.len()
        );
    }
    for fault in &held.faults {
        errln!("strandbench: {fault}");
    }
    for c in held.changes.iter().take(SHOWN) {
        let value = |v: Option<f64>| v.map_or("no value".to_owned(), |v| v.to_string());
        errln!(
            "strandbench: {} by {}, seed {}: {} {} -> {} {} ({}; {} may pass)",
            c.scene,
            c.variant,
            c.seed,
            c.metric,
            value(c.reference),
            value(c.now),
            c.unit,
            if c.better { "better" } else { "worse" },
            c.tolerance
        );
    }
    if held.changes.len() > SHOWN {
        errln!("strandbench: and {} more changes (--json has all)", held.changes.len() - SHOWN);
    }
    if !held.passes() {
        errln!(
            "strandbench: the gate is shut; where the changes are wanted, `strandbench gate --accept` writes the new reference"
        );
    }
    Ok(held.passes())
}

fn run_plan(args: &GateArgs, plan: &Plan, seeds: &[u64], show: &Show) -> Result<Vec<Results>> {
    let cells = plan.cells(seeds)?;
    let _lock = Lock::take(&args.out)?;
    run_all(&cells, &args.out, show)?;
    Ok(Results::read(&args.out)?)
}

fn statistical(args: &GateArgs, plan: &Plan, n: u64, show: &Show, json: bool) -> Result<bool> {
    if plan.margin.is_empty() {
        bail!("{} declares no margin: there is nothing to show on fresh seeds", args.plan.display());
    }
    let clock =
        || std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).map_or(0, |d| d.as_secs());
    // Seeds from the clock (1.7e9 and more) are far from any that a plan names; one that is named would not be fresh.
    let first = args.first_seed.unwrap_or_else(clock);
    let seeds: Vec<u64> = (0..n).map(|i| first.saturating_add(i)).collect();
    if let Some(known) = seeds.iter().find(|s| plan.seeds.contains(s)) {
        bail!("seed {known} is one of the plan's own and not fresh; choose another --first-seed");
    }
    if !show.quiet() && !json {
        outln!("fresh seeds {first} to {}", seeds[seeds.len() - 1]);
    }
    let reference = if args.a_a.is_some() { Vec::new() } else { Results::read(&args.reference)? };
    let now = run_plan(args, plan, &seeds, show)?;
    if let Some(rounds) = args.a_a {
        let of_reference = plan.seeds.len();
        let sizes = [of_reference, seeds.len().saturating_sub(of_reference).min(of_reference * 2)];
        let found = a_a(&now, plan, sizes, rounds, 1)?;
        if json {
            return print_json(&serde_json::to_value(&found)?);
        }
        outln!(
            "{} of {} rounds failed though nothing changed ({:.1} %): {} reference and {} fresh seeds a scene out of {}; {:.1} % of the \
             95 % intervals leave out zero",
            found.alarms,
            found.rounds,
            100.0 * f64::from(found.alarms) / f64::from(found.rounds),
            found.seeds[0],
            found.seeds[1],
            found.pool,
            100.0 * found.intervals_without_zero
        );
        return Ok(true);
    }
    let found = fresh(&reference, &now, plan)?;
    if json {
        print_json(&serde_json::to_value(&found)?)?;
    }
    for f in &found {
        let [low, high] = f.difference.interval;
        let line = format!(
            "{} of {}: {:+.4} {} ({low:+.4} to {high:+.4}), {} may be lost: {}",
            f.metric,
            f.variant,
            f.difference.mean,
            f.unit,
            f.margin,
            if f.passes { "passes" } else { "not shown to lose less" }
        );
        if !f.passes {
            errln!("strandbench: {line}");
        } else if !json && !show.quiet() {
            outln!("{line}");
        }
    }
    Ok(found.iter().all(|f| f.passes))
}

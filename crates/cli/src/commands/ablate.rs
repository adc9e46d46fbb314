//! `ablate`: which there are, what they will cost, and what came out.

use super::print_json;
use crate::measure_args::AblateArgs;
use crate::print::{errln, outln};
use crate::progress::Show;
use anyhow::Result;
use strandbench_suite::ablate::{ABLATIONS, Ablation, Outcomes, PAGE, Plan, ablate, forecast};
use strandbench_suite::{Lock, Outcome};

pub(super) fn run(args: &AblateArgs, show: &Show, json: bool) -> Result<bool> {
    if args.list {
        return list(json);
    }
    let wanted: Vec<&Ablation> =
        args.names.iter().map(|name| Ablation::named(name)).collect::<Result<_, _>>()?;
    let seeds = if args.seed.is_empty() { vec![1] } else { args.seed.clone() };
    let plan = |ablation: &Ablation| match args.scene.is_empty() {
        true => Plan::of(args.on, ablation),
        false => Plan::on(&args.scene, &args.tune_on, &seeds, &args.settings, args.frames),
    };
    for ablation in &wanted {
        let f = forecast(ablation, &plan(ablation)?, &args.out)?;
        show.say(&format!(
            "{:<12} at most {} frames to render and {} to reconstruct: some {:.0} min on this machine",
            ablation.name,
            f.renders,
            f.reconstructions,
            (f.seconds / 60.0).ceil()
        ));
    }
    let _lock = Lock::take(&args.out)?;
    let mut done = Vec::new();
    for ablation in wanted {
        done.push(ablate(ablation, &plan(ablation)?, &args.out, show)?);
        if let (false, false, Some(last)) = (json, show.quiet(), done.last()) {
            tell(last);
        }
    }
    if json {
        print_json(&serde_json::to_value(&done)?)?;
    }
    for d in &done {
        if let Some(problem) = &d.history_problem {
            errln!("strandbench: {} is not in the history: {problem}", d.name);
        }
    }
    let mut whole = true;
    for r in done.iter().flat_map(|d| &d.rows) {
        if let Some(trouble) = r.row.outcome.trouble() {
            errln!("strandbench: {} on {}: {trouble}", r.arm, r.row.scene);
            whole &= r.row.outcome == Outcome::Ok;
        }
    }
    Ok(whole)
}

fn tell(done: &Outcomes) {
    outln!("{} ({} set): {}", done.source, done.set, done.claim);
    for t in &done.tuned {
        outln!("  {:<22} weight {} (own {})", t.arm, t.lambda, t.own_lambda);
    }
    for sentence in &done.sentences {
        outln!("  {sentence}");
    }
    outln!("  {}", done.folder.join(PAGE).display());
}

fn list(json: bool) -> Result<bool> {
    if json {
        let all = ABLATIONS.iter().map(|a| {
            let arms: Vec<&str> = a.arms().map(|arm| arm.label).collect();
            serde_json::json!({"name": a.name, "source": a.source, "claim": a.claim, "arms": arms, "primary": a.primary})
        });
        return print_json(&all.collect());
    }
    for a in ABLATIONS {
        let against: Vec<&str> = a.without.iter().map(|arm| arm.label).collect();
        outln!("{:<12} {}: {}", a.name, a.source, a.claim);
        outln!("             {} against {}; judged by {}", a.with.label, against.join("; "), a.primary);
    }
    Ok(true)
}

//! Comparing and looking back.

use super::print_json;
use crate::judge_args::{CompareArgs, FailIfArg, HistoryArgs};
use crate::print::{errln, out, outln};
use crate::progress::Show;
use anyhow::{Result, bail};
use strandbench_suite::compare::{FailIf, Question, compare as compared, markdown, table, write};
use strandbench_suite::{Results, history as past};

pub(super) fn compare(args: &CompareArgs, show: &Show, json: bool) -> Result<bool> {
    let (a, b) = (Results::find(&args.a, &args.results)?, Results::find(&args.b, &args.results)?);
    let mut question = Question {
        allow_unequal: args.allow_unequal,
        margins: args.margin.iter().cloned().collect(),
        ..Question::default()
    };
    (question.options.resamples, question.options.seed) = (args.resamples, args.seed);
    if args.seeds_apart {
        question.options.unit = strandbench_suite::Unit::SceneSeed;
    }
    let comparison = compared(&a, &b, &question, show)?;
    let to = match &args.to {
        Some(to) => to.clone(),
        None => args.results.join("compare").join(format!("{}-{}", a.variant, b.variant)),
    };
    write(&comparison, &to)?;
    if json {
        print_json(&serde_json::to_value(&comparison)?)?;
    } else if args.markdown {
        out!("{}", markdown(&comparison));
    } else if !show.quiet() {
        out!("{}", table(&comparison));
        outln!("{}", to.join("compare.html").display());
    }
    let rule = match args.fail_if {
        FailIfArg::Worse => FailIf::Worse,
        FailIfArg::Different => FailIf::Different,
        FailIfArg::Inferior => FailIf::Inferior,
        FailIfArg::Never => FailIf::Never,
    };
    let faults = comparison.faults(rule);
    for fault in &faults {
        errln!("strandbench: {fault}");
    }
    Ok(faults.is_empty())
}

pub(super) fn history(args: &HistoryArgs, show: &Show, json: bool) -> Result<bool> {
    let mut query = past::Query {
        metrics: args.metric.clone(),
        scenes: args.scene.clone(),
        variants: args.variant.clone(),
    };
    if query.metrics.is_empty() && !args.csv && !json {
        query.metrics.push("A1.median".to_owned());
    }
    let entries = past::read(&args.results, &query)?;
    if entries.is_empty() {
        bail!("{}: no run has such a figure", args.results.display());
    }
    if json {
        return print_json(&serde_json::to_value(&entries)?);
    }
    if args.csv {
        out!("{}", past::csv(&entries));
        return Ok(true);
    }
    let page = args.page.clone().unwrap_or_else(|| args.results.join("history.html"));
    past::draw(&entries, &page)?;
    if !show.quiet() {
        out!("{}", past::table(&entries));
        outln!("{}", page.display());
    }
    Ok(true)
}

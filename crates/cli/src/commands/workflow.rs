//! A run as a workflow: writing it, and its jobs.

use super::{cells, print_json, say_left_out};
use crate::print::{errln, out, outln};
use crate::progress::Show;
use crate::stage_args::RunArgs;
use crate::table;
use crate::workflow_args::{WorkflowCommand, WriteArgs};
use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};
use serde_json::json;
use std::path::{Path, PathBuf};
use strandbench_suite::outside::Config;
use strandbench_suite::workflow::{self, Around, Part, Plan};
use strandbench_suite::{Cell, Outcome};

/// What stands in a plan for the command line.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Arguments {
    run: RunArgs,
    config: Option<PathBuf>,
    frames_per_job: u32,
}

impl Arguments {
    fn cells(&self) -> Result<Vec<Cell>> {
        let config = Config::load(self.config.as_deref())?;
        let mut cells = cells(&self.run.scene, &self.run.variant, &config)?;
        cells.iter_mut().for_each(|cell| cell.time_limit_s = self.run.time_limit);
        Ok(cells)
    }

    fn plan(&self, cells: &[Cell], root: &Path, threads: u16) -> Result<Plan> {
        let around = Around {
            arguments: serde_json::to_value(self)?,
            out: self.run.scene.out.clone(),
            root: root.to_owned(),
            program: std::env::current_exe().context("where this program lies")?,
            threads,
            frames_per_job: self.frames_per_job,
        };
        Ok(workflow::plan(cells, around)?)
    }
}

pub(super) fn run(command: &WorkflowCommand, config: Option<&Path>, show: &Show, json: bool) -> Result<bool> {
    match command {
        WorkflowCommand::Write(args) => write(args, config, show, json),
        WorkflowCommand::Render(args) => {
            let (plan, cells) = open(&args.plan)?;
            let (step, cell) = plan.render(&args.key, &cells, &args.plan)?;
            let part = args.part.unwrap_or(Part::Whole);
            let trouble = workflow::render_job(step, cell, part, &plan.out, show)?;
            if let Some(trouble) = &trouble {
                errln!("strandbench: {}: {trouble}", step.scene);
            }
            told(&json!({"scene": step.scene, "trouble": trouble}), json)
        }
        WorkflowCommand::Cell(args) => {
            let (plan, cells) = open(&args.plan)?;
            let (step, cell) = plan.cell(&args.key, &cells, &args.plan)?;
            let outcome = workflow::cell_job(step, cell, &plan.out, show)?;
            if let Some(trouble) = outcome.trouble() {
                errln!("strandbench: {} by {}, seed {}: {trouble}", step.scene, step.variant, step.seed);
            }
            told(
                &json!({"scene": step.scene, "variant": step.variant, "seed": step.seed, "result": outcome}),
                json,
            )
        }
        WorkflowCommand::Merge(args) => {
            let (plan, cells) = open(&args.plan)?;
            let summary = workflow::merge(&plan, &cells, &plan.out, show)?;
            if !json && !show.quiet() {
                out!("{}", table::summary(&summary));
            }
            for line in summary.rows.iter().filter_map(table::failure) {
                errln!("strandbench: {line}");
            }
            if let Some(problem) = &summary.history_problem {
                errln!("strandbench: this run is not in the history: {problem}");
            }
            let failed = summary.rows.iter().filter(|r| r.outcome != Outcome::Ok).count();
            told(&json!({"cells": summary.rows.len(), "failed": failed, "index": summary.index}), json)
        }
    }
}

fn told(value: &serde_json::Value, json: bool) -> Result<bool> {
    if json { print_json(value) } else { Ok(true) }
}

fn write(args: &WriteArgs, config: Option<&Path>, show: &Show, json: bool) -> Result<bool> {
    let arguments = Arguments {
        run: args.run.clone(),
        config: config.map(Path::to_owned),
        frames_per_job: args.frames_per_job,
    };
    let cells = arguments.cells()?;
    say_left_out(&args.run.scene, show);
    let root = std::env::current_dir().context("the working folder")?;
    let plan = arguments.plan(&cells, &root, args.job_threads)?;
    let files = workflow::write(&plan, &args.to)?;
    if json {
        return print_json(
            &json!({"cells": plan.cells.len(), "renders": plan.renders.len(), "files": files.all}),
        );
    }
    if !show.quiet() {
        outln!("{} cells, {} renders", plan.cells.len(), plan.renders.len());
        outln!("cd {} && snakemake --profile profiles/local", args.to.display());
    }
    Ok(true)
}

/// A plan and its cells, in the plan's folder.
fn open(path: &Path) -> Result<(Plan, Vec<Cell>)> {
    let plan = Plan::read(path)?;
    let wrong = || format!("{}: its arguments are not this program's; write it again", path.display());
    let arguments: Arguments = serde_json::from_value(plan.arguments.clone()).with_context(wrong)?;
    let at = std::path::absolute(path)?;
    std::env::set_current_dir(&plan.root).with_context(|| plan.root.display().to_string())?;
    let cells = arguments.cells()?;
    plan.check(&arguments.plan(&cells, &plan.root, plan.threads)?, &at)?;
    Ok((plan, cells))
}

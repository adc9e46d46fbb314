//! What there is to choose from.

use super::print_json;
use crate::args::ListArgs;
use crate::print::{out, outln};
use crate::table;
use anyhow::Result;
use serde_json::json;
use strandbench_recon::VARIANTS;
use strandbench_suite::BASELINES;
use strandbench_suite::outside::Config;
use strandbench_suite::{Method, SceneJob, Solver, SuiteError};

pub(super) fn scenes(list: &ListArgs, json: bool) -> Result<bool> {
    let entry = |name: &str| SceneJob::open(name, &[]);
    match list {
        ListArgs::List => {
            let jobs: Vec<SceneJob> =
                strandbench_suite::all_scenes().map(|e| entry(e.name)).collect::<Result<_, SuiteError>>()?;
            if json {
                let all: Vec<_> = jobs
                    .iter()
                    .map(|j| {
                        let s = j.spec();
                        json!({"name": j.name, "description": s.description, "difficulty": s.difficulty,
                               "stresses": s.stresses, "frames": s.motion.as_ref().map(|m| m.frames), "strands": s.groom.as_ref().map(|g| g.strands),
                               "default": j.name == strandbench_scenes::DEFAULT_SCENE})
                    })
                    .collect();
                return print_json(&serde_json::Value::Array(all));
            }
            out!("{}", table::scenes(&jobs));
        }
        ListArgs::Show { name } => {
            let job = entry(name)?;
            if json {
                return print_json(&serde_json::to_value(job.spec())?);
            }
            out!("{}", job.toml);
        }
    }
    Ok(true)
}

pub(super) fn variants(list: &ListArgs, config: &Config, json: bool) -> Result<bool> {
    match list {
        ListArgs::List => {
            if json {
                let of_method = VARIANTS.iter().map(serde_json::to_value);
                let all = of_method.chain(BASELINES.iter().map(serde_json::to_value));
                return print_json(&all.collect::<Result<_, _>>()?);
            }
            for v in VARIANTS {
                outln!("{:<22} {}", v.name, v.asks);
            }
            outln!("\nbaselines:");
            for b in BASELINES {
                outln!("{:<22} {}", b.name, b.asks);
            }
            for m in &config.methods {
                outln!("{:<22} {} (a program of its own)", m.name, m.asks);
            }
        }
        ListArgs::Show { name } => {
            let variant = match Method::find_in(name, &[], config)?.solver {
                Solver::Variant(variant) => variant,
                Solver::Baseline(b) => {
                    if json {
                        return print_json(&serde_json::to_value(b)?);
                    }
                    outln!("{}: {}", b.name, b.asks);
                    for (key, value) in b.entries() {
                        outln!("  {key} = {value}");
                    }
                    return Ok(true);
                }
                Solver::Outside(m) => {
                    if json {
                        return print_json(&json!({"name": m.name, "asks": m.asks, "command": m.command}));
                    }
                    outln!("{}: {}\n  command = {:?}", m.name, m.asks, m.command);
                    return Ok(true);
                }
            };
            if json {
                return print_json(&serde_json::to_value(variant)?);
            }
            outln!("{}: {}", variant.name, variant.asks);
            for (key, value) in variant.entries() {
                outln!("  {key} = {value}");
            }
        }
    }
    Ok(true)
}

//! What there is to choose from.

use super::print_json;
use crate::file_args::ListArgs;
use crate::print::{out, outln};
use crate::table;
use anyhow::Result;
use serde_json::json;
use strandbench_recon::VARIANTS;
use strandbench_suite::BASELINES;
use strandbench_suite::face::FaceJob;
use strandbench_suite::outside::Config;
use strandbench_suite::{Method, SceneJob, Solver, SuiteError};

pub(super) fn scenes(list: &ListArgs, json: bool) -> Result<bool> {
    let entry = |name: &str| SceneJob::open(name, &[]);
    match list {
        ListArgs::List => {
            let jobs: Vec<SceneJob> =
                strandbench_suite::all_scenes().map(|e| entry(e.name)).collect::<Result<_, SuiteError>>()?;
            let opened = strandbench_scenes::face::catalog().iter().map(|e| FaceJob::open(e.name, &[]));
            let faces: Vec<FaceJob> =
                opened.filter_map(Result::transpose).collect::<Result<_, SuiteError>>()?;
            if json {
                let all: Vec<_> = jobs
                    .iter()
                    .map(|j| {
                        let s = j.spec();
                        json!({"kind": "hair", "name": j.name, "description": s.description, "difficulty": s.difficulty,
                               "stresses": s.stresses, "frames": s.motion.as_ref().map(|m| m.frames), "strands": s.groom.as_ref().map(|g| g.strands),
                               "default": j.name == strandbench_scenes::DEFAULT_SCENE})
                    })
                    .chain(faces.iter().map(|j| {
                        let s = &j.spec;
                        json!({"kind": "face", "name": j.name, "description": s.description, "stresses": s.stresses,
                               "frames": s.frames()})
                    }))
                    .collect();
                return print_json(&serde_json::Value::Array(all));
            }
            out!("{}", table::scenes(&jobs));
            outln!("\nfaces, to render (fourteen cameras, colour):");
            for j in &faces {
                outln!("{:<22} {} frames. {}", j.name, j.spec.frames(), j.spec.description);
            }
        }
        ListArgs::Show { name } => {
            if let Some(face) = FaceJob::open(name, &[])? {
                if json {
                    return print_json(&serde_json::to_value(&face.spec)?);
                }
                out!("{}", face.toml);
                return Ok(true);
            }
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

//! What goes out to methods from outside.

use super::print_json;
use crate::file_args::{BaselinesArgs, DatasetArgs};
use crate::print::outln;
use crate::progress::Show;
use anyhow::Result;
use serde_json::json;
use strandbench_suite::baselines::{self, BASELINES};
use strandbench_suite::dataset::{self, DatasetOptions};

pub(super) fn export_dataset(args: &DatasetArgs, show: &Show, json: bool) -> Result<bool> {
    let options = DatasetOptions { head: !args.no_head, truth: args.truth };
    let made = dataset::export_dataset(&args.render, &args.out, options, show)?;
    show.clear();
    if json {
        return print_json(&serde_json::to_value(&made)?);
    }
    if !show.quiet() {
        let frames =
            if made.frames.len() == 1 { "1 frame".into() } else { format!("{} frames", made.frames.len()) };
        let with = match (made.head, made.truth) {
            (true, true) => ", with head and truth",
            (true, false) => ", with the head, without the truth",
            (false, true) => ", with the truth",
            (false, false) => ", without the truth",
        };
        outln!("{frames} of {} cameras ({}){with}", made.cameras.len(), made.cameras.join(", "));
        outln!("{}", made.folder.join("README.md").display());
    }
    Ok(true)
}

pub(super) fn list_baselines(json: bool) -> Result<bool> {
    if json {
        let all: Vec<_> = BASELINES.iter().map(|b| json!({"name": b.name, "asks": b.asks})).collect();
        return print_json(&serde_json::Value::Array(all));
    }
    for b in BASELINES {
        outln!("{:<22} {}", b.name, b.asks);
    }
    Ok(true)
}

pub(super) fn write_baselines(args: &BaselinesArgs, show: &Show, json: bool) -> Result<bool> {
    let named = args.python.clone().or_else(|| std::env::var_os("STRANDBENCH_PYTHON").map(Into::into));
    let python = match named {
        Some(python) => std::path::absolute(python)?,
        None => {
            show.say(
                "an environment with NumPy and OpenCV is made in the user's cache folder, if it is not there",
            );
            strandbench_crosscheck::environment("baselines", baselines::REQUIREMENTS, &args.out, show)?
        }
    };
    let config = baselines::write(&args.out, &python)?;
    show.clear();
    if json {
        return print_json(&json!({"config": config, "python": python}));
    }
    if !show.quiet() {
        outln!("{}", config.display());
        let names: Vec<String> = BASELINES.iter().map(|b| format!("--variant {}", b.name)).collect();
        outln!("strandbench run --config {} {}", config.display(), names.join(" "));
    }
    Ok(true)
}

//! Each command as a call into the suite.

mod ablate;
mod door;
mod files;
mod gate;
mod judge;
mod lists;
mod stages;
mod workflow;

use crate::args::{Args, Command};
use crate::file_args::{BaselinesCommand, DatasetCommand};
use crate::print::{errln, out, outln};
use crate::progress::{Show, listen_for_ctrl_c};
use crate::stage_args::{ImportOptionArgs, RunArgs, SceneArgs};
use crate::table;
use anyhow::{Result, anyhow, bail};
use strandbench_io::{ImportOptions, PRESETS};
use strandbench_suite::outside::Config;
use strandbench_suite::{Cell, Lock, Method, SceneJob, all_scenes};

/// Runs the command; `false` if it ran and something in it failed.
pub fn run(args: &Args) -> Result<bool> {
    if let Some(threads) = args.common.threads {
        rayon::ThreadPoolBuilder::new().num_threads(threads.into()).build_global()?;
    }
    let show = Show::new(args.common.quiet);
    let json = args.common.json;
    let config = || Config::load(args.common.config.as_deref());
    match &args.command {
        Command::Scenes(list) => lists::scenes(list, json),
        Command::Variants(list) => lists::variants(list, &config()?, json),
        Command::Baselines(BaselinesCommand::List) => door::list_baselines(json),
        work => {
            listen_for_ctrl_c()?;
            match work {
                Command::Bench(a) => crate::bench::run(a, args.common.threads, &show, json),
                Command::Run(a) => run_job(a, &config()?, &show, json),
                Command::Render(a) => stages::render(a, &show, json),
                Command::Reconstruct(a) => stages::reconstruct(a, &config()?, &show, json),
                Command::Ablate(a) => ablate::run(a, &show, json),
                Command::Score(a) => stages::score(a, &show, json),
                Command::Report(a) => stages::report(a, &show, json),
                Command::Import(a) => files::import(a, &show, json),
                Command::Export(a) => files::export(a, &show, json),
                Command::Dataset(DatasetCommand::Export(a)) => door::export_dataset(a, &show, json),
                Command::Baselines(BaselinesCommand::Config(a)) => door::write_baselines(a, &show, json),
                Command::Compare(a) => judge::compare(a, &show, json),
                Command::Gate(a) => gate::gate(a, &show, json),
                Command::History(a) => judge::history(a, &show, json),
                Command::Workflow(c) => workflow::run(c, args.common.config.as_deref(), &show, json),
                Command::Crosscheck(a) => crate::crosscheck::crosscheck(a, &show, json),
                Command::Scenes(_) | Command::Variants(_) | Command::Baselines(BaselinesCommand::List) => {
                    unreachable!("answered above")
                }
            }
        }
    }
}

pub(crate) fn print_json(value: &serde_json::Value) -> Result<bool> {
    outln!("{}", serde_json::to_string_pretty(value)?);
    Ok(true)
}

/// The scenes asked for; the default scene if none is named.
fn scene_jobs(args: &SceneArgs) -> Result<Vec<SceneJob>> {
    if let Some(hair) = &args.hair {
        // Without --radius-mm the job chooses one by the number of strands, and says so.
        let options = ImportOptions { radius_mm: args.import.radius_mm, ..import_options(&args.import)? };
        return Ok(vec![SceneJob::from_hair(hair, options, args.import.head.clone(), &args.settings)?]);
    }
    let i = &args.import;
    let only_hair = [
        ("--preset", i.preset.is_some()),
        ("--scale-mm", i.scale_mm.is_some()),
        ("--up", i.up.is_some()),
        ("--forward", i.forward.is_some()),
        ("--radius-mm", i.radius_mm.is_some()),
        ("--max-segment-mm", i.max_segment_mm.is_some()),
        ("--points-per-strand", i.points_per_strand.is_some()),
        ("--head", i.head.is_some()),
    ];
    if let Some((name, _)) = only_hair.iter().find(|(_, given)| *given) {
        bail!("{name} says how to read a hair file; give one with --hair FILE");
    }
    let names: Vec<&str> = if args.all && args.frames.is_some() {
        all_scenes().map(|e| e.name).collect()
    } else if args.all {
        strandbench_scenes::catalog().iter().map(|e| e.name).collect()
    } else if args.scene.is_empty() {
        vec![strandbench_scenes::DEFAULT_SCENE]
    } else {
        args.scene.iter().map(String::as_str).collect()
    };
    Ok(names.into_iter().map(|n| SceneJob::open(n, &args.settings)).collect::<Result<_, _>>()?)
}

fn import_options(args: &ImportOptionArgs) -> Result<ImportOptions> {
    let mut options = match &args.preset {
        None => ImportOptions::default(),
        Some(name) => ImportOptions::preset(name)
            .ok_or_else(|| anyhow!("--preset {name}: unknown; known are {}", PRESETS.join(", ")))?,
    };
    options.scale_mm = args.scale_mm.unwrap_or(options.scale_mm);
    options.up = args.up.clone().unwrap_or(options.up);
    options.forward = args.forward.clone().unwrap_or(options.forward);
    options.radius_mm = args.radius_mm.or(options.radius_mm);
    options.max_segment_mm = args.max_segment_mm.unwrap_or(options.max_segment_mm);
    options.points_per_strand = args.points_per_strand.or(options.points_per_strand);
    Ok(options)
}

fn cells(args: &SceneArgs, variants: &[String], config: &Config) -> Result<Vec<Cell>> {
    let methods: Vec<Method> =
        variants.iter().map(|v| Method::find_in(v, &args.settings, config)).collect::<Result<_, _>>()?;
    let mut cells = Cell::matrix(&scene_jobs(args)?, &methods, &args.seed, &args.settings, args.frames)?;
    if args.all {
        // There the frames are those of the scenes that move.
        cells.iter_mut().filter(|cell| !cell.scene.moves()).for_each(|cell| cell.frames = None);
    }
    Ok(cells)
}

/// Which scenes of the catalogue `--all` leaves out, if it does.
fn say_left_out(args: &SceneArgs, show: &Show) {
    if args.all && args.frames.is_none() {
        let moving: Vec<&str> = strandbench_scenes::moving_catalog().iter().map(|e| e.name).collect();
        show.say(&format!(
            "{:<12} {} scenes that move are left out ({}); --all --frames A..B takes them too",
            "--all",
            moving.len(),
            moving.join(", ")
        ));
    }
}

/// What was decided for a hair file, each once.
fn say_notes(cells: &[Cell], show: &Show) {
    for note in cells.first().iter().flat_map(|c| &c.scene.notes) {
        show.say(&format!("{:<12} {note}", "hair file"));
    }
}

fn run_job(args: &RunArgs, config: &Config, show: &Show, json: bool) -> Result<bool> {
    let mut cells = cells(&args.scene, &args.variant, config)?;
    cells.iter_mut().for_each(|cell| cell.time_limit_s = args.time_limit);
    say_notes(&cells, show);
    say_left_out(&args.scene, show);
    let _lock = Lock::take(&args.scene.out)?;
    let summary = strandbench_suite::run_all(&cells, &args.scene.out, show)?;
    if json {
        print_json(&serde_json::to_value(&summary)?)?;
    } else if !show.quiet() {
        out!("{}", table::summary(&summary));
    }
    let failed: Vec<String> = summary.rows.iter().filter_map(table::failure).collect();
    for line in &failed {
        errln!("strandbench: {line}");
    }
    if let Some(problem) = &summary.history_problem {
        errln!("strandbench: this run is not in the history: {problem}");
    }
    Ok(failed.is_empty())
}

//! Each command as a call into the suite.

use crate::args::{
    Args, Command, ImportArgs, ImportOptionArgs, ListArgs, ReconstructArgs, RenderArgs, ReportArgs, RunArgs,
    SceneArgs, ScoreArgs,
};
use crate::progress::{Show, listen_for_ctrl_c};
use crate::table;
use anyhow::{Context, Result, anyhow, bail};
use serde_json::json;
use std::path::{Path, PathBuf};
use strandbench_io::{ImportOptions, PRESETS};
use strandbench_recon::VARIANTS;
use strandbench_suite::sequence::{self, ALL_FRAMES, Sequence};
use strandbench_suite::{
    Cell, Done, ESTIMATE, FRAME, Lock, Method, Part, Places, SceneJob, Setting, SuiteError, TRUTH,
};

/// Runs the command; `false` if it ran and something in it failed.
pub fn run(args: &Args) -> Result<bool> {
    if let Some(threads) = args.common.threads {
        rayon::ThreadPoolBuilder::new().num_threads(threads.into()).build_global()?;
    }
    let show = Show::new(args.common.quiet);
    let json = args.common.json;
    match &args.command {
        Command::Scenes(list) => scenes(list, json),
        Command::Variants(list) => variants(list, json),
        work => {
            listen_for_ctrl_c()?;
            match work {
                Command::Bench(a) => crate::bench::run(a, args.common.threads, &show, json),
                Command::Run(a) => run_job(a, &show, json),
                Command::Render(a) => render(a, &show, json),
                Command::Reconstruct(a) => reconstruct(a, &show, json),
                Command::Score(a) => score(a, &show, json),
                Command::Report(a) => report(a, &show, json),
                Command::Import(a) => import(a, &show, json),
                Command::Crosscheck(a) => crate::crosscheck::crosscheck(a, &show, json),
                Command::Scenes(_) | Command::Variants(_) => unreachable!("answered above"),
            }
        }
    }
}

pub(crate) fn print_json(value: &serde_json::Value) -> Result<bool> {
    println!("{}", serde_json::to_string_pretty(value)?);
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
    let names: Vec<&str> = if args.all {
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

/// What else than the scene a render's folder name tells: another seed, other sampling.
fn suffix(args: &SceneArgs) -> String {
    let seed = (args.seed != 1).then(|| format!("+seed={}", args.seed));
    let sampling = args.settings.iter().filter(|s| s.part == Part::Render);
    seed.into_iter().chain(sampling.map(|s| format!("+{}={}", s.key, s.value))).collect()
}

fn cells(args: &SceneArgs, variants: &[String]) -> Result<Vec<Cell>> {
    let settings = strandbench_suite::render_settings(&args.settings)?;
    let methods: Vec<Method> =
        variants.iter().map(|v| Method::find(v, &args.settings)).collect::<Result<_, _>>()?;
    let mut cells = Vec::new();
    for scene in scene_jobs(args)? {
        for method in &methods {
            cells.push(Cell {
                scene: scene.clone(),
                method: method.clone(),
                settings: settings.clone(),
                suffix: suffix(args),
                seed: args.seed,
                frames: args.frames,
                time_limit_s: None,
            });
        }
    }
    Ok(cells)
}

/// What was decided for a hair file, each once.
fn say_notes(cells: &[Cell], show: &Show) {
    for note in cells.first().iter().flat_map(|c| &c.scene.notes) {
        show.say(&format!("{:<12} {note}", "hair file"));
    }
}

fn run_job(args: &RunArgs, show: &Show, json: bool) -> Result<bool> {
    let mut cells = cells(&args.scene, &args.variant)?;
    cells.iter_mut().for_each(|cell| cell.time_limit_s = args.time_limit);
    say_notes(&cells, show);
    let _lock = Lock::take(&args.scene.out)?;
    let summary = strandbench_suite::run_all(&cells, &args.scene.out, show)?;
    if json {
        print_json(&serde_json::to_value(&summary)?)?;
    } else if !show.quiet() {
        print!("{}", table::summary(&summary));
    }
    let failed: Vec<String> = summary.rows.iter().filter_map(table::failure).collect();
    for line in &failed {
        eprintln!("strandbench: {line}");
    }
    Ok(failed.is_empty())
}

fn render(args: &RenderArgs, show: &Show, json: bool) -> Result<bool> {
    if let Some(wrong) = args.scene.settings.iter().find(|s| s.part == Part::Recon) {
        bail!("--set {wrong}: rendering has no such setting; use scene.KEY or render.KEY");
    }
    let cells = cells(&args.scene, &["luo".to_owned()])?;
    say_notes(&cells, show);
    let _lock = Lock::take(&args.scene.out)?;
    let mut done = Vec::new();
    for cell in &cells {
        let (scene, settings, seed) = (&cell.scene, &cell.settings, cell.seed);
        let folder = cell.places(&args.scene.out).render;
        if scene.moves() {
            let frames = cell.frames.unwrap_or_default();
            done.push(sequence::render_sequence(scene, settings, seed, frames, &folder, show)?.whole());
        } else if cell.frames.is_some() {
            bail!("scene {} has one pose: --frames is for moving scenes", scene.name);
        } else {
            done.push(strandbench_suite::render(scene, settings, seed, &folder, show)?);
        }
    }
    tell(&done, show, json)
}

/// Prints finished stages.
fn tell(done: &[Done], show: &Show, json: bool) -> Result<bool> {
    if json {
        let all: Vec<_> = done
            .iter()
            .map(|d| json!({"folder": d.folder, "reused": d.reused, "reason": d.reason, "record": d.record}))
            .collect();
        return print_json(&serde_json::Value::Array(all));
    }
    for d in done.iter().filter(|_| !show.quiet()) {
        println!("{}", d.folder.display());
    }
    Ok(true)
}

/// The folder two above, by name; a path that is only a name is completed first.
fn beside(folder: &Path, up: usize, name: &str) -> Result<PathBuf> {
    let whole = std::path::absolute(folder).with_context(|| folder.display().to_string())?;
    let base =
        whole.ancestors().nth(up).ok_or_else(|| anyhow!("{}: has no folder {up} above", folder.display()))?;
    Ok(base.join(name))
}

fn reconstruct(args: &ReconstructArgs, show: &Show, json: bool) -> Result<bool> {
    if let Some(wrong) = args.settings.iter().find(|s: &&Setting| s.part != Part::Recon) {
        bail!("--set {wrong}: only the method's parameters can be changed here");
    }
    let method = Method::find(&args.variant, &args.settings)?;
    if Sequence::is(&args.folder) {
        let out = match &args.out {
            Some(out) => out.clone(),
            None => beside(&args.folder, 1, &method.label)?.join("reconstruct"),
        };
        let stages = sequence::reconstruct_sequence(&args.folder, &method.variant, &out, show)?;
        return tell(&[stages.whole()], show, json);
    }
    let frame = if args.folder.join(FRAME).is_dir() { args.folder.join(FRAME) } else { args.folder.clone() };
    let out = match &args.out {
        Some(out) => out.clone(),
        None if frame != args.folder => beside(&args.folder, 1, &method.label)?.join("reconstruct"),
        None => bail!("{} is not a render folder; say where to write with --out DIR", args.folder.display()),
    };
    tell(&[strandbench_suite::reconstruct(&frame, &method.variant, &out, show)?], show, json)
}

/// Scores the frames of a variant folder, or of a folder of answers; `None` if the truth is not of a sequence.
fn score_sequence(args: &ScoreArgs, show: &Show) -> Result<Option<Done>> {
    let within = args.folder.join("reconstruct");
    let (answers, variant) =
        if within.is_dir() { (within, args.folder.clone()) } else { (args.folder.clone(), beside(&args.folder, 1, "")?) };
    let render = match &args.truth {
        Some(render) => render.clone(),
        None => beside(&variant, 1, "render")?,
    };
    if !Sequence::is(&render) {
        return Ok(None);
    }
    let seed = match args.seed {
        Some(seed) => seed,
        None => Sequence::open(&render)?.file.seed,
    };
    let out = args.out.clone().unwrap_or_else(|| variant.join("score"));
    Ok(Some(sequence::score_sequence(&render, &answers, seed, &out, show)?.whole()))
}

fn score(args: &ScoreArgs, show: &Show, json: bool) -> Result<bool> {
    if let Some(done) = score_sequence(args, show)? {
        print_scores(&done.folder.join(ALL_FRAMES), show, json)?;
        return tell(&[done], show, json);
    }
    let candidates = [args.folder.join("reconstruct").join(ESTIMATE), args.folder.join(ESTIMATE)];
    let within = candidates.iter().position(|c| c.is_dir());
    let estimate = within.map_or_else(|| args.folder.clone(), |i| candidates[i].clone());
    // The variant folder is the one asked for, or its parent if its reconstruct folder was.
    let variant = |name: &str| match within {
        Some(levels) => beside(&args.folder, levels, name),
        None if !args.folder.is_dir() => {
            bail!("{}: there is no such folder; `strandbench reconstruct` makes one", args.folder.display())
        }
        None => bail!("{} is a bare estimate; say --truth DIR and --out DIR", args.folder.display()),
    };
    let truth = match &args.truth {
        Some(truth) => truth.clone(),
        None => variant("../render")?.join(TRUTH),
    };
    let out = match &args.out {
        Some(out) => out.clone(),
        None => variant("score")?,
    };
    let render = truth.parent().unwrap_or(Path::new("."));
    let seed = match args.seed {
        Some(seed) => seed,
        None => strandbench_suite::read_render_file(render).map_or(1, |r| r.seed),
    };
    let done = strandbench_suite::score(&truth, &estimate, seed, &out, show)?;
    print_scores(&done.folder, show, json)?;
    tell(&[done], show, json)
}

/// The figures of a score folder as a table.
fn print_scores(folder: &Path, show: &Show, json: bool) -> Result<()> {
    if !json && !show.quiet() {
        let path = folder.join(strandbench_suite::SCORES);
        let text = std::fs::read_to_string(&path).with_context(|| path.display().to_string())?;
        let file: strandbench_suite::ScoreFile =
            serde_json::from_str(&text).with_context(|| path.display().to_string())?;
        print!("{}", table::scores(&file.scores));
    }
    Ok(())
}

fn report(args: &ReportArgs, show: &Show, json: bool) -> Result<bool> {
    if !args.folder.is_dir() {
        bail!("{}: there is no such folder; `strandbench score` makes one", args.folder.display());
    }
    let render = match &args.render {
        Some(render) => render.clone(),
        None => beside(&args.folder, 1, "render")?,
    };
    let variant = std::path::absolute(&args.folder)?;
    let name = variant.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let places = Places::new(&render, &args.folder);
    let done = if Sequence::is(&render) {
        strandbench_suite::report::sequence::report(&places, &name, show)?
    } else {
        strandbench_suite::report::report(&places, &name, show)?
    };
    tell(&[done], show, json)
}

fn import(args: &ImportArgs, show: &Show, json: bool) -> Result<bool> {
    if args.out.exists() && !args.force {
        bail!("{}: is there already; choose another name or say --force", args.out.display());
    }
    let options = import_options(&args.options)?;
    let made =
        strandbench_suite::import(&args.file, &args.out, &options, args.options.head.as_deref(), show)?;
    if json {
        return print_json(&serde_json::to_value(&made)?);
    }
    if !show.quiet() {
        print!("{}", table::import(&made));
    }
    Ok(true)
}

fn scenes(list: &ListArgs, json: bool) -> Result<bool> {
    let entry = |name: &str| SceneJob::open(name, &[]);
    match list {
        ListArgs::List => {
            let jobs: Vec<SceneJob> = strandbench_suite::all_scenes()
                .map(|e| entry(e.name))
                .collect::<Result<_, SuiteError>>()?;
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
            print!("{}", table::scenes(&jobs));
        }
        ListArgs::Show { name } => {
            let job = entry(name)?;
            if json {
                return print_json(&serde_json::to_value(job.spec())?);
            }
            print!("{}", job.toml);
        }
    }
    Ok(true)
}

fn variants(list: &ListArgs, json: bool) -> Result<bool> {
    match list {
        ListArgs::List => {
            if json {
                return print_json(&serde_json::to_value(VARIANTS)?);
            }
            for v in VARIANTS {
                println!("{:<22} {}", v.name, v.asks);
            }
        }
        ListArgs::Show { name } => {
            let method = Method::find(name, &[])?;
            if json {
                return print_json(&serde_json::to_value(method.variant)?);
            }
            println!("{}: {}", method.variant.name, method.variant.asks);
            for (key, value) in method.variant.entries() {
                println!("  {key} = {value}");
            }
        }
    }
    Ok(true)
}

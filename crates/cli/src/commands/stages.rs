//! The stages apart, each on the folder that the one before wrote.

use super::{cells, print_json, say_left_out, say_notes};
use crate::print::{out, outln};
use crate::progress::Show;
use crate::stage_args::{ReconstructArgs, RenderArgs, ReportArgs, SceneArgs, ScoreArgs};
use crate::table;
use anyhow::{Context, Result, anyhow, bail};
use serde_json::json;
use std::path::{Path, PathBuf};
use strandbench_suite::face::{self, FaceFile, FaceJob};
use strandbench_suite::outside::Config;
use strandbench_suite::sequence::{self, ALL_FRAMES, Frames, Sequence};
use strandbench_suite::{Done, ESTIMATE, FRAME, Lock, Method, Part, Places, Setting, TRUTH, render_suffix};

pub(super) fn render(args: &RenderArgs, show: &Show, json: bool) -> Result<bool> {
    if let Some(wrong) = args.scene.settings.iter().find(|s| s.part == Part::Recon) {
        bail!("--set {wrong}: rendering has no such setting; use scene.KEY or render.KEY");
    }
    let (faces, hair) = faces(&args.scene)?;
    let cells = match (hair.scene.is_empty(), faces.is_empty()) {
        // Faces alone were named: there is no default scene beside them.
        (true, false) => Vec::new(),
        _ => cells(&hair, &["luo".to_owned()], &Config::default())?,
    };
    say_notes(&cells, show);
    say_left_out(&args.scene, show);
    let _lock = Lock::take(&args.scene.out)?;
    let mut done = Vec::new();
    for job in &faces {
        done.extend(render_face(job, &args.scene, show)?);
    }
    for cell in &cells {
        done.push(strandbench_suite::render_cell(cell, &cell.places(&args.scene.out).render, show)?);
    }
    tell(&done, show, json)
}

/// The faces among the scenes that were named, and the arguments without them.
fn faces(args: &SceneArgs) -> Result<(Vec<FaceJob>, SceneArgs)> {
    let mut rest = args.clone();
    let mut faces = Vec::new();
    rest.scene.clear();
    for name in &args.scene {
        match FaceJob::open(name, &args.settings)? {
            Some(face) => faces.push(face),
            None => rest.scene.push(name.clone()),
        }
    }
    Ok((faces, rest))
}

/// A face with each of the seeds.
fn render_face(job: &FaceJob, args: &SceneArgs, show: &Show) -> Result<Vec<Done>> {
    let settings = face::settings(&args.settings)?;
    let frames = args.frames.unwrap_or(Frames { first: 0, end: Some(1) });
    if args.frames.is_none() {
        let all = job.spec.frames();
        show.say(&format!("{:<12} frame 0 of {all}; --frames A..B renders others", job.name));
    }
    args.seed
        .iter()
        .map(|&seed| {
            let out =
                args.out.join(format!("{}{}", job.label, render_suffix(seed, &args.settings))).join("render");
            Ok(face::render_face(job, &settings, seed, frames, &out, show)?)
        })
        .collect()
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
        outln!("{}", d.folder.display());
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

pub(super) fn reconstruct(args: &ReconstructArgs, config: &Config, show: &Show, json: bool) -> Result<bool> {
    if let Some(wrong) = args.settings.iter().find(|s: &&Setting| s.part != Part::Recon) {
        bail!("--set {wrong}: only the method's parameters can be changed here");
    }
    let method = Method::find_in(&args.variant, &args.settings, config)?;
    let rendered = Sequence::is(&args.folder) || args.folder.join(FRAME).is_dir();
    let out = match &args.out {
        Some(out) => out.clone(),
        None if rendered => beside(&args.folder, 1, &method.label)?.join("reconstruct"),
        None => bail!("{} is not a render folder; say where to write with --out DIR", args.folder.display()),
    };
    tell(&[method.reconstruct(&args.folder, &out, show)?], show, json)
}

/// Scores the frames of a variant folder, or of a folder of answers; `None` if the truth is not of a sequence.
fn score_sequence(folder: &Path, args: &ScoreArgs, show: &Show) -> Result<Option<Done>> {
    let within = folder.join("reconstruct");
    let (answers, variant) = if within.is_dir() {
        (within, folder.to_owned())
    } else {
        (folder.to_owned(), beside(folder, 1, "")?)
    };
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
    let rest: Option<[PathBuf; 2]> = args.rest.clone().try_into().ok();
    let out = args.out.clone().unwrap_or_else(|| variant.join("score"));
    // What --estimate names was made elsewhere: frames that it leaves out are absent.
    let score = match args.estimate {
        Some(_) => sequence::score_sequence_of_any,
        None => sequence::score_sequence,
    };
    Ok(Some(score(&render, &answers, seed, rest.as_ref(), &out, show)?.whole()))
}

pub(super) fn score(args: &ScoreArgs, show: &Show, json: bool) -> Result<bool> {
    let folder = match (&args.folder, &args.estimate) {
        (Some(folder), _) | (None, Some(folder)) => folder,
        (None, None) => bail!("say what to score: a variant folder, or --estimate DIR"),
    };
    if let Some(done) = score_sequence(folder, args, show)? {
        print_scores(&done.folder.join(ALL_FRAMES), show, json)?;
        return tell(&[done], show, json);
    }
    if !args.rest.is_empty() {
        bail!("--rest is for sequences; {} is not one", folder.display());
    }
    let candidates = [folder.join("reconstruct").join(ESTIMATE), folder.join(ESTIMATE)];
    let within = candidates.iter().position(|c| c.is_dir());
    let estimate = within.map_or_else(|| folder.clone(), |i| candidates[i].clone());
    // The variant folder is the one asked for, or its parent if its reconstruct folder was.
    let variant = |name: &str| match within {
        Some(levels) => beside(folder, levels, name),
        None if !folder.is_dir() => {
            bail!("{}: there is no such folder; `strandbench reconstruct` makes one", folder.display())
        }
        None => bail!("{} is a bare estimate; say --truth DIR and --out DIR", folder.display()),
    };
    let truth = match &args.truth {
        Some(render) if render.join(TRUTH).is_dir() => render.join(TRUTH),
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
        out!("{}", table::scores(&file.scores));
    }
    Ok(())
}

pub(super) fn report(args: &ReportArgs, show: &Show, json: bool) -> Result<bool> {
    if !args.folder.is_dir() {
        bail!("{}: there is no such folder; `strandbench score` makes one", args.folder.display());
    }
    let face = [args.folder.clone(), args.folder.join("render")].into_iter().find(|f| FaceFile::is(f));
    if let Some(folder) = face {
        return tell(&[face::report(&folder, show)?], show, json);
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

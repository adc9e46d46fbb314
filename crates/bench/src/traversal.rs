//! Rays against fibres and triangles: this project's tracer beside Embree and Mitsuba.

use crate::contest::{Contest, Ours, Standing, Tracer};
use crate::embree::{Embree, EmbreeScene, Quality};
use crate::error::BenchError;
use crate::python::{Python, write_array};
use crate::rays::{Kind, RaySets};
use crate::{Build, Options, Report, Work, curves, hair, memory};
use serde_json::json;
use std::path::Path;
use std::time::Instant;
use strandbench_renderer::accel::Accel;
use strandbench_types::{Monitor, StrandSet, TriMesh};

/// Name of the tracer that all are compared with.
pub const REFERENCE: &str = "Embree, high";

/// Times `make`, by the clock and by the processor.
pub(crate) fn built<T>(
    tracer: &str,
    scene: &str,
    make: impl FnOnce() -> Result<T, BenchError>,
) -> Result<(T, Build), BenchError> {
    let (cpu, resident) = (memory::cpu_s(), memory::resident_bytes());
    let clock = Instant::now();
    let made = make()?;
    let wall_s = clock.elapsed().as_secs_f64();
    let grown = memory::resident_bytes().zip(resident).map(|(now, before)| now.saturating_sub(before));
    let build = Build {
        scene: scene.into(),
        tracer: tracer.into(),
        wall_s,
        cpu_s: memory::cpu_s().zip(cpu).map(|(now, before)| now - before),
        bytes: grown,
        peak_bytes: memory::peak_bytes(),
    };
    Ok((made, build))
}

/// Loads the first Embree that there is.
fn embree(options: &Options) -> Result<Embree, String> {
    let mut reasons = Vec::new();
    for place in options.embree_places() {
        match Embree::load(&place) {
            Ok(embree) => return Ok(embree),
            Err(e) => reasons.push(e.to_string()),
        }
    }
    Err(reasons.join("; "))
}

/// Builds once and says what it took.
pub(crate) fn build(options: &Options, report: &mut Report) -> Result<(), BenchError> {
    let strands = hair::wavy(options.strands, options.segments, 1);
    let scene = name(&strands);
    let (accel, mut build) = built("strandbench", &scene, || Ok(Accel::new(&strands, &[])?))?;
    build.bytes = Some(accel.bytes() as u64);
    report.builds.push(build);
    Ok(())
}

fn name(strands: &StrandSet) -> String {
    format!("{} strands, {} segments", strands.len(), strands.points.len() - strands.len())
}

/// Starts a tracer in Python and lets it load; what is missing is noted and left out.
fn python(
    options: &Options,
    variant: &str,
    folder: &Path,
    load: serde_json::Value,
    scene: &str,
    report: &mut Report,
) -> Option<Python> {
    let started = Python::start(&options.interpreter(), variant, folder).and_then(|p| {
        let (spent, _) = p.timed(load)?;
        Ok((p, spent))
    });
    match started {
        Ok((python, spent)) => {
            let tracer = format!("{} {variant}", python.version);
            let (wall_s, cpu_s) = (spent.wall_s, Some(spent.cpu_s));
            let scene = scene.to_owned();
            report.builds.push(Build { scene, tracer, wall_s, cpu_s, bytes: None, peak_bytes: None });
            Some(python)
        }
        Err(e) => {
            report.skipped.push(e.to_string());
            None
        }
    }
}

/// One thread and all, on fibres and on triangles.
pub(crate) fn rays(
    options: &Options,
    folder: &Path,
    report: &mut Report,
    monitor: &dyn Monitor,
) -> Result<(), BenchError> {
    let embree = embree(options).map_err(|e| report.skipped.push(e)).ok();
    if let Some(e) = &embree {
        report.versions.push(format!("Embree {} ({})", e.version(), e.path().display()));
    }
    let strands = hair::wavy(options.strands, options.segments, 1);
    let scene = name(&strands);
    let (accel, mut own) = built("strandbench", &scene, || Ok(Accel::new(&strands, &[])?))?;
    own.bytes = Some(accel.bytes() as u64);
    report.builds.push(own);
    let view = (&hair::camera((640, 480)), &hair::light());
    let sets = RaySets::new(&strands, view, &accel, options.rays, 1);
    report.work.extend(Kind::ALL.map(|kind| Work::mean(&accel, &sets, kind)));
    let mut scenes = Vec::new();
    for (quality, words) in [(Quality::High, REFERENCE), (Quality::Medium, "Embree, medium")] {
        if let Some(e) = &embree {
            let make = || EmbreeScene::curves(e, &strands, quality, options.threads);
            let failed = |e: crate::embree::EmbreeError| BenchError::Tracer {
                tracer: words.into(),
                reason: e.to_string(),
            };
            let (made, build) = built(words, &scene, || make().map_err(failed))?;
            report.builds.push(build);
            scenes.push((words.to_owned(), made));
        }
    }
    curves::write(&strands, curves::LINEAR, folder)?;
    let load = json!({"do": "load", "folder": folder, "curve": curves::LINEAR});
    let mitsuba = python(options, "llvm_ad_rgb", folder, load, &scene, report);
    report.skipped.push(
        "mitsuba scalar_rgb for rays: it answers one ray a call from Python, which times Python; its tracer is \
         the one of the vectorised variant"
            .into(),
    );
    let ours = Ours { accel: &accel, keeps_blockers: false };
    let kept = Ours { accel: &accel, keeps_blockers: true };
    let mut tracers: Vec<(String, &dyn Tracer)> =
        vec![("strandbench".into(), &ours), ("strandbench, blockers kept".into(), &kept)];
    tracers.extend(scenes.iter().map(|(name, s)| (name.clone(), s as &dyn Tracer)));
    tracers.extend(mitsuba.iter().map(|m| (format!("{} {}", m.version, m.name()), m as &dyn Tracer)));
    let mut contest = Contest { scene, tracers, reference: REFERENCE, rounds: options.rounds, threads: 1 };
    report.rays.extend(compete(&mut contest, &sets, mitsuba.as_ref(), options, monitor)?);
    meshes(options, embree.as_ref(), folder, report, monitor)
}

/// With one thread, then with all.
fn compete(
    contest: &mut Contest,
    sets: &RaySets,
    python: Option<&Python>,
    options: &Options,
    monitor: &dyn Monitor,
) -> Result<Vec<Standing>, BenchError> {
    let mut rows = Vec::new();
    let mut counts = vec![1, options.threads];
    counts.dedup();
    for threads in counts {
        contest.threads = threads;
        let words = format!("{}, {threads} threads", contest.scene);
        monitor.begin(&words, (Kind::ALL.len() * contest.rounds) as u64);
        if let Some(p) = python.filter(|p| p.name() != "embreex") {
            p.ask(json!({"do": "threads", "count": threads}))?;
        }
        rows.extend(contest.run(sets, monitor)?);
    }
    Ok(rows)
}

/// A ball of 90 mm with bumps of a millimetre, of 2 n² triangles.
fn bumpy(n: u32) -> TriMesh {
    let mut mesh = TriMesh::default();
    for i in 0..=n {
        for j in 0..n {
            let (a, b) =
                (i as f32 / n as f32 * std::f32::consts::PI, j as f32 / n as f32 * std::f32::consts::TAU);
            let r = 90.0 + libm::sinf(17.0 * a) * libm::cosf(23.0 * b);
            let flat = r * libm::sinf(a);
            mesh.vertices.push(glam::Vec3::new(
                flat * libm::cosf(b),
                r * libm::cosf(a),
                flat * libm::sinf(b),
            ));
        }
    }
    for i in 0..n {
        for j in 0..n {
            let at = |i: u32, j: u32| i * n + j % n;
            mesh.triangles.push([at(i, j), at(i, j + 1), at(i + 1, j)]);
            mesh.triangles.push([at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)]);
        }
    }
    mesh
}

/// The same on triangles.
fn meshes(
    options: &Options,
    embree: Option<&Embree>,
    folder: &Path,
    report: &mut Report,
    monitor: &dyn Monitor,
) -> Result<(), BenchError> {
    let mesh = bumpy(256);
    let scene = format!("{} triangles", mesh.triangles.len());
    let (accel, mut own) = built("strandbench", &scene, || Ok(Accel::new(&StrandSet::new(), &[&mesh])?))?;
    own.bytes = Some(accel.bytes() as u64);
    report.builds.push(own);
    let sets = RaySets::on_mesh(&mesh, (&hair::camera((640, 480)), &hair::light()), &accel, options.rays, 1);
    let high = match embree {
        None => None,
        Some(e) => {
            let make = || EmbreeScene::triangles(e, &mesh, Quality::High, options.threads);
            let failed = |e: crate::embree::EmbreeError| BenchError::Tracer {
                tracer: REFERENCE.into(),
                reason: e.to_string(),
            };
            let (made, build) = built(REFERENCE, &scene, || make().map_err(failed))?;
            report.builds.push(build);
            Some(made)
        }
    };
    write_array(folder, "vertices", mesh.vertices.iter().flat_map(|v| v.to_array()), f32::to_le_bytes)?;
    write_array(folder, "triangles", mesh.triangles.iter().flatten().copied(), u32::to_le_bytes)?;
    let embreex = python(options, "embreex", folder, json!({"do": "load", "folder": folder}), &scene, report);
    let ours = Ours { accel: &accel, keeps_blockers: false };
    let mut tracers: Vec<(String, &dyn Tracer)> = vec![("strandbench".into(), &ours)];
    tracers.extend(high.iter().map(|s| (REFERENCE.to_owned(), s as &dyn Tracer)));
    // The module looks for first hits only.
    let mut contest = Contest { scene, tracers, reference: REFERENCE, rounds: options.rounds, threads: 1 };
    report.rays.extend(compete(&mut contest, &sets, None, options, monitor)?);
    if let Some(e) = &embreex {
        contest.tracers.push((e.version.clone(), e));
        contest.threads = 1;
        let closest = RaySets { sets: [sets.sets[0].clone(), Vec::new(), sets.sets[2].clone()] };
        let rows = contest.run(&closest, monitor)?;
        report.rays.extend(rows.into_iter().filter(|r| r.tracer == e.version && r.kind != Kind::Shadow));
    }
    Ok(())
}

//! Speed of each step of a moving scene at its real size: 640x480, four views, `moving-straight-blonde`, strands grown.
//!
//! `cargo bench --bench sequence`. Accuracy is never measured here.

use criterion::{Criterion, SamplingMode, criterion_group, criterion_main};
use std::time::{Duration, Instant};
use strandbench_recon::{LUO, SequenceReconstructor, VARIANTS, Variant};
use strandbench_renderer::{RenderScene, Settings, expose};
use strandbench_scenes::{Simulation, moving_catalog};
use strandbench_types::{Estimate, Frame, Rig, SampleHits, Silent, Truth};

const SEED: u64 = 1;

/// The head begins to turn.
const FIRST: u32 = 20;

/// Shown forwards and backwards again and again.
const FRAMES: u32 = 4;

/// What a camera sees of a pose, and the truth about it. Direct light: enough to reconstruct from.
fn shoot(scene: &strandbench_scenes::Scene, index: u32) -> (Frame, Truth) {
    let settings =
        Settings { samples_per_pixel: 8, max_samples_per_pixel: 8, depth: 1, ..Settings::default() };
    let prepared = RenderScene::new(scene).expect("builds");
    let renders: Vec<_> = (0..scene.rig.cameras.len())
        .map(|camera| prepared.render(camera, &settings, SEED, &Silent).expect("renders"))
        .collect();
    let hits: Vec<SampleHits> = renders.iter().map(|r| r.hits.clone()).collect();
    let truth =
        strandbench_groundtruth::truth(&scene.rig, &scene.strands, None, &hits).expect("consistent truth");
    let images =
        renders.iter().enumerate().map(|(i, r)| expose(&scene.sensor, i, &r.radiance_rgb, SEED)).collect();
    (Frame { index, images, masks: truth.views.iter().map(|v| v.mask.clone()).collect() }, truth)
}

/// A method amid a long sequence: every frame that comes in lets one out, with neighbours on both sides.
struct Running<'a> {
    frames: &'a [Frame],
    method: SequenceReconstructor,
    next: u32,
}

impl<'a> Running<'a> {
    /// What comes out first is of the first frame.
    fn new(rig: &Rig, frames: &'a [Frame], variant: &Variant) -> (Running<'a>, Estimate) {
        let method = SequenceReconstructor::new(rig, variant).expect("a valid rig");
        let mut running = Running { frames, method, next: 0 };
        let first = loop {
            if let Some(estimate) = running.push() {
                break estimate;
            }
        };
        (running, first)
    }

    fn push(&mut self) -> Option<Estimate> {
        let last = self.frames.len() - 1;
        let turn = self.next as usize % (2 * last);
        let frame = Frame { index: self.next, ..self.frames[turn.min(2 * last - turn)].clone() };
        self.next += 1;
        let mut out = self.method.push(&frame, &Silent).expect("a valid frame");
        assert!(out.len() <= 1, "{} frames came out at once", out.len());
        Some(out.pop()?.outcome.expect("an answer").estimate)
    }
}

fn sequence(c: &mut Criterion) {
    let entry =
        moving_catalog().iter().find(|e| e.name == "moving-straight-blonde").expect("in the catalogue");
    let spec = entry.spec().expect("parses");
    let mut group = c.benchmark_group("sequence");
    group.sample_size(10).warm_up_time(Duration::from_millis(1)).sampling_mode(SamplingMode::Flat);

    let begin = || Simulation::new(&spec, SEED, None, &Silent).expect("grooms");
    let mut simulation = begin();
    let mut next = move || loop {
        match simulation.next_frame(&Silent).expect("not cancelled") {
            Some(frame) => break frame,
            None => simulation = begin(),
        }
    };
    let shots: Vec<(Frame, Truth, Rig)> = (0..FIRST + FRAMES)
        .map(|_| next())
        .filter(|pose| pose.index >= FIRST)
        .map(|pose| {
            let (frame, truth) = shoot(&pose.scene, pose.index);
            (frame, truth, pose.scene.calibrated_rig)
        })
        .collect();
    group.bench_function("motion/a frame simulated and posed", |b| {
        b.iter_custom(|n| {
            let start = Instant::now();
            (0..n).for_each(|_| drop(next()));
            start.elapsed()
        });
    });

    let rig = &shots[0].2;
    let frames: Vec<Frame> = shots.iter().map(|s| s.0.clone()).collect();
    let alone = LUO.with("denoise", "false").expect("a parameter");
    let strands = VARIANTS.iter().find(|v| v.name == "luo-strands").expect("in the table");
    let mut estimate = None;
    for (name, variant) in [("envelope", &alone), ("envelope, de-noised", &LUO), ("strands", strands)] {
        let (mut running, first) = Running::new(rig, &frames, variant);
        estimate = Some(first);
        group.bench_function(format!("reconstruct/a frame, {name}"), |b| {
            b.iter(|| running.push().expect("one comes out"));
        });
    }
    let estimate = estimate.expect("with strands");
    let truth = &shots[0].1;
    group.bench_function("score/envelope of a frame", |b| {
        b.iter(|| strandbench_score::score(truth, &estimate, SEED, &Silent).expect("scores"));
    });
    group.bench_function("score/strands of a frame", |b| {
        b.iter(|| strandbench_score::score_strands(truth, &estimate, SEED, &Silent).expect("scores"));
    });
    group.finish();
}

criterion_group!(benches, sequence);
criterion_main!(benches);

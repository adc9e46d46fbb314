//! Speed of a bearded face: `face-full-beard`, a moment posed, prepared, lit below its skin, and seen by one camera.
//!
//! `cargo bench --bench faces`. Views are sampled as `strandbench render` samples faces; their rates are camera rays a second, of
//! which most only find what they meet and some bring shadow rays and bounces. How far so many are from converged is in
//! reports/faces.md.

use criterion::{Criterion, SamplingMode, Throughput, criterion_group, criterion_main};
use std::path::Path;
use std::time::Duration;
use strandbench_renderer::RenderScene;
use strandbench_scenes::face::{FaceScene, FaceStage, catalog};
use strandbench_types::Silent;

const SEED: u64 = 1;

/// The middle of a spoken sentence.
const TIME_S: f64 = 1.0;

/// A quarter of the scaled setting's side: 1/16 of its pixels, of the same face.
const VIEW_PX: (u32, u32) = (384, 512);

fn faces(c: &mut Criterion) {
    let entry = catalog().iter().find(|e| e.name == "face-full-beard").expect("in the catalogue");
    let mut spec = FaceScene::parse(entry.toml, Path::new(entry.name)).expect("parses");
    (spec.rig.width_px, spec.rig.height_px) = (Some(VIEW_PX.0), Some(VIEW_PX.1));
    let stage = FaceStage::new(&spec, SEED, None).expect("grooms");
    let moment = stage.moment(TIME_S).expect("poses");
    let scene = &moment.scene;
    let settings = strandbench_suite::face::settings(&[]).expect("defaults");

    let mut group = c.benchmark_group("faces");
    group.sample_size(10).warm_up_time(Duration::from_millis(1)).sampling_mode(SamplingMode::Flat);
    group.bench_function("posed", |b| b.iter(|| stage.moment(TIME_S).expect("poses")));
    group.bench_function("tree", |b| b.iter(|| RenderScene::new(scene).expect("builds")));
    group.bench_function("tree and light below the skin", |b| {
        b.iter(|| {
            RenderScene::new(scene).expect("builds").prepare(&settings, SEED, &Silent).expect("lights")
        });
    });
    let prepared = RenderScene::new(scene).expect("builds");
    prepared.prepare(&settings, SEED, &Silent).expect("lights");
    for name in ["front-up-a", "front-below-a", "left-a", "left-x"] {
        let camera = scene.rig.cameras.iter().position(|c| c.name == name).expect("in the rig");
        let view = || prepared.render(camera, &settings, SEED, &Silent).expect("renders");
        group.throughput(Throughput::Elements(view().stats.primary_rays));
        group.bench_function(format!("view {name}, at most 8 samples"), |b| b.iter(view));
    }
    group.finish();
}

criterion_group!(benches, faces);
criterion_main!(benches);

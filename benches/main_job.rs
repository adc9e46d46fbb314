//! Speed of each step of the main job at its real size: 640x480, four views, the default scene.
//!
//! `cargo bench --bench main_job`. Accuracy is never measured here.

use criterion::{Criterion, criterion_group, criterion_main};
use std::time::Duration;
use strandbench_renderer::{RenderScene, Settings, expose};
use strandbench_types::{Frame, SampleHits, Silent};

const SEED: u64 = 1;

fn main_job(c: &mut Criterion) {
    let entry = strandbench_scenes::catalog()
        .iter()
        .find(|e| e.name == strandbench_scenes::DEFAULT_SCENE)
        .expect("the default scene is in the catalogue");
    let spec = entry.spec().expect("the default scene parses");
    let mut group = c.benchmark_group("main_job");
    group.sample_size(10).warm_up_time(Duration::from_secs(1)).measurement_time(Duration::from_secs(10));

    group.bench_function("scene/build", |b| {
        b.iter(|| strandbench_scenes::build(&spec, SEED, None).expect("builds"));
    });
    let scene = strandbench_scenes::build(&spec, SEED, None).expect("builds");
    group.bench_function("renderer/bvh", |b| b.iter(|| RenderScene::new(&scene).expect("builds")));

    let prepared = RenderScene::new(&scene).expect("builds");
    let settings = Settings { samples_per_pixel: 8, max_samples_per_pixel: 8, ..Settings::default() };
    group.bench_function("renderer/view at 8 rays a pixel", |b| {
        b.iter(|| prepared.render(0, &settings, SEED, &Silent).expect("renders"));
    });

    let renders: Vec<_> = (0..scene.rig.cameras.len())
        .map(|camera| prepared.render(camera, &settings, SEED, &Silent).expect("renders"))
        .collect();
    let hits: Vec<SampleHits> = renders.iter().map(|r| r.hits.clone()).collect();
    let truth =
        || strandbench_groundtruth::truth(&scene.rig, &scene.strands, None, &hits).expect("consistent");
    group.bench_function("groundtruth", |b| b.iter(truth));

    let truth = truth();
    let frame = Frame {
        index: 0,
        images: renders
            .iter()
            .enumerate()
            .map(|(i, r)| expose(&scene.sensor, i, &r.radiance_rgb, SEED))
            .collect(),
        masks: truth.views.iter().map(|v| v.mask.clone()).collect(),
    };
    for variant in strandbench_recon::VARIANTS {
        group.bench_function(format!("reconstruct/{}", variant.name), |b| {
            b.iter(|| {
                strandbench_recon::reconstruct(&scene.calibrated_rig, &frame, variant, &Silent)
                    .expect("reconstructs")
            });
        });
    }
    let luo = strandbench_recon::reconstruct(&scene.calibrated_rig, &frame, &strandbench_recon::LUO, &Silent)
        .expect("reconstructs");
    group.bench_function("score", |b| {
        b.iter(|| strandbench_score::score(&truth, &luo.estimate, SEED, &Silent).expect("scores"));
    });
    group.finish();
}

criterion_group!(benches, main_job);
criterion_main!(benches);

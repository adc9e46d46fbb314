//! Wall time of the minimisers at the method's size: 640 x 480 pixels, 128 labels, 41 % of the pixels active.

use std::hint::black_box;
use std::time::Duration;

use criterion::{Criterion, criterion_group, criterion_main};
use strandbench_solve::{CoarseToFineOptions, TrwsOptions, coarse_to_fine, trws, winner_take_all};

mod surface;

fn minimisers(c: &mut Criterion) {
    let surface = surface::surface(640, 480, 128, 30.0, 0.3, 1);
    let problem = surface.problem();
    let mut group = c.benchmark_group("640x480x128");
    group.sample_size(10).measurement_time(Duration::from_secs(20));
    group.bench_function("winner_take_all", |b| b.iter(|| winner_take_all(black_box(&problem))));
    group.bench_function("coarse_to_fine", |b| {
        b.iter(|| coarse_to_fine(black_box(&problem), &CoarseToFineOptions::default(), &|| false));
    });
    let options = TrwsOptions { iterations: 5, gap: 0.0 };
    group.bench_function("trws_5", |b| b.iter(|| trws(black_box(&problem), &options, &|| false)));
    group.finish();
}

criterion_group!(benches, minimisers);
criterion_main!(benches);

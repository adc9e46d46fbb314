//! Rays a second through a tuft of 800,000 segments, and a whole small view. Each iteration of a ray
//! benchmark casts every ray of the view once; `thrpt` is rays a second on one thread.

#[path = "../examples/preview/demo.rs"]
mod demo;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::{DVec2, Vec3};
use std::hint::black_box;
use strandbench_renderer::accel::{Accel, Hit, LastBlockers, Skip};
use strandbench_renderer::{Lights, RenderScene, Settings};
use strandbench_scenes::{SkinDetail, SkinTexture};
use strandbench_types::Silent;

fn rays(c: &mut Criterion) {
    let scene = demo::tuft();
    let meshes: Vec<_> = scene.surfaces.iter().map(|s| &s.mesh).collect();
    let mut group = c.benchmark_group("rays");
    group.sample_size(10);
    group.bench_function("build", |b| b.iter(|| Accel::new(&scene.strands, &meshes).unwrap()));
    let camera = &scene.rig.cameras[0];
    let eye = camera.centre_mm().as_vec3();
    // Every third pixel of every third row, in order, as a renderer would ask.
    let primary: Vec<Vec3> = (0..160)
        .flat_map(|y| (0..213).map(move |x| DVec2::new(3.0 * f64::from(x) + 0.4, 3.0 * f64::from(y) + 0.6)))
        .map(|p| camera.ray_direction(p).normalize().as_vec3())
        .collect();
    let wide = Accel::new(&scene.strands, &meshes).unwrap();
    let lights = Lights::new(&scene.lights).unwrap();
    let (mut shadow, mut bounce) = (Vec::new(), Vec::new());
    for (i, &d) in primary.iter().enumerate() {
        if let Some(Hit::Fibre { t, strand, point, .. }) = wide.closest(eye, d) {
            let p = eye + d * t;
            let u = [0.618_034, 0.754_878, 0.569_84].map(|a: f32| (a * i as f32).fract());
            let (z, phi) = (2.0 * u[0] - 1.0, std::f32::consts::TAU * u[1]);
            let flat = (1.0 - z * z).sqrt();
            let away = Vec3::new(flat * phi.cos(), flat * phi.sin(), z);
            bounce.push((p, away, Skip { strand, point, near_mm: 0.16 }));
            if let Some(l) = lights.sample(u, p) {
                shadow.push((p, l, Skip { strand, point, near_mm: 0.16 }));
            }
        }
    }
    let narrow = Accel::new(&scene.strands, &meshes).unwrap().portable();
    for (accel, name) in
        [(&wide, if wide.is_wide() { "avx2" } else { "portable again" }), (&narrow, "portable")]
    {
        group.throughput(Throughput::Elements(primary.len() as u64));
        group.bench_function(format!("primary, {name}"), |b| {
            b.iter(|| primary.iter().filter(|&&d| black_box(accel.closest(eye, d)).is_some()).count());
        });
        group.throughput(Throughput::Elements(shadow.len() as u64));
        group.bench_function(format!("shadow, {name}"), |b| {
            b.iter(|| {
                let mut last = LastBlockers::default();
                let blocked = |(p, l, skip): &(Vec3, strandbench_renderer::LightSample, Skip)| {
                    accel.occluded(*p, l.direction, l.distance, Some(*skip), &mut last)
                };
                black_box(shadow.iter().map(blocked).filter(|&b| b).count())
            });
        });
        group.throughput(Throughput::Elements(bounce.len() as u64));
        group.bench_function(format!("bounce, {name}"), |b| {
            let met = |&&(p, d, skip): &&(Vec3, Vec3, Skip)| accel.closest_after(p, d, Some(skip)).is_some();
            b.iter(|| black_box(bounce.iter().filter(met).count()));
        });
    }
    group.finish();
}

fn view(c: &mut Criterion) {
    let mut scene = demo::tuft();
    let camera = &mut scene.rig.cameras[0];
    (camera.width, camera.height) = (160, 120);
    camera.focal_px *= 0.25;
    camera.principal_px *= 0.25;
    let prepared = RenderScene::new(&scene).unwrap();
    let settings = Settings {
        samples_per_pixel: 32,
        max_samples_per_pixel: 32,
        noise_target: 0.0,
        ..Settings::default()
    };
    let mut group = c.benchmark_group("view");
    group.sample_size(10);
    group.bench_function("160x120, 32 samples, all threads", |b| {
        b.iter(|| prepared.render(0, &settings, 1, &Silent).unwrap());
    });
    group.finish();
}

/// Places of skin looked up a second, on one thread.
fn skin(c: &mut Criterion) {
    let detail = SkinDetail::skin(SkinTexture::default(), Vec::new(), Vec::new());
    let places: Vec<Vec3> = (0..10_000)
        .map(|i| Vec3::new(0.011 * (i % 100) as f32 - 7.3, 20.0 + 0.013 * (i / 100) as f32, 111.0))
        .collect();
    let mut group = c.benchmark_group("skin");
    group.throughput(Throughput::Elements(places.len() as u64));
    for stubble in [0.0, 0.7] {
        group.bench_function(format!("look, stubble {stubble}"), |b| {
            b.iter(|| places.iter().map(|&p| detail.look(p, stubble).albedo_rgb[1]).sum::<f32>());
        });
    }
    group.finish();
}

criterion_group!(benches, rays, view, skin);
criterion_main!(benches);

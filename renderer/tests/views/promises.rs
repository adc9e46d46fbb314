//! What the renderer promises of every view: the same bits, honest noise, no NaN, faults named, progress.

use crate::common::{camera, fixed, light, plate, render, scene, tuft};
use glam::{DVec3, Vec3};
use std::sync::atomic::{AtomicU64, Ordering};
use strandbench_renderer::{Render, RenderError, RenderScene, Settings, fibre_tangent};
use strandbench_scenes::{AreaLight, Lens, Scene, Surface};
use strandbench_types::{Monitor, Silent, StrandSet};

#[test]
fn same_bits_for_any_number_of_threads_and_other_bits_for_another_seed() {
    let lights = vec![light(Vec3::new(300.0, 300.0, 700.0), 80.0, 60.0), light(Vec3::X * 800.0, 80.0, 60.0)];
    let s = scene(tuft(400), vec![Surface::plain(plate(20.0, -9.0), [0.5; 3])], lights, (50, 40));
    let settings = Settings {
        samples_per_pixel: 4,
        max_samples_per_pixel: 24,
        noise_target: 0.01,
        indirect_every: 2,
        ..Settings::default()
    };
    let with = |threads: usize, seed: u64| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| render(&s, &settings, seed))
    };
    let (one, two, other) = (with(1, 5), with(2, 5), with(2, 6));
    let bits = |r: &Render| r.radiance_rgb.data.iter().flatten().map(|v| v.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(&one), bits(&two));
    assert_eq!(one.variance, two.variance);
    assert_eq!(one.hits, two.hits);
    let rays = |r: &Render| [r.stats.primary_rays, r.stats.shadow_rays, r.stats.bounce_rays];
    assert_eq!(rays(&one), rays(&two));
    assert!(one.stats.bounce_rays > 1000, "paths are followed");
    assert_ne!(bits(&one), bits(&other));
    assert!(one.stats.converged > 0.0 && one.stats.converged < 1.0, "{}", one.stats.converged);
}

#[test]
fn stated_variance_covers_the_spread_over_seeds() {
    let lights = vec![light(Vec3::new(300.0, 300.0, 700.0), 80.0, 60.0), light(Vec3::X * 800.0, 80.0, 60.0)];
    let s = scene(tuft(300), Vec::new(), lights, (24, 24));
    let w = s.sensor.response_rgb;
    let mono = |c: &[f32; 3]| (0..3).map(|k| f64::from(c[k] * w[k])).sum::<f64>();
    let runs: Vec<Render> = (0..12).map(|seed| render(&s, &fixed(32), seed)).collect();
    let n = runs.len() as f64;
    let (mut spread, mut stated) = (0.0, 0.0);
    for i in 0..24 * 24 {
        let v: Vec<f64> = runs.iter().map(|r| mono(&r.radiance_rgb.data[i])).collect();
        let mean = v.iter().sum::<f64>() / n;
        spread += v.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0);
        stated += runs.iter().map(|r| f64::from(r.variance.data[i])).sum::<f64>() / n;
    }
    // Stratified points are quieter than the estimate, which takes them for independent.
    assert!(spread < stated && spread > 0.2 * stated, "spread {spread}, stated {stated}");
}

#[test]
fn lens_and_motion_blur_the_picture_and_not_the_truth() {
    let sharp = scene(tuft(40), vec![], vec![light(Vec3::new(20.0, -40.0, 60.0), 20.0, 5.0)], (48, 40));
    let seen = render(&sharp, &fixed(16), 3);
    assert!(seen.hits.hits.len() > 500, "{} hits", seen.hits.hits.len());
    let mut blurred = [sharp.clone(), sharp.clone(), sharp];
    blurred[0].lens = Some(Lens { aperture_radius_mm: 2.0, focus_mm: 500.0 });
    blurred[1].motion.velocity_mm_s = [4000.0, 0.0, 0.0];
    blurred[2].motion.turn_deg_s = [0.0, 200.0, 0.0];
    for (case, scene) in blurred.iter().enumerate() {
        let r = render(scene, &fixed(16), 3);
        assert_eq!(r.hits, seen.hits, "case {case}");
        let change: f32 = r
            .radiance_rgb
            .data
            .iter()
            .zip(&seen.radiance_rgb.data)
            .map(|(a, b)| (a[1] - b[1]).abs())
            .sum::<f32>()
            / seen.radiance_rgb.data.iter().map(|p| p[1]).sum::<f32>();
        assert!(change > 0.2, "case {case}: the picture changes by {change}");
    }
}

#[test]
fn more_rays_go_where_the_noise_is_until_it_is_gone() {
    let s = scene(tuft(300), Vec::new(), vec![light(Vec3::new(300.0, 300.0, 700.0), 80.0, 600.0)], (32, 32));
    let target = 0.02;
    let coarse = render(&s, &Settings { noise_target: target, ..fixed(8) }, 1);
    let fine = render(&s, &Settings { max_samples_per_pixel: 4096, noise_target: target, ..fixed(8) }, 1);
    assert!(coarse.stats.converged < 1.0 && fine.stats.converged == 1.0);
    let limit = (target * s.sensor.full_scale_radiance).powi(2) * 1.000_01;
    assert!(fine.variance.data.iter().all(|&v| v <= limit));
    assert_eq!(coarse.hits, fine.hits, "the identity buffer holds the first rays alone");
    assert!(fine.stats.primary_rays > coarse.stats.primary_rays);
}

#[test]
fn nothing_becomes_nan_with_lights_and_cameras_in_awkward_places() {
    let mut set = tuft(100);
    set.push(&[Vec3::ZERO, Vec3::ZERO, Vec3::ZERO], 0.04);
    set.push(&[Vec3::ZERO, Vec3::Y * 1e-7, Vec3::Y], 0.04);
    let inside = AreaLight {
        centre_mm: Vec3::ZERO,
        half_u_mm: Vec3::X * 2.0,
        half_v_mm: Vec3::Y * 2.0,
        radiance_rgb: [1.0; 3],
    };
    let flat = AreaLight { half_v_mm: Vec3::ZERO, ..inside };
    let mut s = scene(set, Vec::new(), vec![inside, flat], (20, 20));
    let mut within = camera(20, 20);
    within.name = "within".into();
    within.translation_mm = DVec3::new(0.0, 0.0, 0.01);
    s.rig.cameras.push(within);
    let prepared = RenderScene::new(&s).unwrap();
    for c in 0..2 {
        let r = prepared.render(c, &fixed(16), 1, &Silent).unwrap();
        assert!(r.radiance_rgb.data.iter().flatten().all(|v| v.is_finite()));
        assert!(r.hits.hits.iter().all(|h| h.depth_mm.is_finite() && h.depth_mm > 0.0));
    }
    for strand in 0..s.strands.len() as u32 {
        for i in s.strands.range(strand as usize).skip(1) {
            let t = fibre_tangent(&s.strands, strand, i as u32 - 1, 0.5);
            assert!((t.length() - 1.0).abs() < 1e-5, "strand {strand}: {t}");
        }
    }
}

#[test]
fn bad_scenes_settings_and_cameras_are_named() {
    let good = || scene(tuft(3), Vec::new(), Vec::new(), (8, 8));
    let expect = |s: Scene, part: &str| match RenderScene::new(&s).err() {
        Some(RenderError::Scene(m)) => assert!(m.contains(part), "{m} does not mention {part}"),
        other => panic!("{part}: {other:?}"),
    };
    let mut s = good();
    s.strands.points[5].x = f32::NAN;
    expect(s, "strand 0, point 5");
    let mut s = good();
    s.pigments.pop();
    expect(s, "3 strands have 2 pigments");
    let mut s = good();
    s.pigments[1].eumelanin = -1.0;
    expect(s, "strand 1");
    let mut s = good();
    s.sensor.full_scale_radiance = 0.0;
    expect(s, "full_scale_radiance");
    let mut s = good();
    s.lights.push(AreaLight { radiance_rgb: [f32::NAN; 3], ..light(Vec3::Z, 1.0, 1.0) });
    expect(s, "light 0");
    let mut s = good();
    s.surfaces.push(Surface::plain(plate(1.0, 0.0), [2.0, 0.0, 0.0]));
    expect(s, "surface 0");
    let mut s = good();
    s.strands = StrandSet::new();
    s.pigments.clear();
    expect(s, "nothing to render");
    let s = good();
    let prepared = RenderScene::new(&s).unwrap();
    assert!(prepared.render(1, &fixed(4), 0, &Silent).is_err());
    for bad in [
        Settings { samples_per_pixel: 0, ..Settings::default() },
        Settings { samples_per_pixel: 64, max_samples_per_pixel: 32, ..Settings::default() },
        Settings { max_samples_per_pixel: 70_000, ..Settings::default() },
        Settings { noise_target: f32::NAN, ..Settings::default() },
        Settings { depth: 0, ..Settings::default() },
        Settings { depth: 5000, ..Settings::default() },
        Settings { indirect_every: 0, ..Settings::default() },
        Settings { clamp: -1.0, ..Settings::default() },
    ] {
        assert!(prepared.render(0, &bad, 0, &Silent).is_err(), "{bad:?}");
    }
}

#[test]
fn progress_reaches_its_total_and_cancelling_stops() {
    #[derive(Default)]
    struct Count {
        total: AtomicU64,
        done: AtomicU64,
        stop_after: u64,
    }
    impl Monitor for Count {
        fn begin(&self, _what: &str, total: u64) {
            self.total.store(total, Ordering::Relaxed);
        }
        fn advance(&self, steps: u64) {
            self.done.fetch_add(steps, Ordering::Relaxed);
        }
        fn cancelled(&self) -> bool {
            self.done.load(Ordering::Relaxed) >= self.stop_after
        }
    }
    let s = scene(tuft(20), Vec::new(), Vec::new(), (100, 70));
    let prepared = RenderScene::new(&s).unwrap();
    let all = Count { stop_after: u64::MAX, ..Count::default() };
    prepared.render(0, &fixed(1), 0, &all).unwrap();
    assert_eq!((all.total.into_inner(), all.done.into_inner()), (35, 35));
    let some = Count { stop_after: 3, ..Count::default() };
    assert!(matches!(prepared.render(0, &fixed(1), 0, &some), Err(RenderError::Cancelled(_))));
}

#[test]
fn an_eye_inside_a_fibre_is_counted_and_sees_past_it() {
    let mut s = scene(tuft(50), vec![Surface::plain(plate(30.0, -9.0), [0.5; 3])], Vec::new(), (8, 8));
    s.lights.push(light(Vec3::new(300.0, 300.0, 700.0), 80.0, 60.0));
    let eye = s.rig.cameras[0].centre_mm().as_vec3();
    let without = render(&s, &fixed(4), 1);
    assert_eq!(without.stats.fibres_at_eye, 0);
    // Two segments meet at the eye, and a third of another strand holds it.
    s.strands.push(&[eye - Vec3::Y * 3.0, eye, eye + Vec3::Y * 3.0], 0.04);
    s.strands.push(&[eye - Vec3::X * 3.0, eye + Vec3::X * 3.0], 0.04);
    s.pigments.extend([s.pigments[0]; 2]);
    let within = render(&s, &fixed(4), 1);
    assert_eq!(within.stats.fibres_at_eye, 3);
    let light_of = |r: &Render| r.radiance_rgb.data.iter().map(|c| c[0]).sum::<f32>();
    // The fibres' caps at the eye's sides hide nothing of a view along z.
    assert!((light_of(&within) / light_of(&without) - 1.0).abs() < 0.1);
}

#[test]
fn coincident_and_degenerate_fibres_carry_paths_without_nan() {
    let mut set = tuft(60);
    let copies: Vec<Vec<Vec3>> = (0..60).map(|i| set.points[set.range(i)].to_vec()).collect();
    for points in &copies {
        set.push(points, 0.04);
        set.push(&points.iter().map(|p| *p * 1e-4).collect::<Vec<_>>(), 0.04);
        set.push(&[points[0]; 4], 1e-6);
    }
    let inside = AreaLight {
        centre_mm: Vec3::new(0.5, 0.0, 0.0),
        half_u_mm: Vec3::X * 2.0,
        half_v_mm: Vec3::Y * 2.0,
        radiance_rgb: [1e3, 1.0, 1e-3],
    };
    let skin = Surface::plain(plate(20.0, 0.0), [1.0; 3]);
    let mut s =
        scene(set, vec![skin.clone(), skin], vec![inside, light(Vec3::Z * 400.0, 300.0, 1.0)], (12, 12));
    s.environment = Some(strandbench_scenes::Environment::constant([0.1; 3]));
    for eumelanin in [0.0, 50.0] {
        s.pigments.iter_mut().for_each(|p| p.eumelanin = eumelanin);
        let r = render(&s, &Settings { depth: 20, indirect_every: 1, ..fixed(16) }, 1);
        assert!(r.radiance_rgb.data.iter().flatten().all(|v| v.is_finite() && *v >= 0.0));
        assert_eq!(r.stats.not_finite, 0);
        assert!(r.stats.bounce_rays > 1000);
    }
}

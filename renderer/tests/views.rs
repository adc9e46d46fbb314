//! Whole views of small scenes against closed forms, and the renderer's promises.

use glam::{DVec3, Vec3};
use std::sync::atomic::{AtomicU64, Ordering};
use strandbench_renderer::marschner::{Angles, Fibre, Roots};
use strandbench_renderer::{Render, RenderError, RenderScene, Settings, fibre_tangent};
use strandbench_scenes::{AreaLight, FibreOptics, Pigment, RigMotion, Scene, Sensor, SkinOptics, Surface};
use strandbench_types::{Camera, Monitor, Rig, Silent, StrandSet, TriMesh};

const EYE: DVec3 = DVec3::new(0.0, 0.0, 900.0);

/// A camera on +z that looks at the origin; 0.5 mm a pixel at the origin.
fn camera(width: u32, height: u32) -> Camera {
    Camera::look_at("c0", (width, height), 1800.0, EYE, DVec3::ZERO, DVec3::NEG_Y)
}

/// A square light of half side `half` at `centre` that faces the origin.
fn light(centre: Vec3, half: f32, radiance: f32) -> AreaLight {
    let n = -centre.normalize();
    let u = n.any_orthonormal_vector();
    AreaLight {
        centre_mm: centre,
        half_u_mm: u * half,
        half_v_mm: n.cross(u) * half,
        radiance_rgb: [radiance, 0.5 * radiance, 0.25 * radiance],
    }
}

fn scene(strands: StrandSet, surfaces: Vec<Surface>, lights: Vec<AreaLight>, size: (u32, u32)) -> Scene {
    let rig = Rig {
        cameras: vec![camera(size.0, size.1)],
        near_mm: 800.0,
        far_mm: 1000.0,
        frame_rate_hz: 100.0,
        exposure_s: 1e-3,
    };
    Scene {
        name: "test".into(),
        pigments: vec![Pigment { eumelanin: 0.5, pheomelanin: 0.0 }; strands.len()],
        strands,
        optics: FibreOptics::default(),
        surfaces,
        lights,
        calibrated_rig: rig.clone(),
        rig,
        skin: SkinOptics::default(),
        environment: None,
        lens: None,
        motion: RigMotion::default(),
        sensor: Sensor::default(),
        background_rgb: [0.0; 3],
        head_breadth_mm: 155.0,
    }
}

fn fixed(samples: u32) -> Settings {
    Settings { samples_per_pixel: samples, max_samples_per_pixel: samples, noise_target: 0.0 }
}

fn render(scene: &Scene, settings: &Settings, seed: u64) -> Render {
    RenderScene::new(scene).unwrap().render(0, settings, seed, &Silent).unwrap()
}

/// Vertical fibre through `x`, root at the bottom.
fn fibre(x: f32, radius: f32) -> StrandSet {
    let mut s = StrandSet::new();
    s.push(&(-20..=20).map(|i| Vec3::new(x, i as f32 * 2.0, 0.0)).collect::<Vec<_>>(), radius);
    s
}

fn plate(half: f32, z: f32) -> TriMesh {
    TriMesh {
        vertices: [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
            .map(|(x, y)| Vec3::new(x * half, y * half, z))
            .to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    }
}

#[test]
fn coverage_and_depth_of_one_fibre_are_those_of_a_cylinder() {
    let radius = 0.04f64;
    let s = scene(fibre(1.3, radius as f32), Vec::new(), Vec::new(), (40, 30));
    let r = render(&s, &fixed(256), 3);
    let per_row = |row: usize| (0..40).map(|x| r.hits.pixel(row * 40 + x).len() as f64 / 256.0).sum::<f64>();
    // A cylinder at distance d is seen under the half angle asin(r / d): about 2 r f / d pixels.
    let want = 2.0 * radius * 1800.0 / 900.0;
    let mean = (0..30).map(per_row).sum::<f64>() / 30.0;
    // Stratified counting of an edge in 30 rows of 256 points: well below 1 %.
    assert!((mean - want).abs() < 0.01 * want, "{mean} pixels wide, {want} expected");
    assert_eq!(r.hits.rays, vec![256; 1200]);
    let mut n = 0;
    for y in 0..30usize {
        for x in 0..40usize {
            for h in r.hits.pixel(y * 40 + x) {
                n += 1;
                // The front lies within a radius before the axis.
                let depth = f64::from(h.depth_mm);
                assert!((900.0 - radius - 1e-3..=900.0 + 1e-3).contains(&depth), "depth {depth}");
                // The hit's height by projection against the height of its place on the segment.
                let along = -40.0 + 2.0 * (f64::from(h.segment) + f64::from(h.along));
                let v = (15.0 - along * 1800.0 / depth) - y as f64;
                assert!((-0.01..=1.01).contains(&v), "row {y}: height {along} mm is {v} rows into it");
            }
        }
    }
    assert!(n > 800, "{n} hits");
}

#[test]
fn fibre_on_the_edge_of_two_columns_is_shared_as_its_projection_and_its_depth_is_along_the_axis() {
    // From column 36.94 to 37.02; its distance from the eye is 0.04 mm more than its depth.
    let s = scene(fibre(8.49, 0.02), Vec::new(), Vec::new(), (40, 30));
    let r = render(&s, &fixed(256), 3);
    let column = |x: usize| (0..30).map(|y| r.hits.pixel(y * 40 + x).len() as f64).sum::<f64>();
    let (left, right) = (column(36), column(37));
    assert_eq!((left + right) as usize, r.hits.hits.len());
    assert!((left / (left + right) - 0.75).abs() < 0.02, "{left} rays left, {right} right of the edge");
    assert!(r.hits.hits.iter().all(|h| (899.98 - 1e-3..=900.0 + 1e-3).contains(&f64::from(h.depth_mm))));
}

#[test]
fn radiance_of_one_fibre_is_the_integral_over_the_light() {
    let l = light(Vec3::new(500.0, 300.0, 700.0), 60.0, 3000.0);
    // A fibre wider than a pixel, so that its middle is fully covered; the model has one radiance across it.
    let s = scene(fibre(0.0, 1.5), Vec::new(), vec![l], (6, 6));
    let r = render(&s, &fixed(1024), 1);
    let model = Fibre::new(&s.optics, Roots::Exact).unwrap();
    let sigma = s.pigments[0].absorption_rgb();
    // Quadrature over light and pixel, apart from the renderer: tangent +y, root below.
    let (n, at) = (48, 3 * 6 + 3);
    let mut want = [0.0f64; 3];
    let normal = l.half_u_mm.cross(l.half_v_mm).normalize();
    let area = 4.0 * l.half_u_mm.cross(l.half_v_mm).length();
    for i in 0..n {
        for j in 0..n {
            let f = |k: i32| 2.0 * (k as f32 + 0.5) / n as f32 - 1.0;
            let on = l.centre_mm + l.half_u_mm * f(i) + l.half_v_mm * f(j);
            // The pixel's centre on the fibre's front.
            let p = Vec3::new(0.25, -0.25, (1.5f32 * 1.5 - 0.0625).sqrt());
            let to = on - p;
            let wi = to.normalize();
            let wr = (EYE.as_vec3() - p).normalize();
            let (wi_flat, wr_flat) = (Vec3::new(wi.x, 0.0, wi.z), Vec3::new(wr.x, 0.0, wr.z));
            let cos_phi = wi_flat.normalize().dot(wr_flat.normalize());
            let scatter =
                model.scatter(&Angles { sin_i: wi.y, sin_r: wr.y, cos_phi, cos_2phi_h: 0.0 }, sigma);
            let g = wi_flat.length() * -normal.dot(wi) * area / to.length_squared() / (n * n) as f32;
            for c in 0..3 {
                want[c] += f64::from(scatter[c] * g * l.radiance_rgb[c]);
            }
        }
    }
    for c in 0..3 {
        let got = f64::from(r.radiance_rgb.data[at][c]);
        // 1024 points of a function that varies by a tenth over the light.
        assert!((got - want[c]).abs() < 3e-3 * want[c], "channel {c}: {got}, {}", want[c]);
    }
    assert!(want[0] > 0.01);
}

#[test]
fn plate_under_a_rectangle_has_the_closed_form_irradiance() {
    // Irradiance at a point on the axis of a parallel rectangle: the sum over its four edges (Lambert).
    let (half, height, radiance) = (100.0f32, 400.0f32, 7.0f32);
    let l = AreaLight {
        centre_mm: Vec3::new(0.0, 0.0, height),
        half_u_mm: Vec3::NEG_X * half,
        half_v_mm: Vec3::Y * half,
        radiance_rgb: [radiance; 3],
    };
    let s = scene(
        StrandSet::new(),
        vec![Surface { mesh: plate(50.0, 0.0), albedo_rgb: [0.6; 3] }],
        vec![l],
        (4, 4),
    );
    let got = render(&s, &fixed(4096), 9).radiance_rgb.data[2 * 4 + 2][0];
    let (a, h) = (f64::from(half), f64::from(height));
    let edge = a / (a * a + h * h).sqrt();
    let irradiance = f64::from(radiance) * 4.0 * edge * (edge).atan();
    // Skin is Lambert's law below a coat; over this light's directions the coat is all but constant.
    let f = strandbench_renderer::scatter_skin(Vec3::Z, Vec3::Z, Vec3::Z, [0.6; 3])[0];
    let n = 200;
    let mut mean_f = 0.0;
    let mut weight = 0.0;
    for i in 0..n {
        for j in 0..n {
            let q = |k: i32| (2.0 * (k as f32 + 0.5) / n as f32 - 1.0) * half;
            let to = Vec3::new(q(i), q(j), height);
            let wi = to.normalize();
            let w = f64::from(wi.z * wi.z / to.length_squared());
            mean_f += w * f64::from(strandbench_renderer::scatter_skin(Vec3::Z, wi, Vec3::Z, [0.6; 3])[0]);
            weight += w;
        }
    }
    mean_f /= weight;
    assert!((mean_f - f64::from(f)).abs() < 0.1 * mean_f);
    let want = irradiance * mean_f;
    assert!((f64::from(got) - want).abs() < 3e-3 * want, "{got}, {want}");
}

#[test]
fn lights_are_one_sided_and_fibres_and_meshes_cast_shadows() {
    let lamp = light(Vec3::new(0.0, 0.0, 500.0), 20.0, 50.0);
    let skin = |z| Surface { mesh: plate(40.0, z), albedo_rgb: [0.6; 3] };
    let lit = render(&scene(StrandSet::new(), vec![skin(0.0)], vec![lamp], (8, 8)), &fixed(16), 1);
    let value = |r: &Render| r.radiance_rgb.data[4 * 8 + 4][0];
    assert!(value(&lit) > 0.05);
    let turned = AreaLight { half_u_mm: -lamp.half_u_mm, ..lamp };
    let dark = render(&scene(StrandSet::new(), vec![skin(0.0)], vec![turned], (8, 8)), &fixed(16), 1);
    assert_eq!(value(&dark), 0.0);
    // A light to the side, and a fibre thick enough to hide it, outside the camera's view.
    let side = light(Vec3::new(400.0, 0.0, 400.0), 5.0, 500.0);
    let mut wall = StrandSet::new();
    wall.push(&[Vec3::new(60.0, -200.0, 60.0), Vec3::new(60.0, 200.0, 60.0)], 12.0);
    let open = render(&scene(StrandSet::new(), vec![skin(0.0)], vec![side], (8, 8)), &fixed(16), 1);
    let shut = render(&scene(wall, vec![skin(0.0)], vec![side], (8, 8)), &fixed(16), 1);
    assert!(value(&open) > 0.01 && value(&shut) == 0.0, "{} {}", value(&open), value(&shut));
}

#[test]
fn highlight_of_a_hanging_fibre_lies_on_the_side_that_the_cuticle_turns_to() {
    // Light and camera side by side at height 0: the mirror reflection of R reaches the camera from the point
    // whose inclination is α_R = -7.5°, and the camera is inclined towards the root where the point is above it.
    let mut s = StrandSet::new();
    s.push(&(-80..=80).map(|i| Vec3::new(0.0, i as f32 * 3.0, 0.0)).collect::<Vec<_>>(), 2.0);
    let mut s = scene(s, Vec::new(), vec![light(Vec3::new(0.5, 0.0, 900.0), 0.5, 1e7)], (3, 400));
    s.rig.cameras[0].focal_px *= 0.5;
    s.pigments[0].eumelanin = 50.0;
    s.optics.width_r_deg = 3.0;
    let profile = |s: &Scene| {
        let r = render(s, &fixed(64), 2);
        let best = (0..400)
            .max_by(|&a, &b| r.radiance_rgb.data[a * 3 + 1][0].total_cmp(&r.radiance_rgb.data[b * 3 + 1][0]))
            .unwrap();
        (200.0 - (best as f64 + 0.5)) / 900.0 * 900.0
    };
    let want = 900.0 * 7.5f64.to_radians().tan();
    let got = profile(&s);
    assert!((got - want).abs() < 12.0, "root below: highlight at {got} mm, expected {want} mm");
    s.strands.points.reverse();
    let got = profile(&s);
    assert!((got + want).abs() < 12.0, "root above: highlight at {got} mm, expected {} mm", -want);
}

fn tuft(n: usize) -> StrandSet {
    let mut set = StrandSet::new();
    for i in 0..n {
        let mut rng = strandbench_rng::Rng::keyed(&[4, i as u64]);
        let (x, z) = (rng.range(-8.0, 8.0), rng.range(-8.0, 8.0));
        let lean = rng.range(-0.2, 0.2);
        let points: Vec<Vec3> =
            (0..12).map(|k| Vec3::new(x + lean * k as f32 * 2.0, 10.0 - 2.0 * k as f32, z)).collect();
        set.push(&points, rng.range(0.03, 0.05));
    }
    set
}

#[test]
fn same_bits_for_any_number_of_threads_and_other_bits_for_another_seed() {
    let lights = vec![light(Vec3::new(300.0, 300.0, 700.0), 80.0, 60.0), light(Vec3::X * 800.0, 80.0, 60.0)];
    let s =
        scene(tuft(400), vec![Surface { mesh: plate(20.0, -9.0), albedo_rgb: [0.5; 3] }], lights, (50, 40));
    let settings = Settings { samples_per_pixel: 4, max_samples_per_pixel: 24, noise_target: 0.01 };
    let with = |threads: usize, seed: u64| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| render(&s, &settings, seed))
    };
    let (one, two, other) = (with(1, 5), with(2, 5), with(2, 6));
    let bits = |r: &Render| r.radiance_rgb.data.iter().flatten().map(|v| v.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(&one), bits(&two));
    assert_eq!(one.variance, two.variance);
    assert_eq!(one.hits, two.hits);
    assert_eq!(
        (one.stats.primary_rays, one.stats.shadow_rays),
        (two.stats.primary_rays, two.stats.shadow_rays)
    );
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
fn more_rays_go_where_the_noise_is_until_it_is_gone() {
    let s = scene(tuft(300), Vec::new(), vec![light(Vec3::new(300.0, 300.0, 700.0), 80.0, 600.0)], (32, 32));
    let target = 0.02;
    let coarse =
        render(&s, &Settings { samples_per_pixel: 8, max_samples_per_pixel: 8, noise_target: target }, 1);
    let fine =
        render(&s, &Settings { samples_per_pixel: 8, max_samples_per_pixel: 4096, noise_target: target }, 1);
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
    s.surfaces.push(Surface { mesh: plate(1.0, 0.0), albedo_rgb: [2.0, 0.0, 0.0] });
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
        Settings { samples_per_pixel: 64, max_samples_per_pixel: 32, noise_target: 0.0 },
        Settings { max_samples_per_pixel: 70_000, ..Settings::default() },
        Settings { noise_target: f32::NAN, ..Settings::default() },
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

//! Light below the skin against path tracing, and cross-polarised cameras.

use crate::common::*;
use glam::Vec3;
use std::sync::Arc;
use strandbench_renderer::{Render, RenderScene, Settings, Strategy};
use strandbench_scenes::{
    AreaLight, Environment, FibreOptics, OpticsModel, Scene, SkinDetail, SkinOptics, SkinTexture, Surface,
};
use strandbench_types::{Silent, StrandSet, TriMesh};

/// A square plate of (n + 1)² vertices.
pub fn grid(half: f32, n: usize) -> TriMesh {
    let at = |k: usize| (2.0 * k as f32 / n as f32 - 1.0) * half;
    let m = n as u32 + 1;
    TriMesh {
        vertices: (0..(n + 1) * (n + 1)).map(|k| Vec3::new(at(k % (n + 1)), at(k / (n + 1)), 0.0)).collect(),
        triangles: (0..n * n)
            .map(|k| (k / n * (n + 1) + k % n) as u32)
            .flat_map(|k| [[k, k + 1, k + m + 1], [k, k + m + 1, k + m]])
            .collect(),
    }
}

/// One tone without a pattern.
fn even() -> SkinTexture {
    SkinTexture {
        tone_rgb: [0.6, 0.5, 0.4],
        mottling: 0.0,
        redness: 0.0,
        lips: 0.0,
        grain: 0.0,
        pores: 0.0,
        freckles_per_cm2: 0.0,
        moles_per_dm2: 0.0,
        relief_mm: 0.0,
        ..SkinTexture::default()
    }
}

pub fn skin(mesh: TriMesh, texture: SkinTexture) -> Surface {
    // Behind the face's front, where no region differs.
    let rest: Vec<Vec3> = mesh.vertices.iter().map(|&p| p - Vec3::Z * 80.0).collect();
    let stubble = vec![0.0; rest.len()];
    Surface { mesh, albedo_rgb: [0.1; 3], detail: Some(Arc::new(SkinDetail::skin(texture, rest, stubble))) }
}

pub fn bare(scatter_mm: f32) -> SkinOptics {
    SkinOptics { coat_reflectance: 0.0, scatter_mm, ..SkinOptics::default() }
}

pub fn lamps() -> Vec<AreaLight> {
    vec![
        light(Vec3::new(300.0, 300.0, 700.0), 60.0, 60.0),
        light(Vec3::new(-500.0, 100.0, 500.0), 60.0, 60.0),
    ]
}

fn means(r: &Render) -> [f64; 3] {
    let n = r.radiance_rgb.data.len() as f64;
    std::array::from_fn(|c| r.radiance_rgb.data.iter().map(|p| f64::from(p[c])).sum::<f64>() / n)
}

/// Mean and squared standard error by channel over seeds.
pub fn over_seeds(s: &Scene, settings: &Settings, seeds: u64) -> [(f64, f64); 3] {
    let all: Vec<[f64; 3]> = (0..seeds).map(|k| means(&render(s, settings, k))).collect();
    let n = seeds as f64;
    std::array::from_fn(|c| {
        let mean = all.iter().map(|m| m[c]).sum::<f64>() / n;
        let square = all.iter().map(|m| (m[c] - mean).powi(2)).sum::<f64>();
        (mean, square / (n * (n - 1.0)))
    })
}

#[test]
fn light_that_does_not_spread_is_that_of_path_tracing() {
    let mut s = scene(tuft(150), vec![skin(grid(20.0, 24), even())], lamps(), (30, 24));
    // Hairs hang before the plate, cast shadows on it and light it.
    s.strands.points.iter_mut().for_each(|p| p.z = p.z * 0.4 + 4.0);
    s.pigments.iter_mut().for_each(|p| p.eumelanin = 0.05);
    let settings = Settings { depth: 6, indirect_every: 1, skin_paths: 256, ..fixed(16) };
    s.skin = bare(0.0);
    let paths = over_seeds(&s, &settings, 12);
    let direct = over_seeds(&s, &Settings { depth: 1, ..settings.clone() }, 2);
    s.skin = bare(1e-3);
    let cached = over_seeds(&s, &settings, 12);
    for c in 0..3 {
        let error = (paths[c].1 + cached[c].1).sqrt();
        // Smoothing moves some indirect light across the frame's border, 2 mm of 15: it is even to a tenth there, so by
        // 1 % of the indirect light.
        let indirect = paths[c].0 - direct[c].0;
        assert!(indirect > 0.05 * paths[c].0, "there is light by way of hair");
        let slack = 5.0 * error + 0.01 * indirect;
        assert!((paths[c].0 - cached[c].0).abs() < slack, "channel {c}: {:?} {:?}", paths[c], cached[c]);
        assert!(
            slack < 0.6 * indirect && slack < 0.035 * paths[c].0,
            "the test can tell: {slack}, {paths:?} {cached:?}"
        );
    }
}

#[test]
fn light_spreads_from_a_shadows_edge_by_the_profile_of_skin() {
    // A black screen right above the plate keeps the light of a small lamp from its left half.
    let lamp = light(Vec3::new(0.0, 0.0, 900.0), 4.0, 4e4);
    let screen = TriMesh {
        vertices: [(-40.0, -40.0), (0.0, -40.0), (0.0, 40.0), (-40.0, 40.0)]
            .map(|(x, y)| Vec3::new(x, y, 0.05))
            .to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    };
    let mut s = scene(StrandSet::new(), vec![skin(grid(14.0, 112), even())], vec![lamp], (8, 8));
    s.surfaces.push(Surface::plain(screen, [0.0; 3]));
    s.skin = bare(2.722);
    let far = sample(&s, Vec3::new(9.0, 0.0, 0.0));
    let near = sample(&s, Vec3::new(1.5, 0.0, 0.0));
    // Red: 1 - Σ w Φ(-1.5 / σ) over the Gaussians of 0.753, 1.411 and 2.722 mm.
    for (c, want) in
        [(0, 1.0 - (0.113 * 0.0232 + 0.358 * 0.1439 + 0.078 * 0.2908)), (1, 1.0 - 0.004 * 0.1439), (2, 1.0)]
    {
        let got = near[c] / far[c];
        // The lamp is 8e-5 off perpendicular between the two; implicit steps and patches of 0.25 mm change the red loss of
        // 0.077 by less than a tenth.
        assert!((got - want).abs() < 0.008, "channel {c}: {got}, {want}");
    }
}

/// A camera right above, whose pixels are small.
fn camera_above(x: f64) -> strandbench_types::Camera {
    let at = glam::DVec3::new(x, 0.0, 0.0);
    strandbench_types::Camera::look_at(
        "above",
        (8, 8),
        90_000.0,
        at + glam::DVec3::Z * 900.0,
        at,
        glam::DVec3::NEG_Y,
    )
}

/// Radiance in the middle of a view from right above a place.
fn sample(s: &Scene, at: Vec3) -> [f64; 3] {
    let mut s = s.clone();
    s.rig.cameras = vec![camera_above(f64::from(at.x))];
    means(&render(&s, &Settings { skin_paths: 16, ..fixed(16) }, 1))
}

#[test]
fn skin_has_the_same_bits_whatever_the_order_of_views_and_threads() {
    let mut s = scene(tuft(60), vec![skin(grid(20.0, 16), SkinTexture::default())], lamps(), (24, 20));
    s.skin = SkinOptics { scatter_mm: 2.7, ..SkinOptics::default() };
    s.rig.cameras.push(strandbench_types::Camera { name: "c1".into(), ..camera(20, 24) });
    let settings = Settings { depth: 4, skin_paths: 8, ..fixed(4) };
    let view = |prepared: &RenderScene<'_>, c: usize, seed| {
        prepared.render(c, &settings, seed, &Silent).unwrap().radiance_rgb
    };
    let first = RenderScene::new(&s).unwrap();
    let (a, b, other) = (view(&first, 0, 1), view(&first, 1, 1), view(&first, 0, 2));
    assert_ne!(a, other);
    let pool = |n| rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
    for threads in [1, 3] {
        let second = RenderScene::new(&s).unwrap();
        pool(threads).install(|| {
            assert_eq!(view(&second, 0, 2), other);
            assert_eq!(view(&second, 1, 1), b);
            assert_eq!(view(&second, 0, 1), a);
        });
    }
    // Surfaces without a detail do not care.
    s.surfaces = vec![Surface::plain(plate(20.0, -9.0), [0.5; 3])];
    let spread = render(&s, &settings, 1).radiance_rgb;
    s.skin.scatter_mm = 0.0;
    assert_eq!(spread, render(&s, &settings, 1).radiance_rgb);
}

#[test]
fn a_polarised_camera_sees_skin_without_its_highlight() {
    // One light, so that no choice among lights differs between cameras. Its highlight is in the middle.
    // Bright enough that no point is left out for being dim.
    let lamp = light(Vec3::new(0.0, 60.0, 900.0), 30.0, 4e5);
    for scatter_mm in [0.0, 2.7] {
        let seen = |crossed: bool, tone: [f32; 3]| {
            let texture = SkinTexture { tone_rgb: tone, ..even() };
            let mut s = scene(StrandSet::new(), vec![skin(grid(20.0, 16), texture)], vec![lamp], (16, 16));
            s.skin = SkinOptics { scatter_mm, ..SkinOptics::default() };
            s.polarised = vec![crossed];
            render(&s, &Settings { skin_paths: 8, ..fixed(8) }, 1).radiance_rgb.data
        };
        let (plain, crossed) = (seen(false, [0.6, 0.5, 0.4]), seen(true, [0.6, 0.5, 0.4]));
        let coat = seen(false, [0.0; 3]);
        assert!(seen(true, [0.0; 3]).iter().all(|p| *p == [0.0; 3]), "black skin has nothing but its coat");
        let mut most = 0.0f32;
        for ((p, x), k) in plain.iter().zip(&crossed).zip(&coat) {
            for c in 0..3 {
                most = most.max(k[c] / x[c]);
                // Eight samples, each a sum in another order.
                assert!((p[c] - x[c] - k[c]).abs() < 1e-5 * p[c], "{p:?} {x:?} {k:?}");
            }
        }
        assert!(most > 0.05, "the coat is seen at all: {most}");
    }
}

#[test]
fn a_polarised_camera_sees_fibres_without_r_however_light_is_found() {
    for model in [OpticsModel::Marschner, OpticsModel::Chiang] {
        let mut s = scene(fibre(0.0, 3.0), Vec::new(), Vec::new(), (20, 20));
        s.optics = FibreOptics { model, ..FibreOptics::default() };
        s.environment = Some(Environment::constant([100.0; 3]));
        let mut mean = |eumelanin: f32, crossed: bool, strategy: Strategy, depth: u32| {
            s.pigments[0].eumelanin = eumelanin;
            s.polarised = vec![crossed];
            let settings = Settings { strategy, depth, indirect_every: 1, ..fixed(256) };
            over_seeds(&s, &settings, 6)[0]
        };
        // Black fibres have nothing but R.
        assert!(mean(1e4, false, Strategy::Both, 1).0 > 1.0);
        for strategy in [Strategy::Both, Strategy::Lights, Strategy::Scattering] {
            assert!(mean(1e4, true, strategy, 1).0 < 1e-12, "{model:?} {strategy:?}");
        }
        // What a filter takes from a brown fibre is R, whose share does not depend on pigment.
        let r = mean(1e4, false, Strategy::Lights, 1);
        let plain = mean(0.3, false, Strategy::Both, 1);
        for strategy in [Strategy::Both, Strategy::Lights, Strategy::Scattering] {
            let crossed = mean(0.3, true, strategy, 1);
            let error = (r.1 + plain.1 + crossed.1).sqrt();
            let off = plain.0 - r.0 - crossed.0;
            assert!(
                off.abs() < 5.0 * error && 5.0 * error < 0.5 * r.0,
                "{model:?} {strategy:?}: {off} {error}"
            );
        }
    }
}

#[test]
fn samples_are_spent_where_noise_exceeds_the_sensors() {
    let mut s = scene(tuft(60), vec![skin(grid(20.0, 8), SkinTexture::default())], lamps(), (24, 20));
    let settings = |sensor_noise| Settings {
        sensor_noise,
        samples_per_pixel: 8,
        max_samples_per_pixel: 256,
        depth: 2,
        clamp: 0.0,
        ..Settings::default()
    };
    let rays = |s: &Scene, share| render(s, &settings(share), 1).stats.primary_rays;
    assert!(rays(&s, 0.5) > 2 * rays(&s, 4.0));
    let r = render(&s, &settings(2.0), 1);
    let sensor = &s.sensor;
    let full = f64::from(sensor.full_scale_radiance);
    let met = (0..r.variance.data.len())
        .filter(|&i| {
            let signal =
                (0..3).map(|c| f64::from(r.radiance_rgb.data[i][c] * sensor.response_rgb[c])).sum::<f64>()
                    / full;
            let goal = 4.0 * strandbench_renderer::noise_variance(sensor, signal) * full * full;
            f64::from(r.variance.data[i]) <= goal * 1.001
        })
        .count();
    assert_eq!(met as f64 / r.variance.data.len() as f64, r.stats.converged);
    // A noisier sensor asks for less.
    let before = rays(&s, 2.0);
    s.sensor.full_well_e = 1000.0;
    assert!(rays(&s, 2.0) < before);
}

#[test]
fn details_filters_and_settings_that_do_not_fit_are_refused() {
    let s = scene(StrandSet::new(), vec![skin(grid(20.0, 8), even())], lamps(), (4, 4));
    let refused = |s: &Scene, word: &str| {
        let e = RenderScene::new(s).err().expect(word).to_string();
        assert!(e.contains(word), "{e}");
    };
    let mut bad = s.clone();
    bad.surfaces[0].mesh = grid(20.0, 9);
    refused(&bad, "rest");
    refused(&Scene { polarised: vec![true, false], ..s.clone() }, "polarised");
    refused(&Scene { skin: bare(f32::NAN), ..s.clone() }, "scatter_mm");
    refused(&Scene { skin: bare(1e3), ..s.clone() }, "scatter_mm");
    let prepared = RenderScene::new(&s).unwrap();
    for (settings, word) in [
        (Settings { sensor_noise: f32::NAN, ..fixed(4) }, "sensor_noise"),
        (Settings { skin_paths: 0, ..fixed(4) }, "skin_paths"),
    ] {
        let e = prepared.render(0, &settings, 1, &Silent).unwrap_err().to_string();
        assert!(e.contains(word), "{e}");
    }
}

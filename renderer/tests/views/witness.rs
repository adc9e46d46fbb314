//! Exact direct light over given rays, and rays asked one by one.

use crate::common::{fixed, light, plate, render, scene, tuft};
use glam::Vec3;
use strandbench_renderer::accel::Hit;
use strandbench_renderer::{Direct, Offsets, PointLight, RenderScene};
use strandbench_scenes::{AreaLight, Scene, Surface};

fn rays(n: usize) -> Vec<(Vec3, Vec3)> {
    let at = |k: usize| (k as f32 * 0.618_034).fract();
    let from = Vec3::new(5.0, 20.0, 300.0);
    (0..n)
        .map(|k| {
            let to = Vec3::new(60.0 * at(k) - 30.0, 60.0 * at(3 * k + 1) - 30.0, 0.0);
            (from, (to - from).normalize())
        })
        .collect()
}

fn subject() -> Scene {
    scene(tuft(300), vec![Surface::plain(plate(20.0, -9.0), [0.5, 0.4, 0.3])], Vec::new(), (8, 8))
}

fn lamps() -> [PointLight; 3] {
    [(300.0, 300.0, 700.0), (-500.0, 0.0, 300.0), (0.0, -50.0, 500.0)]
        .map(|(x, y, z)| PointLight { position_mm: Vec3::new(x, y, z), intensity_rgb: [1e5, 2e5, 3e5] })
}

#[test]
fn every_ray_is_answered_and_lights_add_up() {
    let s = subject();
    let prepared = RenderScene::new(&s).unwrap();
    let rays = rays(4000);
    let all = prepared.direct_from_points(&rays, &lamps(), Offsets::Own).unwrap();
    let each: Vec<Vec<Direct>> =
        lamps().iter().map(|l| prepared.direct_from_points(&rays, &[*l], Offsets::Own).unwrap()).collect();
    let mut kinds = [0; 3];
    for (i, d) in all.iter().enumerate() {
        assert_eq!(d.hit, prepared.closest(rays[i].0, rays[i].1.normalize()));
        kinds[match d.hit {
            None => 0,
            Some(Hit::Fibre { .. }) => 1,
            Some(Hit::Mesh { .. }) => 2,
        }] += 1;
        for c in 0..3 {
            let sum: f32 = each.iter().map(|e| e[i].radiance_rgb[c]).sum();
            assert!((d.radiance_rgb[c] - sum).abs() <= 1e-5 * sum);
        }
        for (k, e) in each.iter().enumerate() {
            assert_eq!(d.visible >> k & 1, e[i].visible);
        }
    }
    assert!(kinds.iter().all(|&k| k > 50), "{kinds:?}");
    let seen = all.iter().filter(|d| d.visible != 0).count();
    assert!(seen > 500 && all.iter().any(|d| d.hit.is_some() && d.visible == 0));
}

#[test]
fn a_small_far_rectangle_gives_the_light_of_a_point() {
    // A rectangle of area A and radiance L seen head on has the intensity L A.
    let mut s = subject();
    let lamp = light(Vec3::new(300.0, 300.0, 700.0), 0.5, 1e5);
    s.lights = vec![AreaLight { radiance_rgb: [1e5; 3], ..lamp }];
    let prepared = RenderScene::new(&s).unwrap();
    let point = PointLight { position_mm: lamp.centre_mm, intensity_rgb: [1e5; 3] };
    // The view's rays are not known, but the image's mean is that of a fine grid of rays.
    let camera = &s.rig.cameras[0];
    let n = 64;
    let grid: Vec<(Vec3, Vec3)> = (0..64 * n * n)
        .map(|k| {
            let (cell, sub) = (k / (n * n), k % (n * n));
            let at = |cell: usize, sub: usize| cell as f64 + (sub as f64 + 0.5) / n as f64;
            let px = glam::DVec2::new(at(cell % 8, sub % n), at(cell / 8, sub / n));
            (camera.centre_mm().as_vec3(), camera.ray_direction(px).normalize().as_vec3())
        })
        .collect();
    let exact = prepared.direct_from_points(&grid, &[point], Offsets::Own).unwrap();
    let want = exact.iter().map(|d| f64::from(d.radiance_rgb[0])).sum::<f64>() / grid.len() as f64;
    let fine = render(&s, &fixed(4096), 4);
    let got = fine.radiance_rgb.data.iter().map(|c| f64::from(c[0])).sum::<f64>() / 64.0;
    let error = (fine.variance.data.iter().map(|v| f64::from(*v)).sum::<f64>() / 64.0 / 64.0).sqrt();
    // Both are stratified; the renderer's own error is stated, the grid's is below it.
    assert!((got - want).abs() < 5.0 * error.max(1e-3 * want), "{got} ± {error}, {want}");
    assert!(want > 0.0 && error < 0.01 * want);
}

#[test]
fn mitsubas_offset_changes_few_shadows_and_bad_input_is_named() {
    let s = subject();
    let prepared = RenderScene::new(&s).unwrap();
    let rays = rays(4000);
    let [own, theirs] =
        [Offsets::Own, Offsets::Mitsuba].map(|o| prepared.direct_from_points(&rays, &lamps(), o).unwrap());
    let flips: u32 = own.iter().zip(&theirs).map(|(a, b)| (a.visible ^ b.visible).count_ones()).sum();
    // Rays that go on through their own fibre are no shadow here; with the offset they start inside it, and
    // see no entry either, or outside and are stopped by it: only grazing ones differ.
    assert!(flips > 0 && flips < 12_000 / 20, "{flips} of 12000 shadow tests differ");
    let fail = |rays: &[(Vec3, Vec3)], lights: &[PointLight], part: &str| {
        let e = prepared.direct_from_points(rays, lights, Offsets::Own).unwrap_err().to_string();
        assert!(e.contains(part), "{e}");
    };
    fail(&rays, &[lamps()[0]; 65], "65 point lights");
    fail(&rays, &[PointLight { intensity_rgb: [f32::NAN; 3], ..lamps()[0] }], "point light 0");
    fail(&[(Vec3::ZERO, Vec3::ZERO)], &lamps(), "ray 0");
    fail(&[(Vec3::NAN, Vec3::X)], &lamps(), "ray 0");
    // A light on the surface itself is not seen from there, and nothing divides by its distance.
    let i = own.iter().position(|d| d.hit.is_some()).unwrap();
    let at = prepared.surface_point(&own[i].hit.unwrap(), rays[i].0, rays[i].1.normalize()).position_mm;
    let on = PointLight { position_mm: at, intensity_rgb: [1.0; 3] };
    let d = prepared.direct_from_points(&rays[i..=i], &[on], Offsets::Own).unwrap()[0];
    assert!(d.hit.is_some() && d.radiance_rgb[0].is_finite());
}

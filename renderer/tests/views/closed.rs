//! Views of simple shapes against closed forms.

use crate::common::{EYE, fibre, fixed, light, plate, render, scene};
use glam::Vec3;
use strandbench_renderer::marschner::{Angles, Fibre, Roots};
use strandbench_renderer::{Render, Skin};
use strandbench_scenes::{AreaLight, Scene, SkinOptics, Surface};
use strandbench_types::StrandSet;

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
    let s = scene(StrandSet::new(), vec![Surface::plain(plate(50.0, 0.0), [0.6; 3])], vec![l], (4, 4));
    let got = render(&s, &fixed(4096), 9).radiance_rgb.data[2 * 4 + 2][0];
    let (a, h) = (f64::from(half), f64::from(height));
    let edge = a / (a * a + h * h).sqrt();
    let irradiance = f64::from(radiance) * 4.0 * edge * (edge).atan();
    // Skin is Lambert's law below a coat; over this light's directions the coat is all but constant.
    let skin = Skin::new(&SkinOptics::default()).unwrap();
    let f = skin.scatter(Vec3::Z, Vec3::Z, Vec3::Z, [0.6; 3])[0];
    let n = 200;
    let mut mean_f = 0.0;
    let mut weight = 0.0;
    for i in 0..n {
        for j in 0..n {
            let q = |k: i32| (2.0 * (k as f32 + 0.5) / n as f32 - 1.0) * half;
            let to = Vec3::new(q(i), q(j), height);
            let wi = to.normalize();
            let w = f64::from(wi.z * wi.z / to.length_squared());
            mean_f += w * f64::from(skin.scatter(Vec3::Z, wi, Vec3::Z, [0.6; 3])[0]);
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
    let skin = |z| Surface::plain(plate(40.0, z), [0.6; 3]);
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

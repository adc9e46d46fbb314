//! What hides a light and what does not, exactly: no light at all, or all of it.

use crate::common::{fixed, light, plate, render, scene};
use glam::Vec3;
use strandbench_renderer::{Offsets, PointLight, RenderScene, Settings, Strategy};
use strandbench_scenes::{AreaLight, Scene, Surface};
use strandbench_types::{StrandSet, TriMesh};

/// Half sides of a light that is left to points on it, and of one that both ways find, mm; and the ways that find
/// it. Directions of scattering hardly ever meet a small one.
const LIGHTS: [(f32, &[Strategy]); 2] = [
    (5.0, &[Strategy::Both, Strategy::Lights]),
    (200.0, &[Strategy::Both, Strategy::Lights, Strategy::Scattering]),
];
/// Where the light is, mm; 538 mm from the plate's middle.
const PLACE: Vec3 = Vec3::new(200.0, 300.0, 400.0);

/// A square of half side `half`, `mm` from the light towards what it shines on.
fn screen(half: f32, mm: f32) -> Surface {
    let n = -PLACE.normalize();
    let u = n.any_orthonormal_vector();
    let v = n.cross(u);
    let at = |x: f32, y: f32| PLACE + n * mm + (u * x + v * y) * half;
    let mesh = TriMesh {
        vertices: vec![at(-1.0, -1.0), at(1.0, -1.0), at(1.0, 1.0), at(-1.0, 1.0)],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    };
    Surface::plain(mesh, [0.8; 3])
}

/// A plate of skin under one light, and what else there is.
fn lit(lamp: AreaLight, strands: StrandSet, others: Vec<Surface>) -> Scene {
    let skin = Surface::plain(plate(8.0, 0.0), [0.5; 3]);
    scene(strands, [vec![skin], others].concat(), vec![lamp], (12, 12))
}

fn brightest(s: &Scene, strategy: Strategy, depth: u32) -> f32 {
    let settings = Settings { strategy, depth, indirect_every: 1, ..fixed(16) };
    render(s, &settings, 5).radiance_rgb.data.iter().fold(0.0, |m, v| m.max(v[0]))
}

fn total(s: &Scene, strategy: Strategy) -> f64 {
    let settings = Settings { strategy, indirect_every: 1, ..fixed(64) };
    render(s, &settings, 5).radiance_rgb.data.iter().map(|v| f64::from(v[0])).sum()
}

#[test]
fn what_stands_just_before_a_light_hides_all_of_it_and_what_stands_just_behind_nothing() {
    for (half, strategies) in LIGHTS {
        let lamp = light(PLACE, half, 500.0);
        let open = lit(lamp, StrandSet::new(), Vec::new());
        // At 99 hundredths of the way; from within 8 mm around the plate's middle its shadow moves by 0.1 mm.
        let hidden = lit(lamp, StrandSet::new(), vec![screen(1.2 * half, 5.0)]);
        let behind = lit(lamp, StrandSet::new(), vec![screen(1.2 * half, -5.0)]);
        for &strategy in strategies {
            for depth in [1, 3] {
                assert_eq!(
                    brightest(&hidden, strategy, depth),
                    0.0,
                    "{strategy:?}, depth {depth}, half {half}"
                );
            }
            let (all, same) = (total(&open, strategy), total(&behind, strategy));
            // The same rays but for the rounding of where they start, and of the sphere around the scene.
            assert!(
                all > 0.0 && (same / all - 1.0).abs() < 1e-4,
                "{strategy:?}, half {half}: {same} of {all}"
            );
        }
    }
    // A fibre does so too; its own light is no part of direct light. It lies from 4 to 20 mm before the light.
    let lamp = light(PLACE, 5.0, 500.0);
    let n = -PLACE.normalize();
    let u = n.any_orthonormal_vector();
    let mut log = StrandSet::new();
    log.push(&[PLACE + n * 12.0 - u * 10.0, PLACE + n * 12.0 + u * 10.0], 8.0);
    for strategy in [Strategy::Both, Strategy::Lights] {
        assert_eq!(brightest(&lit(lamp, log.clone(), Vec::new()), strategy, 1), 0.0, "{strategy:?}");
    }
}

#[test]
fn point_lights_are_hidden_by_what_stands_just_before_them() {
    let rays: Vec<(Vec3, Vec3)> = (0..100)
        .map(|k| {
            let to = Vec3::new((k % 10) as f32 - 4.5, (k / 10) as f32 - 4.5, 0.0);
            let from = Vec3::new(0.0, 0.0, 900.0);
            (from, (to - from).normalize())
        })
        .collect();
    let lamp = PointLight { position_mm: PLACE, intensity_rgb: [1e5; 3] };
    for (mm, seen) in [(5.0, false), (-5.0, true)] {
        let s = lit(light(PLACE, 5.0, 500.0), StrandSet::new(), vec![screen(6.0, mm)]);
        let prepared = RenderScene::new(&s).unwrap();
        for offsets in [Offsets::Own, Offsets::Mitsuba] {
            let found = prepared.direct_from_points(&rays, &[lamp], offsets).unwrap();
            assert!(
                found.iter().all(|d| d.hit.is_some() && (d.visible == 1) == seen),
                "{offsets:?}, {mm} mm"
            );
        }
    }
}

#[test]
fn a_light_shines_to_one_side() {
    for (half, strategies) in LIGHTS {
        let lamp = light(PLACE, half, 500.0);
        let away = AreaLight { half_u_mm: -lamp.half_u_mm, ..lamp };
        for &strategy in strategies {
            for depth in [1, 3] {
                assert_eq!(brightest(&lit(away, StrandSet::new(), Vec::new()), strategy, depth), 0.0);
            }
            assert!(brightest(&lit(lamp, StrandSet::new(), Vec::new()), strategy, 1) > 0.0);
        }
    }
}

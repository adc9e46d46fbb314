//! Shadows that are kept for all views: as bright as those that are not, and the same whoever finds them.

use crate::common::*;
use crate::skin::{bare, grid, lamps, over_seeds, skin};
use glam::Vec3;
use strandbench_renderer::{RenderScene, Settings};
use strandbench_scenes::{Scene, SkinTexture, Surface};
use strandbench_types::{Camera, Silent, StrandSet};

fn hairy() -> Scene {
    let skin = skin(grid(4.0, 8), SkinTexture::default());
    Scene { skin: bare(0.0), ..scene(tuft(60), vec![skin], lamps(), (24, 20)) }
}

fn kept(spacing: f32) -> Settings {
    Settings { shadow_spacing_px: spacing, depth: 3, indirect_every: 1, clamp: 0.0, ..fixed(64) }
}

#[test]
fn kept_shadows_are_as_dark_as_those_that_are_sought() {
    let lit = hairy();
    // Half way to a lamp, out of the camera's sight: a shadow as wide as the plate.
    let mut shaded = hairy();
    shaded.strands.points.iter_mut().for_each(|p| *p += Vec3::new(150.0, 150.0, 350.0));
    assert!(render(&shaded, &fixed(4), 1).hits.hits.is_empty());
    for (s, spacing, most) in [(&lit, 0.5, 0.01), (&lit, 2.0, 0.02), (&shaded, 1.0, 0.01)] {
        let [plain, with] = [0.0, spacing].map(|spacing| over_seeds(s, &kept(spacing), 12));
        for (c, (a, b)) in plain.iter().zip(with).enumerate() {
            let error = (a.1 + b.1).sqrt();
            assert!(5.0 * error < most * a.0, "channel {c}: {error} of {} tells nothing", a.0);
            assert!(
                (b.0 - a.0).abs() < most * a.0,
                "spacing {spacing}, channel {c}: {} instead of {}",
                b.0,
                a.0
            );
        }
    }
}

#[test]
fn a_fibre_is_as_bright_where_it_leaves_the_skin_as_above() {
    // Half of the only segment is below an opaque plate, and so is one of its two points.
    let mut strands = StrandSet::new();
    strands.push(&[Vec3::new(-3.0, 0.0, -3.0), Vec3::new(3.0, 0.0, 3.0)], 0.5);
    let black = Surface::plain(plate(40.0, 0.0), [0.0; 3]);
    let mut s = scene(strands, vec![black], lamps(), (32, 32));
    s.skin = bare(0.0);
    let settings = |spacing| Settings { shadow_spacing_px: spacing, depth: 1, ..fixed(256) };
    let [plain, with] = [0.0, 1000.0].map(|spacing| over_seeds(&s, &settings(spacing), 4)[1]);
    assert!((with.0 / plain.0 - 1.0).abs() < 0.01, "{} instead of {}", with.0, plain.0);
}

#[test]
fn same_bits_for_any_number_of_threads_and_order_of_views() {
    let mut s = hairy();
    s.rig.cameras.push(Camera { name: "c1".into(), ..camera(20, 24) });
    let view = |prepared: &RenderScene<'_>, c: usize, seed| {
        let r = prepared.render(c, &Settings { sensor_noise: 1.0, ..kept(1.0) }, seed, &Silent).unwrap();
        (r.radiance_rgb, r.stats.shadow_rays)
    };
    let first = RenderScene::new(&s).unwrap();
    let (a, b, other) = (view(&first, 0, 1), view(&first, 1, 1), view(&first, 0, 2));
    assert_ne!(a.0, other.0);
    assert!(b.1 < a.1 / 2, "{} shadow rays, then {}", a.1, b.1);
    for threads in [1, 3] {
        let second = RenderScene::new(&s).unwrap();
        rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| {
            assert_eq!(view(&second, 0, 2), other);
            let (b2, a2) = (view(&second, 1, 1), view(&second, 0, 1));
            assert_eq!((&b2.0, &a2.0), (&b.0, &a.0));
            assert_eq!(b2.1 + a2.1, b.1 + a.1, "rays are counted once");
        });
    }
}

#[test]
fn an_environment_and_many_lights_keep_their_own_shadow_rays() {
    let mut sky = hairy();
    sky.environment = Some(strandbench_scenes::Environment::constant([0.1; 3]));
    let mut many = hairy();
    many.lights = std::iter::repeat_n(lamps(), 9).flatten().collect();
    many.lights.truncate(17);
    assert_eq!(many.lights.len(), 17);
    for s in [sky, many] {
        let [plain, with] = [0.0, 1.0].map(|spacing| render(&s, &kept(spacing), 1).radiance_rgb);
        assert_eq!(plain, with);
    }
}

#[test]
fn spacings_that_mean_nothing_are_refused() {
    for spacing in [-1.0, f32::NAN, f32::INFINITY, 1e-3, 1e4] {
        let s = hairy();
        let refused = RenderScene::new(&s).unwrap().render(0, &kept(spacing), 1, &Silent);
        assert!(refused.unwrap_err().to_string().contains("shadow_spacing_px"));
    }
}

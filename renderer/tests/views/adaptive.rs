//! Pixels that are rendered until the sensor hides their noise: nothing is made brighter or darker by it, and the error is
//! what it is said to be.

use crate::common::*;
use crate::skin::{bare, grid, lamps, over_seeds, skin};
use strandbench_renderer::{Settings, noise_variance};
use strandbench_scenes::{Scene, SkinTexture};

fn hairy() -> Scene {
    let skin = skin(grid(4.0, 8), SkinTexture::default());
    Scene { background_rgb: [0.02, 0.01, 0.03], ..scene(tuft(60), vec![skin], lamps(), (24, 20)) }
}

fn adaptive(first: u32, most: u32, share: f32) -> Settings {
    Settings {
        samples_per_pixel: first,
        max_samples_per_pixel: most,
        sensor_noise: share,
        indirect_every: 1,
        depth: 2,
        clamp: 0.0,
        skin_paths: 8,
        ..Settings::default()
    }
}

/// The mean of [`hairy`] over seeds, sampled plainly and with cover and shading apart.
fn both_ways(s: &Scene, seeds: [u64; 2]) {
    let plain = Settings { sensor_noise: 0.0, noise_target: 0.0, ..adaptive(64, 64, 0.0) };
    let [a, b] = [(plain, seeds[0]), (adaptive(8, 64, 0.5), seeds[1])].map(|(p, n)| over_seeds(s, &p, n));
    for (c, (a, b)) in a.iter().zip(b).enumerate() {
        let (off, error) = (b.0 - a.0, (a.1 + b.1).sqrt());
        assert!(off.abs() < 5.0 * error, "channel {c}: {off} against {error}");
        assert!(5.0 * error < 0.02 * a.0, "channel {c}: {error} of {} tells nothing", a.0);
    }
}

#[test]
fn what_is_sampled_apart_has_the_mean_of_what_is_not() {
    both_ways(&hairy(), [24, 48]);
}

#[test]
fn it_has_that_mean_before_skin_whose_light_below_is_not_known() {
    both_ways(&Scene { skin: bare(0.0), ..hairy() }, [24, 48]);
}

#[test]
fn it_has_that_mean_where_no_fibre_has_much_of_a_pixel() {
    // A dozen fibres in a pixel, a twentieth of it each, dark and fair.
    let mut s = Scene { skin: bare(0.0), ..hairy() };
    s.strands.points.iter_mut().for_each(|p| p.x *= 0.1);
    s.strands.radii_mm.iter_mut().for_each(|r| *r *= 0.25);
    s.pigments.iter_mut().step_by(3).for_each(|p| p.eumelanin = 0.02);
    both_ways(&s, [24, 48]);
}

#[test]
fn what_is_sampled_apart_has_the_identities_of_what_is_not() {
    let [a, b] = [0.0, 1.0].map(|share| render(&hairy(), &adaptive(8, 64, share), 3));
    assert_eq!(a.hits, b.hits);
}

/// Of each pixel: mean and variance over seeds of the radiance as the sensor weighs it, and the mean variance estimated.
fn over_pixels(s: &Scene, settings: &Settings) -> Vec<[f64; 3]> {
    let renders: Vec<_> = (0..24).map(|seed| render(s, settings, seed)).collect();
    let n = renders.len() as f64;
    let weights = s.sensor.response_rgb;
    let of = |i: usize| {
        let mono = renders.iter().map(|r| r.radiance_rgb.data[i]);
        let mono: Vec<f64> = mono.map(|p| (0..3).map(|c| f64::from(p[c] * weights[c])).sum()).collect();
        let mean = mono.iter().sum::<f64>() / n;
        let found = mono.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
        [mean, found, renders.iter().map(|r| f64::from(r.variance.data[i])).sum::<f64>() / n]
    };
    (0..renders[0].variance.data.len()).map(of).collect()
}

#[test]
fn the_estimated_error_is_about_the_difference_of_seeds() {
    let s = Scene { skin: bare(0.0), ..hairy() };
    let pixels = over_pixels(&s, &adaptive(8, 8, 1.0));
    let [found, said] = [1, 2].map(|k| pixels.iter().map(|p| p[k]).sum::<f64>());
    assert!((0.6..2.0).contains(&(said / found)), "{said} of {found}");
}

#[test]
fn the_sensor_hides_what_error_is_left() {
    let s = Scene { skin: bare(0.0), ..hairy() };
    let full = f64::from(s.sensor.full_scale_radiance);
    let over = |most: u32| {
        let pixels = over_pixels(&s, &adaptive(8, most, 1.0));
        let over = pixels
            .iter()
            .map(|[mean, found, _]| found / (noise_variance(&s.sensor, mean / full) * full * full));
        over.sum::<f64>() / pixels.len() as f64
    };
    let (before, after) = (over(8), over(512));
    assert!(before > 2.0 && after < 1.0, "{before} times the sensor's variance, then {after}");
}

#[test]
fn same_bits_for_any_number_of_threads() {
    let s = hairy();
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| render(&s, &adaptive(4, 32, 1.0), 1))
    };
    let [one, three] = [1, 3].map(with);
    assert_eq!(one.radiance_rgb.data, three.radiance_rgb.data);
    assert_eq!(one.variance.data, three.variance.data);
    assert_eq!(one.hits, three.hits);
}

#[test]
fn one_sample_is_enough_for_a_picture() {
    let r = render(&hairy(), &adaptive(1, 1, 1.0), 1);
    assert!(r.radiance_rgb.data.iter().flatten().all(|v| v.is_finite()));
    assert!(r.variance.data.iter().all(|v| v.is_finite()));
}

#[test]
fn one_ray_at_first_is_not_taken_for_enough() {
    let s = Scene { skin: bare(0.0), ..hairy() };
    let [one, eight] = [1, 8].map(|first| render(&s, &adaptive(first, 256, 1.0), 1).stats);
    let pixels = s.rig.cameras[0].width as u64 * s.rig.cameras[0].height as u64;
    assert!(one.converged > 0.95 * eight.converged, "{} against {}", one.converged, eight.converged);
    assert!(one.primary_rays >= 2 * pixels, "{} rays for {pixels} pixels", one.primary_rays);
}

#[test]
fn a_colour_sensor_asks_as_much_of_a_grey_scene_as_a_monochrome_one() {
    let with = |weight: f32| {
        let mut s = hairy();
        s.sensor.response_rgb = [weight; 3];
        render(&s, &adaptive(8, 64, 1.0), 1)
    };
    // Weights whose sums differ by a power of two, so that nothing is rounded.
    let [a, b] = [0.25, 1.0].map(with);
    assert_eq!(a.radiance_rgb.data, b.radiance_rgb.data);
    assert!(a.variance.data.iter().zip(&b.variance.data).all(|(a, b)| 16.0 * a == *b));
}

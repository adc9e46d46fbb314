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

#[test]
fn what_is_sampled_apart_has_the_mean_and_the_identities_of_what_is_not() {
    let mut s = hairy();
    for below in [true, false] {
        if !below {
            s.skin = bare(0.0);
        }
        let plain = Settings { sensor_noise: 0.0, noise_target: 0.0, ..adaptive(64, 64, 0.0) };
        let [a, b] = [(plain, 24), (adaptive(8, 64, 0.5), 48)].map(|(p, n)| over_seeds(&s, &p, n));
        for (c, (a, b)) in a.iter().zip(b).enumerate() {
            let (off, error) = (b.0 - a.0, (a.1 + b.1).sqrt());
            assert!(off.abs() < 5.0 * error, "channel {c}, light below {below}: {off} against {error}");
            assert!(5.0 * error < 0.02 * a.0, "channel {c}: {error} of {} tells nothing", a.0);
        }
    }
    let [a, b] = [0.0, 1.0].map(|share| render(&s, &adaptive(8, 64, share), 3));
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

use super::*;

/// A sensor without any fault.
fn ideal() -> Sensor {
    Sensor {
        full_scale_radiance: 2.0,
        gain_spread: 0.0,
        full_well_e: 0.0,
        read_noise_e: 0.0,
        vignetting: 0.0,
        bits: 0,
        response_rgb: [0.5, 0.25, 0.25],
    }
}

fn moments(v: &[f32]) -> (f64, f64) {
    let n = v.len() as f64;
    let mean = v.iter().map(|&x| f64::from(x)).sum::<f64>() / n;
    (mean, v.iter().map(|&x| (f64::from(x) - mean).powi(2)).sum::<f64>() / (n - 1.0))
}

#[test]
fn faultless_sensor_weighs_scales_and_clips() {
    let light = Plane::from_vec(3, 1, vec![[1.0, 2.0, 4.0], [9.0; 3], [f32::NAN, 0.0, 0.0]]);
    assert_eq!(expose(&ideal(), 3, &light, 1).data, [1.0, 1.0, 0.0]);
    let dim = Plane::filled(1, 1, [0.4, 0.4, 0.4]);
    assert!((expose(&ideal(), 0, &dim, 1).data[0] - 0.2).abs() < 1e-6);
}

#[test]
fn noise_has_the_mean_and_variance_of_shot_and_read_noise() {
    // From 2 electrons (Poisson proper) over the change of method to 8,000.
    for (signal, well, read) in [(2e-4, 1e4, 0.0f64), (6e-3, 1e4, 3.0), (0.009, 1e4, 0.0), (0.5, 1.6e4, 15.0)]
    {
        let sensor = Sensor { full_well_e: well as f32, read_noise_e: read as f32, ..ideal() };
        let n = 400 * 250;
        let image = expose(&sensor, 0, &Plane::filled(400, 250, [2.0 * signal as f32; 3]), 7);
        let (mean, variance) = moments(&image.data);
        let want = signal / well + (read / well).powi(2);
        // Clipping at 0 must not touch the moments: read noise stays five deviations away.
        let electrons: f64 = signal * well;
        assert!(read == 0.0 || electrons > 5.0 * (electrons + read * read).sqrt());
        let error = (want / n as f64).sqrt();
        assert!((mean - signal).abs() < 5.0 * error, "signal {signal}: mean {mean}");
        // Variance of a sample variance: 2/n for a Gaussian, 1/(n λ) more for a Poisson count.
        let spread = (2.0 / n as f64 + 1.0 / (n as f64 * signal * well)).sqrt();
        assert!((variance / want - 1.0).abs() < 5.0 * spread, "signal {signal}: {variance}, {want}");
    }
}

#[test]
fn few_electrons_follow_the_poisson_distribution() {
    let sensor = Sensor { full_well_e: 1000.0, ..ideal() };
    let image = expose(&sensor, 0, &Plane::filled(500, 400, [2.0 * 0.003; 3]), 3);
    let mut p = (-3.0f64).exp();
    for k in 0..10 {
        let got = image.data.iter().filter(|&&v| (v * 1000.0).round() as i32 == k).count() as f64 / 2e5;
        assert!((got - p).abs() < 5.0 * (p / 2e5).sqrt(), "{k} electrons: {got}, {p}");
        p *= 3.0 / f64::from(k + 1);
    }
}

#[test]
fn gain_vignetting_and_quantiser_do_what_they_say() {
    let sensor = Sensor { gain_spread: 0.03, ..ideal() };
    let gains: Vec<f32> = (0..20_000).map(|c| gain(&sensor, c, 5) as f32).collect();
    let (mean, variance) = moments(&gains);
    assert!((mean - 1.0).abs() < 5.0 * 0.03 / 20_000f64.sqrt(), "{mean}");
    assert!((variance.sqrt() / 0.03 - 1.0).abs() < 5.0 / 40_000f64.sqrt(), "{variance}");
    let light = Plane::filled(1, 1, [1.0; 3]);
    let shown = f64::from(expose(&sensor, 4, &light, 5).data[0]);
    assert!((shown - 0.5 * gain(&sensor, 4, 5)).abs() < 1e-6);
    assert_ne!(gain(&sensor, 4, 5), gain(&sensor, 4, 6));

    let sensor = Sensor { vignetting: 0.2, ..ideal() };
    let v = expose(&sensor, 0, &Plane::filled(101, 101, [1.0; 3]), 1);
    let corner2 = 2.0 * 50.5f64 * 50.5;
    assert!((f64::from(v.data[50 * 101 + 50]) - 0.5).abs() < 1e-6);
    let want = 0.5 * (1.0 - 0.2 * 2.0 * 50.0 * 50.0 / corner2);
    assert!((f64::from(v.data[0]) - want).abs() < 1e-6 && v.data[0] == v.data[101 * 101 - 1]);

    let sensor = Sensor { bits: 3, ..ideal() };
    let steps = Plane::from_vec(4, 1, [0.0, 0.2, 1.13, 2.0].map(|v| [v; 3]).to_vec());
    let sevenths = expose(&sensor, 0, &steps, 1).map(|v| v * 7.0);
    for (got, want) in sevenths.data.iter().zip([0.0, 1.0, 4.0, 7.0]) {
        assert!((got - want).abs() < 1e-5, "{got} {want}");
    }
}

#[test]
fn noise_is_a_function_of_seed_camera_and_pixel() {
    let sensor = Sensor::default();
    let light = Plane::filled(64, 1, [0.5; 3]);
    let a = expose(&sensor, 1, &light, 9);
    assert_eq!(a, expose(&sensor, 1, &light, 9));
    assert_ne!(a, expose(&sensor, 2, &light, 9));
    assert_ne!(a, expose(&sensor, 1, &light, 10));
    let (_, variance) = moments(&a.data);
    assert!(variance > 0.0, "pixels differ");
}

#[test]
fn channels_of_a_colour_sensor_are_exposed_each_by_itself() {
    let ideal = Sensor { response_rgb: [0.4, 0.8, 1.2], ..ideal() };
    let light = Plane::from_vec(2, 1, vec![[1.0, 0.5, 0.25], [9.0, f32::NAN, 0.0]]);
    let got = expose_rgb(&ideal, 0, &light, 1);
    for (c, want) in [0.25, 0.25, 0.1875].into_iter().enumerate() {
        assert!((got.data[0][c] - want).abs() < 1e-6, "{c}: {}", got.data[0][c]);
    }
    assert_eq!(got.data[1], [1.0, 0.0, 0.0]);
    // The noise of each channel follows its own signal, and no two channels share their numbers.
    let (well, read) = (1.6e4, 15.0f64);
    let sensor = Sensor {
        full_well_e: well as f32,
        read_noise_e: read as f32,
        gain_spread: 0.1,
        vignetting: 0.3,
        ..ideal
    };
    let light = Plane::filled(300, 200, [1.0, 0.5, 0.1]);
    let a = expose_rgb(&sensor, 3, &light, 7);
    assert_eq!(a, expose_rgb(&sensor, 3, &light, 7));
    assert_ne!(a, expose_rgb(&sensor, 2, &light, 7));
    assert_ne!(a, expose_rgb(&sensor, 3, &light, 8));
    let g = gain(&sensor, 3, 7);
    let exposure = Exposure::new(&sensor, 3, (300, 200), 7);
    let n = a.data.len() as f64;
    // Residuals over their standard deviation: mean 0, variance 1, and uncorrelated between channels.
    let z: Vec<[f64; 3]> = (0..a.data.len())
        .map(|i| {
            std::array::from_fn(|c| {
                let signal = [0.25, 0.25, 0.075][c] * exposure.vignette(i);
                let sd = g * (signal / well + (read / well).powi(2)).sqrt();
                (f64::from(a.data[i][c]) - g * signal) / sd
            })
        })
        .collect();
    for c in 0..3 {
        let mean = z.iter().map(|z| z[c]).sum::<f64>() / n;
        let square = z.iter().map(|z| z[c] * z[c]).sum::<f64>() / n;
        let both = z.iter().map(|z| z[c] * z[(c + 1) % 3]).sum::<f64>() / n;
        assert!(mean.abs() < 5.0 / n.sqrt(), "{c}: mean {mean}");
        assert!((square - 1.0).abs() < 5.0 * (2.0 / n).sqrt(), "{c}: variance {square}");
        assert!(both.abs() < 5.0 / n.sqrt(), "{c}: correlation {both}");
    }
}

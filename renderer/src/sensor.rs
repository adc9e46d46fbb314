//! What a camera makes of the light it gets.

use strandbench_rng::Rng;
use strandbench_scenes::Sensor;
use strandbench_types::Plane;

/// Keys of the streams, so that gain and noise never share numbers.
const GAIN_KEY: u64 = 0x6761_696e;
const NOISE_KEY: u64 = 0x6e6f_6973;
const COLOUR_NOISE_KEY: u64 = 0x636f_6c6f;
/// Mean count of electrons above which a Gaussian stands in for the Poisson distribution.
const GAUSSIAN_ABOVE: f64 = 100.0;

/// A standard normal number (Box and Muller 1958).
fn normal(rng: &mut Rng) -> f64 {
    let radius = (-2.0 * libm::log(1.0 - rng.f64())).sqrt();
    radius * libm::cos(2.0 * std::f64::consts::PI * rng.f64())
}

/// A Poisson count: inversion of the distribution up to a mean of 100, above that a Gaussian of the same mean
/// and variance, rounded.
fn poisson(mean: f64, rng: &mut Rng) -> f64 {
    if mean <= 0.0 {
        return 0.0;
    }
    if mean > GAUSSIAN_ABOVE {
        return (mean + mean.sqrt() * normal(rng)).round().max(0.0);
    }
    let u = rng.f64();
    let mut p = libm::exp(-mean);
    let mut below = p;
    let mut k = 0.0;
    // The tail beyond mean + 40 sqrt(mean) + 40 holds less than f64 can tell.
    while u >= below && k < 40.0 * mean.sqrt() + mean + 40.0 {
        k += 1.0;
        p *= mean / k;
        below += p;
    }
    k
}

/// The gain of camera `camera`: 1 plus a normal number times the spread, kept within 0.2 and 5.
pub fn gain(sensor: &Sensor, camera: usize, seed: u64) -> f64 {
    let mut rng = Rng::keyed(&[seed, GAIN_KEY, camera as u64]);
    (1.0 + f64::from(sensor.gain_spread) * normal(&mut rng)).clamp(0.2, 5.0)
}

/// Variance of a pixel's value due to shot noise, read noise and rounding, at a signal in the middle of the image; both
/// relative to full scale, before the gain.
pub fn noise_variance(sensor: &Sensor, signal: f64) -> f64 {
    let (well, read) = (f64::from(sensor.full_well_e), f64::from(sensor.read_noise_e));
    let electrons = if well > 0.0 { signal.clamp(0.0, 1.0) / well + (read / well).powi(2) } else { 0.0 };
    let step = if sensor.bits > 0 { 1.0 / (2f64.powi(sensor.bits.min(32) as i32) - 1.0) } else { 0.0 };
    electrons + step * step / 12.0
}

/// What happens to each pixel of one camera.
struct Exposure<'a> {
    sensor: &'a Sensor,
    width: usize,
    centre: [f64; 2],
    corner2: f64,
    gain: f64,
    levels: Option<f64>,
}

impl<'a> Exposure<'a> {
    fn new(sensor: &'a Sensor, camera: usize, (width, height): (usize, usize), seed: u64) -> Exposure<'a> {
        let [cx, cy] = [0.5 * width as f64, 0.5 * height as f64];
        Exposure {
            sensor,
            width,
            centre: [cx, cy],
            corner2: (cx * cx + cy * cy).max(1e-9),
            gain: gain(sensor, camera, seed),
            levels: (sensor.bits > 0).then(|| (2.0f64.powi(sensor.bits.min(32) as i32)) - 1.0),
        }
    }

    /// The share of the light that vignetting leaves to pixel `i`.
    fn vignette(&self, i: usize) -> f64 {
        let (x, y) =
            ((i % self.width) as f64 + 0.5 - self.centre[0], (i / self.width) as f64 + 0.5 - self.centre[1]);
        1.0 - f64::from(self.sensor.vignetting) * (x * x + y * y) / self.corner2
    }

    /// The value of light `v` (1.0 fills the well), with the numbers that `rng` draws.
    fn value(&self, mut v: f64, rng: impl FnOnce() -> Rng) -> f32 {
        let well = f64::from(self.sensor.full_well_e);
        let read = f64::from(self.sensor.read_noise_e);
        if !v.is_finite() {
            v = 0.0;
        }
        if well > 0.0 {
            let mut rng = rng();
            let mut electrons = poisson(v.min(4.0) * well, &mut rng).min(well);
            if read > 0.0 {
                electrons += read * normal(&mut rng);
            }
            v = electrons / well;
        }
        v = (v * self.gain).clamp(0.0, 1.0);
        if let Some(levels) = self.levels {
            v = (v * levels).round() / levels;
        }
        v as f32
    }
}

/// The linear-light monochrome image (1.0 = full scale) that camera `camera` delivers for a radiance.
///
/// In this order: weights of the response; vignetting, quadratic in the distance from the image's centre;
/// exposure, so that `full_scale_radiance` fills the well; shot noise, read noise and the limit of the full
/// well, in electrons; the camera's gain; the limits 0 and 1; rounding to `bits`. Every fault whose value is
/// zero is absent, and the two limits then remain. Values that are not finite count as dark.
pub fn expose(sensor: &Sensor, camera: usize, radiance_rgb: &Plane<[f32; 3]>, seed: u64) -> Plane<f32> {
    let (width, height) = radiance_rgb.size();
    let exposure = Exposure::new(sensor, camera, (width, height), seed);
    let full = f64::from(sensor.full_scale_radiance);
    let mut out = Plane::filled(width, height, 0.0f32);
    for (i, (o, rgb)) in out.data.iter_mut().zip(&radiance_rgb.data).enumerate() {
        let light: f64 = (0..3).map(|c| f64::from(sensor.response_rgb[c]) * f64::from(rgb[c])).sum();
        let v = light * exposure.vignette(i) / full;
        *o = exposure.value(v, || Rng::keyed(&[seed, NOISE_KEY, camera as u64, i as u64]));
    }
    out
}

/// The linear-light colour image (1.0 = full scale, linear RGB) that camera `camera` delivers for a radiance: a sensor
/// of three wells at every pixel, as a prism makes it, and no mosaic of filters.
///
/// Each channel is exposed as [`expose`] does, with noise of its own, and responds to its own primary alone: by its
/// weight relative to the mean of the three, which leaves `full_scale_radiance` of equal weights to fill all wells.
/// Weights of 0 leave a channel dark but for read noise. Gain and vignetting are the camera's.
pub fn expose_rgb(
    sensor: &Sensor,
    camera: usize,
    radiance_rgb: &Plane<[f32; 3]>,
    seed: u64,
) -> Plane<[f32; 3]> {
    let (width, height) = radiance_rgb.size();
    let exposure = Exposure::new(sensor, camera, (width, height), seed);
    let response = sensor.response_rgb.map(f64::from);
    let total: f64 = response.iter().sum();
    let share = response.map(|w| if total > 0.0 { 3.0 * w / total } else { 0.0 });
    let full = f64::from(sensor.full_scale_radiance);
    let mut out = Plane::filled(width, height, [0.0f32; 3]);
    for (i, (o, rgb)) in out.data.iter_mut().zip(&radiance_rgb.data).enumerate() {
        let seen = exposure.vignette(i) / full;
        *o = std::array::from_fn(|c| {
            let key = [seed, COLOUR_NOISE_KEY, camera as u64, i as u64, c as u64];
            exposure.value(share[c] * f64::from(rgb[c]) * seen, || Rng::keyed(&key))
        });
    }
    out
}

#[cfg(test)]
mod tests {
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
        for (signal, well, read) in
            [(2e-4, 1e4, 0.0f64), (6e-3, 1e4, 3.0), (0.009, 1e4, 0.0), (0.5, 1.6e4, 15.0)]
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
}

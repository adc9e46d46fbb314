//! What a camera makes of the light it gets.

use strandbench_rng::Rng;
use strandbench_scenes::Sensor;
use strandbench_types::Plane;

/// Keys of the streams, so that gain and noise never share numbers.
const GAIN_KEY: u64 = 0x6761_696e;
const NOISE_KEY: u64 = 0x6e6f_6973;
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

/// The linear-light monochrome image (1.0 = full scale) that camera `camera` delivers for a radiance.
///
/// In this order: weights of the response; vignetting, quadratic in the distance from the image's centre;
/// exposure, so that `full_scale_radiance` fills the well; shot noise, read noise and the limit of the full
/// well, in electrons; the camera's gain; the limits 0 and 1; rounding to `bits`. Every fault whose value is
/// zero is absent, and the two limits then remain. Values that are not finite count as dark.
pub fn expose(sensor: &Sensor, camera: usize, radiance_rgb: &Plane<[f32; 3]>, seed: u64) -> Plane<f32> {
    let (width, height) = radiance_rgb.size();
    let (cx, cy) = (0.5 * width as f64, 0.5 * height as f64);
    let corner2 = (cx * cx + cy * cy).max(1e-9);
    let gain = gain(sensor, camera, seed);
    let well = f64::from(sensor.full_well_e);
    let read = f64::from(sensor.read_noise_e);
    let levels = (sensor.bits > 0).then(|| (2.0f64.powi(sensor.bits.min(32) as i32)) - 1.0);
    let full = f64::from(sensor.full_scale_radiance);
    let mut out = Plane::filled(width, height, 0.0f32);
    for (i, (o, rgb)) in out.data.iter_mut().zip(&radiance_rgb.data).enumerate() {
        let light: f64 = (0..3).map(|c| f64::from(sensor.response_rgb[c]) * f64::from(rgb[c])).sum();
        let (x, y) = ((i % width) as f64 + 0.5 - cx, (i / width) as f64 + 0.5 - cy);
        let vignette = 1.0 - f64::from(sensor.vignetting) * (x * x + y * y) / corner2;
        let mut v = light * vignette / full;
        if !v.is_finite() {
            v = 0.0;
        }
        if well > 0.0 {
            let mut rng = Rng::keyed(&[seed, NOISE_KEY, camera as u64, i as u64]);
            let mut electrons = poisson(v.min(4.0) * well, &mut rng).min(well);
            if read > 0.0 {
                electrons += read * normal(&mut rng);
            }
            v = electrons / well;
        }
        v = (v * gain).clamp(0.0, 1.0);
        if let Some(levels) = levels {
            v = (v * levels).round() / levels;
        }
        *o = v as f32;
    }
    out
}

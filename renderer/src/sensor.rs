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
mod tests;

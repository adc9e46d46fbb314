//! The eyeball: sclera, iris and pupil, about the direction in which the neutral eye looks.

use super::noise::noise;
use super::{SkinLook, SkinTexture};
use crate::groom::ramp;
use glam::Vec3;

/// Radii about the axis of sight, mm, on the embedded face's eyeballs, which are a third larger than real ones.
const IRIS_MM: f32 = 6.8;
const PUPIL_MM: f32 = 2.3;
const SCLERA_RGB: [f32; 3] = [0.62, 0.55, 0.51];
const PUPIL_RGB: [f32; 3] = [0.004; 3];
/// The cornea is smooth: its roughness against skin's.
const ROUGHNESS: f32 = 0.2;

/// `p` from the eyeball's middle, mm.
pub(super) fn look(t: &SkinTexture, p: Vec3) -> SkinLook {
    let out = (p.x * p.x + p.y * p.y).sqrt();
    let key = strandbench_rng::mix(t.seed ^ 0xE4E << 32);
    let mix =
        |a: [f32; 3], b: [f32; 3], w: f32| -> [f32; 3] { std::array::from_fn(|c| a[c] + (b[c] - a[c]) * w) };
    let (vein, _) = noise(key, p / 1.7);
    let (thread, _) = noise(key, p / 0.8);
    // Blood vessels towards the corners.
    let red = 0.1 * (1.0 - thread * thread * 4.0).max(0.0) * ramp(out, 8.0, 6.0) + 0.02 * vein;
    let sclera = std::array::from_fn(|c| SCLERA_RGB[c] * (1.0 - red * [0.2, 1.4, 1.3][c]));
    // Threads of the iris run outward: noise over the direction, hardly any along the radius.
    let spoke = Vec3::new(p.x / out.max(0.3) * 9.0, p.y / out.max(0.3) * 9.0, out * 0.5);
    let (fibre, _) = noise(key ^ 1, spoke);
    let collar = ramp(out, PUPIL_MM, 0.5) * (1.0 - ramp(out, PUPIL_MM + 1.2, 1.2));
    let rim = ramp(out, IRIS_MM - 1.3, 1.2);
    let light = (1.0 + 0.2 * fibre + 0.2 * collar - 0.65 * rim).max(0.1);
    let iris = t.iris_rgb.map(|v| (v * light).min(0.95));
    let front = p.z > 0.0;
    let within = if front { 1.0 - ramp(out, IRIS_MM - 0.35, 0.7) } else { 0.0 };
    let pupil = if front { 1.0 - ramp(out, PUPIL_MM - 0.15, 0.3) } else { 0.0 };
    let albedo_rgb = mix(mix(sclera, iris, within), PUPIL_RGB, pupil);
    SkinLook { albedo_rgb, slope: Vec3::ZERO, coat: 1.0, roughness: ROUGHNESS }
}

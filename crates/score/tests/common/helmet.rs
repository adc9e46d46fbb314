//! Hair of head size, from a formula.

use glam::DVec3;
use strandbench_rng::Rng;
use strandbench_types::StrandSet;

/// Strands of a length that start on the upper part of an ellipsoid and fall round it, `step_mm` from vertex to vertex.
pub fn hair(seed: u64, strands: u64, length_mm: f64, step_mm: f64) -> StrandSet {
    let mut set = StrandSet::new();
    for i in 0..strands {
        let mut r = Rng::keyed(&[seed, i]);
        let (turn, up) = (r.f64() * std::f64::consts::TAU, 0.15 + 0.85 * r.f64());
        let radius = DVec3::new(78.0, 100.0, 95.0) + DVec3::splat(25.0 * r.f64().powi(2));
        let flat = (1.0 - up * up).sqrt();
        let mut p = DVec3::new(turn.sin() * flat, up, turn.cos() * flat) * radius;
        let (phase, wave) = (r.f64() * 6.0, 1.0 + r.f64());
        let mut points = vec![p.as_vec3()];
        for k in 0..(length_mm / step_mm) as usize {
            let out = (p / (radius * radius)).normalize();
            let mut d = DVec3::NEG_Y + DVec3::Y * out.y * 0.2;
            d -= out * d.dot(out).min(0.0);
            d +=
                DVec3::new((phase + k as f64 * step_mm * 0.05).sin(), 0.0, (phase * 2.0).cos()) * 0.12 * wave;
            p += d.normalize() * step_mm;
            points.push(p.as_vec3());
        }
        set.push(&points, 0.04);
    }
    set
}

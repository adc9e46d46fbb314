//! Rectangular one-sided lights, sampled uniformly over their area.

use glam::Vec3;
use strandbench_scenes::AreaLight;

/// A point on a light as seen from a shading point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightSample {
    /// Unit direction towards the light.
    pub direction: Vec3,
    /// Distance, mm.
    pub distance: f32,
    /// Radiance times the light's cosine over squared distance, over the probability density: multiplied with
    /// the scattering function and the receiver's cosine it estimates the reflected radiance.
    pub weight_rgb: [f32; 3],
}

#[derive(Clone, Copy, Debug)]
struct Emitter {
    centre: Vec3,
    half_u: Vec3,
    half_v: Vec3,
    normal: Vec3,
    /// Radiance times area over the probability of the choice.
    power_rgb: [f32; 3],
    /// Upper end of this light's share of [0, 1).
    end: f32,
    start: f32,
}

/// The lights of a scene; each is chosen in proportion to its area times its mean radiance.
#[derive(Clone, Debug, Default)]
pub struct Lights {
    emitters: Vec<Emitter>,
}

impl Lights {
    /// Lights without area or radiance are left out.
    ///
    /// # Errors
    /// If a light has a value that is not finite, or negative radiance.
    pub fn new(lights: &[AreaLight]) -> Result<Lights, String> {
        let mut emitters = Vec::new();
        let mut weights = Vec::new();
        for (i, l) in lights.iter().enumerate() {
            let finite = l.centre_mm.is_finite() && l.half_u_mm.is_finite() && l.half_v_mm.is_finite();
            if !finite || l.radiance_rgb.iter().any(|&r| !(r >= 0.0 && r.is_finite())) {
                return Err(format!("light {i}: a number is not finite, or its radiance is negative"));
            }
            let across = l.half_u_mm.cross(l.half_v_mm);
            let area = 4.0 * across.length();
            let weight = area * l.radiance_rgb.iter().sum::<f32>();
            if weight <= 0.0 {
                continue;
            }
            weights.push(f64::from(weight));
            emitters.push(Emitter {
                centre: l.centre_mm,
                half_u: l.half_u_mm,
                half_v: l.half_v_mm,
                normal: across.normalize(),
                power_rgb: l.radiance_rgb.map(|r| r * area),
                end: 1.0,
                start: 0.0,
            });
        }
        let total: f64 = weights.iter().sum();
        let mut before = 0.0;
        for (e, w) in emitters.iter_mut().zip(&weights) {
            e.start = (before / total) as f32;
            before += w;
            e.end = (before / total) as f32;
            e.power_rgb = e.power_rgb.map(|p| p / (e.end - e.start));
        }
        Ok(Lights { emitters })
    }

    /// Whether no light emits.
    pub fn is_empty(&self) -> bool {
        self.emitters.is_empty()
    }

    /// A point on a light for `u` in [0, 1)³ (choice, position); `None` if it faces away from `point`.
    #[inline]
    pub fn sample(&self, u: [f32; 3], point: Vec3) -> Option<LightSample> {
        let e = self.emitters.iter().find(|e| u[0] < e.end).or(self.emitters.last())?;
        let on = e.centre + e.half_u * (2.0 * u[1] - 1.0) + e.half_v * (2.0 * u[2] - 1.0);
        let to = on - point;
        let d2 = to.length_squared();
        if d2 < 1e-12 {
            return None;
        }
        let distance = d2.sqrt();
        let direction = to / distance;
        let cos = -e.normal.dot(direction);
        if cos <= 0.0 {
            return None;
        }
        let w = cos / d2;
        Some(LightSample { direction, distance, weight_rgb: e.power_rgb.map(|p| p * w) })
    }
}

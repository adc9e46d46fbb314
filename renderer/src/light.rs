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
    /// Radiance times area.
    power_rgb: [f32; 3],
    /// This light's share of [0, 1).
    start: f32,
    end: f32,
}

impl Emitter {
    #[inline]
    fn sample(&self, u: [f32; 2], point: Vec3) -> Option<LightSample> {
        let on = self.centre + self.half_u * (2.0 * u[0] - 1.0) + self.half_v * (2.0 * u[1] - 1.0);
        let to = on - point;
        let d2 = to.length_squared();
        if d2 < 1e-12 {
            return None;
        }
        let distance = d2.sqrt();
        let direction = to / distance;
        let cos = -self.normal.dot(direction);
        if cos <= 0.0 {
            return None;
        }
        let w = cos / d2;
        Some(LightSample { direction, distance, weight_rgb: self.power_rgb.map(|p| p * w) })
    }
}

/// A light point chosen among one on each light, see [`Lights::choose`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Choice {
    /// Index of the light among those that emit.
    pub light: usize,
    /// Unit direction towards the point.
    pub direction: Vec3,
    /// Distance, mm.
    pub distance: f32,
    /// Estimate of the reflected radiance before shadow, linear RGB.
    pub radiance_rgb: [f32; 3],
}

/// Points that [`Lights::choose`] draws.
pub const DRAWS: usize = 2;
/// Lights that [`Lights::choose`] weighs against each other; of more, one is drawn blindly.
const WEIGHED: usize = 8;

/// The lights of a scene.
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
        }
        Ok(Lights { emitters })
    }

    /// Whether no light emits.
    pub fn is_empty(&self) -> bool {
        self.emitters.is_empty()
    }

    /// How many lights emit.
    pub fn len(&self) -> usize {
        self.emitters.len()
    }

    /// A point on a light for `u` in [0, 1)³ (choice in proportion to area times radiance, position); `None` if
    /// it faces away from `point`.
    #[inline]
    pub fn sample(&self, u: [f32; 3], point: Vec3) -> Option<LightSample> {
        let e = self.emitters.get(self.draw(u[0]))?;
        let mut s = e.sample([u[1], u[2]], point)?;
        s.weight_rgb = s.weight_rgb.map(|w| w / (e.end - e.start));
        Some(s)
    }

    fn draw(&self, u: f32) -> usize {
        self.emitters.iter().position(|e| u < e.end).unwrap_or(self.emitters.len().saturating_sub(1))
    }

    /// One of the points that `u` (in [0, 1)³: choice, position) names on each light, drawn in proportion to what
    /// it would reflect: `reflect` gives scattering times the receiver's cosine towards a direction. Its mean over
    /// `u` is the sum over all lights (importance resampling with one candidate a light, Talbot et al. 2005), as
    /// long as what is in the way is taken into account afterwards. Where that sum stays below `dim` the point is
    /// left out more often the dimmer it is, and made brighter in turn. `None` if nothing is drawn.
    #[inline(always)]
    pub fn choose(
        &self,
        u: [f32; 3],
        point: Vec3,
        dim: f32,
        reflect: impl Fn(Vec3) -> [f32; 3],
    ) -> [Option<Choice>; DRAWS] {
        let candidate = |light: usize, s: LightSample| {
            let f = reflect(s.direction);
            Choice {
                light,
                direction: s.direction,
                distance: s.distance,
                radiance_rgb: std::array::from_fn(|c| f[c] * s.weight_rgb[c]),
            }
        };
        let mean = |c: &Choice| c.radiance_rgb.iter().sum::<f32>() * (1.0 / 3.0);
        let mut candidates = [None; WEIGHED];
        let mut u0 = u[0];
        if self.emitters.len() > WEIGHED {
            let light = self.draw(u0);
            candidates[0] = self.sample(u, point).map(|s| candidate(light, s));
            let e = &self.emitters[light];
            u0 = (u0 - e.start) / (e.end - e.start);
        } else {
            for (i, e) in self.emitters.iter().enumerate() {
                candidates[i] = e.sample([u[1], u[2]], point).map(|s| candidate(i, s));
            }
        }
        let shares = candidates.map(|c| c.as_ref().map_or(0.0, mean));
        let total: f32 = shares.iter().sum();
        let mut drawn = [None; DRAWS];
        if total <= 0.0 {
            return drawn;
        }
        // Evenly spaced marks over the shares; what dim lights leave of the range is nobody's.
        let step = total.max(dim) * (1.0 / DRAWS as f32);
        let mut mark = u0 * step;
        let mut end = 0.0;
        let mut n = 0;
        for (c, share) in candidates.iter().zip(shares) {
            let start = end;
            end += share;
            let mut marks = 0;
            while mark < end && mark >= start && marks < DRAWS - n {
                marks += 1;
                mark += step;
            }
            if let Some(c) = c
                && marks > 0
            {
                let scale = marks as f32 * step / share;
                drawn[n] = Some(Choice { radiance_rgb: c.radiance_rgb.map(|r| r * scale), ..*c });
                n += 1;
            }
        }
        drawn
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `n` lights around +z, of different sizes and colours.
    fn lights(n: usize) -> Lights {
        let make = |i: usize| {
            let x = i as f32;
            AreaLight {
                centre_mm: Vec3::new(300.0 * (1.7 * x).sin(), 250.0 * (2.3 * x).cos(), 700.0),
                half_u_mm: Vec3::NEG_X * (40.0 + 10.0 * x),
                half_v_mm: Vec3::Y * 60.0,
                radiance_rgb: [1.0 + x, 2.0, 0.5 * x],
            }
        };
        Lights::new(&(0..n).map(make).collect::<Vec<_>>()).unwrap()
    }

    /// A lobe, so that lights and places on them differ.
    fn reflect(d: Vec3) -> [f32; 3] {
        let lobe = d.dot(Vec3::new(0.3, 0.2, 0.93)).max(0.0).powi(40);
        [lobe, 0.5 * lobe + 0.01, 0.02]
    }

    #[test]
    fn drawn_points_add_up_to_all_lights_also_behind_a_screen() {
        for (n, dim) in [(3, 0.0f32), (3, 0.01), (WEIGHED + 4, 0.0), (WEIGHED + 4, 0.01)] {
            let lights = lights(n);
            // Half of the directions are hidden after the draw.
            let seen = |d: Vec3| d.x < 0.2;
            let (mut want, mut got, mut squares) = ([0.0f64; 3], [0.0f64; 3], [0.0f64; 3]);
            let cells = 64u32;
            for k in 0..cells * cells {
                let at = |n: u32| (n as f32 + 0.5) / cells as f32;
                for e in &lights.emitters {
                    if let Some(s) =
                        e.sample([at(k % cells), at(k / cells)], Vec3::ZERO).filter(|s| seen(s.direction))
                    {
                        let f = reflect(s.direction);
                        for c in 0..3 {
                            want[c] += f64::from(f[c] * s.weight_rgb[c]) / f64::from(cells * cells);
                        }
                    }
                }
            }
            let sampler = crate::sampler::PixelSampler::new(n as u64);
            let rays = 65_536u32;
            let mut drawn = 0;
            for i in 0..rays {
                let choices = lights.choose(sampler.light(i), Vec3::ZERO, dim, reflect);
                drawn += choices.iter().flatten().count();
                for k in 0..3 {
                    let seen = choices.iter().flatten().filter(|c| seen(c.direction));
                    let sum = seen.map(|c| f64::from(c.radiance_rgb[k])).sum::<f64>();
                    got[k] += sum / f64::from(rays);
                    squares[k] += sum * sum / f64::from(rays);
                }
            }
            for c in 0..3 {
                let error = ((squares[c] - got[c] * got[c]) / f64::from(rays)).sqrt();
                assert!(error < 0.02 * want[c], "channel {c}: standard error {error} of {}", want[c]);
                assert!((got[c] - want[c]).abs() < 4.0 * error, "{n} lights, dim {dim}: {got:?}, {want:?}");
            }
            assert!(dim == 0.0 || drawn < rays as usize * DRAWS, "dim light is left out now and then");
        }
    }
}

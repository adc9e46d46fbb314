//! Rectangular one-sided lights, sampled uniformly over their area, and the environment beside them.
//!
//! Lights neither hide what is behind them nor are seen by cameras; rays that scattering sends out see them.

mod emitter;
mod mix;

use crate::environment::Sky;
use emitter::Emitter;
pub use emitter::LightSample;
use glam::Vec3;
pub use mix::{Mix, Strategy};
use strandbench_scenes::AreaLight;

/// A light point chosen among one on each light, see [`Lights::choose`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Choice {
    /// Index of the light among those that emit; the environment is behind the last.
    pub light: usize,
    /// Unit direction towards the point.
    pub direction: Vec3,
    /// Distance, mm; infinite for the environment.
    pub distance: f32,
    /// Estimate of the reflected radiance before shadow, linear RGB.
    pub radiance_rgb: [f32; 3],
}

/// Lights that [`Lights::choose`] weighs against each other; of more, one is drawn blindly.
pub(crate) const WEIGHED: usize = 16;
/// Rooms for fewer lights cost less to fill.
pub(crate) const FEW: usize = 8;

/// The lights of a scene.
#[derive(Clone, Debug, Default)]
pub struct Lights {
    emitters: Vec<Emitter>,
    sky: Option<Sky>,
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
            if let Some(emitter) = Emitter::of(l) {
                weights.push(f64::from(emitter.area * l.radiance_rgb.iter().sum::<f32>()));
                emitters.push(emitter);
            }
        }
        let total: f64 = weights.iter().sum();
        let mut before = 0.0;
        for (e, w) in emitters.iter_mut().zip(&weights) {
            e.start = (before / total) as f32;
            before += w;
            e.end = (before / total) as f32;
        }
        Ok(Lights { emitters, sky: None })
    }

    /// The same lights below an environment.
    pub fn with_sky(self, sky: Option<Sky>) -> Lights {
        Lights { sky, ..self }
    }

    /// Whether nothing emits.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// How many lights emit, the environment among them.
    pub fn len(&self) -> usize {
        self.emitters.len() + usize::from(self.sky.is_some())
    }

    /// How many rectangles emit.
    pub(crate) fn rectangles(&self) -> usize {
        self.emitters.len()
    }

    /// Direction to a rectangle's centre, and about the irradiance that it gives a surface that faces it; `None` if
    /// it faces away.
    pub(crate) fn towards(&self, light: usize, point: Vec3) -> Option<(Vec3, f32)> {
        let e = &self.emitters[light];
        let s = e.sample([0.5, 0.5], point)?;
        // Close by, a rectangle's solid angle is bounded.
        Some((s.direction, s.weight_rgb.iter().sum::<f32>() * (s.pdf / (s.pdf + 0.2))))
    }

    /// The point that `u` names on a rectangle; `None` if it faces away.
    pub(crate) fn on_rectangle(&self, light: usize, u: [f32; 2], point: Vec3) -> Option<LightSample> {
        self.emitters[light].sample(u, point)
    }

    /// A point on a light for `u` in [0, 1)³ (choice in proportion to area times radiance, position); `None` if
    /// it faces away from `point`.
    #[inline]
    pub fn sample(&self, u: [f32; 3], point: Vec3) -> Option<LightSample> {
        let e = self.emitters.get(self.draw(u[0]))?;
        let mut s = e.sample([u[1], u[2]], point)?;
        s.weight_rgb = s.weight_rgb.map(|w| w / (e.end - e.start));
        s.pdf *= e.end - e.start;
        Some(s)
    }

    fn draw(&self, u: f32) -> usize {
        self.emitters.iter().position(|e| u < e.end).unwrap_or(self.emitters.len().saturating_sub(1))
    }

    /// At most `DRAWS` of the points that `u` (in [0, 1)³: choice, position) names on each light, drawn in
    /// proportion to what they would reflect: `lobe` gives scattering times the receiver's cosine towards a
    /// direction, and the density with which directions of scattering are drawn there, which matters only where
    /// `mix` [leaves](Lights::leaves) light to them. Its mean over `u` is the sum over all lights
    /// (importance resampling with one candidate a light, Talbot et al. 2005), each candidate times its weight in
    /// `mix`, as long as what is in the way is taken into account afterwards. Where that sum stays below `dim`
    /// points are left out more often the dimmer it is, and made brighter in turn.
    #[inline(always)]
    pub fn choose<const DRAWS: usize>(
        &self,
        u: [f32; 3],
        point: Vec3,
        dim: f32,
        mix: Mix,
        lobe: impl Fn(Vec3) -> ([f32; 3], f32),
    ) -> [Option<Choice>; DRAWS] {
        if self.emitters.len() <= FEW || self.emitters.len() > WEIGHED {
            self.choose_among::<DRAWS, { FEW + 1 }>(u, point, dim, mix, lobe)
        } else {
            self.choose_among::<DRAWS, { WEIGHED + 1 }>(u, point, dim, mix, lobe)
        }
    }

    /// What the points that `u` names on each rectangle reflect together, each times what `visible` says is seen of its
    /// rectangle; `lobe` and `mix` as for [`Lights::choose`].
    #[inline(always)]
    pub(crate) fn seen_in_part(
        &self,
        u: [f32; 3],
        point: Vec3,
        mix: Mix,
        visible: &[f32],
        lobe: impl Fn(Vec3) -> ([f32; 3], f32),
    ) -> [f32; 3] {
        let mut rgb = [0.0; 3];
        if mix.strategy == Strategy::Scattering {
            return rgb;
        }
        for (e, &share) in self.emitters.iter().zip(visible).filter(|(_, share)| **share > 0.0) {
            if let Some(s) = e.sample([u[1], u[2]], point) {
                let light = mix.reflected(&s, e.is_small(point), &lobe);
                rgb = std::array::from_fn(|c| rgb[c] + share * light[c]);
            }
        }
        rgb
    }

    /// With room for `ROOM` candidates, the environment in the last.
    #[inline(always)]
    fn choose_among<const DRAWS: usize, const ROOM: usize>(
        &self,
        u: [f32; 3],
        point: Vec3,
        dim: f32,
        mix: Mix,
        lobe: impl Fn(Vec3) -> ([f32; 3], f32),
    ) -> [Option<Choice>; DRAWS] {
        let mut drawn = [None; DRAWS];
        if mix.strategy == Strategy::Scattering {
            return drawn;
        }
        let candidate = |light: usize, s: LightSample, small: bool| Choice {
            light,
            direction: s.direction,
            distance: s.distance,
            radiance_rgb: mix.reflected(&s, small, &lobe),
        };
        let mean = |c: &Choice| c.radiance_rgb.iter().sum::<f32>() * (1.0 / 3.0);
        let mut candidates = [None; ROOM];
        let mut u0 = u[0];
        if self.emitters.len() > WEIGHED {
            let light = self.draw(u0);
            let e = &self.emitters[light];
            candidates[0] = self.sample(u, point).map(|s| candidate(light, s, e.is_small(point)));
            u0 = ((u0 - e.start) / (e.end - e.start)).clamp(0.0, 1.0);
        } else {
            for (i, e) in self.emitters.iter().enumerate() {
                let s = e.sample([u[1], u[2]], point);
                candidates[i] = s.map(|s| candidate(i, s, e.is_small(point)));
            }
        }
        if let Some(sky) = &self.sky {
            let s = sky.sample([u[1], u[2]]);
            let s = LightSample {
                direction: s.direction,
                distance: f32::INFINITY,
                weight_rgb: s.weight_rgb,
                pdf: s.pdf,
            };
            candidates[ROOM - 1] = Some(candidate(self.emitters.len(), s, false));
        }
        let shares = candidates.map(|c| c.as_ref().map_or(0.0, mean));
        let total: f32 = shares.iter().sum();
        if total.is_nan() || total <= 0.0 {
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

    /// Whether `mix` leaves any light at `point` to directions of scattering.
    #[inline]
    pub fn leaves(&self, point: Vec3, mix: Mix) -> bool {
        match mix.strategy {
            Strategy::Lights => false,
            Strategy::Scattering => !self.is_empty(),
            Strategy::Both => self.sky.is_some() || self.emitters.iter().any(|e| !e.is_small(point)),
        }
    }

    /// Whether a ray from `origin` in a direction of scattering could find light that `mix` leaves to it.
    #[inline]
    pub fn reach(&self, origin: Vec3, direction: Vec3, mix: Mix) -> bool {
        mix.strategy != Strategy::Lights
            && (self.sky.is_some()
                || self.emitters.iter().any(|e| {
                    !(mix.strategy == Strategy::Both && e.is_small(origin))
                        && e.meet(origin, direction).is_some()
                }))
    }

    /// The light that a ray in a direction of scattering, of density `pdf`, finds before `distance` (infinite if
    /// the ray meets nothing), each light times its weight in `mix`.
    #[inline]
    pub fn seen(&self, origin: Vec3, direction: Vec3, distance: f32, pdf: f32, mix: Mix) -> [f32; 3] {
        let mut rgb = [0.0; 3];
        if mix.strategy == Strategy::Lights {
            return rgb;
        }
        let blind = self.emitters.len() > WEIGHED;
        let both = mix.strategy == Strategy::Both;
        for e in &self.emitters {
            if both && e.is_small(origin) {
                continue;
            }
            if let Some((t, density)) = e.meet(origin, direction)
                && t < distance
            {
                let density = if blind { density * (e.end - e.start) } else { density };
                let weight = (1.0 - mix.of_light(density, pdf)) / e.area;
                rgb = std::array::from_fn(|c| rgb[c] + e.power_rgb[c] * weight);
            }
        }
        if let Some(sky) = &self.sky
            && distance == f32::INFINITY
        {
            let (radiance, density) = sky.radiance_pdf(direction);
            let weight = 1.0 - mix.of_light(density, pdf);
            rgb = std::array::from_fn(|c| rgb[c] + radiance[c] * weight);
        }
        rgb
    }
}

#[cfg(test)]
mod tests;

//! Light below the skin: irradiance on the mesh, spread as skin spreads it, shared by all views of a frame.

mod patch;
mod spread;
#[cfg(test)]
mod tests;

use crate::light::Strategy;
use crate::path::{Draws, Scratch, Walk, Work};
use crate::sampler::PixelSampler;
use crate::scene::RenderScene;
use crate::vertex::{Lobe, SURFACE_OFFSET_MM, SurfacePoint, Vertex};
use crate::{RenderError, Settings};
use glam::Vec3;
use patch::{Patches, hat};
use rayon::prelude::*;
use spread::Sheet;
use std::sync::Arc;
use strandbench_rng::Rng;
use strandbench_scenes::face::Tissue;
use strandbench_types::{Cancelled, Monitor};

/// Skin's diffusion profile as a sum of Gaussians (d'Eon, Luebke and Enderton 2007, Figure 12): variance in mm², and
/// weights of red, green and blue, which sum to 1 over the Gaussians.
pub const PROFILE: [(f64, [f64; 3]); 6] = [
    (0.0064, [0.233, 0.455, 0.649]),
    (0.0484, [0.100, 0.336, 0.344]),
    (0.187, [0.118, 0.198, 0.0]),
    (0.567, [0.113, 0.007, 0.007]),
    (1.99, [0.358, 0.004, 0.0]),
    (7.41, [0.078, 0.0, 0.0]),
];

/// Light that spreads less than this, mm, leaves where it enters: about half of what vertices of a face are apart.
const LOCAL_MM: f64 = 0.5;
/// Standard deviation of the smoothing of light that comes by way of hair and other skin, mm.
const INDIRECT_MM: f64 = 2.0;
const SKIN_KEY: u64 = 0x736b_696e;

/// What the light below depends on beside the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct GlowKey {
    seed: u64,
    depth: u32,
    paths: u32,
    clamp: u32,
}

/// Light from below the skin of one frame, for any camera.
///
/// Around each vertex paths end on points spread over its triangles (with the vertex's hat function as their density):
/// direct light from points on lights, shadowed by hair and skin, and what further scatterings in hair and on skin
/// bring. This transmitted irradiance is spread over the mesh by the Gaussians of skin's profile, by channel, red
/// farthest: heat flow on the surface, implicit and of exact total, in place of a convolution. Gaussians narrower than
/// half a millimetre count as a point: their share of direct light is found at each hit by its own shadow rays, so that
/// hairs cast sharp shadows and relief shades. A camera ray that meets skin gets this, the wider shares interpolated,
/// and indirect light smoothed by 2 mm, all times the texture's albedo there, times what the coat lets out. Other paths
/// that meet skin end there, with the same light less the fine shadows.
///
/// Left out: light through thin parts (ears, nostrils, lids against the light), for it goes along the surface alone;
/// spreading between parts of the mesh that touch without being joined (closed lips); what the coat reflects of hair
/// and skin rather than of lights, for cameras and for paths; relief in the shares that spread; albedo of the way
/// below the skin (it is that of the place where light leaves). Single scattering is within the narrowest Gaussian.
#[derive(Clone, Debug)]
pub struct SkinLight {
    /// Indexed `[surface]`; nothing for those without skin.
    surfaces: Vec<Option<Glow>>,
    /// Part of direct light that leaves where it enters, linear RGB.
    local: [f32; 3],
    /// Rays that were traced.
    pub(crate) rays: u64,
}

/// In units of radiance below a white, uncoated surface (irradiance over π), linear RGB, indexed `[vertex]`.
#[derive(Clone, Debug)]
struct Glow {
    /// All but the local part of direct light.
    beside: Vec<Vec3>,
    /// All.
    whole: Vec<Vec3>,
}

impl SkinLight {
    /// What leaves towards a camera besides direct light, and the vertex less the light that is in it already; `None` on
    /// anything but skin.
    #[inline]
    pub(crate) fn beside(&self, vertex: &mut Vertex<'_>) -> Option<[f32; 3]> {
        let rgb = self.out(vertex, |g| &g.beside)?;
        if let Lobe::Skin(s) = &vertex.lobe {
            let albedo = s.albedo_rgb();
            vertex.lobe = Lobe::Skin(s.with_albedo(std::array::from_fn(|c| albedo[c] * self.local[c])));
        }
        Some(rgb)
    }

    /// All that leaves towards a vertex before; `None` on anything but skin.
    #[inline]
    pub(crate) fn leaving(&self, vertex: &Vertex<'_>) -> Option<[f32; 3]> {
        self.out(vertex, |g| &g.whole)
    }

    fn out(&self, vertex: &Vertex<'_>, which: impl Fn(&Glow) -> &Vec<Vec3>) -> Option<[f32; 3]> {
        let (at, Lobe::Skin(skin)) = (vertex.below?, &vertex.lobe) else { return None };
        let glow = which(self.surfaces[at.surface].as_ref()?);
        let light: Vec3 = (0..3).map(|k| glow[at.corners[k]] * at.weights[k]).sum();
        let (albedo, out) = (skin.albedo_rgb(), skin.through_out());
        Some(std::array::from_fn(|c| albedo[c] * out * light[c]))
    }
}

impl RenderScene<'_> {
    /// Works out what all views of these settings and this seed share, which the first of them would do otherwise.
    ///
    /// # Errors
    /// If the settings contradict each other, or the work is cancelled.
    pub fn prepare(&self, settings: &Settings, seed: u64, monitor: &dyn Monitor) -> Result<(), RenderError> {
        settings.validate(1)?;
        self.light_below(settings, seed, monitor).map(|_| ())
    }

    /// The light below the skin, found once for all views; `None` if the scene's skin spreads none.
    pub(crate) fn light_below(
        &self,
        settings: &Settings,
        seed: u64,
        monitor: &dyn Monitor,
    ) -> Result<Option<Arc<SkinLight>>, RenderError> {
        let skin = |s: &strandbench_scenes::Surface| {
            s.detail.as_ref().is_some_and(|d| d.tissue == Tissue::Skin) && !s.mesh.triangles.is_empty()
        };
        if self.scene.skin.scatter_mm == 0.0 || !self.scene.surfaces.iter().any(skin) {
            return Ok(None);
        }
        let (depth, paths) = (settings.depth, settings.skin_paths);
        let key = GlowKey { seed, depth, paths, clamp: settings.clamp.to_bits() };
        let kept =
            |slot: &Option<(GlowKey, Arc<SkinLight>)>| slot.clone().filter(|k| k.0 == key).map(|k| k.1);
        // The lock is not held while threads work: one that waits for it might be asked to work.
        if let Some(light) = self.glow.lock().ok().and_then(|slot| kept(&slot)) {
            return Ok(Some(light));
        }
        let light = Arc::new(self.find_light(settings, seed, monitor, skin)?);
        if let Ok(mut slot) = self.glow.lock() {
            *slot = Some((key, light.clone()));
        }
        Ok(Some(light))
    }

    fn find_light(
        &self,
        settings: &Settings,
        seed: u64,
        monitor: &dyn Monitor,
        skin: impl Fn(&strandbench_scenes::Surface) -> bool,
    ) -> Result<SkinLight, RenderError> {
        let scale = f64::from(self.scene.skin.scatter_mm) / PROFILE[5].0.sqrt();
        let wide = |variance: f64| variance.sqrt() * scale >= LOCAL_MM;
        let mut local = [0.0f64; 3];
        for (_, weights) in PROFILE.iter().filter(|g| !wide(g.0)) {
            (0..3).for_each(|c| local[c] += weights[c]);
        }
        let mut out = SkinLight { surfaces: Vec::new(), local: local.map(|v| v as f32), rays: 0 };
        for (i, s) in self.scene.surfaces.iter().enumerate() {
            if !skin(s) {
                out.surfaces.push(None);
                continue;
            }
            let (direct, mut indirect, rays) = self.irradiance(i, settings, seed, monitor)?;
            out.rays += rays;
            let sheet = Sheet::new(&s.mesh);
            sheet.spread(&mut indirect, INDIRECT_MM * INDIRECT_MM);
            let total: Vec<[f64; 3]> =
                direct.iter().zip(&indirect).map(|(d, i)| std::array::from_fn(|c| d[c] + i[c])).collect();
            let mut spread = total.clone();
            let mut before = 0.0;
            let mut below = vec![[0.0f64; 3]; total.len()];
            for (variance, weights) in PROFILE.iter().filter(|g| wide(g.0)) {
                monitor.check()?;
                let variance = variance * scale * scale;
                sheet.spread(&mut spread, variance - before);
                before = variance;
                for (b, s) in below.iter_mut().zip(&spread) {
                    (0..3).for_each(|c| b[c] += weights[c] * s[c]);
                }
            }
            let with = |here: &[[f64; 3]]| -> Vec<Vec3> {
                let sum = |(b, h): (&[f64; 3], &[f64; 3])| {
                    Vec3::from_array(std::array::from_fn(|c| (b[c] + local[c] * h[c]) as f32))
                };
                below.iter().zip(here).map(sum).collect()
            };
            out.surfaces.push(Some(Glow { beside: with(&indirect), whole: with(&total) }));
        }
        Ok(out)
    }

    /// Direct and indirect light at each vertex of a surface, and the rays that they took.
    #[expect(clippy::type_complexity, reason = "two fields and a count, used once")]
    fn irradiance(
        &self,
        which: usize,
        settings: &Settings,
        seed: u64,
        monitor: &dyn Monitor,
    ) -> Result<(Vec<[f64; 3]>, Vec<[f64; 3]>, u64), RenderError> {
        let mesh = &self.scene.surfaces[which].mesh;
        let patches = Patches::new(mesh);
        let full_scale = self.scene.sensor.full_scale_radiance;
        let walk = Walk {
            depth: settings.depth,
            strategy: Strategy::Lights,
            every: 1,
            thorough: false,
            most_radiance: settings.clamp * full_scale,
            full_scale,
            polarised: false,
        };
        const LOT: usize = 256;
        let lots = mesh.vertices.len().div_ceil(LOT);
        monitor.begin("light below the skin", lots as u64);
        let one = |lot: usize| -> Result<Vec<([f64; 3], [f64; 3], u64)>, Cancelled> {
            monitor.check()?;
            let mut scratch = Scratch::new(self.lights.len(), None);
            let last = ((lot + 1) * LOT).min(mesh.vertices.len());
            let made = (lot * LOT..last)
                .map(|v| self.at_vertex(which, v, &patches, settings.skin_paths, &walk, seed, &mut scratch))
                .collect();
            monitor.advance(1);
            Ok(made)
        };
        let lots: Vec<_> = (0..lots).into_par_iter().map(one).collect::<Result<_, _>>()?;
        let (mut direct, mut indirect, mut rays) = (Vec::new(), Vec::new(), 0);
        for (d, i, n) in lots.into_iter().flatten() {
            direct.push(d);
            indirect.push(i);
            rays += n;
        }
        Ok((direct, indirect, rays))
    }

    #[expect(clippy::too_many_arguments, reason = "what one vertex needs")]
    fn at_vertex(
        &self,
        which: usize,
        vertex: usize,
        patches: &Patches,
        paths: u32,
        walk: &Walk,
        seed: u64,
        scratch: &mut Scratch<'_>,
    ) -> ([f64; 3], [f64; 3], u64) {
        let key = Rng::keyed(&[seed, SKIN_KEY, which as u64, vertex as u64]).next_u64();
        let sampler = PixelSampler::new(key);
        let (mut direct, mut indirect) = ([0.0f64; 3], [0.0f64; 3]);
        let mut work = Work::default();
        for index in 0..paths {
            let ([u, v], [w, ..]) = (sampler.film(index), sampler.lens(index));
            let Some(triangle) = patches.draw(vertex, w) else { continue };
            let here = hat(u);
            let at = self.receiver(which, triangle, vertex, [here, (1.0 - here) * v]);
            let light = self.direct_light(&at, None, sampler.light(index), walk, scratch, &mut work);
            let draws = Draws { sampler: &sampler, index, key };
            let more = match walk.depth {
                1 => [0.0; 3],
                _ => self.followed_light(at, None, draws, walk, None, scratch, &mut work),
            };
            for c in 0..3 {
                direct[c] += if light[c].is_finite() { f64::from(light[c]) } else { 0.0 };
                indirect[c] += if more[c].is_finite() { f64::from(more[c]) } else { 0.0 };
            }
        }
        let mean = |sum: [f64; 3]| sum.map(|v| v / f64::from(paths));
        (mean(direct), mean(indirect), work.shadow + work.bounce)
    }

    /// A point on the outside of a triangle: weights of the corner `vertex` and of the one after it.
    fn receiver(&self, which: usize, triangle: usize, vertex: usize, [here, next]: [f32; 2]) -> Vertex<'_> {
        let s = &self.scene.surfaces[which];
        let mut corners = s.mesh.triangles[triangle].map(|k| k as usize);
        while corners[0] != vertex && corners.contains(&vertex) {
            corners.rotate_left(1);
        }
        let weights = [here, next, 1.0 - here - next];
        let mix = |of: &[Vec3]| (0..3).map(|k| of[corners[k]] * weights[k]).sum::<Vec3>();
        let [a, b, c] = corners.map(|k| s.mesh.vertices[k]);
        let face = (b - a).cross(c - a).normalize_or_zero();
        let normal = mix(&self.normals[which]).try_normalize().unwrap_or(face);
        let position_mm = mix(&s.mesh.vertices);
        let skin = match &s.detail {
            Some(d) => {
                let stubble = (0..3).map(|k| d.stubble[corners[k]] * weights[k]).sum();
                let look = d.look(mix(&d.rest), stubble);
                self.skin.varied(look.coat, look.roughness)
            }
            None => self.skin,
        };
        Vertex {
            surface: SurfacePoint { position_mm, normal: face, tangent: Vec3::ZERO },
            start: position_mm + face * SURFACE_OFFSET_MM,
            skip: None,
            lobe: Lobe::Skin(skin.receiver(normal, face)),
            below: None,
            hit: None,
        }
    }
}

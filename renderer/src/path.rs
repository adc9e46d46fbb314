//! Paths of light beyond the first scattering (Kajiya 1986), with light drawn at every vertex.

use crate::accel::{Beam, Hit, LastBlockers};
use crate::guide::Guide;
use crate::light::{Mix, Strategy, WEIGHED};
use crate::sampler::PixelSampler;
use crate::scene::RenderScene;
use crate::shadows::Shadows;
use crate::skin_light::SkinLight;
use crate::vertex::Vertex;
use glam::Vec3;
use strandbench_rng::Rng;

/// Unshadowed radiance, relative to the sensor's full scale, below which a point gets fewer shadow rays.
const DIM: f32 = 0.1;
/// A path goes on with the probability of its throughput times this, at most 1 (Russian roulette, unbiased). Of 0.5
/// to 100 this took least time times variance on straight blonde hair.
const ROULETTE: f32 = 3.0;
/// Rays and mishaps.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Work {
    pub primary: u64,
    pub shadow: u64,
    pub bounce: u64,
    pub not_finite: u64,
}

/// How paths are followed in one view.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Walk {
    /// Most scatterings of a path.
    pub depth: u32,
    pub strategy: Strategy,
    /// One camera ray of so many is followed beyond its first vertex.
    pub every: u32,
    /// Largest radiance of what one path brings from beyond its first vertex; 0 for no limit.
    pub most_radiance: f32,
    /// Whether up to one shadow ray for each light is traced at the first vertex and four at each later one, not two and one.
    pub thorough: bool,
    /// Sensor's full scale.
    pub full_scale: f32,
    /// Whether the camera sees no light that one reflection at a surface sends from a light.
    pub polarised: bool,
}

impl Walk {
    /// How the ways of finding light share it at the first vertex.
    pub fn first_mix(&self) -> Mix {
        Mix { strategy: self.strategy, share: 1.0 / self.every as f32 }
    }
}

/// What a thread keeps while it renders a tile.
pub(crate) struct Scratch<'a> {
    /// Indexed [light]: blockers of first vertices, and of all others.
    first: Vec<LastBlockers>,
    later: Vec<LastBlockers>,
    /// Of points that are looked for to be kept.
    kept: Vec<LastBlockers>,
    shadows: Option<&'a Shadows>,
    /// Of the pixel that is worked on, if it was begun there.
    pub beam: Beam,
}

impl<'a> Scratch<'a> {
    pub fn new(lights: usize, shadows: Option<&'a Shadows>) -> Scratch<'a> {
        let none = || vec![LastBlockers::default(); lights];
        Scratch { first: none(), later: none(), kept: none(), shadows, beam: Beam::default() }
    }
}

/// The part of the followed samples: their index, and the sampler of their pixel.
#[derive(Clone, Copy)]
pub(crate) struct Draws<'a> {
    pub sampler: &'a PixelSampler,
    pub index: u32,
    pub key: u64,
}

fn add(sum: &mut [f32; 3], factor: [f32; 3], value: [f32; 3]) {
    for c in 0..3 {
        sum[c] += factor[c] * value[c];
    }
}

fn distance(hit: &Option<Hit>) -> f32 {
    match hit {
        None => f32::INFINITY,
        Some(Hit::Fibre { t, .. } | Hit::Mesh { t, .. }) => *t,
    }
}

/// Scattering towards a light, and the density of directions of scattering there.
#[inline(always)]
fn towards<const POLARISED: bool>(
    vertex: &Vertex<'_>,
    guide: Option<&Guide>,
) -> impl Fn(Vec3) -> ([f32; 3], f32) {
    move |to_light| match guide {
        None if POLARISED => (vertex.lobe.depolarised(to_light), 0.0),
        None => (vertex.lobe.eval(to_light), 0.0),
        Some(guide) if POLARISED => {
            let pdf = vertex.lobe.eval_pdf(to_light).1;
            (vertex.lobe.depolarised(to_light), guide.pdf(to_light, pdf))
        }
        Some(guide) => {
            let (eval, pdf) = vertex.lobe.eval_pdf(to_light);
            (eval, guide.pdf(to_light, pdf))
        }
    }
}

impl RenderScene<'_> {
    /// What directions of scattering follow at a vertex.
    fn guide(&self, vertex: &Vertex<'_>) -> Guide {
        Guide::new(&self.lights, vertex.surface.position_mm, vertex.surface.tangent, &vertex.lobe)
    }

    /// The guide, where points on lights leave light to directions of scattering.
    pub(crate) fn guide_beside_lights(&self, vertex: &Vertex<'_>, mix: Mix) -> Option<Guide> {
        self.lights.leaves(vertex.surface.position_mm, mix).then(|| self.guide(vertex))
    }

    /// Light from lights by one scattering at the first vertex: drawn among one point on each, shadowed. `guide` is
    /// that of [`RenderScene::guide_beside_lights`] with the walk's [`Walk::first_mix`].
    pub(crate) fn direct_light(
        &self,
        vertex: &Vertex<'_>,
        guide: Option<&Guide>,
        u: [f32; 3],
        walk: &Walk,
        scratch: &mut Scratch<'_>,
        work: &mut Work,
    ) -> [f32; 3] {
        self.first_light(vertex, guide, walk.first_mix(), walk.thorough, u, walk, scratch, work)
    }

    /// The same on skin whose light below is known, by points on lights alone: one shadow ray for each light if `all`,
    /// else two.
    pub(crate) fn direct_light_on_skin(
        &self,
        vertex: &Vertex<'_>,
        all: bool,
        u: [f32; 3],
        walk: &Walk,
        scratch: &mut Scratch<'_>,
        work: &mut Work,
    ) -> [f32; 3] {
        let mix = Mix { strategy: Strategy::Lights, share: 1.0 };
        self.first_light(vertex, None, mix, all, u, walk, scratch, work)
    }

    fn first_light(
        &self,
        vertex: &Vertex<'_>,
        guide: Option<&Guide>,
        mix: Mix,
        all: bool,
        u: [f32; 3],
        walk: &Walk,
        scratch: &mut Scratch<'_>,
        work: &mut Work,
    ) -> [f32; 3] {
        let kept = match walk.polarised {
            true => self.light_of_kept_shadows::<true>(vertex, guide, mix, u, scratch, work),
            false => self.light_of_kept_shadows::<false>(vertex, guide, mix, u, scratch, work),
        };
        if let Some(rgb) = kept {
            return rgb;
        }
        let (dim, blockers, rays) = (DIM * walk.full_scale, &mut scratch.first, &mut work.shadow);
        match (all, walk.polarised) {
            (true, false) => self.drawn_light::<WEIGHED, false>(vertex, guide, u, dim, mix, blockers, rays),
            (true, true) => self.drawn_light::<WEIGHED, true>(vertex, guide, u, dim, mix, blockers, rays),
            (false, false) => self.drawn_light::<2, false>(vertex, guide, u, dim, mix, blockers, rays),
            (false, true) => self.drawn_light::<2, true>(vertex, guide, u, dim, mix, blockers, rays),
        }
    }

    /// Light from lights by one scattering, from one point on each and with the shadows that are kept; `None` where none are.
    fn light_of_kept_shadows<const POLARISED: bool>(
        &self,
        vertex: &Vertex<'_>,
        guide: Option<&Guide>,
        mix: Mix,
        u: [f32; 3],
        scratch: &mut Scratch<'_>,
        work: &mut Work,
    ) -> Option<[f32; 3]> {
        let visible = scratch.shadows?.at(self, vertex.hit.as_ref()?, &mut scratch.kept, work)?;
        let point = vertex.surface.position_mm;
        Some(self.lights.seen_in_part(u, point, mix, &visible, towards::<POLARISED>(vertex, guide)))
    }

    fn drawn_light<const DRAWS: usize, const POLARISED: bool>(
        &self,
        vertex: &Vertex<'_>,
        guide: Option<&Guide>,
        u: [f32; 3],
        dim: f32,
        mix: Mix,
        blockers: &mut [LastBlockers],
        shadow_rays: &mut u64,
    ) -> [f32; 3] {
        let point = vertex.surface.position_mm;
        let choices = self.lights.choose::<DRAWS>(u, point, dim, mix, towards::<POLARISED>(vertex, guide));
        let mut rgb = [0.0; 3];
        for c in choices.iter().flatten() {
            *shadow_rays += 1;
            let blockers = &mut blockers[c.light];
            if !self.accel.occluded(vertex.start, c.direction, c.distance, vertex.skip, blockers) {
                rgb = std::array::from_fn(|k| rgb[k] + c.radiance_rgb[k]);
            }
        }
        rgb
    }

    /// Light that scattering at the first vertex finds: on lights, what [`RenderScene::direct_light`] leaves to it,
    /// and from further vertices, up to the walk's depth. `guide` as there. Paths end where they meet skin whose light is known.
    pub(crate) fn followed_light(
        &self,
        first: Vertex<'_>,
        guide: Option<Guide>,
        draws: Draws<'_>,
        walk: &Walk,
        light: Option<&SkinLight>,
        scratch: &mut Scratch<'_>,
        work: &mut Work,
    ) -> [f32; 3] {
        let mut rng = Rng::keyed(&[draws.key, u64::from(draws.index)]);
        let mut rgb = [0.0; 3];
        let mut throughput = [1.0f32; 3];
        let (mut vertex, mut known) = (first, guide);
        let mut mix = walk.first_mix();
        for scattering in 1..=walk.depth {
            let point = vertex.surface.position_mm;
            let last = scattering == walk.depth;
            if last && !self.lights.leaves(point, mix) {
                break;
            }
            let u = match scattering {
                1 => draws.sampler.scattering(draws.index),
                _ => std::array::from_fn(|_| rng.f32()),
            };
            let guide = known.take().unwrap_or_else(|| self.guide(&vertex));
            let Some(drawn) = guide.sample(&vertex.lobe, u) else { break };
            for c in 0..3 {
                throughput[c] *= drawn.weight_rgb[c];
            }
            let direction = drawn.to_light;
            if last && !self.lights.reach(point, direction, mix) {
                break;
            }
            work.bounce += 1;
            let hit = self.accel.closest_after(vertex.start, direction, vertex.skip);
            let seen = self.lights.seen(point, direction, distance(&hit), drawn.pdf, mix);
            if walk.polarised && scattering == 1 {
                add(&mut rgb, vertex.lobe.depolarised(direction).map(|f| f / drawn.pdf), seen);
            } else {
                add(&mut rgb, throughput, seen);
            }
            let Some(hit) = hit.filter(|_| !last) else { break };
            vertex = self.vertex(&hit, vertex.start, direction);
            if let Some(light) = light
                && let Some(glow) = light.leaving(&vertex)
            {
                add(&mut rgb, throughput, glow);
                break;
            }
            let carried = throughput.iter().fold(0.0f32, |a, &b| a.max(b));
            if carried <= 0.0 {
                break;
            }
            let survival = (carried * ROULETTE).min(1.0);
            mix.share = survival;
            let u = match scattering {
                1 => draws.sampler.second_light(draws.index),
                _ => std::array::from_fn(|_| rng.f32()),
            };
            let dim = DIM * walk.full_scale / carried;
            known = self.guide_beside_lights(&vertex, mix);
            let guide = known.as_ref();
            let kept = self.light_of_kept_shadows::<false>(&vertex, guide, mix, u, scratch, work);
            let (blockers, rays) = (&mut scratch.later, &mut work.shadow);
            let found = kept.unwrap_or_else(|| match walk.thorough {
                true => self.drawn_light::<4, false>(&vertex, guide, u, dim, mix, blockers, rays),
                false => self.drawn_light::<1, false>(&vertex, guide, u, dim, mix, blockers, rays),
            });
            add(&mut rgb, throughput, found);
            if rng.f32() >= survival {
                break;
            }
            throughput = throughput.map(|t| t / survival);
        }
        let brightest = rgb.iter().fold(0.0f32, |a, &b| a.max(b));
        if walk.most_radiance > 0.0 && brightest > walk.most_radiance {
            rgb = rgb.map(|v| v * walk.most_radiance / brightest);
        }
        rgb
    }
}

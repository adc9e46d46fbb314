//! One camera's view: tiles of pixels, adaptive sampling, the identity buffer.

mod rays;

use crate::accel::Hit;
use crate::footprint::Footprint;
use crate::lens::{CameraRay, RayMaker};
use crate::path::{Draws, Scratch, Walk};
use crate::sampler::PixelSampler;
use crate::scene::RenderScene;
use crate::shadows::Shadows;
use crate::skin_light::SkinLight;
use crate::tile::{Assembly, TILE, Tile};
use crate::{Render, RenderError, Settings};
use rayon::prelude::*;
use std::sync::Arc;
use std::time::Instant;
use strandbench_types::{Cancelled, Monitor};

/// Rays added to a pixel that has not converged, before it is looked at again.
const BATCH: u32 = 16;

/// Tiles that are worked on together, for each thread.
const TILES_A_THREAD: usize = 24;

/// What all tiles of a view share.
pub(crate) struct View<'a> {
    pub scene: &'a RenderScene<'a>,
    pub settings: &'a Settings,
    pub walk: Walk,
    maker: RayMaker,
    pinhole: bool,
    pub footprint: Footprint,
    pub width: usize,
    pub height: usize,
    camera: usize,
    seed: u64,
    light: Option<Arc<SkinLight>>,
    pub shadows: Option<Arc<Shadows>>,
}

impl View<'_> {
    fn tile(&self, x0: usize, y0: usize) -> Tile {
        let mut tile = Tile::default();
        let mut scratch = Scratch::new(self.scene.lights.len(), self.shadows.as_deref());
        let mut groups = Vec::new();
        for y in y0..(y0 + TILE).min(self.height) {
            for x in x0..(x0 + TILE).min(self.width) {
                self.pixel(x, y, &mut tile, &mut scratch, &mut groups);
            }
        }
        tile
    }

    /// Radiance as the sensor weighs it.
    pub(crate) fn mono(&self, rgb: &[f32; 3]) -> f64 {
        let weights = self.scene.scene.sensor.response_rgb;
        (0..3).map(|c| f64::from(rgb[c] * weights[c])).sum()
    }

    /// One camera ray's light; `begun` says whether the pixel's beam was.
    fn sample(
        &self,
        at: (usize, usize),
        draws: Draws<'_>,
        (followed, begun): (Option<u32>, bool),
        tile: &mut Tile,
        scratch: &mut Scratch<'_>,
    ) -> ([f32; 3], [f32; 3]) {
        let n = draws.index;
        let ray = self.camera_ray(at, draws.sampler, n);
        let hit = self.meet(&ray, begun.then_some(&mut scratch.beam), tile);
        // Pixels that need more than the first samples do so for the sake of edges, not of shadows.
        let first = n < self.settings.samples_per_pixel;
        if first {
            let seen = self.identity(at, draws.sampler, n, (&ray, hit.as_ref()), tile);
            tile.hits.extend(seen);
        }
        match hit {
            None => (self.scene.scene.background_rgb, [0.0; 3]),
            Some(hit) => self.light((&ray, &hit), draws, followed, first, tile, scratch),
        }
    }

    /// Light that leaves a hit: direct, with all lights on skin if `all`, and what following it brings if `followed`
    /// says so.
    pub(crate) fn light(
        &self,
        (ray, hit): (&CameraRay, &Hit),
        draws: Draws<'_>,
        followed: Option<u32>,
        all: bool,
        tile: &mut Tile,
        scratch: &mut Scratch<'_>,
    ) -> ([f32; 3], [f32; 3]) {
        let scene = self.scene;
        let mut vertex = scene.vertex(hit, ray.origin, ray.direction);
        let light = self.light.as_deref();
        let u = draws.sampler.light(draws.index);
        if let Some(glow) = light.and_then(|l| l.beside(&mut vertex)) {
            // All that scattering would find is in the light below; the coat reflects lights alone.
            let direct = scene.direct_light_on_skin(&vertex, all, u, &self.walk, scratch, &mut tile.work);
            return (tile.finite(std::array::from_fn(|c| direct[c] + glow[c])), [0.0; 3]);
        }
        let guide = scene.guide_beside_lights(&vertex, self.walk.first_mix());
        let direct = scene.direct_light(&vertex, guide.as_ref(), u, &self.walk, scratch, &mut tile.work);
        let more = followed.map_or([0.0; 3], |index| {
            let draws = Draws { index, ..draws };
            scene.followed_light(vertex, guide, draws, &self.walk, light, scratch, &mut tile.work)
        });
        (tile.finite(direct), tile.finite(more))
    }

    /// What following a hit on a fibre brings, see [`View::light`].
    pub(crate) fn followed(
        &self,
        (ray, hit): (&CameraRay, &Hit),
        draws: Draws<'_>,
        tile: &mut Tile,
        scratch: &mut Scratch<'_>,
    ) -> [f32; 3] {
        let vertex = self.scene.vertex(hit, ray.origin, ray.direction);
        let guide = self.scene.guide_beside_lights(&vertex, self.walk.first_mix());
        let light = self.light.as_deref();
        let work = &mut tile.work;
        let more = self.scene.followed_light(vertex, guide, draws, &self.walk, light, scratch, work);
        tile.finite(more)
    }

    fn pixel(&self, x: usize, y: usize, tile: &mut Tile, scratch: &mut Scratch<'_>, groups: &mut Vec<f64>) {
        if !self.footprint.covers(x, y) {
            tile.empty(self.scene.scene.background_rgb);
            return;
        }
        let key = self.key(x, y);
        let sampler = PixelSampler::new(key);
        let (first, most) = (self.settings.samples_per_pixel, self.settings.max_samples_per_pixel);
        let every = self.walk.every;
        let hits_before = tile.hits.len();
        let mut sum = [0.0f64; 3];
        // Welford's running mean and sum of squared deviations of the sensor-weighted radiance of groups: one
        // followed camera ray and as many others as come on one.
        let (mut mean, mut squares, mut count) = (0.0f64, 0.0f64, 0u32);
        let goal = (f64::from(self.settings.noise_target)
            * f64::from(self.scene.scene.sensor.full_scale_radiance))
        .powi(2);
        let begun = self.begin(&mut scratch.beam, (x, y), first);
        let mut n = 0u32;
        let mut stop = first;
        let variance = loop {
            let in_batch = (stop - n) / every;
            groups.clear();
            groups.resize(in_batch as usize, 0.0);
            for i in 0..stop - n {
                let followed = (i < in_batch).then(|| n / every + i);
                let draws = Draws { sampler: &sampler, index: n + i, key };
                let (direct, more) = self.sample((x, y), draws, (followed, begun), tile, scratch);
                for c in 0..3 {
                    sum[c] += f64::from(direct[c]) + f64::from(every) * f64::from(more[c]);
                }
                groups[(i % in_batch) as usize] += self.mono(&direct) / f64::from(every) + self.mono(&more);
            }
            n = stop;
            for value in groups.iter() {
                count += 1;
                let delta = value - mean;
                mean += delta / f64::from(count);
                squares += delta * (value - mean);
            }
            let variance =
                if count > 1 { squares / (f64::from(count - 1) * f64::from(count)) } else { f64::INFINITY };
            if variance <= goal {
                tile.converged += 1;
                break variance;
            }
            if n >= most {
                break variance;
            }
            stop = (n + BATCH).min(most);
        };
        tile.rgb.push(sum.map(|s| (s / f64::from(n)) as f32));
        tile.variance.push(if variance.is_finite() { variance as f32 } else { 0.0 });
        tile.counts.push((tile.hits.len() - hits_before) as u32);
    }
}

/// Greatest common divisor.
fn gcd(a: u32, b: u32) -> u32 {
    if b == 0 { a } else { gcd(b, a % b) }
}

impl RenderScene<'_> {
    /// Renders the view of camera `camera` (index in the scene's true rig); same seed, same bits.
    ///
    /// Each ray that hits carries up to two shadow rays, to points drawn among one on each light in proportion to
    /// what they would reflect if nothing hid them: direct light. One ray in [`Settings::indirect_every`] is
    /// followed further and counts as often: at each next vertex one shadow ray, up to [`Settings::depth`]
    /// scatterings, with Russian roulette. Where both ways can find a light (large lights, the environment) the
    /// balance heuristic weighs them. Lights and the environment are invisible to the camera, which sees the
    /// scene's background, and hide nothing. Film, lens, time, lights and the first scattering are stratified
    /// within the pixel. With [`Settings::sensor_noise`], camera rays and shading are sampled apart instead (see there).
    ///
    /// With `scatter_mm` in the skin's optics, the light below surfaces that have a detail is worked out first, once for
    /// all views of the same settings and seed (see [`crate::SkinLight`]).
    ///
    /// Of a camera with a filter across that of the lights (`Scene::polarised`) this is modelled: light that one
    /// reflection at a surface (the skin's coat, a fibre's R) sends from a light or the environment straight into the
    /// camera keeps its polarisation and is blocked; all other light counts as depolarised and passes. The half of
    /// depolarised light that a filter takes is left to the exposure: the camera is as bright as one without. Not
    /// modelled: the little polarisation that TT, TRT, second reflections and light from just below the skin keep, that
    /// a reflection near Brewster's angle turns the plane, and filters that are not crossed exactly.
    ///
    /// With [`Settings::shadow_spacing_px`] shadows of lights are looked up where they are kept, for the first view to ask.
    ///
    /// Unbiased but for what is named: shadows that are kept are interpolated; scatterings beyond the depth are left out; a pixel stops once its estimated
    /// standard error is below the target, which leaves dim, rarely lit pixels slightly low; a clamp, if set,
    /// darkens; samples that are not finite count as dark (and are counted).
    ///
    /// # Errors
    /// If the camera does not exist, the settings contradict each other, or the work is cancelled.
    pub fn render(
        &self,
        camera: usize,
        settings: &Settings,
        seed: u64,
        monitor: &dyn Monitor,
    ) -> Result<Render, RenderError> {
        let clock = Instant::now();
        let cameras = &self.scene.rig.cameras;
        let cam = cameras.get(camera).ok_or_else(|| {
            RenderError::Scene(format!(
                "scene {} has {} cameras; there is none with index {camera}",
                self.scene.name,
                cameras.len()
            ))
        })?;
        let (width, height) = (cam.width as usize, cam.height as usize);
        settings.validate(width * height)?;
        let sphere = self.accel.bounding_sphere();
        let exposure_s = self.scene.rig.exposure_s;
        let maker = RayMaker::new(cam, self.scene.lens, &self.scene.motion, exposure_s, sphere);
        let view = View {
            scene: self,
            settings,
            walk: Walk {
                depth: settings.depth,
                strategy: settings.strategy,
                every: [settings.samples_per_pixel, settings.max_samples_per_pixel, BATCH]
                    .into_iter()
                    .fold(settings.indirect_every, gcd),
                most_radiance: settings.clamp * self.scene.sensor.full_scale_radiance,
                thorough: settings.sensor_noise > 0.0,
                full_scale: self.scene.sensor.full_scale_radiance,
                polarised: self.scene.polarised.get(camera).copied().unwrap_or(false),
            },
            light: self.light_below(settings, seed, monitor)?,
            shadows: self.shadows(settings, seed)?,
            pinhole: maker.is_pinhole(),
            footprint: if maker.is_pinhole() {
                Footprint::of(self.scene, cam)
            } else {
                Footprint::everything(width, height)
            },
            maker,
            width,
            height,
            camera,
            seed,
        };
        let (across, down) = (width.div_ceil(TILE), height.div_ceil(TILE));
        monitor.begin(&format!("render {}", cam.name), (across * down) as u64);
        let mut made = Assembly::new((width, height), settings.samples_per_pixel as u16);
        // Enough tiles at once that no processor waits for long at the end of a lot.
        let lot = (TILES_A_THREAD * rayon::current_num_threads()).div_ceil(across);
        for first in (0..down).step_by(lot) {
            let tiles: Vec<Tile> = (first * across..(first + lot).min(down) * across)
                .into_par_iter()
                .map(|i| {
                    monitor.check()?;
                    let (x, y) = (i % across * TILE, i / across * TILE);
                    let tile =
                        if settings.sensor_noise > 0.0 { view.adaptive_tile(x, y) } else { view.tile(x, y) };
                    monitor.advance(1);
                    Ok(tile)
                })
                .collect::<Result<_, Cancelled>>()?;
            tiles.chunks(across).for_each(|band| made.push(band));
        }
        let mut render = made.finish();
        render.stats.fibres_at_eye = self.fibres_around(cam.centre_mm().as_vec3());
        render.stats.wall_s = clock.elapsed().as_secs_f64();
        Ok(render)
    }
}

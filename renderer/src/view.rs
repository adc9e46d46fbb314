//! One camera's view: tiles of pixels, adaptive sampling, the identity buffer.

use crate::accel::{Hit, LastBlockers};
use crate::footprint::Footprint;
use crate::sampler::PixelSampler;
use crate::scene::RenderScene;
use crate::{Render, RenderError, Settings, Stats};
use glam::{DVec2, DVec3, Vec3};
use rayon::prelude::*;
use std::time::Instant;
use strandbench_rng::Rng;
use strandbench_types::{Camera, Cancelled, Monitor, Plane, SampleHit, SampleHits};

/// Side of a tile, pixels.
const TILE: usize = 16;
/// Rays added to a pixel that has not converged, before it is looked at again.
const BATCH: u32 = 16;

/// A camera's rays, in f64 until they reach the scene.
struct RayMaker {
    eye: DVec3,
    base: DVec3,
    per_x: DVec3,
    per_y: DVec3,
    centre: DVec3,
    radius: f64,
}

/// A ray that starts where it may first meet the scene.
struct CameraRay {
    origin: Vec3,
    direction: Vec3,
    /// Distance from the eye to `origin`, mm.
    start: f64,
    /// Depth along +z per distance along the ray.
    depth_per_t: f64,
}

impl RayMaker {
    fn new(camera: &Camera, (centre, radius): (Vec3, f32)) -> RayMaker {
        let base = camera.ray_direction(DVec2::ZERO);
        RayMaker {
            eye: camera.centre_mm(),
            base,
            per_x: camera.ray_direction(DVec2::X) - base,
            per_y: camera.ray_direction(DVec2::Y) - base,
            centre: centre.as_dvec3(),
            radius: f64::from(radius),
        }
    }

    #[inline]
    fn ray(&self, x: f64, y: f64) -> CameraRay {
        let d = self.base + self.per_x * x + self.per_y * y;
        let depth_per_t = 1.0 / d.length();
        let d = d * depth_per_t;
        let start = ((self.centre - self.eye).dot(d) - self.radius).max(0.0);
        CameraRay {
            origin: (self.eye + d * start).as_vec3(),
            direction: d.as_vec3().normalize(),
            start,
            depth_per_t,
        }
    }
}

#[derive(Default)]
struct Tile {
    rgb: Vec<[f32; 3]>,
    variance: Vec<f32>,
    /// Hits on hair per pixel.
    counts: Vec<u32>,
    hits: Vec<SampleHit>,
    primary: u64,
    shadow: u64,
    converged: u64,
}

/// What all tiles of a view share.
struct View<'a> {
    scene: &'a RenderScene<'a>,
    settings: &'a Settings,
    maker: RayMaker,
    footprint: Footprint,
    width: usize,
    height: usize,
    camera: usize,
    seed: u64,
}

impl View<'_> {
    fn tile(&self, x0: usize, y0: usize) -> Tile {
        let mut tile = Tile::default();
        let mut blockers = vec![LastBlockers::default(); self.scene.lights.len()];
        for y in y0..(y0 + TILE).min(self.height) {
            for x in x0..(x0 + TILE).min(self.width) {
                self.pixel(x, y, &mut tile, &mut blockers);
            }
        }
        tile
    }

    fn pixel(&self, x: usize, y: usize, tile: &mut Tile, blockers: &mut [LastBlockers]) {
        let scene = self.scene.scene;
        if !self.footprint.covers(x, y) {
            tile.rgb.push(scene.background_rgb);
            tile.variance.push(0.0);
            tile.counts.push(0);
            tile.converged += 1;
            return;
        }
        let index = (y * self.width + x) as u64;
        let sampler = PixelSampler::new(Rng::keyed(&[self.seed, self.camera as u64, index]).next_u64());
        let weights = scene.sensor.response_rgb;
        let goal = f64::from(self.settings.noise_target * scene.sensor.full_scale_radiance).powi(2);
        let (first, most) = (self.settings.samples_per_pixel, self.settings.max_samples_per_pixel);
        let hits_before = tile.hits.len();
        let mut sum = [0.0f64; 3];
        // Welford's running mean and sum of squared deviations of the sensor-weighted radiance.
        let (mut mean, mut squares) = (0.0f64, 0.0f64);
        let mut n = 0u32;
        let mut stop = first;
        let variance = loop {
            while n < stop {
                let [fx, fy] = sampler.film(n);
                let ray = self.maker.ray(x as f64 + f64::from(fx), y as f64 + f64::from(fy));
                tile.primary += 1;
                let rgb = match self.scene.accel.closest(ray.origin, ray.direction) {
                    None => scene.background_rgb,
                    Some(hit) => {
                        if n < first
                            && let Hit::Fibre { t, strand, point, along } = hit
                        {
                            tile.hits.push(SampleHit {
                                strand,
                                segment: point - scene.strands.offsets[strand as usize],
                                along,
                                depth_mm: ((ray.start + f64::from(t)) * ray.depth_per_t) as f32,
                            });
                        }
                        let u = sampler.light(n);
                        self.scene.shade(&hit, ray.origin, ray.direction, u, blockers, &mut tile.shadow)
                    }
                };
                n += 1;
                let value: f64 = (0..3).map(|c| f64::from(rgb[c] * weights[c])).sum();
                let delta = value - mean;
                mean += delta / f64::from(n);
                squares += delta * (value - mean);
                for c in 0..3 {
                    sum[c] += f64::from(rgb[c]);
                }
            }
            let variance = if n > 1 { squares / (f64::from(n - 1) * f64::from(n)) } else { f64::INFINITY };
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

impl RenderScene<'_> {
    /// Renders the view of camera `camera` (index in the scene's true rig); same seed, same bits.
    ///
    /// Each ray that hits carries up to two shadow rays, to points drawn among one on each light in proportion to
    /// what they would reflect if nothing hid them: unbiased direct light. Lights themselves are invisible to the camera. Film and
    /// light positions are stratified within the pixel. A pixel stops once its estimated standard error is
    /// below the target; that the estimate decides when to stop biases dim, rarely lit pixels slightly low.
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
        let view = View {
            scene: self,
            settings,
            maker: RayMaker::new(cam, self.accel.bounding_sphere()),
            footprint: Footprint::of(self.scene, cam),
            width,
            height,
            camera,
            seed,
        };
        let (across, down) = (width.div_ceil(TILE), height.div_ceil(TILE));
        monitor.begin(&format!("render {}", cam.name), (across * down) as u64);
        let tiles: Vec<Tile> = (0..across * down)
            .into_par_iter()
            .map(|i| {
                monitor.check()?;
                let tile = view.tile(i % across * TILE, i / across * TILE);
                monitor.advance(1);
                Ok(tile)
            })
            .collect::<Result<_, Cancelled>>()?;
        Ok(assemble(tiles, (width, height), settings.samples_per_pixel as u16, clock))
    }
}

fn assemble(tiles: Vec<Tile>, (width, height): (usize, usize), rays: u16, clock: Instant) -> Render {
    let across = width.div_ceil(TILE);
    let mut rgb = Plane::filled(width, height, [0.0f32; 3]);
    let mut variance = Plane::filled(width, height, 0.0f32);
    let mut offsets = vec![0u32; width * height + 1];
    let pixels = |i: usize| {
        let (x0, y0) = (i % across * TILE, i / across * TILE);
        (y0..(y0 + TILE).min(height))
            .flat_map(move |y| (x0..(x0 + TILE).min(width)).map(move |x| y * width + x))
    };
    let mut stats = Stats::default();
    let mut converged = 0;
    for (i, tile) in tiles.iter().enumerate() {
        for (k, at) in pixels(i).enumerate() {
            rgb.data[at] = tile.rgb[k];
            variance.data[at] = tile.variance[k];
            offsets[at + 1] = tile.counts[k];
        }
        stats.primary_rays += tile.primary;
        stats.shadow_rays += tile.shadow;
        converged += tile.converged;
    }
    for i in 0..width * height {
        offsets[i + 1] += offsets[i];
    }
    let nothing = SampleHit { strand: 0, segment: 0, along: 0.0, depth_mm: 0.0 };
    let mut hits = vec![nothing; offsets[width * height] as usize];
    for (i, tile) in tiles.into_iter().enumerate() {
        let mut from = 0;
        for (k, at) in pixels(i).enumerate() {
            let n = tile.counts[k] as usize;
            let to = offsets[at] as usize;
            hits[to..to + n].copy_from_slice(&tile.hits[from..from + n]);
            from += n;
        }
    }
    stats.converged = converged as f64 / (width * height) as f64;
    stats.wall_s = clock.elapsed().as_secs_f64();
    let rays = vec![rays; width * height];
    Render { radiance_rgb: rgb, variance, hits: SampleHits { width, height, rays, offsets, hits }, stats }
}

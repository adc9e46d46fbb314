//! Pixels rendered until the sensor's noise hides theirs.
//!
//! A ray that only finds what it meets costs a tenth of one that is shaded, and fibres thinner than a pixel ask for
//! many of the first kind: how much of the pixel each covers. Cover and shading are therefore sampled apart. Many camera
//! rays give the share of the pixel that strands and meshes have; of the hits of each, as many are shaded as its part of
//! the error asks for (stratified sampling with shares from a larger first sample: Neyman 1938, "double sampling").

mod estimate;
mod strands;

use crate::accel::Hit;
use crate::path::{Draws, Scratch};
use crate::sampler::PixelSampler;
use crate::sensor::noise_variance;
use crate::tile::{TILE, Tile};
use crate::view::View;
use estimate::{Between, Shaded, Stratified};
use strandbench_rng::Rng;
use strands::{Strands, spread};

/// Camera rays of a pixel in which, or beside which, fibres are seen.
const COVER: u32 = 64;
/// So many camera rays may be traced for each sample that may be shaded.
const CHEAP: u32 = 8;
/// At first: hits on fibres lit by lights, paths from them, hits on meshes.
const FIRST: [u32; 3] = [8, 16, 8];
/// What a camera ray, a hit lit by lights, a path, a mesh's hit cost, in camera rays.
const COST: [u32; 4] = [1, 10, 10, 10];
/// What has less than this part of a pixel's error is not sampled further for its sake.
const MINOR: f64 = 0.1;
/// Samples of lights on meshes start here, apart from those on fibres.
const APART: u32 = 0x8000;

const FIBRES: usize = 0;
const MESHES: usize = 1;

/// Parts of a pixel's error: where camera rays go, light from lights on fibres, paths from fibres, meshes.
const COVERED: usize = 0;
const DIRECT: usize = 1;
const PATHS: usize = 2;
const ON_MESHES: usize = 3;

/// A camera ray's hit.
#[derive(Clone, Copy)]
struct Met {
    index: u32,
    hit: Hit,
}

impl Met {
    fn kind(&self) -> usize {
        match self.hit {
            Hit::Fibre { .. } => FIBRES,
            Hit::Mesh { .. } => MESHES,
        }
    }

    /// Fibres side by side come one after the other, so that evenly spaced hits are of all of them.
    fn order(&self) -> (u32, u32) {
        match self.hit {
            Hit::Fibre { strand, .. } => (strand, self.index),
            Hit::Mesh { .. } => (0, self.index),
        }
    }
}

/// What one pixel after the other is worked out in.
#[derive(Default)]
struct Work {
    /// Indexed [kind].
    met: [Vec<Met>; 2],
    strands: Strands,
    paths: Shaded,
    meshes: Shaded,
    /// Of each part of the error, relative to the variance that is wanted.
    stratified: [Stratified; 4],
}

impl Work {
    fn clear(&mut self) {
        self.met.iter_mut().for_each(Vec::clear);
        self.strands.clear();
        self.paths.clear();
        self.meshes.clear();
    }

    /// Parts of the pixel that fibres and meshes have.
    fn share(&self, rays: u32) -> [f64; 2] {
        [FIBRES, MESHES].map(|k| self.met[k].len() as f64 / f64::from(rays))
    }
}

/// First hits of a tile's pixels, and of those around it.
struct Around {
    side: usize,
    /// Indexed [row, column]; all first rays of a pixel one after the other.
    hits: Vec<Option<Hit>>,
    /// Whether one of them is a fibre.
    hair: Vec<bool>,
}

impl View<'_> {
    fn total(&self) -> f64 {
        self.scene.scene.sensor.response_rgb.iter().map(|&w| f64::from(w)).sum()
    }

    /// The mean of the channels as the sensor weighs them.
    fn level(&self, rgb: &[f32; 3]) -> f64 {
        if self.total() > 0.0 { self.mono(rgb) / self.total() } else { 0.0 }
    }

    /// Variance at which a pixel of this level is converged.
    fn wanted_variance(&self, level: f64) -> f64 {
        let sensor = &self.scene.scene.sensor;
        let full = f64::from(sensor.full_scale_radiance);
        (f64::from(self.settings.sensor_noise) * full).powi(2) * noise_variance(sensor, level / full)
    }

    /// A tile whose pixels take as many samples as each needs.
    pub(crate) fn adaptive_tile(&self, x0: usize, y0: usize) -> Tile {
        let mut tile = Tile::default();
        let mut scratch = Scratch::new(self.scene.lights.len(), self.shadows.as_deref());
        let mut work = Work::default();
        let around = self.around(x0, y0, &mut tile, &mut scratch);
        for y in y0..(y0 + TILE).min(self.height) {
            for x in x0..(x0 + TILE).min(self.width) {
                if !self.footprint.covers(x, y) {
                    tile.empty(self.scene.scene.background_rgb);
                    continue;
                }
                let (column, row) = (x - x0 + 1, y - y0 + 1);
                // A fibre that first rays miss in a pixel is seen in the next.
                let near = |r: usize| &around.hair[r * around.side + column - 1..][..3];
                let hair = (row - 1..=row + 1).any(|r| near(r).contains(&true));
                let first = self.settings.samples_per_pixel as usize;
                let hits = &around.hits[(row * around.side + column) * first..][..first];
                self.adaptive_pixel((x, y), hits, hair, &mut work, &mut tile, &mut scratch);
            }
        }
        tile
    }

    fn around(&self, x0: usize, y0: usize, tile: &mut Tile, scratch: &mut Scratch<'_>) -> Around {
        let (side, first) = (TILE + 2, self.settings.samples_per_pixel);
        let mut hits = Vec::with_capacity(side * side * first as usize);
        let mut hair = vec![false; side * side];
        for (i, hair) in hair.iter_mut().enumerate() {
            // One to the left and above; what is outside the image is not covered.
            let (x, y) = ((x0 + i % side).wrapping_sub(1), (y0 + i / side).wrapping_sub(1));
            if x >= self.width || y >= self.height || !self.footprint.covers(x, y) {
                hits.extend((0..first).map(|_| None));
                continue;
            }
            let sampler = PixelSampler::new(self.key(x, y));
            let begun = self.begin(&mut scratch.beam, (x, y), first);
            for n in 0..first {
                let beam = begun.then_some(&mut scratch.beam);
                let hit = self.meet(&self.camera_ray((x, y), &sampler, n), beam, tile);
                *hair |= matches!(hit, Some(Hit::Fibre { .. }));
                hits.push(hit);
            }
        }
        Around { side, hits, hair }
    }

    fn adaptive_pixel(
        &self,
        at: (usize, usize),
        first: &[Option<Hit>],
        hair: bool,
        work: &mut Work,
        tile: &mut Tile,
        scratch: &mut Scratch<'_>,
    ) {
        let key = self.key(at.0, at.1);
        let sampler = PixelSampler::new(key);
        let hits_before = tile.hits.len();
        for (n, hit) in (0..).zip(first) {
            let ray = self.camera_ray(at, &sampler, n);
            let seen = self.identity(at, &sampler, n, (&ray, hit.as_ref()), tile);
            tile.hits.extend(seen);
        }
        let background = self.scene.scene.background_rgb;
        let most = self.settings.max_samples_per_pixel;
        let most = [if hair { most.saturating_mul(CHEAP) } else { most }, most, most, most];
        work.clear();
        let mut rays = 0;
        let cover = if hair { COVER.max(first.len() as u32) } else { first.len() as u32 };
        let begin = [cover, FIRST[0], FIRST[1] / self.walk.every, FIRST[2]];
        let mut wanted: [u32; 4] = std::array::from_fn(|i| begin[i].clamp(1, most[i]));
        let mut begun = false;
        let (variance, converged) = loop {
            let to_come = wanted[COVERED].saturating_sub(rays.max(first.len() as u32));
            begun = begun || self.begin(&mut scratch.beam, at, to_come);
            for n in rays..wanted[COVERED] {
                let hit = match first.get(n as usize) {
                    Some(hit) => *hit,
                    None => {
                        let beam = begun.then_some(&mut scratch.beam);
                        self.meet(&self.camera_ray(at, &sampler, n), beam, tile)
                    }
                };
                if let Some(hit) = hit {
                    let met = Met { index: n, hit };
                    work.met[met.kind()].push(met);
                }
            }
            if rays < wanted[COVERED] {
                rays = wanted[COVERED];
                work.met[FIBRES].sort_unstable_by_key(Met::order);
                work.strands.group(&work.met[FIBRES], rays);
            }
            self.shade(at, wanted, (key, &sampler), work, tile, scratch);
            let mut between = Between::new(rays, self.level(&background));
            work.strands.cover(&work.met[FIBRES], &mut between);
            let share = work.share(rays);
            between.add(work.meshes.mean(), work.met[MESHES].iter().map(|m| m.index));
            let found = [
                between.variance(),
                work.strands.light(rays).1,
                work.paths.variance_of(share[FIBRES]),
                work.meshes.variance_of(share[MESHES]),
            ];
            let parts: [f64; 4] = std::array::from_fn(|i| found[i].single * work.stratified[i].share());
            let variance: f64 = parts.iter().sum();
            let goal = self.wanted_variance(between.mean() + share[FIBRES] * work.paths.mean());
            let worth = |i: usize| parts[i] / f64::from(wanted[i] * COST[i]);
            let worst = (0..4)
                .filter(|&i| wanted[i] < most[i] && parts[i] > 0.0 && parts[i] >= MINOR * variance)
                .max_by(|&a, &b| worth(a).total_cmp(&worth(b)));
            let Some(worst) = worst.filter(|_| variance > goal) else {
                for (stratified, v) in work.stratified.iter_mut().zip(found) {
                    stratified.learn(v.times(1.0 / goal));
                }
                break (variance, variance <= goal);
            };
            wanted[worst] = more(wanted[worst]).min(most[worst]);
        };
        let share = work.share(rays);
        let (direct, paths, meshes) =
            (work.strands.light(rays).0, work.paths.mean_rgb(), work.meshes.mean_rgb());
        tile.rgb.push(std::array::from_fn(|c| {
            let empty = (1.0 - share[FIBRES] - share[MESHES]) * f64::from(background[c]);
            (empty + direct[c] + share[FIBRES] * paths[c] + share[MESHES] * meshes[c]) as f32
        }));
        let of_sum = variance * self.total().powi(2);
        tile.variance.push(if of_sum.is_finite() { of_sum as f32 } else { 0.0 });
        tile.counts.push((tile.hits.len() - hits_before) as u32);
        tile.converged += u64::from(converged);
    }

    /// Shades hits until there are as many as are `wanted`: light from lights on fibres strand by strand, paths from evenly
    /// spaced hits on fibres, and meshes' hits in the order of the camera's rays, again with further points on lights.
    fn shade(
        &self,
        at: (usize, usize),
        wanted: [u32; 4],
        (key, sampler): (u64, &PixelSampler),
        work: &mut Work,
        tile: &mut Tile,
        scratch: &mut Scratch<'_>,
    ) {
        let [fibres, meshes] = &work.met;
        let begin = Rng::keyed(&[key, FIBRES as u64]).next_u64() as u32;
        let draws = |index: u32| Draws { sampler, index, key };
        work.strands.shade(fibres, wanted[DIRECT], begin, |place, n| {
            let Met { index, hit } = fibres[place];
            let ray = self.camera_ray(at, sampler, index);
            let rgb = self.light((&ray, &hit), draws(n), None, true, tile, scratch).0;
            (rgb, self.level(&rgb))
        });
        for n in work.paths.count()..if fibres.is_empty() { 0 } else { wanted[PATHS] } {
            let Met { index, hit } = fibres[spread(n, begin, fibres.len())];
            let ray = self.camera_ray(at, sampler, index);
            let rgb = self.followed((&ray, &hit), draws(n), tile, scratch);
            work.paths.add(rgb, self.level(&rgb));
        }
        let every = self.walk.every;
        for n in work.meshes.count()..if meshes.is_empty() { 0 } else { wanted[ON_MESHES] } {
            let Met { index, hit } = meshes[n as usize % meshes.len()];
            let ray = self.camera_ray(at, sampler, index);
            let drawn = APART + n % APART;
            let followed = n.is_multiple_of(every).then_some(drawn / every);
            let (direct, more) = self.light((&ray, &hit), draws(drawn), followed, true, tile, scratch);
            let rgb: [f32; 3] = std::array::from_fn(|c| direct[c] + every as f32 * more[c]);
            work.meshes.add(rgb, self.level(&rgb));
        }
    }
}

/// The next of 4, 6, 8, 12, 16, ...
fn more(n: u32) -> u32 {
    if n.is_power_of_two() { n + n.div_ceil(2) } else { n + n.div_ceil(3) }
}

//! Pixels rendered until the sensor's noise hides theirs.
//!
//! A ray that only finds what it meets costs a tenth of one that is shaded, and fibres thinner than a pixel ask for
//! many of the first kind: how much of the pixel they cover. Cover and shading are therefore sampled apart. Many camera
//! rays give the share of the pixel that fibres and meshes have; of the hits of each, as many are shaded as its part of
//! the error asks for (stratified sampling with shares from a larger first sample: Neyman 1938, "double sampling").

mod estimate;

use crate::accel::Hit;
use crate::path::{Draws, Scratch};
use crate::sampler::PixelSampler;
use crate::tile::{TILE, Tile};
use crate::view::View;
use estimate::{Shaded, Stratified, Variance};
use strandbench_rng::Rng;

/// Camera rays of a pixel in which, or beside which, fibres are seen.
const COVER: u32 = 64;
/// Hits shaded at first, on fibres and on meshes.
const FIRST: [u32; 2] = [16, 8];
/// Samples of lights on meshes start here, apart from those on fibres.
const APART: u32 = 0x8000;

const FIBRES: usize = 0;
const MESHES: usize = 1;

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
    shaded: [Shaded; 2],
    /// Of the cover, of fibres, of meshes; relative to the variance that is wanted.
    stratified: [Stratified; 3],
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
    /// A tile whose pixels take as many samples as each needs.
    pub(crate) fn adaptive_tile(&self, x0: usize, y0: usize) -> Tile {
        let mut tile = Tile::default();
        let mut scratch = Scratch::new(self.scene.lights.len());
        let mut work = Work::default();
        let around = self.around(x0, y0, &mut tile);
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

    fn around(&self, x0: usize, y0: usize, tile: &mut Tile) -> Around {
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
            for n in 0..first {
                let hit = self.meet(&self.camera_ray((x, y), &sampler, n), tile);
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
        scratch: &mut Scratch,
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
        let mono = self.mono(&background);
        let most = self.settings.max_samples_per_pixel;
        work.met.iter_mut().for_each(Vec::clear);
        work.shaded.iter_mut().for_each(Shaded::clear);
        let mut rays = 0;
        let mut wanted = if hair { COVER.clamp(first.len() as u32, most) } else { first.len() as u32 };
        let mut shade = FIRST.map(|n| n.min(most));
        let (variance, converged) = loop {
            for n in rays..wanted {
                let hit = match first.get(n as usize) {
                    Some(hit) => *hit,
                    None => self.meet(&self.camera_ray(at, &sampler, n), tile),
                };
                if let Some(hit) = hit {
                    let met = Met { index: n, hit };
                    work.met[met.kind()].push(met);
                }
            }
            if rays < wanted {
                work.met[FIBRES].sort_unstable_by_key(Met::order);
                rays = wanted;
            }
            for kind in [FIBRES, MESHES] {
                self.shade(at, kind, shade[kind], (key, &sampler), work, tile, scratch);
            }
            // Parts of the variance: of the cover, of what fibres look like, of what meshes look like.
            let share = [FIBRES, MESHES].map(|k| work.met[k].len() as f64 / f64::from(rays));
            let cover = cover_variance(&work.met, rays, work.shaded.each_ref().map(Shaded::mean), mono);
            let of = |k: usize| match work.met[k].is_empty() {
                true => Variance::default(),
                false => work.shaded[k].variance().times(share[k] * share[k]),
            };
            let found = [cover, of(FIBRES), of(MESHES)];
            let parts: [f64; 3] = std::array::from_fn(|i| found[i].single * work.stratified[i].share());
            let variance: f64 = parts.iter().sum();
            let mean = share[FIBRES] * work.shaded[FIBRES].mean()
                + share[MESHES] * work.shaded[MESHES].mean()
                + (1.0 - share[FIBRES] - share[MESHES]) * mono;
            let goal = self.goal(mean);
            let free = [rays < most, shade[FIBRES] < most, shade[MESHES] < most];
            let worst =
                (0..3).filter(|&i| free[i] && parts[i] > 0.0).max_by(|&a, &b| parts[a].total_cmp(&parts[b]));
            let Some(worst) = worst.filter(|_| variance > goal) else {
                for (stratified, v) in work.stratified.iter_mut().zip(found) {
                    stratified.learn(v.times(1.0 / goal));
                }
                break (variance, variance <= goal);
            };
            match worst {
                0 => wanted = more(rays).min(most),
                kind => shade[kind - 1] = more(shade[kind - 1]).min(most),
            }
        };
        let mut rgb = background.map(f64::from);
        for (met, shaded) in work.met.iter().zip(&work.shaded).filter(|(m, _)| !m.is_empty()) {
            let (share, n) = (met.len() as f64 / f64::from(rays), shaded.values.len() as f64);
            for c in 0..3 {
                rgb[c] += share * (shaded.sum_rgb[c] / n - f64::from(background[c]));
            }
        }
        tile.rgb.push(rgb.map(|v| v as f32));
        tile.variance.push(if variance.is_finite() { variance as f32 } else { 0.0 });
        tile.counts.push((tile.hits.len() - hits_before) as u32);
        tile.converged += u64::from(converged);
    }

    /// Shades hits of a kind until there are `upto`: evenly spaced ones of the list, the more the closer (van der
    /// Corput's order, begun anywhere), and meshes' in the order of the camera's rays, each with further points on lights.
    fn shade(
        &self,
        at: (usize, usize),
        kind: usize,
        upto: u32,
        (key, sampler): (u64, &PixelSampler),
        work: &mut Work,
        tile: &mut Tile,
        scratch: &mut Scratch,
    ) {
        let (met, shaded) = (&work.met[kind], &mut work.shaded[kind]);
        let every = self.walk.every;
        let begin = Rng::keyed(&[key, kind as u64]).next_u64() as u32;
        for n in shaded.values.len() as u32..if met.is_empty() { 0 } else { upto } {
            let place = match kind {
                FIBRES => (u64::from(n.reverse_bits().wrapping_add(begin)) * met.len() as u64) >> 32,
                _ => u64::from(n) % met.len() as u64,
            };
            let Met { index, hit } = met[place as usize];
            let ray = self.camera_ray(at, sampler, index);
            let drawn = if kind == FIBRES { n } else { APART + n % APART };
            let draws = Draws { sampler, index: drawn, key };
            let followed = n.is_multiple_of(every).then_some(drawn / every);
            let (direct, more) = self.light((&ray, &hit), draws, followed, true, tile, scratch);
            let rgb: [f32; 3] = std::array::from_fn(|c| direct[c] + every as f32 * more[c]);
            for c in 0..3 {
                shaded.sum_rgb[c] += f64::from(rgb[c]);
            }
            shaded.values.push(self.mono(&rgb));
        }
    }
}

/// The next of 4, 6, 8, 12, 16, ...
fn more(n: u32) -> u32 {
    if n.is_power_of_two() { n + n.div_ceil(2) } else { n + n.div_ceil(3) }
}

/// Variance of a pixel's mean that comes of where its camera rays go.
fn cover_variance(met: &[Vec<Met>; 2], rays: u32, means: [f64; 2], background: f64) -> Variance {
    if rays < 2 {
        return Variance::UNKNOWN;
    }
    let n = f64::from(rays);
    let (mut sum, mut squares, mut halves) = (0.0, 0.0, [0.0; 2]);
    for (met, mean) in met.iter().zip(means) {
        let (value, count) = (mean - background, met.len() as f64);
        sum += value * count;
        squares += value * value * count;
        let first = met.iter().filter(|m| m.index < rays / 2).count() as f64;
        halves[0] += value * first;
        halves[1] += value * (count - first);
    }
    Variance {
        single: (squares - sum * sum / n).max(0.0) / (n * (n - 1.0)),
        halves: ((halves[0] - halves[1]) / n).powi(2),
    }
}

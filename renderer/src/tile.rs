//! Tiles of a view, and the view that they make up.

use crate::path::Work;
use crate::{Render, Stats};
use strandbench_types::{Plane, SampleHit, SampleHits};

/// Side of a tile, pixels.
pub(crate) const TILE: usize = 16;

/// What one tile holds, pixel by pixel.
#[derive(Default)]
pub(crate) struct Tile {
    pub rgb: Vec<[f32; 3]>,
    pub variance: Vec<f32>,
    /// Hits on hair per pixel.
    pub counts: Vec<u32>,
    pub hits: Vec<SampleHit>,
    pub work: Work,
    pub converged: u64,
}

impl Tile {
    /// The radiance, or darkness for one that is not finite.
    pub fn finite(&mut self, rgb: [f32; 3]) -> [f32; 3] {
        if rgb.iter().all(|v| v.is_finite()) {
            return rgb;
        }
        self.work.not_finite += 1;
        [0.0; 3]
    }
}

/// The whole view of tiles in rows, of `rays` rays a pixel whose hits are kept.
pub(crate) fn assemble(tiles: Vec<Tile>, (width, height): (usize, usize), rays: u16) -> Render {
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
        stats.primary_rays += tile.work.primary;
        stats.shadow_rays += tile.work.shadow;
        stats.bounce_rays += tile.work.bounce;
        stats.not_finite += tile.work.not_finite;
        converged += tile.converged;
    }
    for i in 0..width * height {
        offsets[i + 1] += offsets[i];
    }
    // Row by row of the image, a band of tiles at a time, which are freed as they are done: all hits would otherwise
    // be in memory twice.
    let mut hits = Vec::with_capacity(offsets[width * height] as usize);
    let mut tiles = tiles.into_iter();
    for band in 0..height.div_ceil(TILE) {
        let mut row: Vec<(Tile, usize, usize)> = tiles.by_ref().take(across).map(|t| (t, 0, 0)).collect();
        for _ in band * TILE..((band + 1) * TILE).min(height) {
            for (x, (tile, pixel, from)) in row.iter_mut().enumerate() {
                let end = *pixel + TILE.min(width - x * TILE);
                let n: u32 = tile.counts[*pixel..end].iter().sum();
                hits.extend_from_slice(&tile.hits[*from..*from + n as usize]);
                (*pixel, *from) = (end, *from + n as usize);
            }
        }
    }
    stats.converged = converged as f64 / (width * height) as f64;
    let rays = vec![rays; width * height];
    Render { radiance_rgb: rgb, variance, hits: SampleHits { width, height, rays, offsets, hits }, stats }
}

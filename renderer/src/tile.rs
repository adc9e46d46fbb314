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
    /// Adds a pixel that sees nothing.
    pub fn empty(&mut self, background_rgb: [f32; 3]) {
        self.rgb.push(background_rgb);
        self.variance.push(0.0);
        self.counts.push(0);
        self.converged += 1;
    }

    /// The radiance, or darkness for one that is not finite.
    pub fn finite(&mut self, rgb: [f32; 3]) -> [f32; 3] {
        if rgb.iter().all(|v| v.is_finite()) {
            return rgb;
        }
        self.work.not_finite += 1;
        [0.0; 3]
    }
}

/// A view that bands of tiles make up from the top down, so that no more than a few of them are held beside it.
pub(crate) struct Assembly {
    width: usize,
    height: usize,
    rays: u16,
    rgb: Vec<[f32; 3]>,
    variance: Vec<f32>,
    offsets: Vec<u32>,
    hits: Vec<SampleHit>,
    stats: Stats,
    converged: u64,
}

impl Assembly {
    /// An empty view of `rays` rays a pixel whose hits are kept.
    pub fn new((width, height): (usize, usize), rays: u16) -> Assembly {
        let pixels = width * height;
        let mut offsets = Vec::with_capacity(pixels + 1);
        offsets.push(0);
        Assembly {
            width,
            height,
            rays,
            rgb: Vec::with_capacity(pixels),
            variance: Vec::with_capacity(pixels),
            offsets,
            hits: Vec::new(),
            stats: Stats::default(),
            converged: 0,
        }
    }

    /// Adds the next band: a row of tiles, from left to right.
    pub fn push(&mut self, band: &[Tile]) {
        let rows = TILE.min(self.height - self.rgb.len() / self.width);
        let mut places = vec![(0usize, 0usize); band.len()];
        for _ in 0..rows {
            for (x, (tile, (pixel, hit))) in band.iter().zip(&mut places).enumerate() {
                let end = *pixel + TILE.min(self.width - x * TILE);
                self.rgb.extend_from_slice(&tile.rgb[*pixel..end]);
                self.variance.extend_from_slice(&tile.variance[*pixel..end]);
                let first = *hit;
                for &n in &tile.counts[*pixel..end] {
                    *hit += n as usize;
                    self.offsets.push((self.hits.len() + *hit - first) as u32);
                }
                self.hits.extend_from_slice(&tile.hits[first..*hit]);
                *pixel = end;
            }
        }
        for tile in band {
            self.stats.primary_rays += tile.work.primary;
            self.stats.shadow_rays += tile.work.shadow;
            self.stats.bounce_rays += tile.work.bounce;
            self.stats.not_finite += tile.work.not_finite;
            self.converged += tile.converged;
        }
    }

    /// The view, once all bands are in.
    pub fn finish(mut self) -> Render {
        let (width, height) = (self.width, self.height);
        assert_eq!(self.rgb.len(), width * height, "every band was added");
        self.stats.converged = self.converged as f64 / (width * height) as f64;
        let rays = vec![self.rays; width * height];
        Render {
            radiance_rgb: Plane::from_vec(width, height, self.rgb),
            variance: Plane::from_vec(width, height, self.variance),
            hits: SampleHits { width, height, rays, offsets: self.offsets, hits: self.hits },
            stats: self.stats,
        }
    }
}

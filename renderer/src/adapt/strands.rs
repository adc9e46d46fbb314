//! Hits on fibres of one pixel, strand by strand.
//!
//! What one strand reflects varies little within a pixel; from strand to strand it varies much. So the camera rays that only
//! find what they meet tell how much of the pixel each strand has, and a few hits of each are shaded (post-stratification:
//! Cochran 1977, 5A.9).

use super::Met;
use super::estimate::{Between, Variance};
use crate::accel::Hit;
use std::ops::Range;

/// A strand with less than one in so many of the rays shares its samples with others of that kind.
const OWN: usize = 16;
/// Fewest samples of a strand, if it has as many hits.
const LEAST: usize = 2;

/// Light from lights of one hit.
struct Sample {
    strand: u32,
    rgb: [f32; 3],
    level: f64,
}

#[derive(Default)]
struct Group {
    /// None for what strands share that have little of the pixel.
    strand: Option<u32>,
    /// Hits: of the list, or of those that are left over.
    hits: Range<usize>,
    samples: usize,
    sum_rgb: [f64; 3],
    sum: f64,
    squares: f64,
}

impl Group {
    fn add(&mut self, s: &Sample) {
        self.samples += 1;
        (0..3).for_each(|c| self.sum_rgb[c] += f64::from(s.rgb[c]));
        self.sum += s.level;
        self.squares += s.level * s.level;
    }

    fn mean(&self) -> f64 {
        self.sum / self.samples.max(1) as f64
    }

    /// Squared deviations from the mean.
    fn scatter(&self) -> f64 {
        (self.squares - self.sum * self.mean()).max(0.0)
    }
}

/// The strands of a pixel, and what of them is shaded.
#[derive(Default)]
pub(super) struct Strands {
    groups: Vec<Group>,
    /// Places of hits that no group has for itself.
    rest: Vec<usize>,
    samples: Vec<Sample>,
}

fn strand_of(met: &Met) -> u32 {
    match met.hit {
        Hit::Fibre { strand, .. } => strand,
        Hit::Mesh { .. } => u32::MAX,
    }
}

impl Strands {
    pub fn clear(&mut self) {
        self.groups.clear();
        self.samples.clear();
    }

    /// Sorts the hits of `rays` camera rays, which lie in order of strands, and what is shaded of them already.
    pub fn group(&mut self, met: &[Met], rays: u32) {
        self.groups.clear();
        self.rest.clear();
        let mut start = 0;
        for run in met.chunk_by(|a, b| strand_of(a) == strand_of(b)) {
            let hits = start..start + run.len();
            start = hits.end;
            if run.len() * OWN < rays as usize {
                self.rest.extend(hits);
            } else {
                self.groups.push(Group { strand: Some(strand_of(&run[0])), hits, ..Group::default() });
            }
        }
        let own = self.groups.len();
        if !self.rest.is_empty() {
            self.groups.push(Group { hits: 0..self.rest.len(), ..Group::default() });
        }
        for s in &self.samples {
            let at = self.groups[..own].binary_search_by_key(&Some(s.strand), |g| g.strand).unwrap_or(own);
            self.groups[at].add(s);
        }
    }

    /// Shades hits until there are about `upto`, spread over the strands as their hits are: `shade` is given the place of a
    /// hit and how many were shaded before, and returns the light and its level.
    pub fn shade(
        &mut self,
        met: &[Met],
        upto: u32,
        begin: u32,
        mut shade: impl FnMut(usize, u32) -> ([f32; 3], f64),
    ) {
        for g in &mut self.groups {
            let share = (upto as usize * g.hits.len()).div_ceil(met.len());
            while g.samples < share.max(LEAST.min(g.hits.len())) {
                let place = g.hits.start + spread(g.samples as u32, begin, g.hits.len());
                let place = if g.strand.is_none() { self.rest[place] } else { place };
                let (rgb, level) = shade(place, self.samples.len() as u32);
                let sample = Sample { strand: strand_of(&met[place]), rgb, level };
                g.add(&sample);
                self.samples.push(sample);
            }
        }
    }

    /// Adds each group's part to what comes of where camera rays go.
    pub fn cover(&self, met: &[Met], between: &mut Between) {
        for g in &self.groups {
            let hits = g.hits.clone();
            match g.strand {
                Some(_) => between.add(g.mean(), met[hits].iter().map(|m| m.index)),
                None => between.add(g.mean(), self.rest[hits].iter().map(|&i| met[i].index)),
            }
        }
    }

    /// Sums over `rays` of the light of all hits, and the error of their mean that comes of shading few of them: strands are
    /// taken to vary alike, and not at all if none has two samples, for all that differs is then between them.
    pub fn light(&self, rays: u32) -> ([f64; 3], Variance) {
        let (scatter, spare) =
            self.groups.iter().fold((0.0, 0), |(s, n), g| (s + g.scatter(), n + g.samples.saturating_sub(1)));
        let each = scatter / spare.max(1) as f64;
        let (mut rgb, mut variance) = ([0.0; 3], 0.0);
        for g in &self.groups {
            let (share, n) = (g.hits.len() as f64 / f64::from(rays), g.samples as f64);
            (0..3).for_each(|c| rgb[c] += share * g.sum_rgb[c] / n);
            variance += share * share * each / n;
        }
        (rgb, Variance { single: variance, halves: variance })
    }
}

/// The `n`th of evenly spaced places among `count`, the more the closer (van der Corput's order), begun anywhere.
pub(super) fn spread(n: u32, begin: u32, count: usize) -> usize {
    ((u64::from(n.reverse_bits().wrapping_add(begin)) * count as u64) >> 32) as usize
}

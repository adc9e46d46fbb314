//! Which strand and which clump of strands a wanted pixel shows: what pixels share their errors by.

use crate::depth::{depth_50, pixel_centre};
use crate::regions::Regions;
use rayon::prelude::*;
use strandbench_types::Truth;
use strandbench_types::nearest::SegmentIndex;

/// Edge of the cells of roots, mm: a hand's lock of hair. Nothing but resampling depends on it.
const CLUMP_MM: f64 = 20.0;

/// A pixel over which A1 is taken. Serves statistics over raw errors; no figure depends on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// Row-major index of the pixel in the reference view.
    pub pixel: u32,
    /// The true strand whose piece, among those that the reference camera sees, is nearest to the true depth at 50 %
    /// coverage on the ray of the pixel's centre.
    pub strand: u32,
    /// Strands whose roots (first points) share a cubic cell of 20 mm along the axes of the reference camera have the same
    /// number; cells are numbered from 0.
    pub clump: u32,
}

/// The places of the inner pixels, in reading order. `strand_of` names the strand of each segment of `index`.
pub(crate) fn places(
    truth: &Truth,
    regions: &Regions,
    index: &SegmentIndex,
    strand_of: &[u32],
) -> Vec<Place> {
    let camera = &truth.rig.cameras[0];
    let clumps = clumps(truth);
    let place = |&pixel: &u32| {
        let surface = camera.unproject(pixel_centre(pixel, camera.width), depth_50(truth, pixel));
        let strand = strand_of[index.nearest(surface) as usize];
        Place { pixel, strand, clump: clumps[strand as usize] }
    };
    regions.inner.par_iter().map(place).collect()
}

/// Number of each strand's clump.
fn clumps(truth: &Truth) -> Vec<u32> {
    let camera = &truth.rig.cameras[0];
    let cell = |strand: &[glam::Vec3]| {
        let root = strand.first().map_or(glam::DVec3::ZERO, |p| camera.to_camera(p.as_dvec3()));
        (root / CLUMP_MM).floor().as_i64vec3().to_array()
    };
    let cells: Vec<[i64; 3]> = truth.strands.iter().map(cell).collect();
    let mut names = cells.clone();
    names.sort_unstable();
    names.dedup();
    cells.iter().map(|c| names.partition_point(|n| n < c) as u32).collect()
}

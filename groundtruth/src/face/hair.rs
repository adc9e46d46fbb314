//! Where hairs stand, how densely, and which axis is nearest.

use crate::GroundTruthError;
use glam::DVec3;
use std::collections::HashMap;
use strandbench_types::nearest::{Segment, SegmentIndex};
use strandbench_types::{HairRoot, StrandSet};

/// Radius of the disk in which hairs are counted for the density around a root, mm.
pub const DENSITY_RADIUS_MM: f32 = 5.0;

/// Where the strands of a scene stand in the skin, each indexed `[strand]`.
#[derive(Clone, Copy, Debug)]
pub struct Follicles<'a> {
    /// Triangle of the skin.
    pub triangles: &'a [u32],
    /// Weights of the triangle's corners.
    pub barycentrics: &'a [[f32; 3]],
    /// Kind of hair.
    pub kinds: &'a [u8],
}

/// Root, follicle, length, kind and density of every strand. The density around a root is the number of strands of any
/// kind whose roots lie within [`DENSITY_RADIUS_MM`], itself among them, over the area of a disk of that radius: taken
/// where the skin is nearly flat at this scale, low at the edge of a beard by definition.
///
/// # Errors
/// If strands are not valid or their number is not that of triangles, weights and kinds.
pub fn hair_roots(strands: &StrandSet, follicles: &Follicles) -> Result<Vec<HairRoot>, GroundTruthError> {
    strands.validate()?;
    let n = strands.len();
    let given = [follicles.triangles.len(), follicles.barycentrics.len(), follicles.kinds.len()];
    if given != [n; 3] {
        let text = format!("{n} strands have {given:?} triangles, weights and kinds; each strand needs one");
        return Err(GroundTruthError::Inconsistent(text));
    }
    let roots: Vec<_> = (0..n).map(|i| strands.points[strands.range(i).start]).collect();
    let cell = |p: &glam::Vec3| (*p / DENSITY_RADIUS_MM).floor().as_ivec3();
    let mut cells: HashMap<glam::IVec3, Vec<u32>> = HashMap::new();
    for (i, p) in roots.iter().enumerate() {
        cells.entry(cell(p)).or_default().push(i as u32);
    }
    let disk_cm2 = std::f32::consts::PI * (DENSITY_RADIUS_MM * 0.1).powi(2);
    let around = |p: &glam::Vec3| {
        let middle = cell(p);
        let near =
            |i: &&u32| roots[**i as usize].distance_squared(*p) <= DENSITY_RADIUS_MM * DENSITY_RADIUS_MM;
        let block = (0..27).map(|k| glam::IVec3::new(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1));
        let of = |d: glam::IVec3| cells.get(&(middle + d)).map_or(0, |c| c.iter().filter(near).count());
        block.map(of).sum::<usize>() as f32 / disk_cm2
    };
    Ok((0..n)
        .map(|i| HairRoot {
            position_mm: roots[i],
            triangle: follicles.triangles[i],
            barycentric: follicles.barycentrics[i],
            length_mm: strands.length_mm(i) as f32,
            kind: follicles.kinds[i],
            density_per_cm2: around(&roots[i]),
        })
        .collect())
}

/// The axes of some strands, ready for nearest queries.
pub struct HairIndex {
    segments: SegmentIndex,
    /// Strand of each segment.
    owners: Vec<u32>,
    low: DVec3,
    high: DVec3,
}

impl HairIndex {
    /// Over the strands that `include` names by index.
    ///
    /// # Errors
    /// If the strands are not valid, or none is included.
    pub fn new(strands: &StrandSet, include: impl Fn(usize) -> bool) -> Result<HairIndex, GroundTruthError> {
        strands.validate()?;
        let (mut segments, mut owners) = (Vec::<Segment>::new(), Vec::new());
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for i in (0..strands.len()).filter(|&i| include(i)) {
            for w in strands.strand(i).windows(2) {
                let s = [w[0].as_dvec3(), w[1].as_dvec3()];
                low = low.min(s[0]).min(s[1]);
                high = high.max(s[0]).max(s[1]);
                segments.push(s);
                owners.push(i as u32);
            }
        }
        if segments.is_empty() {
            let text = "no strand is included; distance to hair needs at least one".to_owned();
            return Err(GroundTruthError::Inconsistent(text));
        }
        Ok(HairIndex { segments: SegmentIndex::new(segments), owners, low, high })
    }

    /// Lowest and highest corner of a box around the axes, mm.
    pub fn bounds(&self) -> (DVec3, DVec3) {
        (self.low, self.high)
    }

    /// Distance (mm) from `p` to the nearest point of any axis nearer than `within_mm`, and the strand that holds it.
    pub fn nearest_within(&self, p: DVec3, within_mm: f64) -> Option<(f64, u32)> {
        let (d, segment) = self.segments.nearest_within(p, within_mm)?;
        Some((d, self.owners[segment as usize]))
    }
}

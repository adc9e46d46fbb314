//! The identity buffer condensed to one value per pixel, for files and for people.

use crate::fibre_tangent;
use glam::Vec3;
use strandbench_types::{Plane, SampleHit, SampleHits, StrandSet};

/// What the strand that covers most of each pixel is and does there. Pixels without hair hold NaN, but for
/// coverage and tangent, which are 0.
#[derive(Clone, Debug)]
pub struct IdentityPlanes {
    /// Strand index; exact in f32 below 2^24 strands.
    pub strand: Plane<f32>,
    /// Segment index within the strand.
    pub segment: Plane<f32>,
    /// Position along the segment, 0..1.
    pub along: Plane<f32>,
    /// Depth along +z of that hit, mm.
    pub depth_mm: Plane<f32>,
    /// Unit tangent of the fibre at that hit, root to tip, world.
    pub tangent: Plane<Vec3>,
    /// Share of the pixel's rays that met hair first, 0..1.
    pub coverage: Plane<f32>,
}

impl IdentityPlanes {
    /// For each pixel the strand with the most hits (of equals, the one with the nearest hit, then the lower
    /// index) and its nearest hit.
    pub fn of(hits: &SampleHits, strands: &StrandSet) -> IdentityPlanes {
        let (w, h) = (hits.width, hits.height);
        let absent = Plane::filled(w, h, f32::NAN);
        let mut planes = IdentityPlanes {
            strand: absent.clone(),
            segment: absent.clone(),
            along: absent.clone(),
            depth_mm: absent,
            tangent: Plane::filled(w, h, Vec3::ZERO),
            coverage: Plane::filled(w, h, 0.0),
        };
        let mut sorted: Vec<SampleHit> = Vec::new();
        for i in 0..w * h {
            let pixel = hits.pixel(i);
            let Some(best) = dominant(pixel, &mut sorted) else { continue };
            planes.strand.data[i] = best.strand as f32;
            planes.segment.data[i] = best.segment as f32;
            planes.along.data[i] = best.along;
            planes.depth_mm.data[i] = best.depth_mm;
            let point = strands.offsets[best.strand as usize] + best.segment;
            planes.tangent.data[i] = fibre_tangent(strands, best.strand, point, best.along);
            planes.coverage.data[i] = pixel.len() as f32 / f32::from(hits.rays[i]);
        }
        planes
    }

    /// Channel names and planes as an OpenEXR file holds them: `strand`, `segment`, `along`, `depth_mm`,
    /// `tangent.x`, `tangent.y`, `tangent.z`, `coverage`.
    pub fn channels(&self) -> Vec<(&'static str, Plane<f32>)> {
        vec![
            ("strand", self.strand.clone()),
            ("segment", self.segment.clone()),
            ("along", self.along.clone()),
            ("depth_mm", self.depth_mm.clone()),
            ("tangent.x", self.tangent.map(|t| t.x)),
            ("tangent.y", self.tangent.map(|t| t.y)),
            ("tangent.z", self.tangent.map(|t| t.z)),
            ("coverage", self.coverage.clone()),
        ]
    }
}

/// The nearest hit of the strand with the most hits; `sorted` is scratch space.
fn dominant(pixel: &[SampleHit], sorted: &mut Vec<SampleHit>) -> Option<SampleHit> {
    sorted.clear();
    sorted.extend_from_slice(pixel);
    sorted.sort_unstable_by(|a, b| a.strand.cmp(&b.strand).then(a.depth_mm.total_cmp(&b.depth_mm)));
    let mut best: Option<&[SampleHit]> = None;
    for run in sorted.chunk_by(|a, b| a.strand == b.strand) {
        let wins = best
            .is_none_or(|b| run.len() > b.len() || (run.len() == b.len() && run[0].depth_mm < b[0].depth_mm));
        if wins {
            best = Some(run);
        }
    }
    best.map(|run| run[0])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hit(strand: u32, segment: u32, depth_mm: f32) -> SampleHit {
        SampleHit { strand, segment, along: 0.25, depth_mm }
    }

    #[test]
    fn most_hits_win_then_the_nearest_and_empty_pixels_stay_empty() {
        let mut strands = StrandSet::new();
        strands.push(&[Vec3::ZERO, Vec3::X, Vec3::X * 2.0], 0.04);
        strands.push(&[Vec3::ZERO, Vec3::Y, Vec3::Y * 2.0], 0.04);
        strands.push(&[Vec3::ZERO, Vec3::Z, Vec3::Z * 2.0], 0.04);
        let hits = SampleHits {
            width: 3,
            height: 1,
            rays: vec![8; 3],
            offsets: vec![0, 4, 4, 6],
            hits: vec![
                hit(2, 0, 5.0),
                hit(1, 1, 9.0),
                hit(1, 0, 8.0),
                hit(0, 0, 7.0),
                hit(2, 1, 6.0),
                hit(0, 1, 6.5),
            ],
        };
        let p = IdentityPlanes::of(&hits, &strands);
        assert_eq!((p.strand.data[0], p.segment.data[0], p.depth_mm.data[0]), (1.0, 0.0, 8.0));
        assert_eq!((p.tangent.data[0], p.coverage.data[0], p.along.data[0]), (Vec3::Y, 0.5, 0.25));
        assert!(p.strand.data[1].is_nan() && p.depth_mm.data[1].is_nan());
        assert_eq!((p.tangent.data[1], p.coverage.data[1]), (Vec3::ZERO, 0.0));
        assert_eq!((p.strand.data[2], p.coverage.data[2]), (2.0, 0.25), "of equals the nearest");
        assert_eq!(p.channels().len(), 8);
    }
}

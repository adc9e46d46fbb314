//! Points on estimated strands that can be found again in another frame.

use crate::strands::samples::{Sample, Walk};
use std::collections::HashMap;
use strandbench_types::{Estimate, StrandSet, Visibility};

/// Arc length between points, mm; the first lies at half of it.
pub(crate) const SPACING_MM: f64 = 5.0;

/// A strand's point: by identity where the method keeps one, and arc length from the strand's first point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Spot {
    pub id: Option<u64>,
    pub arc_mm: f64,
    pub sample: Sample,
}

/// The strands of one frame's estimate, found by identity.
pub(crate) struct Tracks {
    pub strands: StrandSet,
    ids: Option<Vec<u64>>,
    strand_of_id: HashMap<u64, u32>,
}

impl Tracks {
    pub fn new(estimate: &Estimate) -> Tracks {
        let strands = estimate.strands.clone().unwrap_or_default();
        let ids = estimate.strand_ids.clone();
        let strand_of_id = ids.iter().flatten().zip(0..).map(|(&id, k)| (id, k)).collect();
        Tracks { strands, ids, strand_of_id }
    }

    /// Points along all strands long enough for a sample, at most `most`: every k-th, from the one of rank ⌊k/2⌋.
    pub fn spots(&self, most: u64) -> Vec<Spot> {
        let on = |s: usize| {
            let length = self.strands.length_mm(s);
            if Visibility::samples_on(length) == 0 {
                return 0;
            }
            // A strand shorter than half the spacing has one point, in its middle.
            ((length / SPACING_MM + 0.5).floor() as u64).max(1)
        };
        let counts: Vec<u64> = (0..self.strands.len()).map(on).collect();
        let k = counts.iter().sum::<u64>().div_ceil(most).max(1);
        let (mut out, mut rank) = (Vec::new(), 0);
        for (s, &n) in counts.iter().enumerate() {
            let next = rank + (k / 2 + k - rank % k) % k;
            if next < rank + n {
                let mut walk = Walk::new(&self.strands, s);
                for i in (next - rank..n).step_by(k as usize) {
                    let regular = (i as f64 + 0.5) * SPACING_MM;
                    let arc_mm = if regular > walk.length { 0.5 * walk.length } else { regular };
                    let id = self.ids.as_ref().map(|ids| ids[s]);
                    out.push(Spot { id, arc_mm, sample: walk.at(arc_mm) });
                }
            }
            rank += n;
        }
        out
    }

    /// The same spot in this frame; `None` if its strand is gone or has become too short.
    pub fn find(&self, spot: &Spot) -> Option<Sample> {
        let strand = *self.strand_of_id.get(&spot.id?)? as usize;
        let mut walk = Walk::new(&self.strands, strand);
        (spot.arc_mm <= walk.length).then(|| walk.at(spot.arc_mm))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn spots_are_found_again_by_identity_and_arc() {
        let mut strands = StrandSet::new();
        strands.push(&[Vec3::ZERO, Vec3::X * 3.0], 0.04);
        strands.push(&[Vec3::Y, Vec3::Y + Vec3::X * 13.0], 0.04);
        strands.push(&[Vec3::Z, Vec3::Z + Vec3::X * 0.2], 0.04);
        let with = |strands: &StrandSet, ids: Vec<u64>| {
            Tracks::new(&Estimate {
                strands: Some(strands.clone()),
                strand_ids: Some(ids),
                ..Estimate::default()
            })
        };
        let a = with(&strands, vec![8, 9, 10]);
        let spots = a.spots(99);
        let got: Vec<(u64, f64)> = spots.iter().map(|s| (s.id.unwrap(), s.arc_mm)).collect();
        assert_eq!(got, [(8, 2.5), (9, 2.5), (9, 7.5), (9, 12.5)]);
        assert_eq!(a.spots(2).iter().map(|s| s.arc_mm).collect::<Vec<_>>(), [2.5, 12.5]);
        let mut other = StrandSet::new();
        other.push(&[Vec3::ZERO, Vec3::X * 8.0], 0.04);
        let b = with(&other, vec![9]);
        let found: Vec<Option<f64>> = spots.iter().map(|s| b.find(s).map(|s| s.position.x)).collect();
        assert_eq!(found, [None, Some(2.5), Some(7.5), None]);
        let none = Tracks::new(&Estimate { strands: Some(other), ..Estimate::default() });
        assert!(spots.iter().all(|s| none.find(s).is_none()) && none.spots(9)[0].id.is_none());
    }
}

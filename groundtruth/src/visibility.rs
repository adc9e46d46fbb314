//! Arc length along the strands, and which of their samples a camera sees.

use crate::{GroundTruthError, MAX_STRAND_SAMPLES};
use rayon::prelude::*;
use strandbench_types::{StrandSet, VISIBILITY_STEP_MM, Visibility};

/// Coverage in pixels from which on a sample counts as seen (METRICS ground rule 5).
const SEEN_PX: f64 = 0.05;

/// A hit on a strand too short to carry a sample.
pub(crate) const UNTRACKED: u64 = u64::MAX;

/// Arc length at every point, and where each strand's samples start.
pub(crate) struct Arcs {
    /// Arc length from the strand's first point, mm, indexed as the strands' points.
    pub arc_mm: Vec<f64>,
    /// Start of each strand's samples, and their total as the last entry.
    offsets: Vec<u32>,
}

impl Arcs {
    pub fn new(strands: &StrandSet) -> Result<Arcs, GroundTruthError> {
        let mut arc_mm = vec![0.0; strands.points.len()];
        let mut offsets = Vec::with_capacity(strands.len() + 1);
        offsets.push(0);
        let mut total = 0u64;
        for i in 0..strands.len() {
            let points = strands.range(i);
            let mut s = 0.0;
            for k in points.start + 1..points.end {
                s += f64::from(strands.points[k - 1].distance(strands.points[k]));
                arc_mm[k] = s;
            }
            total = total.saturating_add(Visibility::samples_on(s) as u64);
            if total > MAX_STRAND_SAMPLES {
                return Err(GroundTruthError::Inconsistent(format!(
                    "strands 0 to {i} are longer than {:.0} m together, more than any head; check the unit \
                     of the strands (mm)",
                    MAX_STRAND_SAMPLES as f64 * f64::from(VISIBILITY_STEP_MM) * 1e-3
                )));
            }
            offsets.push(total as u32);
        }
        Ok(Arcs { arc_mm, offsets })
    }

    pub fn samples(&self) -> usize {
        *self.offsets.last().expect("one entry more than strands") as usize
    }

    /// Key of a hit at arc length `s_mm` of `strand` in a pixel of `rays`, for [`mark`].
    pub fn key(&self, strand: usize, s_mm: f64, rays: u16) -> u64 {
        let (start, end) = (u64::from(self.offsets[strand]), u64::from(self.offsets[strand + 1]));
        if start == end {
            return UNTRACKED;
        }
        let i = (s_mm / f64::from(VISIBILITY_STEP_MM)) as u64;
        (start + i).min(end - 1) << 16 | u64::from(rays)
    }

    pub fn into_visibility(self, seen_by: Vec<u32>) -> Visibility {
        Visibility { offsets: self.offsets, seen_by }
    }
}

/// Sets `bit` for every sample whose hits cover at least [`SEEN_PX`]. Sorting the keys makes the sums
/// independent of the order in which the hits came.
pub(crate) fn mark(mut touched: Vec<u64>, bit: u32, seen_by: &mut [u32]) {
    touched.par_sort_unstable();
    let tracked = touched.partition_point(|&k| k != UNTRACKED);
    let same = |mask: u32| move |a: &u64, b: &u64| a >> mask == b >> mask;
    for of_sample in touched[..tracked].chunk_by(same(16)) {
        let coverage_px: f64 =
            of_sample.chunk_by(same(0)).map(|equal| equal.len() as f64 / (equal[0] & 0xffff) as f64).sum();
        if coverage_px >= SEEN_PX {
            seen_by[(of_sample[0] >> 16) as usize] |= bit;
        }
    }
}

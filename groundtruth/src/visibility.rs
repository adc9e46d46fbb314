//! Arc length along the strands, and which of their samples a camera sees.

use crate::{GroundTruthError, MAX_STRAND_SAMPLES, check, view};
use rayon::prelude::*;
use strandbench_types::{Rig, SampleHits, StrandSet, VISIBILITY_STEP_MM, ViewTruth, Visibility};

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

/// Truth of views one after the other, so that no camera's identity buffer need be held beside another's.
pub struct Sightings<'a> {
    rig: &'a Rig,
    strands: &'a StrandSet,
    arcs: Arcs,
    seen_by: Vec<u32>,
    /// A bit for each camera that was looked through.
    done: u32,
}

impl<'a> Sightings<'a> {
    /// Before any camera has seen anything.
    ///
    /// # Errors
    /// If the rig or the strands are not usable, or there is more hair than memory is reserved for.
    pub fn new(rig: &'a Rig, strands: &'a StrandSet) -> Result<Sightings<'a>, GroundTruthError> {
        check::scene(rig, strands, None)?;
        let arcs = Arcs::new(strands)?;
        let seen_by = vec![0; arcs.samples()];
        Ok(Sightings { rig, strands, arcs, seen_by, done: 0 })
    }

    /// The truth of a camera's view, whose identity buffer is no longer needed afterwards. Cameras may come in any
    /// order.
    ///
    /// # Errors
    /// If there is no such camera, it was there before, or its buffer contradicts rig or strands; nothing has changed
    /// then.
    pub fn add(&mut self, camera: usize, hits: &SampleHits) -> Result<ViewTruth, GroundTruthError> {
        let cameras = self.rig.cameras.len();
        let bad = |text: String| Err(GroundTruthError::Inconsistent(text));
        let Some(c) = self.rig.cameras.get(camera) else {
            return bad(format!("the rig has {cameras} cameras; there is none with index {camera}"));
        };
        if self.done >> camera & 1 == 1 {
            return bad(format!("camera {} comes twice; give each camera's hits once", c.name));
        }
        check::buffer(c, hits)?;
        let (view, touched) = view::reduce(self.rig, camera, self.strands, &self.arcs, hits)?;
        mark(touched, 1 << camera, &mut self.seen_by);
        self.done |= 1 << camera;
        Ok(view)
    }

    /// What the cameras that were added see.
    pub fn finish(self) -> Visibility {
        self.arcs.into_visibility(self.seen_by)
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

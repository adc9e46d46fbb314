//! What is asked of an estimated sample: which true strand it stands for, and whether it is observed at all.

use super::curves::{Curves, Hit};
use super::free::FreeSpace;
use super::samples::{Sample, Samples, Set, TrueStrands};
use super::stairs::{GRID_MM, NOTHING, Stairs, cos_squared};
use crate::ScoreError;
use rayon::prelude::*;
use strandbench_types::nearest::Ordered;
use strandbench_types::{StrandSet, Truth, Visibility};

/// The truth, ready to be compared with.
pub(crate) struct Reference<'a> {
    pub strands: TrueStrands<'a>,
    pub v1: Curves,
    pub v2: Curves,
    pub free: FreeSpace<'a>,
    /// Samples of FULL, V1 and V2, thinned.
    pub samples: [Samples; 3],
}

/// Most samples of the true sets FULL, V1 and V2 that are asked for.
pub(crate) const MOST_TRUE: [u64; 3] = [1 << 17, 1 << 17, 1 << 18];

impl<'a> Reference<'a> {
    pub fn new(truth: &'a Truth) -> Result<Reference<'a>, ScoreError> {
        let strands = TrueStrands::new(truth)?;
        let (v1, v2) = (strands.curves(Set::V1), strands.curves(Set::V2));
        if v2.is_empty() {
            return crate::check::fault(
                "no strand sample is seen by two cameras: there is nothing to score strands on".to_owned(),
            );
        }
        let samples = [Set::Full, Set::V1, Set::V2].map(|set| strands.samples(set, MOST_TRUE[set as usize]));
        Ok(Reference { free: FreeSpace::new(truth), strands, v1, v2, samples })
    }

    pub fn curves(&self, set: Set) -> &Curves {
        match set {
            Set::Full => &self.strands.full,
            Set::V1 => &self.v1,
            Set::V2 => &self.v2,
        }
    }

    pub fn samples(&self, set: Set) -> &Samples {
        &self.samples[set as usize]
    }
}

/// An estimated sample, its place in the truth, and whether a camera sees that there is nothing.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Judged {
    pub sample: Sample,
    /// Nearest point of any true strand.
    pub nearest: Hit,
    /// Cameras that see that point.
    pub cameras: u32,
    pub free: bool,
}

/// Depth of the visible layer: what lies farther from every true strand of a set, and not in free space, is
/// behind it, mm.
const LAYER_MM: f64 = GRID_MM[6];

impl Judged {
    /// Whether the sample lies in a set's visible layer: its nearest true strand belongs to the set there, and is near.
    pub fn in_layer(&self, set: Set) -> bool {
        set == Set::Full || (self.cameras >= set as u32 && self.nearest.distance_mm <= LAYER_MM)
    }

    /// Whether the sample counts against a set: it lies in the visible layer, or cameras see that it lies in free
    /// space. In free space, what matches a true strand outside the set does not count either.
    pub fn observed(&self, set: Set, mm: f64, deg: f64) -> bool {
        let n = &self.nearest;
        let stands_for_other = n.distance_mm <= mm && n.cos2 >= cos_squared(deg) && self.cameras < set as u32;
        self.in_layer(set) || (self.free && !stands_for_other)
    }

    /// Where on the grid the sample counts for something else than the set: [`Judged::observed`] of the whole grid at
    /// once. `None` if it counts nowhere.
    pub fn elsewhere(&self, set: Set) -> Option<Stairs> {
        if self.in_layer(set) || (self.free && self.cameras >= set as u32) {
            return Some(NOTHING);
        }
        self.free.then(|| self.nearest.stairs())
    }
}

/// Strands that are scored: a method's, a null's or the ceiling's.
pub(crate) struct Candidate<'a> {
    pub name: &'static str,
    pub strands: &'a StrandSet,
    /// All strands that have a sample.
    pub curves: &'a Curves,
    pub judged: Ordered<Judged>,
    /// Strands too short for a sample, left out.
    pub too_short: u64,
    /// Most samples of a true set that are asked for.
    pub most: usize,
    /// Samples of V2 that are asked for, and the estimated strand nearest to each.
    pub wanted: Ordered<Sample>,
    pub nearest: Vec<Option<Hit>>,
}

impl<'a> Candidate<'a> {
    /// The strands that take part, as curves.
    pub fn curves(strands: &StrandSet) -> Result<Curves, ScoreError> {
        let lengths: Vec<f64> = (0..strands.len()).into_par_iter().map(|s| strands.length_mm(s)).collect();
        Curves::whole(strands, |s| Visibility::samples_on(lengths[s]) > 0)
    }

    /// `most` bounds the candidate's own samples as well as the true ones.
    pub fn new(
        reference: &Reference,
        name: &'static str,
        strands: &'a StrandSet,
        curves: &'a Curves,
        most: usize,
    ) -> Candidate<'a> {
        let samples = Samples::of(strands, |_, _| true, most as u64);
        let judge = |s: &Sample| {
            let nearest =
                reference.strands.full.nearest(s.position, s.tangent, f64::INFINITY, 0.0).expect("not empty");
            let cameras = reference.strands.cameras_at(nearest.point, nearest.along);
            Judged { sample: *s, nearest, cameras, free: reference.free.holds(s.position) }
        };
        let judged = Ordered::new(samples.list, |s| s.position).map(judge);
        let wanted = Ordered::new(reference.samples(Set::V2).thinned(most).list, |s| s.position);
        let nearest = wanted.ask(|_, s| curves.nearest(s.position, s.tangent, f64::INFINITY, 0.0));
        let is_short = |s: &usize| Visibility::samples_on(strands.length_mm(*s)) == 0;
        let too_short = (0..strands.len()).into_par_iter().filter(is_short).count() as u64;
        Candidate { name, strands, curves, judged, too_short, most, wanted, nearest }
    }
}

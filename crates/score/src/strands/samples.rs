//! Samples at equal arc length, and what the truth knows of them.

use super::curves::{Curves, MIN_SEGMENT_MM, Part};
use crate::ScoreError;
use glam::DVec3;
use rayon::prelude::*;
use strandbench_types::{StrandSet, Truth, VISIBILITY_STEP_MM, Visibility};

/// Arc length between samples, mm; the first lies at half of it (METRICS ground rule 3).
pub(crate) const STEP_MM: f64 = VISIBILITY_STEP_MM as f64;

/// A point of a strand that stands for a length of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sample {
    pub position: DVec3,
    /// Unit direction from root to tip; zero where the strand has none.
    pub tangent: DVec3,
    /// Length of strand that it stands for, samples left out by thinning included.
    pub weight_mm: f64,
    pub strand: u32,
    /// Index of the segment's first point in the strand set.
    pub point: u32,
    /// Position on that segment, 0 to 1.
    pub along: f64,
}

/// A list of samples, of which every `stride`-th was taken.
#[derive(Clone, Debug, Default)]
pub(crate) struct Samples {
    pub list: Vec<Sample>,
}

/// Every how many-th member of a list of `n` is taken so that at most `most` are.
fn stride(n: u64, most: u64) -> u64 {
    n.div_ceil(most).max(1)
}

impl Samples {
    /// Samples of all strands for which `keep(strand, sample)` holds, strand after strand, at most `most`: every
    /// k-th of the list, from the one of rank ⌊k/2⌋.
    pub fn of(strands: &StrandSet, keep: impl Fn(usize, usize) -> bool + Sync, most: u64) -> Samples {
        let on = |s: usize| Visibility::samples_on(strands.length_mm(s));
        let kept = |s: usize| (0..on(s)).filter(|&i| keep(s, i)).count() as u64;
        let counts: Vec<u64> = (0..strands.len()).into_par_iter().map(kept).collect();
        let mut total = 0;
        let first: Vec<u64> = counts
            .iter()
            .map(|c| {
                total += c;
                total - c
            })
            .collect();
        let k = stride(total, most);
        let of_strand = |s: usize| {
            let mut out = Vec::new();
            if (first[s] + k - 1 - k / 2) / k == (first[s] + counts[s] + k - 1 - k / 2) / k {
                return out;
            }
            let (n, mut rank) = (on(s), first[s]);
            let mut walk = Walk::new(strands, s);
            for i in (0..n).filter(|&i| keep(s, i)) {
                if rank % k == k / 2 {
                    let own = if i + 1 == n { walk.length - i as f64 * STEP_MM } else { STEP_MM };
                    out.push(Sample { weight_mm: own * k as f64, ..walk.at((i as f64 + 0.5) * STEP_MM) });
                }
                rank += 1;
            }
            out
        };
        let lists: Vec<Vec<Sample>> = (0..strands.len()).into_par_iter().map(of_strand).collect();
        Samples { list: lists.concat() }
    }

    /// Every k-th of the list again, so that at most `most` remain.
    pub fn thinned(&self, most: usize) -> Samples {
        let k = stride(self.list.len() as u64, most as u64) as usize;
        let take = self.list.iter().skip(k / 2).step_by(k);
        let list = take.map(|s| Sample { weight_mm: s.weight_mm * k as f64, ..*s }).collect();
        Samples { list }
    }
}

/// Walks along a strand, forwards only.
pub(crate) struct Walk<'a> {
    set: &'a StrandSet,
    strand: usize,
    /// Arc length of the strand, mm.
    pub length: f64,
    /// Index of the segment at hand, and where it starts and ends.
    point: usize,
    start: f64,
    end: f64,
}

impl<'a> Walk<'a> {
    pub fn new(set: &'a StrandSet, strand: usize) -> Walk<'a> {
        let point = set.range(strand).start;
        let end = f64::from(set.points[point].distance(set.points[point + 1]));
        Walk { set, strand, length: set.length_mm(strand), point, start: 0.0, end }
    }

    /// The sample at arc length `s` (mm), which must not decrease from call to call; its weight is not set.
    pub fn at(&mut self, s: f64) -> Sample {
        let last = self.set.range(self.strand).end - 2;
        let points = &self.set.points;
        while (self.end < s || self.end - self.start < f64::from(MIN_SEGMENT_MM)) && self.point < last {
            self.point += 1;
            self.start = self.end;
            self.end += f64::from(points[self.point].distance(points[self.point + 1]));
        }
        let (a, b) = (points[self.point].as_dvec3(), points[self.point + 1].as_dvec3());
        let length = self.end - self.start;
        let along = if length > 0.0 { ((s - self.start) / length).min(1.0) } else { 0.0 };
        Sample {
            position: a.lerp(b, along),
            tangent: (b - a).normalize_or_zero(),
            weight_mm: 0.0,
            strand: self.strand as u32,
            point: self.point as u32,
            along,
        }
    }
}

/// Which samples of the truth count: those seen by at least so many cameras.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Set {
    Full = 0,
    V1 = 1,
    V2 = 2,
}

/// The true strands with what a query needs to know of them.
pub(crate) struct TrueStrands<'a> {
    pub truth: &'a Truth,
    /// Arc length from the root at each point, mm.
    pub arc_mm: Vec<f64>,
    /// Strand of each point.
    pub strand_of: Vec<u32>,
    pub full: Curves,
}

impl<'a> TrueStrands<'a> {
    pub fn new(truth: &'a Truth) -> Result<TrueStrands<'a>, ScoreError> {
        let set = &truth.strands;
        let of_strand = |s: usize| {
            let mut arc = 0.0;
            set.range(s).map(move |i| {
                if i > set.range(s).start {
                    arc += f64::from(set.points[i - 1].distance(set.points[i]));
                }
                (arc, s as u32)
            })
        };
        let (arc_mm, strand_of) = (0..set.len()).into_par_iter().flat_map_iter(of_strand).unzip();
        Ok(TrueStrands { truth, arc_mm, strand_of, full: Curves::whole(set, |_| true)? })
    }

    /// Number of cameras that see sample `i` of a strand.
    pub fn cameras(&self, strand: usize, i: usize) -> u32 {
        let v = &self.truth.visibility;
        v.seen_by[v.offsets[strand] as usize + i].count_ones()
    }

    fn samples_on(&self, strand: usize) -> usize {
        let o = &self.truth.visibility.offsets;
        (o[strand + 1] - o[strand]) as usize
    }

    /// Number of cameras that see the stretch at a place on a segment; 0 on a strand too short for a sample.
    pub fn cameras_at(&self, point: u32, along: f64) -> u32 {
        let p = point as usize;
        let strand = self.strand_of[p] as usize;
        let n = self.samples_on(strand);
        if n == 0 {
            return 0;
        }
        let arc = self.arc_mm[p] + along * (self.arc_mm[p + 1] - self.arc_mm[p]);
        self.cameras(strand, ((arc / STEP_MM) as usize).min(n - 1))
    }

    /// Samples of a set, at most `most`.
    pub fn samples(&self, set: Set, most: u64) -> Samples {
        Samples::of(&self.truth.strands, |s, i| self.cameras(s, i) >= set as u32, most)
    }

    /// The parts of segments that belong to a set.
    pub fn parts(&self, set: Set) -> Vec<Part> {
        let strands = &self.truth.strands;
        let of_strand = |s: usize| {
            let n = self.samples_on(s);
            let mut out = Vec::new();
            if (0..n).all(|i| self.cameras(s, i) < set as u32) {
                return out;
            }
            for p in strands.range(s).start..strands.range(s).end - 1 {
                let (start, end) = (self.arc_mm[p], self.arc_mm[p + 1]);
                let length = end - start;
                if length < f64::from(MIN_SEGMENT_MM) {
                    continue;
                }
                let place = |arc: f64| ((arc - start) / length).clamp(0.0, 1.0);
                let of = |arc: f64| ((arc / STEP_MM) as usize).min(n - 1);
                let mut run: Option<f64> = None;
                for i in of(start)..=of(end) {
                    let seen = self.cameras(s, i) >= set as u32;
                    let from = place(i as f64 * STEP_MM);
                    match (seen, run) {
                        (true, None) => run = Some(from),
                        (false, Some(begun)) => {
                            out.push((p as u32, [begun, from]));
                            run = None;
                        }
                        _ => {}
                    }
                }
                if let Some(begun) = run {
                    out.push((p as u32, [begun, 1.0]));
                }
            }
            out.retain(|(_, [from, to])| to > from);
            out
        };
        let lists: Vec<Vec<Part>> = (0..strands.len()).into_par_iter().map(of_strand).collect();
        lists.concat()
    }

    pub fn curves(&self, set: Set) -> Curves {
        Curves::parts(&self.truth.strands, &self.parts(set))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;
    use strandbench_types::Rig;

    fn along_x(x: &[f32]) -> Vec<Vec3> {
        x.iter().map(|&x| Vec3::new(x, 0.0, 0.0)).collect()
    }

    #[test]
    fn samples_stand_for_all_of_the_length() {
        let mut set = StrandSet::new();
        set.push(&along_x(&[0.0, 0.75, 0.75, 2.0, 3.2]), 0.04);
        set.push(&along_x(&[0.0, 0.2]), 0.04);
        set.push(&along_x(&[5.0, 4.0]), 0.04);
        let all = Samples::of(&set, |_, _| true, u64::MAX);
        let got: Vec<(f64, u32)> =
            all.list.iter().map(|s| ((s.position.x * 1e4).round() / 1e4, s.strand)).collect();
        assert_eq!(
            got,
            [(0.25, 0), (0.75, 0), (1.25, 0), (1.75, 0), (2.25, 0), (2.75, 0), (4.75, 2), (4.25, 2)]
        );
        let length: f64 = all.list.iter().filter(|s| s.strand == 0).map(|s| s.weight_mm).sum();
        assert!((length - set.length_mm(0)).abs() < 1e-12, "{length}");
        assert_eq!(all.list[7].tangent, DVec3::NEG_X);
        // Thinning takes every third from the middle of the first three, in one step or in two.
        let third = Samples::of(&set, |_, _| true, 3);
        assert_eq!(third.list.iter().map(|s| s.position.x.round()).collect::<Vec<_>>(), [1.0, 2.0, 4.0]);
        assert_eq!(third.list[0].weight_mm, 1.5);
        assert_eq!(all.thinned(3).list, third.list);
        let odd = Samples::of(&set, |_, i| i % 2 == 1, u64::MAX);
        assert_eq!(odd.list.len(), 4);
    }

    #[test]
    fn parts_are_the_stretches_that_enough_cameras_see() {
        let mut strands = StrandSet::new();
        strands.push(&along_x(&[0.0, 0.75, 2.0, 3.2]), 0.04);
        let visibility = Visibility { offsets: vec![0, 6], seen_by: vec![0, 3, 1, 3, 0, 7] };
        let rig = Rig { cameras: vec![], near_mm: 1.0, far_mm: 2.0, frame_rate_hz: 1.0, exposure_s: 1.0 };
        let truth = Truth { rig, views: vec![], strands, visibility, head: None };
        let t = TrueStrands::new(&truth).unwrap();
        let spans = |set| -> Vec<(f64, f64)> {
            let x = |p: u32, u: f64| {
                let at = |i: u32| f64::from(truth.strands.points[i as usize].x);
                ((at(p) + u * (at(p + 1) - at(p))) * 1e4).round() / 1e4
            };
            t.parts(set).iter().map(|&(p, [a, b])| (x(p, a), x(p, b))).collect()
        };
        assert_eq!(spans(Set::V2), [(0.5, 0.75), (0.75, 1.0), (1.5, 2.0), (2.5, 3.2)]);
        assert_eq!(spans(Set::V1), [(0.5, 0.75), (0.75, 2.0), (2.5, 3.2)]);
        assert_eq!(spans(Set::Full), [(0.0, 0.75), (0.75, 2.0), (2.0, 3.2)]);
        assert_eq!(t.samples(Set::V2, 99).list.len(), 3);
        assert_eq!([0.1, 0.9].map(|u| t.cameras_at(0, u)), [0, 2]);
        assert_eq!([0.0, 0.5, 1.0].map(|u| t.cameras_at(2, u)), [0, 3, 3]);
    }
}

//! The pieces of true strands that the reference camera sees, as curves and as samples.

use crate::ScoreError;
use glam::DVec3;
use rayon::prelude::*;
use strandbench_types::{StrandSet, Truth, VISIBILITY_STEP_MM};

/// Segments shorter than this are left out and counted, mm (METRICS ground rule 3).
const MIN_SEGMENT_MM: f64 = 1e-6;

/// A straight piece of a strand, world, mm.
pub(crate) type Piece = [DVec3; 2];

/// Number of segments of `strands` too short to have a direction.
pub(crate) fn short_segments(strands: &StrandSet) -> u64 {
    let short =
        |s: &[glam::Vec3]| s.windows(2).filter(|w| f64::from(w[0].distance(w[1])) < MIN_SEGMENT_MM).count();
    strands.iter().map(|s| short(s) as u64).sum()
}

/// The stretches of strand that the reference camera sees, cut from their polylines: what A2 measures
/// distances to; and the strand of each.
pub(crate) fn curves(truth: &Truth) -> Result<(Vec<Piece>, Vec<u32>), ScoreError> {
    let pieces: Vec<Vec<Piece>> =
        (0..truth.strands.len()).into_par_iter().map(|i| pieces(truth, i)).collect();
    let strand_of = pieces.iter().zip(0..).flat_map(|(of, i)| std::iter::repeat_n(i, of.len())).collect();
    let pieces = pieces.concat();
    if pieces.is_empty() {
        return Err(ScoreError::Input(
            "the reference camera sees no strand sample: there is nothing to measure distances to".to_owned(),
        ));
    }
    Ok((pieces, strand_of))
}

fn pieces(truth: &Truth, strand: usize) -> Vec<Piece> {
    let v = &truth.visibility;
    let seen = &v.seen_by[v.offsets[strand] as usize..v.offsets[strand + 1] as usize];
    let mut out = Vec::new();
    if seen.iter().all(|bits| bits & 1 == 0) {
        return out;
    }
    let step = f64::from(VISIBILITY_STEP_MM);
    let points = truth.strands.strand(strand);
    let length = truth.strands.length_mm(strand);
    let mut segments = points.windows(2);
    let (mut segment, mut start, mut end) = (None::<Piece>, 0.0, 0.0);
    let mut i = 0;
    while i < seen.len() {
        if seen[i] & 1 == 0 {
            i += 1;
            continue;
        }
        let from = i;
        while i < seen.len() && seen[i] & 1 != 0 {
            i += 1;
        }
        let lo = from as f64 * step;
        let hi = if i == seen.len() { length } else { i as f64 * step };
        loop {
            if let Some([a, b]) = segment {
                let (s, e) = (lo.max(start), hi.min(end));
                if e > s && end - start >= MIN_SEGMENT_MM {
                    let at = |s: f64| a + (b - a) * ((s - start) / (end - start));
                    out.push([at(s), at(e)]);
                }
                if end >= hi {
                    break;
                }
            }
            let Some(w) = segments.next() else { break };
            segment = Some([w[0].as_dvec3(), w[1].as_dvec3()]);
            (start, end) = (end, end + f64::from(w[0].distance(w[1])));
        }
    }
    out
}

/// A strand sample that the reference camera sees.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Seen {
    pub position: DVec3,
    /// Whether another camera sees it too.
    pub again: bool,
}

/// Every sample that the reference camera sees, strand after strand.
pub(crate) fn samples(truth: &Truth) -> Vec<Seen> {
    let v = &truth.visibility;
    let of_strand = |strand: usize| {
        let seen = &v.seen_by[v.offsets[strand] as usize..v.offsets[strand + 1] as usize];
        let mut out = Vec::new();
        if seen.iter().all(|bits| bits & 1 == 0) {
            return out;
        }
        let mut segments = truth.strands.strand(strand).windows(2);
        let (mut segment, mut start, mut end) = ([DVec3::ZERO; 2], 0.0, 0.0);
        for (i, &bits) in seen.iter().enumerate() {
            let s = (i as f64 + 0.5) * f64::from(VISIBILITY_STEP_MM);
            while end < s {
                let Some(w) = segments.next() else { break };
                segment = [w[0].as_dvec3(), w[1].as_dvec3()];
                (start, end) = (end, end + f64::from(w[0].distance(w[1])));
            }
            if bits & 1 != 0 && end > start {
                let position = segment[0].lerp(segment[1], ((s - start) / (end - start)).min(1.0));
                out.push(Seen { position, again: bits & !1 != 0 });
            }
        }
        out
    };
    let all: Vec<Vec<Seen>> = (0..truth.strands.len()).into_par_iter().map(of_strand).collect();
    all.concat()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;
    use strandbench_types::{Camera, Rig, ViewTruth, Visibility};

    /// A truth of one strand, straight along +x, whose samples are seen by these cameras.
    fn one_strand(x: &[f32], seen_by: &[u32]) -> Truth {
        let mut strands = StrandSet::new();
        strands.push(&x.iter().map(|&x| Vec3::new(x, 0.0, 0.0)).collect::<Vec<_>>(), 0.04);
        let visibility = Visibility { offsets: vec![0, seen_by.len() as u32], seen_by: seen_by.to_vec() };
        let cameras = Vec::<Camera>::new();
        let rig = Rig { cameras, near_mm: 1.0, far_mm: 2.0, frame_rate_hz: 1.0, exposure_s: 1.0 };
        Truth { rig, views: Vec::<ViewTruth>::new(), strands, visibility, head: None }
    }

    fn spans(x: &[f32], seen_by: &[u32]) -> Vec<(f64, f64)> {
        curves(&one_strand(x, seen_by)).unwrap().0.iter().map(|[a, b]| (a.x, b.x)).collect()
    }

    #[test]
    fn pieces_are_the_seen_stretches_cut_at_vertices() {
        // 3.2 mm: stretches 0-0.5, ..., 2-2.5, and the last one from 2.5 to the end; vertices at 0.75 and 2.
        let x = [0.0, 0.75, 2.0, 3.2];
        let end = f64::from(3.2f32);
        assert_eq!(spans(&x, &[1; 6]), [(0.0, 0.75), (0.75, 2.0), (2.0, end)]);
        assert_eq!(spans(&x, &[0, 1, 0, 0, 3, 0]), [(0.5, 0.75), (0.75, 1.0), (2.0, 2.5)]);
        assert_eq!(spans(&x, &[2, 2, 2, 2, 2, 5]).len(), 1);
        let last = spans(&x, &[0, 0, 0, 0, 0, 1])[0];
        assert!((last.0 - 2.5).abs() < 1e-6 && last.1 == end);
        assert!(
            curves(&one_strand(&x, &[2, 2, 2, 0, 0, 4])).is_err(),
            "another camera's view is not this one's"
        );
        // Vertices on top of one another are no obstacle, and are counted.
        let doubled = [0.0, 0.75, 0.75, 2.0, 3.2];
        assert_eq!(spans(&doubled, &[1; 6]), [(0.0, 0.75), (0.75, 2.0), (2.0, end)]);
        assert_eq!(short_segments(&one_strand(&doubled, &[1; 6]).strands), 1);
    }

    #[test]
    fn samples_lie_in_the_middle_of_their_stretches() {
        let t = one_strand(&[0.0, 0.75, 2.0, 3.2], &[1, 0, 3, 2, 0, 5]);
        let got: Vec<(f64, bool)> = samples(&t).iter().map(|s| (s.position.x, s.again)).collect();
        for (got, want) in got.iter().zip([(0.25, false), (1.25, true), (2.75, true)]) {
            assert!((got.0 - want.0).abs() < 1e-6 && got.1 == want.1, "{got:?} for {want:?}");
        }
        assert_eq!(got.len(), 3);
    }
}

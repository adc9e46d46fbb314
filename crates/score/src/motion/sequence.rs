//! A sequence, frame by frame; of earlier frames nothing is kept but the last and some points.

use super::bands::Series;
use super::carrier::{Carrier, Pose};
use super::flicker::Flicker;
use super::points::{Spot, Tracks};
use super::rows;
use super::sheet::{FrameFigures, SequenceSheet};
use crate::ScoreError;
use crate::check::{self, fault};
use crate::stats::{percentile, sorted};
use crate::strands::curves::{Curves, check_lengths};
use crate::strands::samples::{Sample, Samples, TrueStrands};
use crate::strands::stairs::cos_squared;
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use strandbench_types::{Estimate, Monitor, StrandSet, Truth};

/// Most points of a frame whose motion is measured.
const MOST_SPOTS: u64 = 1 << 13;

/// Most points of the first frame that are followed to the end.
const MOST_FOLLOWED: u64 = 1 << 12;

/// Most of these whose whole path is kept.
const MOST_PATHS: usize = 1 << 9;

/// A point survives within this distance (mm) and angle (degrees) of the strand it started at.
const SURVIVES: (f64, f64) = (2.0, 20.0);

/// A point whose jitter and motion the next frame will tell.
struct Pending {
    spot: Spot,
    carrier: Carrier,
    /// Offset as the carrier sees it, in the frame before; absent if the strand was not there.
    before: Option<DVec3>,
}

/// A point of the first frame, followed to the end.
struct Followed {
    spot: Spot,
    carrier: Carrier,
    /// True strand that carries it.
    strand: u32,
    /// Whether it was within 2 mm and 20 degrees at first.
    good: bool,
}

/// What one frame leaves for the next.
struct Last {
    points: Vec<Vec3>,
    tracks: Tracks,
    curves: Curves,
    pending: Vec<Pending>,
    /// Points among which those of `pending` have a carrier.
    wanted: u64,
}

/// Scores a sequence of frames by C1 to C7 of the protocol. Frames are pushed in order of time, `1 / frame_rate_hz`
/// apart; a frame without an estimate is pushed as an empty one. Strands that keep their identity
/// ([`Estimate::strand_ids`]) are tracked; without identities C1 and C4 to C7 have no value, which is the worst.
///
/// Memory: two frames, and per frame some thousand raw errors (at most 200 kB).
pub struct SequenceScorer {
    rate_hz: f64,
    offsets: Vec<u32>,
    first_points: Vec<Vec3>,
    last: Option<Last>,
    followed: Vec<Followed>,
    flicker: Flicker,
    paths: Vec<[Series; 3]>,
    pub(super) raw: rows::Raw,
    by_frame: Vec<FrameFigures>,
}

impl SequenceScorer {
    /// A scorer of a sequence whose first frame has this truth; the frame itself is still to be pushed.
    ///
    /// # Errors
    /// If the truth is inconsistent or the rig's frame rate is not positive.
    pub fn new(first: &Truth) -> Result<SequenceScorer, ScoreError> {
        check::truth(first)?;
        let rate_hz = first.rig.frame_rate_hz;
        if !(rate_hz > 0.0 && rate_hz.is_finite()) {
            return fault(format!("the rig's frame rate is {rate_hz} Hz; give the frames a second"));
        }
        Ok(SequenceScorer {
            rate_hz,
            offsets: first.strands.offsets.clone(),
            first_points: first.strands.points.clone(),
            last: None,
            followed: Vec::new(),
            flicker: Flicker::new(first),
            paths: Vec::new(),
            raw: rows::Raw::default(),
            by_frame: Vec::new(),
        })
    }

    /// Adds the next frame.
    ///
    /// # Errors
    /// If truth or estimate is inconsistent, the true strands are not those of the first frame, or the work is
    /// cancelled. The scorer is then as before.
    pub fn push(
        &mut self,
        truth: &Truth,
        estimate: &Estimate,
        monitor: &dyn Monitor,
    ) -> Result<(), ScoreError> {
        let frame = self.by_frame.len() as u32;
        let named = |e: ScoreError| match e {
            ScoreError::Input(m) => ScoreError::Input(format!("frame {frame}: {m}")),
            other => other,
        };
        check::truth(truth).and_then(|()| check::estimate(truth, estimate)).map_err(named)?;
        if truth.strands.offsets != self.offsets || truth.rig.frame_rate_hz != self.rate_hz {
            return fault(format!(
                "frame {frame}: strands, points or frame rate of the truth differ from the first frame's; every frame \
                 must hold the same material points"
            ));
        }
        if let Some(strands) = &estimate.strands {
            check_lengths(strands, "estimate's").map_err(named)?;
        }
        monitor.check()?;
        let own = TrueStrands::new(truth)?;
        let tracks = Tracks::new(estimate);
        let curves = curves_of(&tracks.strands)?;
        monitor.check()?;

        let mut figures = FrameFigures { frame, ..FrameFigures::default() };
        let spots = tracks.spots(MOST_SPOTS);
        let carriers: Vec<Option<Carrier>> =
            spots.par_iter().map(|s| Carrier::of(&own, s.sample.position, s.sample.tangent)).collect();
        if let Some(last) = self.last.take() {
            self.between(&last, (&truth.strands.points, &tracks, &curves), (&spots, &carriers));
            self.last = Some(last);
        } else {
            self.follow(&own, &tracks);
        }
        self.drift(truth, &tracks, &mut figures);
        self.flicker.push(truth, &own.arc_mm, &own.strand_of, estimate);

        let last = self.last.as_ref();
        let wanted = spots.len() as u64;
        let mut pending = Vec::new();
        for (spot, carrier) in spots.into_iter().zip(carriers) {
            let Some(carrier) = carrier else { continue };
            let before = last.and_then(|l| {
                let p = l.tracks.find(&spot)?.position;
                Some(carrier.local(&carrier.pose(&l.points), p))
            });
            pending.push(Pending { spot, carrier, before });
        }
        self.last = Some(Last { points: truth.strands.points.clone(), tracks, curves, pending, wanted });
        self.by_frame.push(figures);
        Ok(())
    }

    /// C1, C2 and C6: from the last frame to this one.
    fn between(
        &mut self,
        last: &Last,
        (points, tracks, curves): (&[Vec3], &Tracks, &Curves),
        (spots, carriers): (&[Spot], &[Option<Carrier>]),
    ) {
        struct Step {
            jitter: Option<f64>,
            flow: Option<f64>,
            regrown: f64,
        }
        let distance = |curves: &Curves, p: DVec3, t: DVec3| {
            curves.nearest(p, t, f64::INFINITY, 0.0).map_or(f64::INFINITY, |h| h.distance_mm)
        };
        let steps: Vec<Step> = last
            .pending
            .par_iter()
            .map(|p| {
                let pose: Pose = p.carrier.pose(points);
                let here = p.carrier.offset(p.spot.sample.position);
                let after = tracks.find(&p.spot).map(|s| p.carrier.local(&pose, s.position));
                let jitter = p.before.zip(after).map(|(b, a)| (b - 2.0 * here + a).length());
                let carried = p.carrier.carried(&pose, p.spot.sample.position);
                Step {
                    jitter,
                    flow: after.map(|a| a.distance(here)),
                    regrown: distance(curves, carried, p.spot.sample.tangent),
                }
            })
            .collect();
        let back: Vec<f64> = spots
            .par_iter()
            .zip(carriers)
            .filter_map(|(s, c)| {
                let c = c.as_ref()?;
                let carried = c.carried(&c.pose(&last.points), s.sample.position);
                Some(distance(&last.curves, carried, s.sample.tangent))
            })
            .collect();
        let before = self.by_frame.len() - 1;
        let interior = before > 0;
        let jitter: Vec<f64> = steps.iter().filter_map(|s| s.jitter).collect();
        let flow: Vec<f64> = steps.iter().filter_map(|s| s.flow).collect();
        let forth: Vec<f64> = steps.iter().map(|s| s.regrown).collect();
        let f = &mut self.by_frame[before];
        f.jitter_mm = mean(&jitter);
        f.flow_mm = mean(&flow);
        f.regrown_mm = mean(&forth).zip(mean(&back)).map(|(a, b)| 0.5 * (a + b)).filter(|v| v.is_finite());
        let spots_before = last.wanted;
        self.raw.jitter.add(jitter, if interior { spots_before } else { 0 });
        self.raw.flow.add(flow, spots_before);
        // One of the two sets empty: the other's points have nothing to be near to.
        self.raw.forth.add(forth, spots_before.max(u64::from(back.is_empty())));
        self.raw.back.add(back, spots.len() as u64);
    }

    /// Chooses what to follow, in the first frame.
    fn follow(&mut self, own: &TrueStrands, tracks: &Tracks) {
        let choose = |spot: Spot| {
            let (p, t) = (spot.sample.position, spot.sample.tangent);
            let carrier = Carrier::of(own, p, t)?;
            let strand = own.strand_of[carrier.anchor.point as usize];
            let good = near_strand(&own.truth.strands, strand, &spot.sample);
            Some(Followed { spot, carrier, strand, good })
        };
        let spots = tracks.spots(MOST_FOLLOWED);
        self.raw.followed_wanted = spots.len() as u64;
        self.followed = spots.into_iter().filter(|s| s.id.is_some()).filter_map(choose).collect();
        self.paths = vec![Default::default(); self.followed.len().min(MOST_PATHS)];
    }

    /// C4, C5 and C7: what has become of the first frame's points.
    fn drift(&mut self, truth: &Truth, tracks: &Tracks, figures: &mut FrameFigures) {
        let points = &truth.strands.points;
        struct Now {
            drift: f64,
            survives: bool,
            moved: DVec3,
            path: Option<(DVec3, DVec3)>,
        }
        let now: Vec<Now> = self
            .followed
            .par_iter()
            .map(|f| {
                let pose = f.carrier.pose(points);
                let moved = pose.place - f.carrier.anchor.at(&self.first_points);
                let Some(s) = tracks.find(&f.spot) else {
                    return Now { drift: f64::INFINITY, survives: false, moved, path: None };
                };
                let drift = f.carrier.local(&pose, s.position) - f.carrier.offset(f.spot.sample.position);
                let survives = f.good && near_strand(&truth.strands, f.strand, &s);
                Now { drift: drift.length(), survives, moved, path: Some((s.position, pose.place)) }
            })
            .collect();
        let step = self.followed.len().div_ceil(MOST_PATHS).max(1);
        for (path, n) in self.paths.iter_mut().zip(now.iter().step_by(step)) {
            for axis in 0..3 {
                path[axis].push(n.path.map(|(x, y)| (x[axis], y[axis])));
            }
        }
        if now.is_empty() {
            return;
        }
        let median = percentile(&sorted(now.iter().map(|n| n.drift).collect()), 50);
        figures.drift_mm = Some(median).filter(|m| m.is_finite());
        let squares: f64 = now.iter().map(|n| n.moved.length_squared()).sum();
        figures.moved_mm = Some((squares / now.len() as f64).sqrt());
        let good = self.followed.iter().filter(|f| f.good).count();
        let alive = now.iter().filter(|n| n.survives).count();
        figures.survival = (good > 0).then(|| alive as f64 / good as f64);
    }

    /// The figures. `flicker_floor_mm` is what [`flicker_floor_mm`] gives for two answers to the same hair at rest, seen with
    /// other noise.
    ///
    /// # Errors
    /// If no frame was pushed, or the floor is not a distance.
    pub fn finish(self, flicker_floor_mm: Option<f64>) -> Result<SequenceSheet, ScoreError> {
        if self.by_frame.is_empty() {
            return fault("the sequence has no frames: there is nothing to score".to_owned());
        }
        if let Some(floor) = flicker_floor_mm.filter(|f| !(f.is_finite() && *f >= 0.0)) {
            return fault(format!("the flicker floor is {floor} mm; give a distance"));
        }
        let paths: Vec<Series> =
            self.paths.into_iter().flatten().filter(|s| s.iter().all(Option::is_some)).collect();
        let scores = rows::rows(rows::Inputs {
            raw: self.raw,
            followed: self.followed.len() as u64,
            by_frame: &self.by_frame,
            flicker: &self.flicker,
            paths: &paths,
            rate_hz: self.rate_hz,
            floor_mm: flicker_floor_mm,
        });
        let protocol = crate::protocol_id();
        Ok(SequenceSheet { protocol, frames: self.by_frame.len() as u32, scores, by_frame: self.by_frame })
    }
}

/// The curves of an estimate, strands too short for a sample left out.
fn curves_of(strands: &StrandSet) -> Result<Curves, ScoreError> {
    let has_sample = |s: usize| strandbench_types::Visibility::samples_on(strands.length_mm(s)) > 0;
    Curves::whole(strands, has_sample)
}

/// Whether a sample is within 2 mm and 20 degrees of a piece of one strand.
fn near_strand(strands: &StrandSet, strand: u32, s: &Sample) -> bool {
    let (mm, deg) = SURVIVES;
    strands.strand(strand as usize).windows(2).any(|w| {
        let piece = [w[0].as_dvec3(), w[1].as_dvec3()];
        let u = (piece[1] - piece[0]).normalize_or_zero();
        strandbench_types::nearest::point_to_segment_squared(s.position, &piece) <= mm * mm
            && u.dot(s.tangent).powi(2) >= cos_squared(deg)
    })
}

fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

/// Mean distance (mm) between two estimates' strands, both ways: the flicker floor, if both are of the same hair at
/// rest and differ in noise alone. `None` if one of them has no strands.
///
/// # Errors
/// If an estimate's strands are not valid.
pub fn flicker_floor_mm(a: &Estimate, b: &Estimate) -> Result<Option<f64>, ScoreError> {
    let mut means = Vec::new();
    for (from, to) in [(a, b), (b, a)] {
        let (Some(from), Some(to)) = (&from.strands, &to.strands) else { return Ok(None) };
        for set in [from, to] {
            set.validate().map_err(|e| ScoreError::Input(format!("the estimate's strands: {e}")))?;
            check_lengths(set, "estimate's")?;
        }
        let curves = curves_of(to)?;
        let samples = Samples::of(from, |_, _| true, 1 << 17).list;
        let distances: Vec<f64> = samples
            .par_iter()
            .filter_map(|s| Some(curves.nearest(s.position, s.tangent, f64::INFINITY, 0.0)?.distance_mm))
            .collect();
        means.push(mean(&distances));
    }
    Ok(means[0].zip(means[1]).map(|(x, y)| 0.5 * (x + y)))
}

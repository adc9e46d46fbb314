//! Sequences with known faults score what their faults are.

mod common;

use common::strands::{layers, mapped, moved_outwards};
use common::{normal, remapped};
use glam::{DMat3, DVec3, Vec3};
use std::f64::consts::TAU;
use strandbench_score::{ScoreError, SequenceScorer, SequenceSheet, flicker_floor_mm};
use strandbench_types::{DepthMap, Estimate, Plane, Silent, StrandSet, Truth};

const RATE_HZ: f64 = 100.0;

/// The head's motion at a time, s: where a point of the scene goes. All bands of C5 are in it.
fn sway(t: f64, p: DVec3) -> DVec3 {
    let turn = 0.2 * (TAU * t).sin() + 0.05 * (TAU * 2.0 * t).sin();
    let shift = DVec3::new(3.0 * (TAU * 4.0 * t).sin(), 1.5 * (TAU * 8.0 * t).sin(), 2.0 * (TAU * t).cos());
    DMat3::from_rotation_y(turn) * p + shift
}

fn moved(set: &StrandSet, t: f64, also: impl Fn(usize, DVec3) -> DVec3) -> StrandSet {
    mapped(set, |k, p| p.iter().map(|p| (sway(t, also(k, p.as_dvec3()))).as_vec3()).collect())
}

/// Truth of frame `k`: the strands move, cameras and maps stay.
fn truth_at(t: &Truth, seconds: f64) -> Truth {
    Truth { strands: moved(&t.strands, seconds, |_, p| p), ..t.clone() }
}

fn with_ids(strands: StrandSet, ids: Vec<u64>) -> Estimate {
    Estimate { strands: Some(strands), strand_ids: Some(ids), ..Estimate::default() }
}

fn ids(n: usize) -> Vec<u64> {
    (0..n as u64).map(|k| 1000 - k).collect()
}

fn run(frames: usize, truth: impl Fn(usize) -> Truth, estimate: impl Fn(usize) -> Estimate) -> SequenceSheet {
    let mut s = SequenceScorer::new(&truth(0)).unwrap();
    for k in 0..frames {
        s.push(&truth(k), &estimate(k), &Silent).unwrap();
    }
    s.finish(None).unwrap()
}

/// A sequence of the swaying scene and an estimate of each frame.
fn swaying(frames: usize, estimate: impl Fn(&Truth, usize) -> Estimate) -> SequenceSheet {
    let t = layers();
    run(frames, |k| truth_at(&t, k as f64 / RATE_HZ), |k| estimate(&t, k))
}

fn value(s: &SequenceSheet, id: &str) -> f64 {
    s.get(id).unwrap().value.unwrap_or_else(|| panic!("{id} has no value"))
}

const ZERO: [&str; 12] = [
    "C1.jitter.mean",
    "C1.jitter.p95",
    "C1.noise_sd",
    "C2.regrown.mean",
    "C2.regrown.median",
    "C4.drift.median",
    "C4.loop.median",
    "C5.log2_gain_1hz",
    "C5.lag_8hz",
    "C6.flow.mean",
    "C6.flow.p90",
    "C5.lag_2hz",
];

#[test]
fn the_moving_truth_is_perfect_and_so_is_a_constant_offset() {
    let exact = swaying(210, |t, k| {
        let strands = moved(&t.strands, k as f64 / RATE_HZ, |_, p| p);
        let n = strands.len();
        with_ids(strands, ids(n))
    });
    for id in ZERO {
        // 32-bit points carry 4e-6 mm each; four of them enter a second difference.
        assert!(value(&exact, id).abs() < 3e-5, "{id}: {}", value(&exact, id));
    }
    assert_eq!((value(&exact, "C7.survival_1s"), value(&exact, "C7.survival_2s")), (1.0, 1.0));
    assert_eq!(exact.by_frame.len(), 210);
    assert!(exact.by_frame[25].moved_mm.unwrap() > 5.0, "the scene moves");

    // A constant error that moves along is no jitter, no drift and no lag.
    let beside = swaying(30, |t, k| {
        let strands = moved(&moved_outwards(t, 1.5), k as f64 / RATE_HZ, |_, p| p);
        let n = strands.len();
        with_ids(strands, ids(n))
    });
    for id in ["C1.jitter.p95", "C4.drift.median", "C6.flow.p90"] {
        // The surroundings give the turn of a rigid motion up to the pull towards none: 1e-6 of a radian over 1.5 mm.
        assert!(value(&beside, id) < 5e-5, "{id}: {}", value(&beside, id));
    }
    assert!((value(&beside, "C2.regrown.median")) < 1e-4);
}

#[test]
fn noise_is_measured_as_its_standard_deviation() {
    for sd in [0.1, 1.0] {
        let s = swaying(40, |t, k| {
            // Each strand shaken as a whole, so that no noise is cut off by the nearest point of a curve.
            let strands = moved(&t.strands, k as f64 / RATE_HZ, |j, p| {
                let n = |axis: u64| sd * normal(&[5, j as u64, k as u64, axis]);
                p + DVec3::new(n(0), n(1), n(2))
            });
            let n = strands.len();
            with_ids(strands, ids(n))
        });
        // 38 triples of some 45 visible strands, of which neighbouring triples overlap: about 700 free ones; the
        // length's relative spread is 0.42, so the standard error is 1.6 %: five of them.
        let got = value(&s, "C1.noise_sd");
        assert!((got / sd - 1.0).abs() < 0.08, "{got} for {sd}");
        assert!((value(&s, "C1.acceleration") / value(&s, "C1.jitter.mean") - 1e4).abs() < 1e-6);
        assert!(value(&s, "C6.flow.mean") > sd, "noise moves points too");
    }
}

#[test]
fn drift_lag_and_gain_are_what_was_put_in() {
    let rate_mm_s = 3.0;
    let s = swaying(101, |t, k| {
        let seconds = k as f64 / RATE_HZ;
        let slide = |_: usize, p: DVec3| p + DVec3::X * (rate_mm_s * seconds);
        let strands = moved(&t.strands, seconds, slide);
        let n = strands.len();
        with_ids(strands, ids(n))
    });
    let (drift, rate) = (value(&s, "C4.drift.median"), value(&s, "C4.drift.rate"));
    assert!((drift - 3.0).abs() < 1e-3 && (rate - 3.0).abs() < 1e-3, "{drift} {rate}");
    assert!((value(&s, "C4.loop.median") - 3.0).abs() < 0.2, "the loop closes at the end of the second");
    assert!((value(&s, "C6.flow.median") - 0.03).abs() < 1e-3);
    assert_eq!(value(&s, "C7.survival_1s"), 0.0, "3 mm is beyond 2 mm");

    let late = swaying(200, |t, k| {
        let strands = moved(&t.strands, k as f64 / RATE_HZ - 0.02, |_, p| p);
        let n = strands.len();
        with_ids(strands, ids(n))
    });
    for band in ["1hz", "2hz", "4hz", "8hz"] {
        let lag = value(&late, &format!("C5.lag_{band}"));
        assert!((lag - 20.0).abs() < 0.7, "{band}: {lag} ms");
        assert!(value(&late, &format!("C5.log2_gain_{band}")).abs() < 0.03, "{band}");
    }

    // A mean over five frames: gain of a sine is sin(5x) / (5 sin x), x = π f / 100, without lag.
    let blurred = swaying(200, |t, k| {
        let at = |d: i32| moved(&t.strands, (k as f64 + f64::from(d)) / RATE_HZ, |_, p| p);
        let sets: Vec<StrandSet> = (-2..=2).map(at).collect();
        let mut mean = sets[0].clone();
        for (i, p) in mean.points.iter_mut().enumerate() {
            *p = sets.iter().map(|s| s.points[i]).sum::<Vec3>() / 5.0;
        }
        let n = mean.len();
        with_ids(mean, ids(n))
    });
    for (f, band) in [(4.0, "4hz"), (8.0, "8hz")] {
        let x = std::f64::consts::PI * f / RATE_HZ;
        let want = ((5.0 * x).sin() / (5.0 * x.sin())).log2();
        let got = value(&blurred, &format!("C5.log2_gain_{band}"));
        assert!((got - want).abs() < 0.02, "{band}: {got} for {want}");
        assert!(value(&blurred, &format!("C5.lag_{band}")).abs() < 0.2);
    }
}

#[test]
fn depth_that_flickers_or_lags_is_found() {
    let t = layers();
    // The scene stands still; its depth does what the estimate says.
    let still = |by: &dyn Fn(usize, usize) -> Option<f32>| {
        let estimate = |k: usize| Estimate {
            depth: Some(remapped(&t.views[0].depth_50, |i, z| by(i, k).map(|e| z + e))),
            ..Estimate::default()
        };
        run(30, |_| t.clone(), estimate)
    };
    assert_eq!(value(&still(&|_, _| Some(4.0)), "C3.flicker.p95"), 0.0, "a constant error does not flicker");
    let s = still(&|i, k| Some((0.5 * normal(&[i as u64, k as u64])) as f32));
    // 30 frames: the standard deviation has a relative error of 1 / √58 at each point, a hundredth over the median.
    assert!((value(&s, "C3.flicker.p50") - 0.5).abs() < 0.02, "{}", value(&s, "C3.flicker.p50"));
    assert!((0.55..0.72).contains(&value(&s, "C3.flicker.p95")));
    let s = still(&|i, k| ((i + k) % 3 == 0).then_some(0.0));
    assert_eq!(s.get("C3.flicker.p50").unwrap().value, None, "two answers in three are absent");
    let s = still(&|i, k| ((i + k) % 3 != 0).then_some(0.0));
    assert_eq!(value(&s, "C3.flicker.p50"), 0.0);
    assert!((s.get("C3.flicker.p50").unwrap().coverage - 2.0 / 3.0).abs() < 0.02);

    // Everything moves in depth; the estimate is 10 ms late. Its map is level and fills the image, so that points may
    // wander over it.
    let shift = |k: f64| (6.0 * (TAU * 2.0 * k / RATE_HZ).sin()) as f32;
    let camera_z = t.rig.cameras[0].camera_from_world.transpose() * DVec3::Z;
    let (w, h) = t.views[0].depth_50.size();
    let level = |by: f32| DepthMap::from_raw(Plane::filled(w, h, 640.0 + by));
    let truth = |k: usize| {
        let mut f = t.clone();
        let by = camera_z.as_vec3() * shift(k as f64);
        f.strands.points.iter_mut().for_each(|p| *p += by);
        let v = &mut f.views[0];
        (v.depth_50, v.depth_05, v.depth_first) =
            (level(shift(k as f64)), level(shift(k as f64)), level(shift(k as f64)));
        v.mask = Plane::filled(w, h, true);
        f
    };
    let late = |k: usize| Estimate { depth: Some(level(shift(k as f64 - 1.0))), ..Estimate::default() };
    let s = run(150, truth, late);
    // Three whole periods leak nothing. A single-precision depth of 640 mm is off by at most 3e-5 mm, a 2e5-th of the
    // motion's 6 mm: as many parts of the gain, and 4e-4 ms of the lag.
    let (lag, gain) = (value(&s, "C5.depth.lag_2hz"), value(&s, "C5.depth.log2_gain_2hz"));
    assert!((lag - 10.0).abs() < 1e-3 && gain.abs() < 1e-5, "{lag} ms, {gain}");
    assert!(s.get("C5.depth.lag_8hz").is_err(), "nothing moves at 8 Hz");
}

#[test]
fn regrown_strands_change_by_what_they_change() {
    let t = layers();
    let grown = |seed: u64| {
        let strands = mapped(&t.strands, |j, p| {
            let by = (0.7 * normal(&[seed, j as u64])) as f32;
            p.iter().map(|p| *p + Vec3::new(p.x, 0.0, p.z).normalize() * by).collect()
        });
        Estimate { strands: Some(strands), ..Estimate::default() }
    };
    let floor = flicker_floor_mm(&grown(1), &grown(2)).unwrap().unwrap();
    let mut s = SequenceScorer::new(&t).unwrap();
    for k in 0..12 {
        s.push(&t, &grown(k), &Silent).unwrap();
    }
    let s = s.finish(Some(floor)).unwrap();
    // The difference of two normal offsets: mean size 0.7 √2 √(2/π).
    let want = 0.7 * 2f64.sqrt() * (2.0 / std::f64::consts::PI).sqrt();
    // 60 strands, of which half is seen, in 11 steps: relative spread 0.75 over the root of 330; five of them.
    assert!((value(&s, "C2.regrown.mean") / want - 1.0).abs() < 0.2, "{}", value(&s, "C2.regrown.mean"));
    assert!(value(&s, "C2.above_floor").abs() < 0.5 * want);
    for id in ["C1.jitter.mean", "C4.drift.median", "C6.flow.mean"] {
        assert_eq!(s.get(id).unwrap().value, None, "{id} needs identities");
    }
    // A point computed on a curve lies on it up to rounding.
    assert!(flicker_floor_mm(&grown(1), &grown(1)).unwrap().unwrap() < 1e-12);
    assert_eq!(flicker_floor_mm(&grown(1), &Estimate::default()).unwrap(), None);
}

#[test]
fn survival_counts_strands_that_are_lost_or_swapped() {
    let s = swaying(101, |t, k| {
        let strands = moved(&t.strands, k as f64 / RATE_HZ, |_, p| p);
        let n = strands.len();
        let mut names = ids(n);
        if k >= 50 {
            // Every other strand loses its name.
            names.iter_mut().step_by(2).for_each(|i| *i += 5000);
        }
        with_ids(strands, names)
    });
    let kept = value(&s, "C7.survival_1s");
    assert!((kept - 0.5).abs() < 0.1, "{kept}");
    assert!(s.get("C7.survival_2s").is_err(), "the sequence is too short for it");
    let swapped = swaying(101, |t, k| {
        let strands = moved(&t.strands, k as f64 / RATE_HZ, |_, p| p);
        let n = strands.len();
        let mut names = ids(n);
        if k >= 50 {
            names.rotate_left(1);
        }
        with_ids(strands, names)
    });
    assert_eq!(value(&swapped, "C7.survival_1s"), 0.0, "the neighbour is 12 mm away");
    assert!(value(&swapped, "C4.drift.median") > 5.0);
}

#[test]
fn an_empty_frame_is_scored_as_absent() {
    let with_gap = |gap: bool| {
        swaying(12, move |t, k| {
            if gap && k == 6 {
                return Estimate::default();
            }
            let strands = moved(&t.strands, k as f64 / RATE_HZ, |_, p| p);
            let n = strands.len();
            with_ids(strands, ids(n))
        })
    };
    let (whole, gap) = (with_gap(false), with_gap(true));
    assert_eq!(gap.get("C2.regrown.mean").unwrap().value, None, "nothing to be near to is infinitely far");
    let coverage = |s: &SequenceSheet| s.get("C1.jitter.mean").unwrap().coverage;
    assert!(coverage(&gap) < 0.8 * coverage(&whole));
    let nothing = swaying(5, |_, _| Estimate::default());
    for s in &nothing.scores {
        assert!(s.value.is_none() && s.coverage == 0.0, "{s:?}");
    }
}

#[test]
fn time_may_run_backwards_and_threads_may_vary() {
    let t = layers();
    let frame = |k: usize| {
        let seconds = k as f64 / RATE_HZ;
        let shake = |j: usize, p: DVec3| p + DVec3::splat(0.4 * normal(&[j as u64, k as u64]));
        let strands = moved(&t.strands, seconds, shake);
        let n = strands.len();
        (truth_at(&t, seconds), with_ids(strands, ids(n)))
    };
    let run = |order: Vec<usize>| {
        let mut s = SequenceScorer::new(&frame(order[0]).0).unwrap();
        for k in order {
            let (truth, estimate) = frame(k);
            s.push(&truth, &estimate, &Silent).unwrap();
        }
        s.finish(None).unwrap()
    };
    let (forth, back) = (run((0..9).collect()), run((0..9).rev().collect()));
    for id in ["C1.jitter.mean", "C1.jitter.p95", "C2.regrown.mean", "C2.regrown.median"] {
        let (a, b) = (value(&forth, id), value(&back, id));
        assert!((a - b).abs() < 1e-6 * a, "{id}: {a} {b}");
    }
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| format!("{:?}", run((0..5).collect())))
    };
    assert!(with(1) == with(2), "scores depend on the number of threads");
}

#[test]
fn bad_sequences_are_errors() {
    let t = layers();
    let input = |r: Result<(), ScoreError>, want: &str| match r {
        Err(ScoreError::Input(m)) => assert!(m.contains(want), "{m}"),
        other => panic!("{want}: {other:?}"),
    };
    let mut s = SequenceScorer::new(&t).unwrap();
    s.push(&t, &Estimate::default(), &Silent).unwrap();
    let mut fewer = t.clone();
    fewer.strands = mapped(&t.strands, |k, p| if k == 3 { p[..20].to_vec() } else { p.to_vec() });
    fewer.visibility = {
        let mut v = strandbench_types::Visibility { offsets: vec![0], seen_by: vec![] };
        for k in 0..fewer.strands.len() {
            let n = strandbench_types::Visibility::samples_on(fewer.strands.length_mm(k));
            v.seen_by.extend(vec![3; n]);
            v.offsets.push(v.seen_by.len() as u32);
        }
        v
    };
    input(s.push(&fewer, &Estimate::default(), &Silent), "frame 1: strands, points");
    let mut nan = StrandSet::new();
    nan.push(&[Vec3::ZERO, Vec3::NAN], 0.04);
    let nan = Estimate { strands: Some(nan), ..Estimate::default() };
    input(s.push(&t, &nan, &Silent), "frame 1: the estimate's strands: strand 0, point 1");
    // A refused frame leaves the scorer as it was.
    s.push(&t, &Estimate::default(), &Silent).unwrap();
    assert_eq!(s.finish(None).unwrap().frames, 2);
    let none = SequenceScorer::new(&t).unwrap();
    input(none.finish(None).map(|_| ()), "no frames");
    let mut one = SequenceScorer::new(&t).unwrap();
    one.push(&t, &Estimate::default(), &Silent).unwrap();
    input(one.finish(Some(f64::NAN)).map(|_| ()), "flicker floor");
    let mut stopped = t.clone();
    stopped.rig.frame_rate_hz = 0.0;
    input(SequenceScorer::new(&stopped).map(|_| ()), "frame rate");
    // A single frame has no motion to score.
    let mut one = SequenceScorer::new(&t).unwrap();
    one.push(&t, &Estimate::default(), &Silent).unwrap();
    assert!(one.finish(None).unwrap().scores.is_empty());
}

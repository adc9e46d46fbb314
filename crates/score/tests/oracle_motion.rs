//! Figures over time against their second implementation, `oracle_motion.py` (numpy).

mod common;

use common::strands::{layers, mapped};
use common::{ask, normal, numpy, remapped};
use glam::{DMat3, DVec3, Vec3};
use serde_json::{Value, json};
use std::f64::consts::TAU;
use strandbench_score::SequenceScorer;
use strandbench_types::{Estimate, Silent, StrandSet, Truth, Visibility};

/// All bands of C5 lie below half of it, and two seconds are few frames.
const RATE_HZ: f64 = 24.0;

/// Strands of both layers on the side of the cameras: more of them near each other than turn a carrier.
fn chosen(all: &Truth) -> Vec<usize> {
    (0..all.strands.len()).filter(|k| (k % 30 + 5) % 30 < 10).collect()
}

/// A third of each of these.
fn short(all: &Truth) -> StrandSet {
    let mut out = StrandSet::new();
    chosen(all).iter().for_each(|&k| out.push(&all.strands.strand(k)[4..14], 0.04));
    out
}

/// The head turns and shifts, and each strand swings by itself.
fn swung(set: &StrandSet, t: f64) -> StrandSet {
    let turn = DMat3::from_rotation_y(0.1 * (TAU * t).sin());
    let shift = DVec3::new(2.0 * (TAU * 4.0 * t).sin(), (TAU * 8.0 * t).sin(), 3.0 * (TAU * 2.0 * t).cos());
    mapped(set, |k, points| {
        let bend = |i: usize| 0.02 * (i * i) as f64 * (TAU * t * 1.3 + k as f64).sin();
        let at = |(i, p): (usize, &Vec3)| turn * (p.as_dvec3() + DVec3::new(0.0, 0.0, bend(i))) + shift;
        points.iter().enumerate().map(at).map(|p| p.as_vec3()).collect()
    })
}

/// A frame's truth: strands, what is seen and depth change.
fn truth(all: &Truth, frame: usize) -> Truth {
    let t = frame as f64 / RATE_HZ;
    let mut out = Truth { strands: swung(&short(all), t), visibility: Visibility::default(), ..all.clone() };
    out.rig.frame_rate_hz = RATE_HZ;
    out.visibility.offsets.push(0);
    for (k, &own) in chosen(all).iter().enumerate() {
        let from = all.visibility.offsets[own] as usize;
        let seen = |i: usize| match (i / 9 + k + frame / 5) % 6 {
            0 => 0,
            1 => 2,
            _ => all.visibility.seen_by[from + i],
        };
        out.visibility.seen_by.extend((0..Visibility::samples_on(out.strands.length_mm(k))).map(seen));
        out.visibility.offsets.push(out.visibility.seen_by.len() as u32);
    }
    let v = &mut out.views[0];
    // Depth grows away from the camera, which looks along -z.
    let shift = -3.0 * (TAU * 2.0 * t).cos();
    for map in [&mut v.depth_50, &mut v.depth_05, &mut v.depth_first] {
        *map = remapped(map, |i, z| Some(z + shift as f32 + 0.01 * (i % 13) as f32));
    }
    out
}

/// An answer with faults of every kind: late, noisy, drifting; strands that come and go, are renamed or cut; depth with
/// gaps.
fn estimate(all: &Truth, frame: usize, named: bool) -> Estimate {
    let t = frame as f64 / RATE_HZ;
    let late = swung(&short(all), t - 0.02);
    let mut strands = StrandSet::new();
    let mut ids = Vec::new();
    for (k, points) in late.iter().enumerate() {
        if k % 4 == 1 && (7 * frame + 5 * k).is_multiple_of(23) {
            continue;
        }
        let own = |i: u64| 1.1 * normal(&[1, k as u64, i]);
        let noise = |i: u64| 0.2 * normal(&[2, k as u64, frame as u64, i]);
        let by: DVec3 = DVec3::from_array(std::array::from_fn(|i| own(i as u64) + noise(i as u64)));
        let by = by + DVec3::X * (0.3 * t * (k % 3) as f64);
        let cut = if k % 6 == 2 && frame % 10 == 3 { points.len() - 2 } else { points.len() };
        let points: Vec<Vec3> = points[..cut].iter().map(|p| (p.as_dvec3() + by).as_vec3()).collect();
        strands.push(&points, 0.04);
        ids.push(if k % 5 == 0 && frame > 30 { 5000 + k as u64 } else { 900 - k as u64 });
    }
    let depth = remapped(&truth(all, frame.saturating_sub(1)).views[0].depth_50, |i, z| {
        let there = !(i * 31 + frame * 17).is_multiple_of(5) && i % 97 != 3;
        there.then(|| z + (0.4 * normal(&[3, i as u64, frame as u64])) as f32)
    });
    Estimate {
        strands: Some(strands),
        strand_ids: named.then_some(ids),
        depth: Some(depth),
        ..Estimate::default()
    }
}

fn frame_json(t: &Truth, e: &Estimate) -> Value {
    let strands = |s: &StrandSet| s.iter().map(|p| json!(p)).collect::<Vec<_>>();
    let o = &t.visibility.offsets;
    let map = |d: &strandbench_types::DepthMap| -> Vec<Option<f32>> {
        (0..d.raw().data.len()).map(|i| d.get_index(i)).collect()
    };
    let seen = |k: usize| t.visibility.seen_by[o[k] as usize..o[k + 1] as usize].to_vec();
    json!({
        "true": strands(&t.strands), "seen_by": (0..t.strands.len()).map(seen).collect::<Vec<_>>(),
        "estimated": e.strands.as_ref().map_or(vec![], strands), "ids": e.strand_ids,
        "z_true": map(&t.views[0].depth_50), "z": e.depth.as_ref().map(map),
    })
}

/// The scorer's figures and the oracle's; `None` without numpy.
fn both(
    frames: &[(Truth, Estimate)],
    floor_mm: Option<f64>,
) -> Option<(Vec<strandbench_score::Score>, Value)> {
    let python = numpy()?;
    let mut scorer = SequenceScorer::new(&frames[0].0).unwrap();
    frames.iter().for_each(|(t, e)| scorer.push(t, e, &Silent).unwrap());
    let sheet = scorer.finish(floor_mm).unwrap();
    let c = &frames[0].0.rig.cameras[0];
    let case = json!({
        "rate_hz": RATE_HZ, "floor_mm": floor_mm,
        "camera": {
            "R": c.camera_from_world.to_cols_array(), "t": c.translation_mm, "focal": c.focal_px,
            "principal": c.principal_px, "width": c.width, "height": c.height,
        },
        "frames": frames.iter().map(|(t, e)| frame_json(t, e)).collect::<Vec<_>>(),
    });
    Some((sheet.scores, ask(&python, "oracle_motion.py", &case)))
}

fn agree(frames: &[(Truth, Estimate)], floor_mm: Option<f64>) -> Option<Value> {
    let (scores, figures) = both(frames, floor_mm)?;
    let there = figures.as_object().unwrap();
    let mut wrong = Vec::new();
    for s in &scores {
        let want = there.get(&s.metric).unwrap_or_else(|| panic!("the oracle has no {}", s.metric));
        match (s.value, want.as_f64()) {
            (Some(a), Some(b)) if (a - b).abs() < 1e-9 * b.abs().max(1.0) => {}
            (None, None) => {}
            (a, b) => wrong.push(format!("{}: {a:?} here, {b:?} there", s.metric)),
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
    assert_eq!(scores.len(), there.len(), "the oracle has figures of its own");
    Some(figures)
}

#[test]
fn an_independent_implementation_agrees() {
    let all = layers();
    let frames: Vec<_> = (0..50).map(|k| (truth(&all, k), estimate(&all, k, true))).collect();
    let Some(figures) = agree(&frames, Some(0.25)) else { return };
    // The case is no trivial one.
    let value = |id: &str| figures[id].as_f64().unwrap_or_else(|| panic!("{id} has no value"));
    for id in ["C1.jitter.mean", "C2.regrown.mean", "C3.flicker.p50", "C4.drift.median", "C6.flow.mean"] {
        assert!(value(id) > 0.1, "{id}");
    }
    for id in ["C7.survival_1s", "C7.survival_2s"] {
        assert!((0.05..0.95).contains(&value(id)), "{id}");
    }
    assert!(value("C7.survival_2s") < value("C7.survival_1s"));
    for band in ["1hz", "2hz", "4hz", "8hz"] {
        assert!(value(&format!("C5.lag_{band}")) > 10.0, "{band}");
    }
    assert!(value("C5.depth.lag_2hz") > 10.0);
}

#[test]
fn it_agrees_on_absent_frames_and_nameless_strands() {
    let all = layers();
    let gap = |k| if k == 3 { Estimate::default() } else { estimate(&all, k, true) };
    let frames: Vec<_> = (0..6).map(|k| (truth(&all, k), gap(k))).collect();
    let Some(figures) = agree(&frames, None) else { return };
    assert!(figures["C2.regrown.mean"].is_null() && figures["C1.jitter.mean"].is_f64());
    let frames: Vec<_> = (0..3).map(|k| (truth(&all, k), estimate(&all, k, false))).collect();
    let Some(figures) = agree(&frames, None) else { return };
    assert!(figures["C1.jitter.mean"].is_null() && figures["C2.regrown.mean"].is_f64());
}

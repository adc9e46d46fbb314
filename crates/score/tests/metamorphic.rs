//! Changes that must not change a score.

mod common;

use common::{Motion, RADIUS, STILL, remapped, scene, sheet, submission, value};
use glam::{DMat3, DVec3, Vec3};
use std::collections::BTreeMap;
use strandbench_score::{ScoreSheet, score};
use strandbench_types::{Estimate, Silent, StrandSet, Truth};

const LAYERS: [f64; 2] = [RADIUS, 50.0];

/// A submission with faults of every kind, so that no score is trivial.
fn faulty(truth: &Truth) -> Estimate {
    let mut e = submission(truth);
    let w = truth.views[0].mask.width;
    e.depth = Some(remapped(&truth.views[0].depth_50, |i, z| {
        let off = ((i % w) as f32 * 0.61).sin() * 4.0 + (i / w) as f32 * 0.05;
        (i % 23 != 7).then_some(z + off)
    }));
    e.envelope = Some(common::mesh(&truth.rig.cameras[0], e.depth.as_ref().unwrap()));
    let o = e.orientation.as_mut().unwrap();
    for i in 0..o.re.data.len() {
        let (a, s) = (0.6 * (i % 7) as f32, 1.0 + (i % 11) as f32);
        let (re, im) = (o.re.data[i], o.im.data[i]);
        o.re.data[i] = s * (re * a.cos() - im * a.sin());
        o.im.data[i] = s * (re * a.sin() + im * a.cos());
    }
    // Lines leant towards the camera's own axes, so that they move with it.
    let right = truth.rig.cameras[0].camera_from_world.transpose() * DVec3::new(0.7, 0.1, 0.5);
    for (i, d) in e.orientation_3d.as_mut().unwrap().data.iter_mut().enumerate() {
        if *d != Vec3::ZERO {
            let sign = d.dot(right.as_vec3()).signum();
            *d += right.as_vec3() * sign * 0.3 * (i % 3) as f32;
        }
    }
    e
}

fn figures(s: &ScoreSheet) -> BTreeMap<(String, String), (Option<f64>, f64, u64)> {
    let figure = |s: &strandbench_score::Score| (s.value, s.coverage, s.wanted);
    s.scores.iter().map(|s| ((s.metric.clone(), s.subject.clone()), figure(s))).collect()
}

#[test]
fn moving_the_world_moves_no_score() {
    let axis = DVec3::new(0.3, -0.8, 0.5).normalize();
    let motion =
        Motion { rotation: DMat3::from_axis_angle(axis, 1.1), shift: DVec3::new(150.0, -90.0, 260.0) };
    let (still, moved) = (scene(&STILL, &LAYERS), scene(&motion, &LAYERS));
    let (a, b) = (sheet(&still, &faulty(&still)), sheet(&moved, &faulty(&moved)));
    let (a, b) = (figures(&a), figures(&b));
    assert_eq!(a.len(), b.len());
    for (name, (va, ca, wa)) in &a {
        let (vb, cb, wb) = &b[name];
        assert_eq!((ca, wa), (cb, wb), "{name:?}");
        // 32-bit coordinates carry 3e-5 mm at 500 mm; a share may move by a few of its samples.
        let step = if name.0.contains("within") || name.0.contains("over") { 2e-3 } else { 1e-3 };
        match (va, vb) {
            (Some(va), Some(vb)) => assert!((va - vb).abs() <= step, "{name:?}: {va} {vb}"),
            _ => assert_eq!(va, vb, "{name:?}"),
        }
    }
    let depth_rows = a.keys().filter(|(m, s)| m.starts_with("A1") && s == "method");
    assert!(depth_rows.clone().count() > 50);
    for k in depth_rows.filter(|(m, _)| !m.contains("voxel") && !m.ends_with("cc")) {
        assert!(a[k].0 == b[k].0, "depth along the ray does not know the world: {k:?}");
    }
}

#[test]
fn the_order_of_the_other_cameras_matters_to_nobody() {
    let t = scene(&STILL, &LAYERS);
    let mut swapped = t.clone();
    swapped.rig.cameras.swap(1, 2);
    swapped.views.swap(1, 2);
    for bits in &mut swapped.visibility.seen_by {
        *bits = *bits & 1 | (*bits & 2) << 1 | (*bits & 4) >> 1;
    }
    let mut a = figures(&sheet(&t, &faulty(&t)));
    let b = figures(&sheet(&swapped, &faulty(&swapped)));
    for subject in ["method", "N0", "N1", "N2", "NC", "C"] {
        let key = |c: u32| (format!("A4.iou.{c}"), subject.to_owned());
        assert_ne!(a[&key(1)], a[&key(2)], "the two cameras must see something different");
        let (one, two) = (a[&key(1)], a[&key(2)]);
        a.insert(key(1), two);
        a.insert(key(2), one);
        // A mean of two numbers in another order may differ in its last bit.
        let mean = ("A4.iou.mean".to_owned(), subject.to_owned());
        assert!((a[&mean].0.unwrap() - b[&mean].0.unwrap()).abs() < 1e-15);
        a.insert(mean.clone(), b[&mean]);
    }
    assert_eq!(a, b);
}

#[test]
fn the_same_curves_through_other_vertices_score_the_same() {
    let t = scene(&STILL, &LAYERS);
    let mut other = t.clone();
    other.strands = StrandSet::new();
    for (k, points) in t.strands.iter().enumerate() {
        let mut finer = vec![points[0]];
        for (j, w) in points.windows(2).enumerate() {
            let parts = 1 + (j * 7 + k) % 4;
            finer.extend((1..=parts).map(|i| w[0].lerp(w[1], i as f32 / parts as f32)));
        }
        other.strands.push(&finer, 0.04);
    }
    assert!(other.strands.points.len() > 2 * t.strands.points.len());
    let (a, b) = (sheet(&t, &faulty(&t)), sheet(&other, &faulty(&t)));
    for id in ["A2.within_10mm", "A2.median", "A2.p95", "A2.pushed.median", "A2.pushed.within_10mm"] {
        assert!((value(&a, id) - value(&b, id)).abs() < 1e-4, "{id}: {} {}", value(&a, id), value(&b, id));
    }
    assert!(value(&a, "A2.median") > 0.1);
    // The order of strands, and their direction, are no part of a distance either.
    let mut turned = t.clone();
    turned.strands = StrandSet::new();
    turned.visibility = strandbench_types::Visibility { offsets: vec![0], seen_by: vec![] };
    for k in (0..t.strands.len()).rev() {
        turned.strands.push(t.strands.strand(k), 0.04);
        let v = &t.visibility;
        turned.visibility.seen_by.extend(&v.seen_by[v.offsets[k] as usize..v.offsets[k + 1] as usize]);
        turned.visibility.offsets.push(turned.visibility.seen_by.len() as u32);
    }
    let c = sheet(&turned, &faulty(&t));
    let of_method = |s: &ScoreSheet| {
        let f = figures(s).into_iter();
        f.filter(|(k, _)| k.1 == "method" && !k.0.ends_with("cc")).collect::<Vec<_>>()
    };
    assert_eq!(of_method(&a), of_method(&c));
}

#[test]
fn threads_change_no_bit() {
    let t = scene(&STILL, &LAYERS);
    let e = faulty(&t);
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| score(&t, &e, 3, &Silent).unwrap())
    };
    let text = |s: &ScoreSheet| format!("{s:?}");
    assert!(text(&run(1)) == text(&run(3)), "scores depend on the number of threads");
}

#[test]
fn hidden_hair_is_no_part_of_luos_figure() {
    let mut t = scene(&STILL, &LAYERS);
    let e = submission(&t);
    let both = value(&sheet(&t, &e), "A2.pushed.median");
    // The inner layer no longer seen: the pushed envelope loses its neighbours.
    let inner = t.visibility.offsets[90] as usize;
    t.visibility.seen_by[inner..].fill(0);
    let outer = value(&sheet(&t, &e), "A2.pushed.median");
    assert!(outer > both + 3.0, "{outer} {both}");
}

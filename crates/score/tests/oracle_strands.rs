//! Strand figures against their second implementation, `oracle_strands.py` (numpy).

mod common;

use common::strands::{layers, mapped, of};
use glam::Vec3;
use serde_json::{Value, json};
use strandbench_rng::Rng;
use strandbench_types::{StrandSet, Truth, Visibility};

/// A small case with faults of every kind: noise, turned and reversed strands, fragments, copies, strays, gaps in
/// visibility.
fn case() -> (Truth, StrandSet) {
    let all = layers();
    let mut t = Truth { strands: StrandSet::new(), visibility: Visibility::default(), ..all.clone() };
    t.visibility.offsets.push(0);
    for k in (0..all.strands.len()).step_by(3) {
        let points = &all.strands.strand(k)[4..14];
        t.strands.push(points, 0.04);
        let n = Visibility::samples_on(t.strands.length_mm(t.strands.len() - 1));
        let from = all.visibility.offsets[k] as usize;
        let seen =
            |i: usize| if (i / 9 + k).is_multiple_of(4) { 1 } else { all.visibility.seen_by[from + i] };
        t.visibility.seen_by.extend((0..n).map(seen));
        t.visibility.offsets.push(t.visibility.seen_by.len() as u32);
    }
    let noisy = mapped(&t.strands, |k, points| {
        let mut r = Rng::keyed(&[11, k as u64]);
        let offset = Vec3::new(r.range(-1.5, 1.5), r.range(-2.0, 2.0), r.range(-1.5, 1.5));
        let bend = r.range(-0.02, 0.02);
        let at = |(i, p): (usize, &Vec3)| {
            *p + offset + Vec3::new(bend * (i * i) as f32, 0.1 * r.range(-1.0, 1.0), 0.1 * r.range(-1.0, 1.0))
        };
        points.iter().enumerate().map(at).collect()
    });
    let mut e = StrandSet::new();
    for (k, points) in noisy.iter().enumerate() {
        match k % 5 {
            0 => e.push(&points.iter().rev().copied().collect::<Vec<_>>(), 0.04),
            1 => {
                e.push(&points[..5], 0.04);
                e.push(&points[4..], 0.04);
            }
            2 => {
                e.push(points, 0.04);
                e.push(points, 0.04);
            }
            3 => e.push(&points.iter().map(|p| *p * 1.2).collect::<Vec<_>>(), 0.04),
            _ => e.push(points, 0.04),
        }
    }
    e.push(&[Vec3::ZERO, Vec3::new(9.0, 3.0, 4.0)], 0.04);
    (t, e)
}

fn json(t: &Truth, e: &StrandSet) -> Value {
    let strands = |s: &StrandSet| s.iter().map(|p| json!(p)).collect::<Vec<_>>();
    let o = &t.visibility.offsets;
    json!({
        "true": strands(&t.strands), "estimated": strands(e),
        "seen_by": (0..t.strands.len())
            .map(|k| t.visibility.seen_by[o[k] as usize..o[k + 1] as usize].to_vec())
            .collect::<Vec<_>>(),
        "cameras": t.rig.cameras.iter().zip(&t.views).map(|(c, v)| json!({
            "R": c.camera_from_world.to_cols_array(), "t": c.translation_mm, "focal": c.focal_px,
            "principal": c.principal_px, "width": c.width, "height": c.height,
            "first": (0..v.mask.data.len()).map(|i| v.depth_first.get_index(i)).collect::<Vec<_>>(),
        })).collect::<Vec<_>>(),
    })
}

#[test]
fn an_independent_implementation_agrees() {
    let Some(python) = common::numpy() else { return };
    let (t, e) = case();
    let s = of(&t, &e);
    let figures = common::ask(&python, "oracle_strands.py", &json(&t, &e));
    let figures = figures.as_object().unwrap();
    let mut compared = 0;
    let mut wrong = Vec::new();
    for score in s.scores.iter().filter(|s| s.subject == "method" && !s.metric.ends_with(".cc")) {
        let want = figures.get(&score.metric).unwrap_or_else(|| panic!("the oracle has no {}", score.metric));
        match (score.value, want.as_f64()) {
            (Some(a), Some(b)) if (a - b).abs() < 1e-9 * b.abs().max(1.0) => {}
            (None, None) => {}
            (a, b) => wrong.push(format!("{}: {a:?} here, {b:?} there", score.metric)),
        }
        compared += 1;
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
    assert_eq!(compared, figures.len(), "the oracle has figures of its own");
    // The case is no trivial one.
    for id in ["B1.precision_2mm", "B1.recall_2mm", "B3.idf1", "B4.direction", "B1.unobserved"] {
        assert!((0.02..0.98).contains(&figures[id].as_f64().unwrap()), "{id}");
    }
}

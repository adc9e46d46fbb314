//! The scorer against its second implementation, `oracle.py` (numpy).

mod common;

use common::{RADIUS, STILL, remapped, scene, sheet, submission};
use serde_json::{Value, json};
use strandbench_rng::Rng;
use strandbench_types::{DepthMap, Estimate, OrientationField, Plane, Truth};

/// An estimate with random faults: noise, gaps, wrong lines, absent lines.
fn random(truth: &Truth, seed: u64) -> Estimate {
    let rng = |what: u64, i: usize| Rng::keyed(&[seed, what, i as u64]);
    let depth = remapped(&truth.views[0].depth_50, |i, z| {
        let mut r = rng(0, i);
        (r.f32() > 0.03).then(|| z + r.range(-1.0, 1.0) * r.range(0.0, 12.0))
    });
    let mut e = submission(truth);
    e.envelope = Some(common::mesh(&truth.rig.cameras[0], &depth));
    e.depth = Some(depth);
    let (w, h) = truth.views[0].mask.size();
    let plane = |what: u64| {
        let at = |i: usize| if rng(9, i).f32() < 0.05 { 0.0 } else { rng(what, i).range(-2.0, 2.0) };
        Plane::from_vec(w, h, (0..w * h).map(at).collect())
    };
    e.orientation = Some(OrientationField { re: plane(1), im: plane(2) });
    let noise = plane(3);
    let axis = e.orientation_3d.as_mut().unwrap();
    for (i, d) in axis.data.iter_mut().enumerate() {
        if i % 17 == 3 {
            *d = glam::Vec3::ZERO;
        }
        d.x += noise.data[i];
    }
    e
}

fn map(depth: &DepthMap) -> Vec<Value> {
    (0..depth.raw().data.len()).map(|i| json!(depth.get_index(i))).collect()
}

/// Everything that the oracle needs, plain arrays of numbers, null where absent.
fn case(t: &Truth, e: &Estimate) -> Value {
    let (c, v) = (&t.rig.cameras[0], &t.views[0]);
    let field = e.orientation.as_ref().unwrap();
    let envelope = e.envelope.as_ref().unwrap();
    json!({
        "width": c.width, "height": c.height, "focal": c.focal_px, "principal": c.principal_px,
        "eye": c.centre_mm(), "near": t.rig.near_mm, "far": t.rig.far_mm,
        "cameras": t.rig.cameras.iter().zip(&t.views).map(|(c, v)| json!({
            "R": c.camera_from_world.to_cols_array(), "t": c.translation_mm, "focal": c.focal_px,
            "principal": c.principal_px, "mask": v.mask.data,
        })).collect::<Vec<_>>(),
        "first": map(&v.depth_first), "c05": map(&v.depth_05), "c50": map(&v.depth_50),
        "mask": v.mask.data, "true_axis": v.orientation_3d.data,
        "true_line": v.orientation_2d.data.iter().map(|a| (!a.is_nan()).then_some(*a)).collect::<Vec<_>>(),
        "points": t.strands.points, "offsets": t.strands.offsets,
        "sample_offsets": t.visibility.offsets, "seen_by": t.visibility.seen_by,
        "depth": map(e.depth.as_ref().unwrap()), "re": field.re.data, "im": field.im.data,
        "axis": e.orientation_3d.as_ref().unwrap().data,
        "vertices": envelope.vertices, "triangles": envelope.triangles,
    })
}

#[test]
fn an_independent_implementation_agrees() {
    let mut t = scene(&STILL, &[RADIUS, 47.0]);
    // The oracle compares every point with every piece of strand: leave it one strand in twelve.
    for k in (0..t.strands.len()).filter(|k| k % 12 != 0) {
        let samples = t.visibility.offsets[k] as usize..t.visibility.offsets[k + 1] as usize;
        t.visibility.seen_by[samples].fill(0);
    }
    let e = random(&t, 1);
    let s = sheet(&t, &e);
    let Some(python) = common::numpy() else { return };
    let figures = common::ask(&python, "oracle.py", &case(&t, &e));
    let figures = figures.as_object().unwrap();
    let mut compared = 0;
    for score in &s.scores {
        let id = format!("{} {}", score.subject, score.metric);
        // Random depths (and N0's random lines) are no concern of the oracle's, nor is what is derived from others.
        let random = match score.subject.as_str() {
            "N0" => !score.metric.starts_with("A3"),
            "N1" => ["A1", "A2", "A4"].iter().any(|m| score.metric.starts_with(m)),
            _ => false,
        };
        if random || id.ends_with(".cc") {
            continue;
        }
        let want = figures.get(&id).unwrap_or_else(|| panic!("the oracle has no {id}"));
        match (score.value, want.as_f64()) {
            (Some(a), Some(b)) => assert!((a - b).abs() < 1e-9, "{id}: {a} here, {b} there"),
            (a, b) => assert_eq!(a, b, "{id}"),
        }
        compared += 1;
    }
    assert_eq!(compared, figures.len(), "the oracle has figures of its own");
}

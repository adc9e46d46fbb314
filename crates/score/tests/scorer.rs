//! Estimates with known faults score what their faults are.

mod common;

use common::{RADIUS, STILL, mesh, remapped, row, scene, sheet, submission, value};
use glam::{DQuat, Vec3};
use strandbench_score::METRICS;
use strandbench_types::{DepthMap, Estimate, OrientationField, Plane, Truth};

fn truth() -> Truth {
    scene(&STILL, &[RADIUS])
}

#[test]
fn truth_scores_perfectly() {
    let t = truth();
    let s = sheet(&t, &submission(&t));
    for id in ["A1", "A1.rim"] {
        for name in ["median", "mad", "p95", "bias_mean", "over_1mm", "over_10mm", "over_0.5px"] {
            assert_eq!(value(&s, &format!("{id}.{name}")), 0.0, "{id}.{name}");
        }
    }
    assert_eq!((value(&s, "A1.voxel.p95"), value(&s, "A1.voxel.over_1mm")), (0.0, 0.0));
    // First hit and 5 % lie 3 and 2 mm in front of it in this scene.
    for (id, want) in [("A1.first.bias_median", 3.0), ("A1.c05.median", 2.0), ("A1.first.over_2mm", 1.0)] {
        assert!((value(&s, id) - want).abs() < 1e-4, "{id}");
    }
    for id in ["A3.completeness", "A2.within_10mm", "A5.within_10deg", "B7.within_10deg"] {
        assert_eq!((value(&s, id), row(&s, id).coverage), (1.0, 1.0), "{id}");
    }
    // A surface through the strands' own cylinder is as near to them as their spacing of 4.2 mm allows.
    assert!(value(&s, "A2.p95") < 2.2 && value(&s, "A2.median") > 0.5);
    assert_eq!(value(&s, "A5.p90"), 0.0);
    assert!(value(&s, "B7.p90") < 1e-4);
    // Pixels that belong to no square of four are no part of the mesh.
    assert!(value(&s, "A4.iou.0") > 0.99);
    for id in METRICS.iter().map(|m| m.id).filter(|id| id.ends_with(".cc")) {
        assert_eq!(value(&s, id), 1.0, "{id}");
    }
    let errors: Vec<f32> = s.depth_error_mm.data.iter().copied().filter(|e| !e.is_nan()).collect();
    assert_eq!(errors.len(), t.views[0].depth_50.answered());
    assert!(errors.iter().all(|&e| e == 0.0));
}

#[test]
fn a_shift_along_the_rays_scores_its_size() {
    let t = truth();
    let perfect = submission(&t);
    for mm in [-10.0f32, -4.0, -1.0, -0.25, 0.25, 0.5, 1.0, 2.0, 5.0, 10.0] {
        let depth = remapped(&t.views[0].depth_50, |_, z| Some(z + mm));
        let s = sheet(&t, &Estimate { depth: Some(depth), ..perfect.clone() });
        let size = f64::from(mm.abs());
        for id in ["A1.median", "A1.p90", "A1.p95", "A1.rim.median", "A1.voxel.median", "A1.voxel.p90"] {
            assert_eq!(value(&s, id), size, "{id} at {mm} mm");
        }
        for id in ["A1.bias_mean", "A1.bias_median", "A1.rim.bias_median"] {
            assert_eq!(value(&s, id), f64::from(mm), "{id}");
        }
        assert!((value(&s, "A1.first.bias_mean") - f64::from(mm) - 3.0).abs() < 1e-4);
        assert_eq!(value(&s, "A1.mad"), 0.0);
        for limit in [1.0, 2.0, 5.0, 10.0] {
            let beyond = if size > limit { 1.0 } else { 0.0 };
            for id in ["A1", "A1.rim", "A1.voxel"] {
                let got = value(&s, &format!("{id}.over_{limit}mm"));
                assert!((got - beyond).abs() < 1e-12, "{id} at {mm} beyond {limit}: {got}");
            }
        }
        // At 640 to 690 mm and 240 px a footprint is 2.7 to 2.9 mm.
        for (px, name) in [(0.5, "0.5"), (1.0, "1"), (2.0, "2"), (4.0, "4")] {
            let got = value(&s, &format!("A1.over_{name}px"));
            if size > 2.9 * px || size < 2.65 * px {
                assert_eq!(got, if size > 2.9 * px { 1.0 } else { 0.0 }, "{mm} mm beyond {px} px");
            }
        }
    }
}

#[test]
fn a_turn_of_the_lines_scores_its_angle() {
    let t = truth();
    let perfect = submission(&t);
    let v = &t.views[0];
    for deg in [1.0f64, 5.0, 11.0, 19.0, 21.0, 29.0, 40.0, 90.0, 120.0, 179.0] {
        let turn = deg.to_radians();
        let across = |d: Vec3| {
            let d = d.as_dvec3();
            (DQuat::from_axis_angle(d.any_orthonormal_vector(), turn) * d * 3.0).as_vec3()
        };
        let axis = v.orientation_3d.map(|&d| if d == Vec3::ZERO { d } else { across(d) });
        let line = |f: fn(f64) -> f64| {
            v.orientation_2d.map(|&a| if a.is_nan() { 0.0 } else { f(2.0 * (f64::from(a) + turn)) as f32 })
        };
        let orientation = OrientationField { re: line(f64::cos), im: line(f64::sin) };
        let s = sheet(
            &t,
            &Estimate { orientation: Some(orientation), orientation_3d: Some(axis), ..perfect.clone() },
        );
        // A line turned by more than 90 degrees is on its way back.
        let size = deg.min(180.0 - deg);
        for id in ["A5", "B7"] {
            for name in ["median", "p90"] {
                let got = value(&s, &format!("{id}.{name}"));
                assert!((got - size).abs() < 2e-4, "{id}.{name}: {got} for {deg}");
            }
            for limit in [10.0, 20.0, 30.0] {
                let want = if size <= limit { 1.0 } else { 0.0 };
                assert_eq!(value(&s, &format!("{id}.within_{limit}deg")), want, "{id} {deg} within {limit}");
            }
        }
        assert_eq!(value(&s, "A1.p95"), 0.0, "depth does not depend on lines");
    }
}

#[test]
fn silence_is_worst() {
    let t = truth();
    let empty = sheet(&t, &Estimate::default());
    for s in empty.scores.iter().filter(|s| s.subject == "method" && !s.metric.ends_with(".cc")) {
        assert_eq!(s.coverage, 0.0, "{}", s.metric);
        match (s.unit.as_str(), s.lower_is_better) {
            ("share", true) => assert!(s.value.is_some_and(|v| (v - 1.0).abs() < 1e-12), "{}", s.metric),
            ("share", false) => assert_eq!(s.value, Some(0.0), "{}", s.metric),
            _ => assert_eq!(s.value, None, "{}", s.metric),
        }
        assert!(s.wanted > 0, "{}", s.metric);
    }
    assert!(empty.depth_error_curves[0].1.iter().all(|e| *e == f32::INFINITY));
    assert!(empty.orientation_by_confidence.is_empty());
    // Worse than any null, so never above chance.
    assert!(value(&empty, "A1.within_10mm.cc") < 0.0 && value(&empty, "B7.within_30deg.cc") < 0.0);
    let nowhere = DepthMap::empty(72, 64);
    let same = sheet(&t, &Estimate { depth: Some(nowhere), ..Estimate::default() });
    assert_eq!(same.scores, empty.scores);
}

#[test]
fn absent_pixels_take_the_last_places() {
    let t = truth();
    let inner: Vec<usize> = {
        let s = sheet(&t, &submission(&t));
        assert_eq!(s.depth_error_curves[0].1.len() as u64, row(&s, "A1.median").wanted);
        (0..s.depth_error_mm.data.len()).filter(|&i| !s.depth_error_mm.data[i].is_nan()).collect()
    };
    // Every fifth hair pixel withdrawn, the others 3 mm off.
    let gone = |i: usize| inner.binary_search(&i).is_ok_and(|k| k % 5 == 0);
    let depth = remapped(&t.views[0].depth_50, |i, z| (!gone(i)).then_some(z + 3.0));
    let s = sheet(&t, &Estimate { depth: Some(depth), ..submission(&t) });
    let coverage = row(&s, "A1.median").coverage;
    assert!((coverage - 0.8).abs() < 0.02, "{coverage}");
    assert_eq!((value(&s, "A1.median"), value(&s, "A1.bias_mean"), value(&s, "A1.mad")), (3.0, 3.0, 0.0));
    assert_eq!((row(&s, "A1.p90").value, row(&s, "A1.voxel.p95").value), (None, None));
    assert_eq!(value(&s, "A1.over_2mm"), 1.0);
    assert!((value(&s, "A1.over_5mm") - (1.0 - coverage)).abs() < 1e-12);
    assert!((value(&s, "A1.over_10mm") - (1.0 - coverage)).abs() < 1e-12);
    let hair = inner.len() as f64;
    assert_eq!(value(&s, "A3.completeness"), (0..inner.len()).filter(|k| k % 5 != 0).count() as f64 / hair);
}

#[test]
fn a_pushed_envelope_shows_in_depth_and_barely_in_luos_figure() {
    // Hair through which one sees deeper layers, as real hair is.
    let t = scene(&STILL, &[RADIUS, 52.0, 44.0, 36.0]);
    let depth = remapped(&t.views[0].depth_50, |_, z| Some(z + 20.0));
    let envelope = mesh(&t.rig.cameras[0], &depth);
    let s = sheet(&t, &Estimate { depth: Some(depth), envelope: Some(envelope), ..submission(&t) });
    let good = sheet(&t, &submission(&t));
    assert_eq!((value(&s, "A1.median"), value(&s, "A1.over_10mm")), (20.0, 1.0));
    let (pushed, straight) = (value(&s, "A2.within_10mm"), value(&good, "A2.within_10mm"));
    assert!(straight == 1.0 && pushed > 0.9, "{pushed} against {straight}");
    // One in ten at most notices what has made every depth wrong. The scorer's own control, 20 mm along the rays, tells nearly the same.
    assert!((value(&good, "A2.pushed.within_10mm") - pushed).abs() < 0.03);
    assert!((value(&good, "A2.pushed.median") - value(&s, "A2.median")).abs() < 0.3);
}

#[test]
fn confidence_and_the_worst_block_point_at_the_faults() {
    let t = truth();
    let v = &t.views[0];
    let w = v.mask.width;
    // Strength grows to the right and the error shrinks: 40 degrees left of column 36, none right of it.
    let line = |f: fn(f64) -> f64| {
        let at = |i: usize| {
            let a = f64::from(v.orientation_2d.data[i]);
            if a.is_nan() {
                return 0.0;
            }
            let off: f64 = if i % w < 36 { 40.0 } else { 0.0 };
            (f(2.0 * (a + off.to_radians())) * (1.0 + (i % w) as f64)) as f32
        };
        Plane::from_vec(w, v.mask.height, (0..v.mask.data.len()).map(at).collect())
    };
    let orientation = OrientationField { re: line(f64::cos), im: line(f64::sin) };
    let depth = remapped(&v.depth_50, |i, z| Some(if i % w >= 32 && i / w < 32 { z + 6.0 } else { z + 1.0 }));
    let s = sheet(&t, &Estimate { depth: Some(depth), orientation: Some(orientation), ..submission(&t) });
    let bins = &s.orientation_by_confidence;
    assert_eq!(bins.len(), 10);
    assert_eq!(bins.iter().map(|b| b.pixels).sum::<u64>(), row(&s, "B7.median").wanted);
    assert!(bins.windows(2).all(|b| b[0].strength.1 <= b[1].strength.0));
    assert!((bins[0].median_deg - 40.0).abs() < 1e-3 && bins[0].within == [0.0; 3], "{:?}", bins[0]);
    assert!(bins[9].median_deg < 1e-3 && bins[9].within == [1.0; 3], "{:?}", bins[9]);
    let worst = s.worst_region.unwrap();
    assert_eq!((worst.x, worst.y, worst.size, worst.median_mm), (32, 0, 32, Some(6.0)));
}

#[test]
fn directions_may_have_any_length_but_zero_is_absent() {
    let t = truth();
    let mut e = submission(&t);
    let axis = e.orientation_3d.as_mut().unwrap();
    for (i, d) in axis.data.iter_mut().enumerate() {
        *d *= if i % 2 == 0 { -7.0 } else { 0.0 };
    }
    let s = sheet(&t, &e);
    let half = row(&s, "A5.median").coverage;
    assert!((half - 0.5).abs() < 0.05, "{half}");
    assert_eq!(value(&s, "A5.within_10deg"), half);
    assert_eq!(row(&s, "A5.p90").value, None);
}

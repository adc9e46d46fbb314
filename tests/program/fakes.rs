//! Fake methods with known outcomes through the same scoring stage as any method.

use crate::support::{SCENE, VARIANT, fails, finished, folder, ok};
use glam::Vec3;
use serde_json::Value;
use std::path::Path;
use strandbench_types::{DepthMap, Estimate, Truth};

fn truth() -> Truth {
    strandbench_io::read_truth(&finished().join("out").join(SCENE).join("render/truth")).unwrap()
}

/// Scores an estimate with the program and returns `scores.json`.
fn scored(name: &str, estimate: &Estimate) -> Value {
    let dir = folder(name);
    strandbench_io::write_estimate(&dir.join("estimate"), estimate).unwrap();
    score(&dir)
}

fn score(dir: &Path) -> Value {
    let truth = finished().join("out").join(SCENE).join("render/truth");
    ok(dir, &["score", "estimate", "--truth", truth.to_str().unwrap(), "--out", "score"]);
    serde_json::from_slice(&std::fs::read(dir.join("score/scores.json")).unwrap()).unwrap()
}

fn figure<'a>(scores: &'a Value, metric: &str, subject: &str) -> &'a Value {
    let all = scores["scores"].as_array().unwrap();
    all.iter()
        .find(|s| s["metric"] == metric && s["subject"] == subject)
        .unwrap_or_else(|| panic!("{metric} of {subject}"))
}

fn shifted(map: &DepthMap, by_mm: f32) -> DepthMap {
    let mut moved = map.clone();
    let (width, height) = map.size();
    for y in 0..height {
        for x in 0..width {
            moved.set(x, y, map.get(x, y).map(|z| z + by_mm));
        }
    }
    moved
}

#[test]
fn the_oracle_is_perfect() {
    let truth = truth();
    let view = &truth.views[0];
    let estimate = Estimate {
        depth: Some(view.depth_50.clone()),
        orientation_3d: Some(view.orientation_3d.clone()),
        ..Estimate::default()
    };
    let scores = scored("oracle", &estimate);
    for metric in ["A1.median", "A1.p95", "A1.over_1mm", "A5.median"] {
        assert!(figure(&scores, metric, "method")["value"].as_f64().unwrap().abs() < 1e-6, "{metric}");
    }
    assert_eq!(figure(&scores, "A3.completeness", "method")["value"], 1.0);
    assert!(figure(&scores, "A1.median", "N0")["value"].as_f64().unwrap() > 3.0, "the nulls stand beside it");
}

#[test]
fn a_shift_of_three_millimetres_is_three_millimetres() {
    let estimate = Estimate { depth: Some(shifted(&truth().views[0].depth_50, 3.0)), ..Estimate::default() };
    let scores = scored("shifted", &estimate);
    for metric in ["A1.median", "A1.p95", "A1.bias_median"] {
        let value = figure(&scores, metric, "method")["value"].as_f64().unwrap();
        assert!((value - 3.0).abs() < 1e-3, "{metric} is {value}");
    }
    assert_eq!(figure(&scores, "A1.over_2mm", "method")["value"], 1.0);
    assert_eq!(figure(&scores, "A1.over_5mm", "method")["value"], 0.0);
    assert_eq!(figure(&scores, "A5.median", "method")["value"], Value::Null, "it said nothing of directions");
}

#[test]
fn saying_nothing_is_the_worst_answer() {
    let (width, height) = truth().views[0].mask.size();
    let estimate = Estimate { depth: Some(DepthMap::empty(width, height)), ..Estimate::default() };
    let scores = scored("empty", &estimate);
    let median = figure(&scores, "A1.median", "method");
    assert_eq!((&median["value"], &median["coverage"]), (&Value::Null, &0.0.into()));
    assert_eq!(figure(&scores, "A1.over_10mm", "method")["value"], 1.0);
    assert_eq!(figure(&scores, "A3.completeness", "method")["value"], 0.0);
}

#[test]
fn nonsense_is_refused_and_named() {
    let dir = folder("nonsense");
    let truth_dir = finished().join("out").join(SCENE).join("render/truth");
    let args = ["score", "estimate", "--truth", truth_dir.to_str().unwrap(), "--out", "score"];

    std::fs::create_dir(dir.join("estimate")).unwrap();
    assert!(fails(&dir, &args).contains("estimate"), "an empty folder is no estimate");

    let other = Estimate { depth: Some(DepthMap::empty(7, 5)), ..Estimate::default() };
    strandbench_io::write_estimate(&dir.join("estimate"), &other).unwrap();
    let error = fails(&dir, &args);
    assert!(error.contains("7x5") || error.contains("7 x 5"), "another size: {error}");

    // A NaN is written as it is; whoever reads it must refuse it.
    let view = &truth().views[0];
    let mut lines = view.orientation_3d.clone();
    let hair = view.mask.data.iter().position(|&m| m).unwrap();
    lines.data[hair] = Vec3::splat(f32::NAN);
    std::fs::remove_dir_all(dir.join("estimate")).unwrap();
    let estimate = Estimate { orientation_3d: Some(lines), ..Estimate::default() };
    strandbench_io::write_estimate(&dir.join("estimate"), &estimate).unwrap();
    let error = fails(&dir, &args);
    assert!(error.contains("finite") || error.contains("NaN"), "{error}");
    assert!(!dir.join("score").exists(), "no score came of any of it");
}

#[test]
fn scores_do_not_depend_on_where_the_estimate_lies() {
    let out = finished().join("out").join(SCENE);
    let estimate = strandbench_io::read_estimate(&out.join(VARIANT).join("reconstruct/estimate")).unwrap();
    let scores = scored("elsewhere", &estimate);
    let there: Value =
        serde_json::from_slice(&std::fs::read(out.join(VARIANT).join("score/scores.json")).unwrap()).unwrap();
    assert_eq!(scores, there);
}

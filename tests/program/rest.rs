//! The flicker floor of C2: which two answers it may be taken from.

use crate::sequence::{SETTINGS, finished, value};
use crate::support::{TINY, copy, fails, folder, ok};
use std::path::Path;

const VARIANT: &str = "mine";

/// Renders two frames of hair at rest and answers to them: `<name>/render` and `<name>/mine`.
fn at_rest(dir: &Path, name: &str, more: &[&str], answer: bool) {
    std::fs::write(
        dir.join("still.toml"),
        format!("{TINY}\n[motion]\nframes = 2\n\n[motion.solver]\nguides = 100\n"),
    )
    .unwrap();
    let sampling = ["--set", SETTINGS[0], "--set", SETTINGS[1]];
    ok(dir, &[&["render", "--scene", "still.toml", "--out", name], &sampling[..], more].concat());
    let made = std::fs::read_dir(dir.join(name)).unwrap().flatten().find(|e| e.path().is_dir()).unwrap();
    std::fs::rename(made.path().join("render"), dir.join(name).join("render")).unwrap();
    if answer {
        let (render, out) = (format!("{name}/render"), format!("{name}/{VARIANT}/reconstruct"));
        let recon: Vec<&str> = SETTINGS[2..].iter().flat_map(|s| ["--set", s]).collect();
        ok(dir, &[&["reconstruct", &render, "--variant", "luo-strands", "--out", &out], &recon[..]].concat());
    }
}

#[test]
fn a_flicker_floor_is_of_the_same_hair_at_rest_with_other_noise() {
    let dir = folder("rest");
    at_rest(&dir, "a", &[], true);
    at_rest(&dir, "b", &["--set", "render.noise=1"], true);
    let image = |name: &str| std::fs::read(dir.join(name).join("render/000000/frame/center.exr")).unwrap();
    assert!(image("a") != image("b"), "noise is drawn anew");
    for same in ["exposure/exposure.json", "000000/frame/rig.json"] {
        let read = |name: &str| std::fs::read(dir.join(name).join("render").join(same)).unwrap();
        assert!(read("a") == read("b"), "{same}");
    }
    ok(&dir, &["score", "a/mine", "--rest", "a/mine", "b/mine"]);
    let scores = value(&dir.join("a/mine/score/all/scores.json"));
    let find = |metric: &str| {
        let scores = scores["scores"].as_array().unwrap();
        scores.iter().find(|s| s["metric"] == metric && s["subject"] == "method").unwrap()["value"]
            .as_f64()
            .unwrap()
    };
    let floor = find("C2.regrown.mean") - find("C2.above_floor");
    assert!(floor > 0.0, "two draws of noise do not give the same strands: {floor}");

    let refused = |other: &str| fails(&dir, &["score", "a/mine", "--rest", "a/mine", other, "--out", "not"]);
    let error = refused("a/mine");
    assert!(error.contains("the very images") && error.contains("render.noise=1"), "{error}");

    at_rest(&dir, "c", &["--seed", "2"], false);
    copy(&dir.join("a/mine"), &dir.join("c/mine"));
    let error = refused("c/mine");
    assert!(error.contains("frame 0: the true hair is") && error.contains("of a/mine"), "{error}");

    at_rest(&dir, "d", &["--set", "scene.rig.azimuth_deg=20"], false);
    copy(&dir.join("a/mine"), &dir.join("d/mine"));
    assert!(refused("d/mine").contains("cameras stand elsewhere"));

    let moving = finished().join("out").join(crate::sequence::SCENE).join(crate::sequence::VARIANT);
    let moving = moving.to_str().unwrap();
    let error = fails(&dir, &["score", "a/mine", "--rest", moving, moving, "--out", "not"]);
    assert!(error.contains("mm from where it is in frame 0"), "{error}");
    assert!(!dir.join("not/all").exists());
}

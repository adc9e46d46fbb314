//! `dataset export`: what an outside program is given, read back by other programs, and the way back for its answer.

use crate::sequence;
use crate::support::{SCENE, fails, files, finished, folder, json, ok, python};
use glam::DVec3;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

fn render() -> PathBuf {
    finished().join("out").join(SCENE).join("render")
}

fn read(path: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap()
}

#[test]
fn colmap_opencv_and_nerf_project_as_the_calibrated_rig_does() {
    let Some(python) = python("cv2, pycolmap") else { return };
    let dir = folder("dataset-oracle");
    ok(&dir, &["dataset", "export", render().to_str().unwrap(), "set", "--truth"]);
    let points: Vec<DVec3> = (0..200)
        .map(|i| {
            let part = |k: u32| f64::from(i * k % 199) / 199.0 - 0.5;
            DVec3::new(300.0 * part(17), 400.0 * part(41), 300.0 * part(89))
        })
        .collect();
    let ask = |set: PathBuf| -> Value {
        let case = json!({"folder": set, "points": points.iter().map(|p| p.to_array()).collect::<Vec<_>>()});
        let mut child = Command::new(&python)
            .arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/program/dataset_oracle.py"))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        std::io::Write::write_all(&mut child.stdin.take().unwrap(), case.to_string().as_bytes()).unwrap();
        let out = child.wait_with_output().unwrap();
        assert!(out.status.success(), "the oracle failed");
        serde_json::from_slice(&out.stdout).unwrap()
    };
    let found = ask(dir.join("set"));
    let (rig, _) = strandbench_io::read_frame(&render().join("frame")).unwrap();
    let truth = strandbench_io::read_truth(&render().join("truth")).unwrap();
    let mut moved_px: f64 = 0.0;
    for (camera, real) in rig.cameras.iter().zip(&truth.rig.cameras) {
        for by in ["colmap", "opencv", "nerf"] {
            let pixels = found[by][&camera.name].as_array().unwrap();
            assert_eq!(pixels.len(), points.len(), "{by}, {}", camera.name);
            for (p, pixel) in points.iter().zip(pixels) {
                let (want, _) = camera.project(*p).unwrap();
                let got = glam::DVec2::new(pixel[0].as_f64().unwrap(), pixel[1].as_f64().unwrap());
                assert!((got - want).length() < 1e-6, "{by}, {}: {got} for {want}", camera.name);
                moved_px = moved_px.max((real.project(*p).unwrap().0 - want).length());
            }
        }
    }
    assert!(moved_px > 0.01, "the true rig differs, so the calibrated one was read: {moved_px} px");
}

#[test]
fn a_dataset_holds_what_the_cameras_delivered_and_no_truth() {
    let dir = folder("dataset");
    let done = json(&dir, &["dataset", "export", render().to_str().unwrap(), "set"]);
    assert_eq!((&done["head"], &done["truth"]), (&true.into(), &false.into()));
    let set = dir.join("set");
    let (rig, frame) = strandbench_io::read_frame(&render().join("frame")).unwrap();
    for (c, (image, mask)) in rig.cameras.iter().zip(frame.images.iter().zip(&frame.masks)) {
        let exr = strandbench_io::read_exr(&set.join(format!("images_exr/{}.exr", c.name))).unwrap();
        assert_eq!((exr[0].0.as_str(), &exr[0].1), ("Y", image));
        let png = strandbench_io::read_png_grey(&set.join(format!("images/{}.png", c.name))).unwrap();
        let srgb = strandbench_io::read_png_grey(&set.join(format!("images_srgb/{}.png", c.name))).unwrap();
        let masks = strandbench_io::read_png_grey(&set.join(format!("masks/{}.png", c.name))).unwrap();
        for (i, &v) in image.data.iter().enumerate() {
            let v = v.clamp(0.0, 1.0);
            assert!((png.data[i] - v).abs() <= 0.51 / 65_535.0);
            // The inverse of sRGB's transfer function (IEC 61966-2-1) half a level either side.
            let linear = |s: f32| if s <= 0.040_45 { s / 12.92 } else { ((s + 0.055) / 1.055).powf(2.4) };
            let (low, high) = (linear(srgb.data[i] - 0.502 / 255.0), linear(srgb.data[i] + 0.502 / 255.0));
            assert!(low <= v + 1e-6 && v <= high + 1e-6, "{v} is not between {low} and {high}");
            assert_eq!(masks.data[i] == 1.0, mask.data[i]);
        }
    }
    let described = read(&set.join("dataset.json"));
    assert_eq!(described["cameras"], json!(["center", "left", "right", "top"]));
    assert_eq!((&described["near_mm"], &described["unit"]), (&rig.near_mm.into(), &"mm".into()));
    let head = strandbench_io::read_mesh(&set.join("head.ply")).unwrap();
    let scalp = strandbench_io::read_mesh(&set.join("scalp.ply")).unwrap();
    assert!(scalp.triangles.len() * 2 < head.triangles.len() && scalp.triangles.len() > 100);

    let all = files(&set);
    assert!(all.keys().all(|name| !name.contains("truth")), "{:?}", all.keys());
    for (name, bytes) in files(&render().join("truth")) {
        let same = all.iter().find(|(other, b)| **b == bytes && *other != "head.ply");
        assert_eq!(same.map(|s| s.0), None, "{name} is the truth");
    }
    ok(&dir, &["dataset", "export", render().to_str().unwrap(), "bare", "--no-head"]);
    let bare = files(&dir.join("bare"));
    assert!(bare.keys().all(|name| !name.ends_with(".ply")) && bare.len() + 2 == all.len());

    let error = fails(&dir, &["dataset", "export", render().to_str().unwrap(), "set"]);
    assert!(error.contains("set: is there already"), "{error}");
    let error = fails(&dir, &["dataset", "export", ".", "other"]);
    assert!(error.contains("neither a render folder nor a frame folder"), "{error}");
    assert!(!dir.join("other").exists());
}

#[test]
fn the_exported_truth_scores_100_per_cent() {
    let dir = folder("dataset-truth");
    let render = render();
    ok(&dir, &["dataset", "export", render.to_str().unwrap(), "set", "--truth"]);
    ok(&dir, &["score", "--estimate", "set/truth", "--truth", render.to_str().unwrap(), "--out", "score"]);
    let scores = read(&dir.join("score/scores.json"));
    let value = |metric: &str| {
        let all = scores["scores"].as_array().unwrap();
        let found = all.iter().find(|s| s["metric"] == metric && s["subject"] == "method");
        found.unwrap_or_else(|| panic!("{metric}"))["value"].as_f64()
    };
    for (metric, perfect) in
        [("A1.p95", 0.0), ("A1.over_1mm", 0.0), ("A3.completeness", 1.0), ("A5.p90", 0.0)]
    {
        assert_eq!(value(metric), Some(perfect), "{metric}");
    }
    // Twice the angle went through a sine and a cosine of 32 bits: some 1e-7 radians.
    assert!(value("B7.p90").unwrap() < 1e-4);
    for metric in ["B1.precision_1mm", "B1.recall_1mm", "B1.f_1mm", "B1.f_4mm", "B1.f_auc.cc"] {
        assert!((value(metric).unwrap() - 1.0).abs() < 1e-9, "{metric} is {:?}", value(metric));
    }
}

#[test]
fn a_moving_scene_is_a_folder_a_frame_with_one_calibration() {
    let dir = folder("dataset-moving");
    let render = sequence::finished().join("out").join(sequence::SCENE).join("render");
    ok(&dir, &["dataset", "export", render.to_str().unwrap(), "set", "--truth"]);
    let described = read(&dir.join("set/dataset.json"));
    let frames = described["frames"].as_array().unwrap();
    assert_eq!(frames.len(), 5);
    for (i, f) in frames.iter().enumerate() {
        let name = format!("{i:06}");
        assert_eq!((&f["answer"], &f["index"]), (&name.as_str().into(), &i.into()));
        assert!((f["time_s"].as_f64().unwrap() - i as f64 / 100.0).abs() < 1e-9);
        for kind in ["images", "images_srgb", "masks"] {
            assert!(dir.join("set").join(f[kind].as_str().unwrap()).join("left.png").is_file());
        }
        let head = strandbench_io::read_mesh(&dir.join("set").join(f["head"].as_str().unwrap())).unwrap();
        assert!(head.triangles.len() > 1000);
        assert!(dir.join("set/truth").join(&name).join("strands.hair").is_file());
    }
    let head = |i: usize| std::fs::read(dir.join(format!("set/head/{i:06}.ply"))).unwrap();
    assert_ne!(head(0), head(3), "the head shakes");
    let nerf = read(&dir.join("set/transforms.json"));
    assert_eq!(nerf["frames"].as_array().unwrap().len(), 20);
    assert_eq!(nerf["frames"][19]["time"], 0.04);
}

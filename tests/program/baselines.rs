//! Methods of the field through the door for methods from outside.
#![cfg(target_os = "linux")]

use crate::outside::args;
use crate::support::{SCENE, copy_of_finished, fails, files, folder, json, ok, python};
use glam::{DVec2, DVec3};
use strandbench_types::{Camera, Frame, Plane, Rig};

#[test]
fn the_baselines_run_and_are_rows() {
    let Some(python) = python("cv2, numpy") else { return };
    let dir = copy_of_finished("baselines");
    ok(&dir, &["baselines", "config", "--python", &python]);
    let listed = json(&dir, &["baselines", "list"]);
    let names: Vec<&str> = listed.as_array().unwrap().iter().map(|b| b["name"].as_str().unwrap()).collect();
    let run = [&args(&names)[..], &["--config", "baselines/strandbench.toml"]].concat();
    let summary = json(&dir, &run);
    for (row, name) in summary["rows"].as_array().unwrap().iter().zip(&names) {
        assert_eq!((&row["variant"], &row["outcome"]), (&(*name).into(), &"ok".into()), "{row}");
        let all = row["scores"].as_array().unwrap();
        let value = |metric: &str| {
            let found = all.iter().find(|s| s["metric"] == metric && s["subject"] == "method");
            found.unwrap()["value"].as_f64().unwrap()
        };
        // Hair of twelve pixels' width tells a matcher little; it must answer, within the depths that it was given.
        assert!(value("A3.completeness") > 0.9, "{name}: {}", value("A3.completeness"));
        let estimate = dir.join("out").join(SCENE).join(name).join("reconstruct/estimate");
        let depth = strandbench_io::read_estimate(&estimate).unwrap().depth.unwrap();
        assert!(
            (0..96 * 72).filter_map(|i| depth.get_index(i)).all(|z| (700.0..=1100.0).contains(&z)),
            "{name}"
        );
    }
    let log = dir.join("out").join(SCENE).join(names[0]).join("reconstruct/stdout.txt");
    assert!(std::fs::read_to_string(log).unwrap().contains("pixels of the mask answered"));
    let foreign = files(&dir.join("baselines"));
    assert!(foreign.contains_key("requirements.txt"));
}

#[test]
fn the_built_in_baselines_are_rows_are_kept_and_refuse_what_they_do_not_know() {
    let dir = copy_of_finished("built-in-baselines");
    let names = ["pmvs-poisson", "visual-hull", "constant-depth"];
    let listed = ok(&dir, &["variants", "list"]);
    let below = listed.split("baselines:").nth(1).unwrap();
    assert!(names.iter().all(|n| below.contains(n)), "{listed}");
    let first = json(&dir, &args(&names[1..]));
    let again = json(&dir, &args(&names[1..]));
    for (k, name) in names[1..].iter().enumerate() {
        let (row, later) = (&first["rows"][k], &again["rows"][k]);
        assert_eq!((&row["variant"], &row["outcome"]), (&(*name).into(), &"ok".into()), "{row}");
        let reused = |row: &serde_json::Value| {
            row["reused"].as_array().unwrap().contains(&serde_json::Value::from("reconstruct"))
        };
        assert!(!reused(row) && reused(later), "{row} {later}");
    }
    // Twelve pixels of hair are enough for a few patches at full resolution; a setting is part of the folder's name.
    let sets = ["--set", "level=0", "--set", "min_images=2", "--set", "surface_cell_mm=6"];
    let row = &json(&dir, &[&args(&names[..1])[..], &sets].concat())["rows"][0];
    assert_eq!(row["outcome"], "ok", "{row}");
    assert_eq!(row["variant"], "pmvs-poisson+level=0+min_images=2+surface_cell_mm=6");
    let wrong = fails(&dir, &[&args(&names[..1])[..], &["--set", "lambda=1"]].concat());
    assert!(wrong.contains("lambda") && wrong.contains("screening"), "{wrong}");
    let unknown = fails(&dir, &args(&["pmvs"]));
    assert!(unknown.contains("pmvs-poisson") && unknown.contains("luo"), "{unknown}");
}

/// Brightness of a wall with hills of 10 to 60 mm, which no two of its places share.
fn pattern(x: f64, y: f64) -> f64 {
    let waves = (0..24).map(|k| {
        let (turn, length_mm) = (2.399_963 * f64::from(k), 10.0 * 1.081f64.powi(k));
        (std::f64::consts::TAU / length_mm * (x * turn.cos() + y * turn.sin()) + 1.7 * f64::from(k * k)).sin()
    });
    0.5 + 0.08 * waves.sum::<f64>()
}

/// Four views of a slanted wall, and its depth in the first.
fn wall() -> (Rig, Frame, Vec<f64>) {
    let (w, h) = (192u32, 144u32);
    let eyes = [("center", 0.0, 0.0), ("left", -90.0, 0.0), ("right", 90.0, 0.0), ("top", 0.0, 90.0)];
    let cameras: Vec<Camera> = eyes
        .iter()
        .map(|(name, x, y)| {
            Camera::look_at(name, (w, h), 400.0, DVec3::new(*x, *y, 900.0), DVec3::ZERO, DVec3::NEG_Y)
        })
        .collect();
    let normal = DVec3::new(-0.25, 0.1, 1.0);
    let pixels = || (0..w * h).map(|i| DVec2::new(f64::from(i % w) + 0.5, f64::from(i / w) + 0.5));
    let hit = |c: &Camera, p: DVec2| -normal.dot(c.centre_mm()) / normal.dot(c.ray_direction(p));
    let image = |c: &Camera| {
        let on = pixels().map(|p| c.centre_mm() + c.ray_direction(p) * hit(c, p));
        Plane::from_vec(
            w as usize,
            h as usize,
            on.map(|x| pattern(x.x, x.y).clamp(0.0, 1.0) as f32).collect(),
        )
    };
    let depth = pixels().map(|p| hit(&cameras[0], p)).collect();
    let frame = Frame {
        index: 0,
        images: cameras.iter().map(image).collect(),
        masks: vec![Plane::filled(w as usize, h as usize, true); 4],
    };
    let rig = Rig { cameras, near_mm: 750.0, far_mm: 1100.0, frame_rate_hz: 100.0, exposure_s: 0.001 };
    (rig, frame, depth)
}

#[test]
fn the_baselines_find_a_textured_wall() {
    let Some(python) = python("cv2, numpy") else { return };
    let dir = folder("wall");
    let (rig, frame, depth) = wall();
    strandbench_io::write_frame(&dir.join("frame"), &rig, &frame).unwrap();
    ok(&dir, &["baselines", "config", "--python", &python]);
    for b in json(&dir, &["baselines", "list"]).as_array().unwrap() {
        let name = b["name"].as_str().unwrap();
        let config = ["--config", "baselines/strandbench.toml"];
        ok(&dir, &[&["reconstruct", "frame", "--variant", name, "--out", name][..], &config].concat());
        let found = strandbench_io::read_estimate(&dir.join(name).join("estimate")).unwrap().depth.unwrap();
        // In pixels between the views of a pair: 400 px times 90 mm over the depth.
        let off =
            |(i, &z): (usize, &f64)| Some((36_000.0 / f64::from(found.get_index(i)?) - 36_000.0 / z).abs());
        let mut off_px: Vec<f64> = depth.iter().enumerate().filter_map(off).collect();
        off_px.sort_by(f64::total_cmp);
        let (answered, median) = (off_px.len() as f64 / depth.len() as f64, off_px[off_px.len() / 2]);
        println!("{name}: {:.1} % answered, median {median:.3} px", answered * 100.0);
        // Semi-global matching tells sixteenths of a pixel, and depth is taken from the nearest pixel of the rectified
        // image: together an eighth.
        assert!(answered > 0.9 && median < 0.125, "{name}: {answered}, {median} px");
    }
}

//! Hair files from outside: the whole job on a good one, a clear refusal of every bad one.

use crate::support::{differences, fails, files, folder, json, ok, strandbench, text};
use std::path::Path;

const SEGMENTS: u32 = 1;
const POINTS: u32 = 2;

/// A Cem Yuksel `.hair` file: header, then the arrays given.
fn hair(strands: u32, points: u32, flags: u32, segments: &[u16], xyz: &[[f32; 3]]) -> Vec<u8> {
    let mut bytes = b"HAIR".to_vec();
    for n in [strands, points, flags, 4] {
        bytes.extend(n.to_le_bytes());
    }
    for f in [0.1f32, 0.0, 0.5, 0.4, 0.3] {
        bytes.extend(f.to_le_bytes());
    }
    bytes.extend([0u8; 88]);
    segments.iter().for_each(|s| bytes.extend(s.to_le_bytes()));
    xyz.iter().flatten().for_each(|v| bytes.extend(v.to_le_bytes()));
    bytes
}

/// A curtain of 60 x 10 strands of five points, 200 units long, z up.
fn curtain() -> (Vec<u16>, Vec<[f32; 3]>) {
    let mut xyz = Vec::new();
    for i in 0..60 {
        for j in 0..10 {
            for k in 0..5 {
                let (x, y, z) = (i as f32 * 2.0 - 60.0, j as f32 * 2.0, 100.0 - k as f32 * 50.0);
                xyz.push([x + (k as f32 + j as f32).sin(), y, z]);
            }
        }
    }
    (vec![4; 600], xyz)
}

fn small<'a>(file: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    let mut args =
        vec!["run", "--hair", file, "--up", "z", "--forward", "y", "--radius-mm", "1.0", "--out", "out"];
    for setting in [
        "render.samples_per_pixel=8",
        "render.max_samples_per_pixel=8",
        "recon.labels=32",
        "scene.rig.width_px=96",
        "scene.rig.height_px=72",
        "scene.rig.focal_px=187.5",
    ] {
        args.extend(["--set", setting]);
    }
    args.extend(more);
    args
}

#[test]
fn the_whole_job_runs_on_a_hair_file() {
    let dir = folder("hair-good");
    let (segments, xyz) = curtain();
    std::fs::write(dir.join("curtain.hair"), hair(600, 3000, SEGMENTS | POINTS, &segments, &xyz)).unwrap();
    let summary = json(&dir, &small("curtain.hair", &[]));
    let row = &summary["rows"][0];
    assert_eq!(row["outcome"], "ok", "{row}");
    assert!(dir.join(row["report"].as_str().unwrap()).is_file());
    let again = json(&dir, &small("curtain.hair", &[]));
    assert_eq!(again["rows"][0]["reused"].as_array().unwrap().len(), 4);
    let moved: Vec<[f32; 3]> = xyz.iter().map(|p| [p[0], p[1] + p[2] * 0.1, p[2]]).collect();
    std::fs::write(dir.join("curtain.hair"), hair(600, 3000, SEGMENTS | POINTS, &segments, &moved)).unwrap();
    let changed = json(&dir, &small("curtain.hair", &[]));
    assert_eq!(
        changed["rows"][0]["reused"].as_array().unwrap().len(),
        0,
        "the file's content is what counts"
    );
}

#[test]
fn import_converts_counts_and_draws() {
    let dir = folder("import");
    let (segments, xyz) = curtain();
    std::fs::write(dir.join("curtain.hair"), hair(600, 3000, SEGMENTS | POINTS, &segments, &xyz)).unwrap();
    let args = ["import", "curtain.hair", "mm.ply", "--up", "z", "--forward", "y", "--scale-mm", "0.5"];
    let made = json(&dir, &args);
    assert_eq!((&made["strands"], &made["report"]["points_in_file"]), (&600.into(), &3000.into()));
    let longest = made["length_mm"][2].as_f64().unwrap();
    assert!((100.0..104.0).contains(&longest), "200 units of half a millimetre: {longest}");
    assert!(made["longest_segment_mm"].as_f64().unwrap() <= 5.001);
    assert!(std::fs::read(dir.join("mm.png")).unwrap().starts_with(b"\x89PNG"));
    let before = files(&dir);
    assert!(fails(&dir, &args).contains("--force"), "nothing is overwritten unasked");
    assert_eq!(differences(&before, &files(&dir)), Vec::<String>::new());
    assert!(ok(&dir, &[&args[..], &["--force"]].concat()).contains("600 kept"));
}

#[test]
fn every_bad_hair_file_is_refused_with_its_name_and_nothing_is_written() {
    let dir = folder("hair-bad");
    let (segments, xyz) = curtain();
    let good = hair(600, 3000, SEGMENTS | POINTS, &segments, &xyz);
    let mut nan = xyz.clone();
    nan[777][1] = f32::NAN;
    let point = vec![[1.0f32, 2.0, 3.0]; 3000];
    let mut magic = good.clone();
    magic[..4].copy_from_slice(b"WIGS");
    let cases: Vec<(&str, Vec<u8>, &str)> = vec![
        ("empty.hair", Vec::new(), ""),
        ("header-only.hair", good[..60].to_vec(), "truncated"),
        ("truncated.hair", good[..good.len() - 5].to_vec(), "truncated"),
        ("magic.hair", magic, "magic"),
        ("nan.hair", hair(600, 3000, SEGMENTS | POINTS, &segments, &nan), "finite"),
        ("zero-length.hair", hair(600, 3000, SEGMENTS | POINTS, &segments, &point), "length"),
        ("huge.hair", hair(u32::MAX, u32::MAX, SEGMENTS | POINTS, &segments, &xyz), "truncated"),
        ("no-points.hair", hair(600, 3000, SEGMENTS, &segments, &[]), "point array"),
        ("missing-array.hair", hair(600, 3000, SEGMENTS | POINTS | 4, &segments, &xyz), "thickness"),
        ("counts.hair", hair(600, 2999, SEGMENTS | POINTS, &segments, &xyz[..2999]), "2999"),
    ];
    for (name, bytes, wanted) in cases {
        std::fs::write(dir.join(name), bytes).unwrap();
        let error = fails(&dir, &small(name, &[]));
        assert!(error.contains(name) && error.contains(wanted), "{name}: {error}");
        // That it failed is a row of the table and of the history.
        let told = |f: &String| {
            ["index.", "results.", "costs.html", "history.sqlite"].iter().any(|name| f.starts_with(name))
        };
        let left: Vec<String> = files(&dir.join("out")).into_keys().filter(|f| !told(f)).collect();
        assert_eq!(left, [".strandbench.lock"], "{name}");
        assert!(fails(&dir, &["import", name, "x.ply"]).contains(name));
        assert!(!dir.join("x.ply").exists() && !dir.join("x.png").exists());
    }
    let missing = fails(&dir, &small("nowhere.hair", &[]));
    assert!(missing.contains("nowhere.hair"), "{missing}");
    let axes =
        strandbench(&dir, &["run", "--hair", "nan.hair", "--up", "z", "--forward", "-z", "--out", "out"]);
    assert_eq!(axes.status.code(), Some(1));
    assert!(text(&axes.stderr).contains("parallel"), "{}", text(&axes.stderr));
}

/// Cem Yuksel's straight.hair, if the data is at hand: the whole job, small.
#[test]
fn straight_hair_through_the_whole_job() {
    let Some(data) = std::env::var_os("STRANDBENCH_DATA") else {
        println!("ignored, no data: set STRANDBENCH_DATA");
        return;
    };
    let file = Path::new(&data).join("hair/cem_yuksel/straight.hair");
    let dir = folder("straight");
    let mut args = vec![
        "run",
        "--hair",
        file.to_str().unwrap(),
        "--preset",
        "yuksel",
        "--radius-mm",
        "0.2",
        "--out",
        "out",
    ];
    for setting in [
        "render.samples_per_pixel=8",
        "render.max_samples_per_pixel=8",
        "recon.labels=32",
        "scene.rig.width_px=160",
        "scene.rig.height_px=120",
        "scene.rig.focal_px=312.5",
    ] {
        args.extend(["--set", setting]);
    }
    let summary = json(&dir, &args);
    let row = &summary["rows"][0];
    assert_eq!(row["outcome"], "ok");
    let completeness = row["scores"].as_array().unwrap().iter();
    let completeness =
        completeness.clone().find(|s| s["metric"] == "A3.completeness" && s["subject"] == "method");
    assert!(completeness.unwrap()["value"].as_f64().unwrap() > 0.5);
}

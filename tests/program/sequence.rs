//! Moving scenes: what a run leaves behind, going on after a stop, and frames that lack something.

use crate::support::{
    TINY, copy, differences, fails, files, folder, json, ok, results, reused, strandbench, text,
};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

const MOTION: &str = r#"
[motion]
frames = 5

[motion.head]
kind = "shake"
amplitude_deg = 20
frequency_hz = 3
cycles = 1
start_s = 0.0

[motion.solver]
guides = 100
"#;

pub const SCENE: &str = "moving+samples_per_pixel=8+max_samples_per_pixel=8";
pub const SETTINGS: [&str; 6] = [
    "render.samples_per_pixel=8",
    "render.max_samples_per_pixel=8",
    "recon.labels=32",
    "recon.surface_seeds=150",
    "recon.interior_seeds=150",
    "recon.orientation_passes=1",
];
pub const VARIANT: &str = "luo-strands+labels=32+surface_seeds=150+interior_seeds=150+orientation_passes=1";

fn run<'a>(command: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    let mut args = vec![command, "--scene", "moving.toml", "--out", "out"];
    for s in SETTINGS.iter().filter(|s| command == "run" || s.starts_with("render")) {
        args.extend(["--set", s]);
    }
    if command == "run" {
        args.extend(["--variant", "luo-strands"]);
    }
    args.extend(more);
    args
}

fn scene(dir: &Path) {
    std::fs::write(dir.join("moving.toml"), format!("{TINY}{MOTION}")).unwrap();
}

/// A folder in which a tiny moving scene has been run; shared, so look and do not touch.
pub fn finished() -> &'static Path {
    static DONE: OnceLock<PathBuf> = OnceLock::new();
    DONE.get_or_init(|| {
        let dir = folder("moving");
        scene(&dir);
        ok(&dir, &run("run", &[]));
        dir
    })
}

fn copy_of_finished(name: &str) -> PathBuf {
    let dir = folder(name);
    copy(finished(), &dir);
    dir
}

pub fn value(path: &Path) -> serde_json::Value {
    serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap()
}

#[test]
fn a_moving_scene_leaves_every_frame_its_figures_and_a_player() {
    let out = finished().join("out");
    let (render, variant) = (out.join(SCENE).join("render"), out.join(SCENE).join(VARIANT));
    assert_eq!(value(&render.join("sequence.json"))["frames"], serde_json::json!([0, 1, 2, 3, 4]));
    for frame in 0..5 {
        let name = format!("{frame:06}");
        for file in ["frame/center.exr", "truth/seen_by.bin", "truth/top_truth.exr", "center.png"] {
            assert!(render.join(&name).join(file).is_file(), "{name}/{file}");
        }
        assert!(!render.join(&name).join("truth/strands.hair").exists(), "the motion tells the strands");
        for file in ["estimate/depth.exr", "estimate/strands.hair", "estimate/strand_ids.bin"] {
            assert!(variant.join("reconstruct").join(&name).join(file).is_file(), "{name}/{file}");
        }
        assert!(variant.join("score").join(&name).join("scores.json").is_file());
        for kind in ["input", "envelope", "error", "strands", "synthesised"] {
            assert!(variant.join("report/frames").join(format!("{name}_{kind}.jpg")).is_file(), "{kind}");
        }
    }
    let scores = value(&variant.join("score/all/scores.json"));
    let has = |metric: &str| {
        scores["scores"].as_array().unwrap().iter().any(|s| s["metric"] == metric && s["subject"] == "method")
    };
    for metric in ["A1.median", "B1.f_3mm", "B3.idf1", "C1.noise_sd", "C2.regrown.mean", "C4.drift.median"] {
        assert!(has(metric), "{metric}");
    }
    let csv = std::fs::read_to_string(variant.join("score/all/frames.csv")).unwrap();
    assert_eq!(csv.lines().count(), 6, "a line a frame and the head");
    let page = std::fs::read_to_string(variant.join("report/report.html")).unwrap();
    for wanted in ["player-data", "Over time", "Strands by distance and angle", "Time and memory", "flicker"]
    {
        assert!(page.contains(wanted), "{wanted}");
    }
    assert!(variant.join("report/frames/strands_by_error.ply").is_file());
}

#[test]
fn a_second_run_repeats_nothing_and_more_frames_repeat_no_render() {
    let dir = copy_of_finished("moving-second");
    let summary = json(&dir, &run("run", &[]));
    assert_eq!(reused(&summary), ["render", "reconstruct", "score", "report"]);
    // Fewer frames of the same scene: the renders stand; the strands of each frame that sees other neighbours do not.
    let before = files(&dir.join("out").join(SCENE).join("render/000001"));
    let fewer = json(&dir, &run("run", &["--frames", "2"]));
    assert_eq!(reused(&fewer), ["render"]);
    assert_eq!(differences(&before, &files(&dir.join("out").join(SCENE).join("render/000001"))), [""; 0]);
}

#[test]
fn what_is_missing_is_made_again_with_the_same_bits() {
    let dir = copy_of_finished("moving-resume");
    let before = results(&dir.join("out"));
    let cell = dir.join("out").join(SCENE).join(VARIANT);
    // As if stopped after frame 2: the checkpoint stands after it.
    for frame in 3..5 {
        std::fs::remove_dir_all(cell.join("reconstruct").join(format!("{frame:06}"))).unwrap();
    }
    std::fs::remove_dir_all(dir.join("out").join(SCENE).join("render/000004")).unwrap();
    let again = json(&dir, &run("run", &[]));
    assert!(
        !reused(&again).contains(&"reconstruct".to_owned()) && !reused(&again).contains(&"render".to_owned())
    );
    let after = results(&dir.join("out"));
    assert!(after.contains_key(&format!("{SCENE}/{VARIANT}/reconstruct/tracked.bin")));
    assert_eq!(differences(&before, &after), [""; 0]);
}

#[test]
fn one_thread_gives_the_same_bits_and_stages_apart_the_same_files() {
    let dir = folder("moving-apart");
    scene(&dir);
    let (render, variant) = (format!("out/{SCENE}/render"), format!("out/{SCENE}/{VARIANT}"));
    ok(&dir, &run("render", &["--threads", "1"]));
    let recon: Vec<&str> = SETTINGS[2..].iter().flat_map(|s| ["--set", s]).collect();
    ok(&dir, &[&["reconstruct", &render, "--variant", "luo-strands", "--threads", "1"], &recon[..]].concat());
    ok(&dir, &["score", &variant, "--threads", "1"]);
    ok(&dir, &["report", &variant, "--threads", "1"]);
    let mut whole = results(&finished().join("out"));
    whole.retain(|name, _| name.contains('/'));
    assert_eq!(differences(&results(&dir.join("out")), &whole), [""; 0]);
}

/// Makes hair vanish from the reference view's mask of a frame.
fn blank(frame: &Path) {
    let path = frame.join("frame/center_mask.png");
    let (w, h) = image::image_dimensions(&path).unwrap();
    image::GrayImage::new(w, h).save(&path).unwrap();
}

#[test]
fn a_mask_that_vanishes_is_a_frame_without_an_answer_and_scores_as_one() {
    let dir = copy_of_finished("moving-vanish");
    let (render, mine) = (format!("out/{SCENE}/render"), "out/mine".to_owned());
    blank(&dir.join(&render).join("000002"));
    ok(&dir, &["reconstruct", &render, "--set", "labels=32", "--out", &format!("{mine}/reconstruct")]);
    let absent = value(&dir.join(&mine).join("reconstruct/000002/absent.json"));
    assert!(absent["reason"].as_str().unwrap().contains("mask"), "{absent}");
    ok(&dir, &["score", &mine, "--truth", &render]);
    ok(&dir, &["report", &mine, "--render", &render]);
    let frames = value(&dir.join(&mine).join("score/all/frames.json"));
    let row = |k: usize| &frames["frames"][k];
    assert!(row(2)["absent"].is_string() && row(1)["absent"].is_null());
    assert!(row(2)["method"]["A1.median"].is_null(), "infinitely wrong");
    assert!(row(1)["method"]["A1.median"].is_number());
    assert_eq!(row(2)["method"]["A3.completeness"], 0.0);
    let page = std::fs::read_to_string(dir.join(&mine).join("report/report.html")).unwrap();
    assert!(page.contains("Frames without an answer") && page.contains("1 of the frames have no answer"));
}

#[test]
fn a_frame_that_an_estimate_leaves_out_is_the_worst_answer_and_no_frame_at_all_is_an_error() {
    let dir = copy_of_finished("moving-gaps");
    let render = format!("out/{SCENE}/render");
    let answers = dir.join("out").join(SCENE).join(VARIANT).join("reconstruct");
    // As another program would leave them: files in a folder a frame, none for 1 and 3, an empty one for 4.
    for frame in [0, 2] {
        copy(&answers.join(format!("{frame:06}/estimate")), &dir.join(format!("mine/{frame:06}")));
        std::fs::remove_file(dir.join(format!("mine/{frame:06}/estimate.json"))).unwrap();
    }
    std::fs::create_dir(dir.join("mine/000004")).unwrap();
    let score = ["score", "--estimate", "mine", "--truth", &render, "--out", "score"];
    ok(&dir, &score);
    let frames = value(&dir.join("score/all/frames.json"));
    let whole = value(&dir.join("out").join(SCENE).join(VARIANT).join("score/all/frames.json"));
    for k in 0..5 {
        let row = &frames["frames"][k];
        if [0, 2].contains(&k) {
            assert!(row["absent"].is_null());
            assert_eq!(row["method"], whole["frames"][k]["method"], "frame {k} scores as in the whole");
        } else {
            assert!(row["absent"].as_str().unwrap().contains("no answer"), "frame {k}: {row}");
            assert!(row["method"]["A1.median"].is_null(), "infinitely wrong");
            assert_eq!(row["method"]["A3.completeness"], 0.0);
        }
    }
    let all = value(&dir.join("score/all/scores.json"));
    let find = |metric: &str| {
        let scores = all["scores"].as_array().unwrap();
        scores.iter().find(|s| s["metric"] == metric && s["subject"] == "method").unwrap().clone()
    };
    assert!(find("A1.median")["value"].is_null(), "three of five frames are unanswered");
    let coverage = |k: usize| whole["frames"][k]["method"]["A3.completeness"].as_f64().unwrap();
    let mean = (coverage(0) + coverage(2)) / 5.0;
    assert!((find("A1.median")["coverage"].as_f64().unwrap() - mean).abs() < 0.02, "{}", find("A1.median"));
    assert!(find("C1.noise_sd")["value"].is_null(), "no strand is followed over three frames");

    std::fs::create_dir(dir.join("mine/000009")).unwrap();
    let error = fails(&dir, &score);
    assert!(error.contains("000009") && error.contains("no such frame, but 0 to 4"), "{error}");
    for frame in [0, 2, 9] {
        std::fs::remove_dir_all(dir.join(format!("mine/{frame:06}"))).unwrap();
    }
    let error = fails(&dir, &score);
    assert!(error.contains("answers to no frame") && error.contains("000000"), "{error}");
}

#[test]
fn frames_that_are_missing_or_of_another_size_are_errors_that_name_them() {
    let dir = copy_of_finished("moving-broken");
    let render = format!("out/{SCENE}/render");
    let go = || fails(&dir, &["reconstruct", &render, "--set", "labels=32", "--out", "mine"]);
    let frame = dir.join(&render).join("000003");
    std::fs::rename(frame.join("frame"), dir.join("aside")).unwrap();
    let error = go();
    assert!(error.contains("000003") && error.contains("missing"), "{error}");
    std::fs::rename(dir.join("aside"), frame.join("frame")).unwrap();
    let image = frame.join("frame/left_mask.png");
    image::GrayImage::new(10, 10).save(&image).unwrap();
    let error = go();
    assert!(error.contains("left_mask.png") && error.contains("10x10"), "{error}");
    let error = fails(&dir, &["score", "mine", "--truth", &render, "--out", "mine-score"]);
    assert!(error.contains("there is no answer to this frame"), "{error}");

    let still = fails(&dir, &["render", "--scene", "straight-blonde", "--frames", "3", "--out", "o"]);
    assert!(still.contains("one pose"), "{still}");
    let beyond = fails(&dir, &run("render", &["--frames", "3..9"]));
    assert!(beyond.contains("3..9") && beyond.contains("0..5"), "{beyond}");
    let bad = strandbench(&dir, &run("render", &["--frames", "5..2"]));
    assert_eq!(bad.status.code(), Some(2), "{}", text(&bad.stderr));
    std::fs::write(dir.join(&render).join("sequence.json"), "{}").unwrap();
    assert!(go().contains("sequence.json"));
}

#[test]
fn strands_and_envelopes_are_exported_and_nothing_is_overwritten() {
    let dir = copy_of_finished("moving-export");
    let variant = format!("out/{SCENE}/{VARIANT}");
    let made = json(&dir, &["export", &variant, "usd"]);
    assert_eq!((&made["frames"], &made["meshes"]), (&5.into(), &5.into()));
    for file in
        ["strands.usda", "envelope.usda", "strands/strands.000004.usda", "envelope/envelope.000000.usda"]
    {
        assert!(dir.join("usd").join(file).is_file(), "{file}");
    }
    let again = fails(&dir, &["export", &variant, "usd"]);
    assert!(again.contains("is there already"), "{again}");
    ok(&dir, &["export", &variant, "plain", "--strands", "data", "--envelope", "obj"]);
    assert!(dir.join("plain/strands/strands.000002.data").is_file());
    assert!(dir.join("plain/envelope/envelope.000002.obj").is_file());
    let truth =
        json(&dir, &["export", &format!("out/{SCENE}/render"), "true", "--truth", "--strands", "hair"]);
    assert_eq!(truth["strands"], 5 * 1200);
    let nothing = fails(&dir, &["export", "nowhere", "x"]);
    assert!(nothing.contains("nowhere") && !dir.join("x").exists(), "{nothing}");
}

//! Bad scenes, settings and frames: a clear error that names file, place and remedy, exit code 1, and nothing
//! that was there before touched.

use crate::support::{
    SCENE, TINY, copy_of_finished, differences, fails, files, finished, folder, strandbench, text, tiny_args,
};
use strandbench_types::Plane;

#[test]
fn a_bad_scene_names_file_key_and_remedy_and_leaves_old_results_alone() {
    let dir = copy_of_finished("bad-scene");
    let before = files(&dir.join("out"));
    let cases: [(&str, &str, &[&str]); 7] = [
        ("strands = 1200", "strands = 1200\ncolour = \"green\"", &["tiny.toml", "line", "colour"]),
        ("radius_mm = 0.45", "radius_mm = -0.45", &["tiny.toml", "line", "radius_mm", "-0.45"]),
        ("strands = 1200", "strands = 0", &["tiny.toml", "line", "strands"]),
        ("strands = 1200", "strands = 4000000000", &["tiny.toml", "line", "strands"]),
        ("top_mm = 200.0", "top_mm = nan", &["tiny.toml", "line", "top_mm"]),
        ("family = \"straight\"", "family = \"plaits\"", &["tiny.toml", "line", "plaits"]),
        ("[rig]", "[rig", &["tiny.toml", "line"]),
    ];
    for (from, to, wanted) in cases {
        assert!(TINY.contains(from), "{from}");
        std::fs::write(dir.join("tiny.toml"), TINY.replacen(from, to, 1)).unwrap();
        let error = fails(&dir, &tiny_args("run", &["--out", "out"]));
        for word in wanted {
            assert!(error.contains(word), "{to}: {word} is not in: {error}");
        }
        assert_eq!(differences(&before, &files(&dir.join("out"))), Vec::<String>::new(), "{to}");
    }
    std::fs::remove_file(dir.join("tiny.toml")).unwrap();
    assert!(fails(&dir, &tiny_args("run", &["--out", "out"])).contains("tiny.toml"));
    let error = fails(&dir, &["run", "--scene", "straight-pink", "--out", "out"]);
    assert!(
        error.contains("straight-pink") && error.contains("straight-blonde"),
        "names those there are: {error}"
    );
    assert_eq!(differences(&before, &files(&dir.join("out"))), Vec::<String>::new());
}

#[test]
fn cameras_that_see_nothing_are_named_and_make_no_folder() {
    let dir = folder("nothing-seen");
    std::fs::write(dir.join("tiny.toml"), TINY).unwrap();
    // With the light meter, which looks first, and with an exposure that the scene gives.
    for exposure in ["scene.rig.width_px=96", "scene.sensor.full_scale_radiance=0.5"] {
        let away = ["--out", "out", "--set", "scene.rig.target_mm=[0, 5000, 0]", "--set", exposure];
        let error = fails(&dir, &tiny_args("render", &away));
        assert!(
            error.contains("center") && error.contains("sees no hair") && error.contains("check the rig"),
            "{exposure}: {error}"
        );
        assert_eq!(error.contains("meter"), !exposure.contains("full_scale"), "{error}");
    }
    let left: Vec<String> = files(&dir.join("out")).into_keys().collect();
    assert_eq!(left, [".strandbench.lock"]);
}

#[test]
fn unknown_settings_say_which_there_are() {
    let dir = folder("settings");
    std::fs::write(dir.join("tiny.toml"), TINY).unwrap();
    for (setting, wanted) in [
        ("recon.lamda=1", "lambda"),
        ("recon.lambda=-1", "lambda"),
        ("render.samples=1", "samples_per_pixel"),
        ("render.samples_per_pixel=0", "samples_per_pixel"),
        ("scene.rig.baseline_mm=1", "baseline_mm"),
        ("scene.rig.near_mm=2000", "near_mm"),
    ] {
        let error = fails(&dir, &tiny_args("run", &["--out", "out", "--set", setting]));
        assert!(error.contains(wanted), "{setting}: {error}");
    }
    let error = fails(&dir, &tiny_args("run", &["--variant", "lou"]));
    assert!(error.contains("unknown variant lou; there are: luo, luo-ncc"), "{error}");
    assert!(!error.contains("--set"), "the option that was given is --variant: {error}");
    let usage = strandbench(&dir, &["run", "--set", "lambda"]);
    assert_eq!(usage.status.code(), Some(2));
    assert!(text(&usage.stderr).contains("key=value"));
    let usage = strandbench(&dir, &["run", "--scale-mm", "2.5"]);
    assert!(text(&usage.stderr).contains("--hair"), "{}", text(&usage.stderr));
}

#[test]
fn a_frame_with_an_empty_mask_or_of_another_size_or_incomplete_is_refused() {
    let dir = copy_of_finished("bad-frame");
    let render = format!("out/{SCENE}/render");
    let frame = dir.join(&render).join("frame");
    let original = files(&frame);
    let before = files(&dir.join("out").join(SCENE).join(crate::support::VARIANT));
    let args = ["reconstruct", render.as_str(), "--set", "labels=32"];
    let restore = || {
        for (name, bytes) in &original {
            std::fs::write(frame.join(name), bytes).unwrap();
        }
    };
    let check = |what: &dyn Fn(), wanted: &[&str]| {
        what();
        let error = fails(&dir, &args);
        for word in wanted {
            assert!(error.contains(word), "{word} is not in: {error}");
        }
        restore();
    };
    let mask = frame.join("center_mask.png");
    check(
        &|| strandbench_io::write_png_grey(&mask, &Plane::filled(96, 72, 0)).unwrap(),
        &["center_mask.png", "empty"],
    );
    check(
        &|| strandbench_io::write_png_grey(&mask, &Plane::filled(95, 72, 255)).unwrap(),
        &["center_mask.png", "95x72", "96x72"],
    );
    let image = frame.join("left.exr");
    check(
        &|| strandbench_io::write_exr(&image, &[("Y", &Plane::filled(10, 10, 0.5))]).unwrap(),
        &["left.exr", "10x10", "96x72"],
    );
    let mut nan = Plane::filled(96, 72, 0.5f32);
    nan.data[100] = f32::NAN;
    check(&|| strandbench_io::write_exr(&image, &[("Y", &nan)]).unwrap(), &["left", "finite"]);
    check(&|| std::fs::remove_file(&image).unwrap(), &["left.exr"]);
    check(&|| std::fs::write(&image, &original["left.exr"][..60]).unwrap(), &["left.exr"]);
    check(&|| std::fs::write(frame.join("rig.json"), "{}").unwrap(), &["rig.json"]);
    check(&|| std::fs::remove_file(frame.join("frame.json")).unwrap(), &["frame.json"]);
    let after = files(&dir.join("out").join(SCENE).join(crate::support::VARIANT));
    assert_eq!(differences(&before, &after), Vec::<String>::new(), "the old result stands");
}

#[test]
fn folders_that_are_not_there_say_which_command_makes_them() {
    let dir = folder("missing");
    assert!(fails(&dir, &["reconstruct", "nowhere", "--out", "x"]).contains("strandbench render"));
    assert!(fails(&dir, &["score", "nowhere", "--truth", "t", "--out", "x"]).contains("strandbench render"));
    let no_score = fails(&dir, &["score", "nowhere"]);
    assert!(no_score.contains("nowhere: there is no such folder; `strandbench reconstruct`"), "{no_score}");
    let no_report = fails(&dir, &["report", "nowhere"]);
    assert!(no_report.contains("nowhere: there is no such folder; `strandbench score`"), "{no_report}");
    let no_scene = fails(&dir, &["run", "--scene", "nowhere.toml"]);
    assert!(no_scene.contains("nowhere.toml: cannot read") && no_scene.contains("scenes show"), "{no_scene}");
    assert!(files(&dir).is_empty(), "and nothing is written");
    std::fs::create_dir(dir.join("bare")).unwrap();
    let bare = fails(&dir, &["score", "bare"]);
    assert!(bare.contains("bare estimate") && bare.contains("--truth"), "{bare}");
}

#[test]
fn a_folder_of_somebody_else_is_not_replaced() {
    let dir = folder("foreign");
    std::fs::create_dir(dir.join("work")).unwrap();
    std::fs::write(dir.join("work/thesis.tex"), "years").unwrap();
    let frame = finished().join("out").join(SCENE).join("render/frame");
    let error = fails(&dir, &["reconstruct", frame.to_str().unwrap(), "--out", "work"]);
    assert!(error.contains("work") && error.contains("not a folder of this program"), "{error}");
    assert_eq!(files(&dir).into_keys().collect::<Vec<_>>(), ["work/thesis.tex"]);
}

//! The whole job: what it leaves behind, what a second run repeats, and that its stages are the same alone.

use crate::support::{
    SCENE, TINY, VARIANT, copy_of_finished, differences, files, finished, folder, json, ok, results, reused,
    tiny_args,
};

const ALL: [&str; 4] = ["render", "reconstruct", "score", "report"];

#[test]
fn the_whole_job_leaves_frame_truth_estimate_scores_and_report() {
    let out = finished().join("out");
    let cell = out.join(SCENE).join(VARIANT);
    for file in [
        "frame/rig.json",
        "frame/center.exr",
        "frame/center.png",
        "frame/top_mask.png",
        "truth/strands.hair",
        "truth/center_truth.exr",
        "truth/visibility.bin",
        "identity/left.exr",
        "radiance/right.exr",
        "center.png",
        "render.json",
        "stage.json",
    ] {
        assert!(out.join(SCENE).join("render").join(file).is_file(), "{file}");
    }
    for file in [
        "reconstruct/estimate/depth.exr",
        "reconstruct/estimate/envelope.ply",
        "reconstruct/diagnostics.json",
        "score/scores.json",
        "score/scores.csv",
        "score/errors.exr",
        "report/report.html",
        "report/report.json",
        "report/report.csv",
    ] {
        assert!(cell.join(file).is_file(), "{file}");
    }
    let report: serde_json::Value =
        serde_json::from_slice(&std::fs::read(cell.join("report/report.json")).unwrap()).unwrap();
    let scores = report["scores"].as_array().unwrap();
    assert!(scores.len() > 50 && report["protocol"].as_str().unwrap().starts_with("v3 "));
    let csv = std::fs::read_to_string(cell.join("report/report.csv")).unwrap();
    let mut lines = csv.lines();
    assert_eq!(lines.next().unwrap(), "scene,variant,seed,metric,subject,unit,value,coverage,wanted");
    assert_eq!(lines.count(), scores.len(), "a line for every figure");
    let median = scores.iter().find(|s| s["metric"] == "A1.median" && s["subject"] == "method").unwrap();
    assert!(median["value"].as_f64().unwrap() > 0.0);
    let line = csv.lines().find(|l| l.contains(",A1.median,method,")).unwrap();
    assert!(line.contains(&median["value"].to_string()), "{line} holds {}", median["value"]);
}

#[test]
fn the_report_stands_alone_and_shows_every_part() {
    let page =
        std::fs::read_to_string(finished().join("out").join(SCENE).join(VARIANT).join("report/report.html"))
            .unwrap();
    for wanted in [
        "What the cameras saw",
        "The rig",
        "Orientation",
        "Depth error",
        "Cut through the hair",
        "turntable-data",
        "Scores",
        "Time and memory",
        "lower bound",
        "How to make this again",
        "N0",
        "ceiling",
    ] {
        assert!(page.contains(wanted), "{wanted}");
    }
    assert!(page.matches("data:image/png;base64,").count() >= 10);
    for outside in ["src=\"http", "href=\"http", "url(http", "@import", "fetch(", "src=\"/", "src=\"."] {
        assert!(!page.contains(outside), "the page needs something from outside: {outside}");
    }
}

#[test]
fn a_second_run_repeats_nothing_and_changes_nothing() {
    let dir = copy_of_finished("second");
    let before = files(&dir.join("out"));
    let summary = json(&dir, &tiny_args("run", &["--out", "out"]));
    assert_eq!(reused(&summary), ALL);
    let mut after = files(&dir.join("out"));
    for index in ["costs.html", "index.json", "history.sqlite"] {
        // These say what the last run re-used; the history grows with every run. index.html and results.* do not change.
        after.insert(index.to_owned(), before[index].clone());
    }
    assert_eq!(differences(&before, &after), Vec::<String>::new());
}

#[test]
fn a_change_redoes_what_depends_on_it_and_no_more() {
    let dir = copy_of_finished("change");
    let go = |more: &[&str]| {
        let more: Vec<&str> = ["--out", "out"].iter().chain(more).copied().collect();
        reused(&json(&dir, &tiny_args("run", &more)))
    };
    assert_eq!(go(&["--set", "recon.lambda=0.5"]), ["render"]);
    assert_eq!(go(&["--variant", "luo-2cam"]), ["render"]);
    assert_eq!(go(&["--seed", "2"]), Vec::<String>::new());
    assert_eq!(go(&[]), ALL, "the first result still stands beside the others");
    std::fs::write(dir.join("tiny.toml"), TINY.replace("top_mm = 200.0", "top_mm = 190.0")).unwrap();
    assert_eq!(go(&[]), Vec::<String>::new(), "other hair, other everything");
    std::fs::write(dir.join("tiny.toml"), format!("# a remark\n{}", TINY.replace("200.0", "190.0"))).unwrap();
    let redone = go(&[]);
    assert!(
        redone.contains(&"reconstruct".to_owned()),
        "the same hair again gives the same frame: {redone:?}"
    );
}

#[test]
fn a_folder_made_with_other_parameters_is_made_again() {
    let dir = copy_of_finished("parameters");
    let render = format!("out/{SCENE}/render");
    let truth = format!("{render}/truth");
    let redone = |args: &[&str], wanted: &str| {
        let done = &json(&dir, args)[0];
        assert_eq!((&done["reused"], &done["reason"]), (&false.into(), &wanted.into()), "{args:?}");
        assert_eq!(json(&dir, args)[0]["reused"], true, "{args:?} again");
    };
    let reconstruct = ["reconstruct", &render, "--out", "mine", "--set", "labels=32"];
    redone(&reconstruct, "no earlier result");
    for (setting, name) in [("lambda=0.5", "parameters.lambda"), ("cost=ncc", "cost"), ("views=two", "views")]
    {
        redone(&[&reconstruct[..], &["--set", setting]].concat(), &format!("recon.{name} changed"));
        redone(&reconstruct, &format!("recon.{name} changed"));
    }
    let score = ["score", "mine/estimate", "--truth", &truth, "--out", "score", "--seed"];
    redone(&[&score[..], &["1"]].concat(), "no earlier result");
    redone(&[&score[..], &["2"]].concat(), "seed changed");
}

#[test]
fn a_damaged_result_is_redone_and_what_follows_fits_again() {
    let dir = copy_of_finished("damaged");
    let go = || reused(&json(&dir, &tiny_args("run", &["--out", "out"])));
    let scene = dir.join("out").join(SCENE);
    let before = results(&dir.join("out"));

    let image = scene.join("render/frame/center.exr");
    let mut bytes = std::fs::read(&image).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    std::fs::write(&image, bytes).unwrap();
    let again = go();
    assert!(!again.contains(&"render".to_owned()));
    assert!(again.contains(&"reconstruct".to_owned()), "the same bits as before the damage: {again:?}");

    let depth = scene.join(VARIANT).join("reconstruct/estimate/depth.exr");
    std::fs::write(&depth, &std::fs::read(&depth).unwrap()[..100]).unwrap();
    let again = go();
    assert!(again.contains(&"render".to_owned()) && !again.contains(&"reconstruct".to_owned()), "{again:?}");

    std::fs::remove_file(scene.join(VARIANT).join("score/scores.json")).unwrap();
    let again = go();
    assert!(again.contains(&"reconstruct".to_owned()) && !again.contains(&"score".to_owned()), "{again:?}");

    std::fs::remove_file(scene.join(VARIANT).join("score/stage.json")).unwrap();
    let again = go();
    assert!(!again.contains(&"score".to_owned()), "{again:?}");
    assert_eq!(differences(&before, &results(&dir.join("out"))), Vec::<String>::new());
    assert_eq!(go(), ALL);
}

#[test]
fn one_thread_and_two_give_the_same_bits() {
    let dir = folder("threads");
    std::fs::write(dir.join("tiny.toml"), TINY).unwrap();
    ok(&dir, &tiny_args("run", &["--out", "one", "--threads", "1"]));
    let (one, two) = (results(&dir.join("one")), results(&finished().join("out")));
    assert!(one.len() > 30, "{} files", one.len());
    assert_eq!(differences(&one, &two), Vec::<String>::new());
}

#[test]
fn the_stages_apart_give_what_run_gives() {
    let dir = folder("apart");
    std::fs::write(dir.join("tiny.toml"), TINY).unwrap();
    ok(&dir, &tiny_args("render", &["--out", "out"]));
    let (render, variant) = (format!("out/{SCENE}/render"), format!("out/{SCENE}/{VARIANT}"));
    ok(&dir, &["reconstruct", &render, "--set", "labels=32"]);
    ok(&dir, &["score", &variant]);
    ok(&dir, &["report", &variant]);
    assert_eq!(
        differences(&results(&dir.join("out")), &{
            let mut all = results(&finished().join("out"));
            all.retain(|name, _| name.contains('/'));
            all
        }),
        Vec::<String>::new()
    );
    let summary = json(&dir, &tiny_args("run", &["--out", "out"]));
    assert_eq!(reused(&summary), ALL, "run takes the folders that the stages made");
}

#[test]
fn two_scenes_make_one_table_and_a_failed_one_is_a_row() {
    let dir = copy_of_finished("two");
    std::fs::write(dir.join("away.toml"), TINY.replace("[rig]\n", "[rig]\ntarget_mm = [0.0, 3000.0, 0.0]\n"))
        .unwrap();
    let args = tiny_args("run", &["--out", "out", "--scene", "away.toml", "--json"]);
    let out = crate::support::strandbench(&dir, &args);
    assert_eq!(out.status.code(), Some(1));
    let summary: serde_json::Value = serde_json::from_slice(&out.stdout).unwrap();
    let rows = summary["rows"].as_array().unwrap();
    assert_eq!((rows.len(), &rows[0]["outcome"], &rows[1]["outcome"]), (2, &"ok".into(), &"failed".into()));
    let pooled = &summary["pooled"][0];
    assert_eq!((&pooled["subject"], &pooled["scenes"]), (&"method".into(), &2.into()));
    assert_eq!(pooled["p90_mm"], serde_json::Value::Null, "a failed scene is infinitely wrong");
    let index = std::fs::read_to_string(dir.join("out/index.html")).unwrap();
    assert!(index.contains("sees no hair") && index.contains("1 of 2 cells failed"));
}

#[test]
fn json_is_one_document_for_every_command() {
    let dir = copy_of_finished("json");
    let (render, variant) = (format!("out/{SCENE}/render"), format!("out/{SCENE}/{VARIANT}"));
    assert!(json(&dir, &["scenes", "list"]).as_array().unwrap().len() >= 12);
    let name = json(&dir, &["scenes", "list"])[0]["name"].as_str().unwrap().to_owned();
    assert!(json(&dir, &["scenes", "show", &name])["rig"].is_object());
    assert!(json(&dir, &["variants", "list"]).as_array().unwrap().len() >= 3);
    assert_eq!(json(&dir, &["variants", "show", "luo"])["name"], "luo");
    assert_eq!(json(&dir, &tiny_args("render", &["--out", "out"]))[0]["reused"], true);
    assert_eq!(json(&dir, &["reconstruct", &render, "--set", "labels=32"])[0]["reused"], true);
    assert_eq!(json(&dir, &["score", &variant])[0]["reused"], true);
    assert_eq!(json(&dir, &["report", &variant])[0]["reused"], true);
}

//! Comparing, gating and looking back.

use crate::support::{
    SCENE, copy_of_finished, fails, finished, folder, json, ok, python, strandbench, text, tiny_args,
};
use serde_json::Value;
use std::path::Path;
use std::process::Command;
use strandbench_types::{DepthMap, Estimate};

/// A run of two variants on the tiny scene with two seeds would be two runs; one seed is enough to pair.
fn two_variants(name: &str) -> std::path::PathBuf {
    let dir = copy_of_finished(name);
    ok(&dir, &tiny_args("run", &["--out", "out", "--variant", "luo", "--variant", "luo-2cam", "--quiet"]));
    dir
}

const A: &str = "luo+labels=32";
const B: &str = "luo-2cam+labels=32";

#[test]
fn two_variants_of_a_run_are_compared_pixel_by_pixel_and_the_run_is_in_the_history() {
    let dir = two_variants("compare");
    let args = ["compare", A, B, "--results", "out", "--to", "page"];
    let c = json(&dir, &args);
    assert_eq!((&c["cells"], &c["scenes"], &c["a"]["variant"]), (&1.into(), &1.into(), &A.into()));
    let median = &c["primary"][0];
    assert_eq!(
        (&median["metric"], &median["difference"]["cells_with_units"]),
        (&"A1.median".into(), &1.into())
    );
    let index: Value = serde_json::from_slice(&std::fs::read(dir.join("out/index.json")).unwrap()).unwrap();
    let of = |row: usize| {
        let scores = index["rows"][row]["scores"].as_array().unwrap();
        let found = scores.iter().find(|s| s["metric"] == "A1.median" && s["subject"] == "method").unwrap();
        found["value"].as_f64().unwrap()
    };
    assert_eq!(median["difference"]["mean"].as_f64().unwrap(), of(1) - of(0));
    assert!(median["difference"]["undefined"].as_str().unwrap().contains("one scene says nothing"));
    let page = std::fs::read_to_string(dir.join("page/compare.html")).unwrap();
    assert!(page.contains("<svg") && page.contains("A1.median") && page.contains(B));
    for outside in ["src=\"http", "href=\"http", "url(http", "@import", "fetch("] {
        assert!(!page.contains(outside), "the page needs something from outside: {outside}");
    }
    let words = ok(&dir, &args);
    assert!(words.contains("A1.median") && words.contains("cannot show any difference"), "{words}");
    let markdown = ok(&dir, &[&args[..], &["--markdown"]].concat());
    assert_eq!(markdown, std::fs::read_to_string(dir.join("page/compare.md")).unwrap());
    // A folder with one variant needs no name; two do.
    let error = fails(&dir, &["compare", "out", "out"]);
    assert!(error.contains("several variants") && error.contains(A), "{error}");
    assert!(
        ok(&dir, &["compare", &format!("out:{A}"), &format!("out:{B}"), "--to", "page"])
            .contains("A1.median")
    );
    let error = fails(&dir, &["compare", A, "luo-nothing", "--results", "out"]);
    assert!(error.contains("luo-nothing") && error.contains(B), "{error}");
    let error = fails(&dir, &["compare", A, B, "--results", "elsewhere"]);
    assert!(error.contains("elsewhere") && error.contains("there is no such file"), "{error}");

    // The copied run's, and this one's of two cells.
    let entries = json(&dir, &["history", "--results", "out", "--metric", "A1.median"]);
    let brief: Vec<(i64, &str)> = (entries.as_array().unwrap().iter())
        .map(|e| (e["run"].as_i64().unwrap(), e["variant"].as_str().unwrap()))
        .collect();
    assert_eq!(brief, [(1, A), (2, A), (2, B)]);
    assert_eq!(entries[1]["value"].as_f64().unwrap(), of(0));
    assert!(ok(&dir, &["history", "--results", "out"]).contains("2 runs"));
    assert!(std::fs::read_to_string(dir.join("out/history.html")).unwrap().contains("<svg"));
    let csv = ok(&dir, &["history", "--results", "out", "--csv"]);
    assert_eq!(csv.lines().filter(|l| l.contains(",A1.median,")).count(), 3);
    assert!(fails(&dir, &["history", "--results", "out", "--metric", "A1.none"]).contains("no run has"));
    python_reads(&dir.join("out/history.sqlite"), 3);
}

/// `sqlite3` of Python's own library, as pandas and polars use it.
fn python_reads(file: &Path, figures: usize) {
    let Some(python) = python("sqlite3") else { return };
    let script = "import sqlite3, sys\n\
        rows = sqlite3.connect(sys.argv[1]).execute(\"select scene, variant, seed, value from figures join cells \
        using (run, cell) where metric = 'A1.median'\").fetchall()\n\
        assert all(isinstance(r[3], float) and r[2] == '1' for r in rows), rows\n\
        print(len(rows))";
    let out = Command::new(python).args(["-c", script, file.to_str().unwrap()]).output().unwrap();
    assert_eq!(text(&out.stdout).trim(), figures.to_string(), "{}", text(&out.stderr));
}

#[test]
fn a_run_does_not_fail_for_its_history() {
    let dir = copy_of_finished("history");
    let file = dir.join("out/history.sqlite");
    std::fs::write(&file, b"nothing that could be read as a database, whatever one tries to do with it")
        .unwrap();
    let out = strandbench(&dir, &tiny_args("run", &["--out", "out"]));
    assert!(out.status.success());
    assert!(text(&out.stderr).contains("is not in the history"), "{}", text(&out.stderr));
    let error = fails(&dir, &["history", "--results", "out"]);
    assert!(error.contains("history.sqlite") && error.contains("damaged"), "{error}");
    std::fs::remove_file(&file).unwrap();
    assert!(fails(&dir, &["history", "--results", "out"]).contains("there is no history"));
}

#[test]
fn every_figure_is_what_the_committed_reference_says() {
    let out = folder("gate-reference");
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    ok(root, &["gate", "--quiet", "--out", out.to_str().unwrap()]);
}

#[test]
fn the_gate_is_open_for_the_same_and_shut_for_anything_else() {
    let dir = copy_of_finished("gate");
    let plan = "scenes = ['tiny.toml']\nvariants = ['luo']\nseeds = [1]\n\
        settings = ['render.samples_per_pixel=8', 'render.max_samples_per_pixel=8', 'recon.labels=32']\n";
    std::fs::write(dir.join("gate.toml"), plan).unwrap();
    let gate = ["gate", "--plan", "gate.toml", "--reference", "gate.csv", "--out", "out"];
    let with = |more: &[&'static str]| [&gate[..], more].concat();
    assert!(fails(&dir, &gate).contains("gate.csv"), "there is no reference yet");
    assert!(ok(&dir, &with(&["--accept"])).contains("figures accepted"));
    let held = json(&dir, &gate);
    assert_eq!((&held["cells"], held["changes"].as_array().unwrap().len()), (&1.into(), 0));
    let figures = held["figures"].as_u64().unwrap();
    assert!(figures > 50, "{figures}");
    let reference = std::fs::read_to_string(dir.join("gate.csv")).unwrap();
    assert_eq!(reference.lines().count() as u64, figures + 1);

    let median = reference.lines().find(|l| l.contains(",A1.median,")).unwrap();
    let value: f64 = median.split(',').nth(5).unwrap().parse().unwrap();
    for (other, word) in [(value * (1.0 - 1e-9), "worse"), (value * (1.0 + 1e-9), "better")] {
        let changed = reference.replace(median, &median.replace(&value.to_string(), &other.to_string()));
        assert_ne!(changed, reference);
        std::fs::write(dir.join("gate.csv"), changed).unwrap();
        let error = fails(&dir, &gate);
        assert!(error.contains("A1.median") && error.contains(word) && error.contains("--accept"), "{error}");
    }
    let cell = reference.lines().nth(1).unwrap().split(',').next().unwrap();
    std::fs::write(dir.join("gate.csv"), reference.replace(&format!("{cell},"), "another,")).unwrap();
    let error = fails(&dir, &gate);
    assert!(
        error.contains("another by") && error.contains("not run") && error.contains("not in the reference"),
        "{error}"
    );
    let protocol = reference.lines().nth(1).unwrap().rsplit(',').next().unwrap();
    std::fs::write(dir.join("gate.csv"), reference.replace(protocol, "v0 0")).unwrap();
    assert!(fails(&dir, &gate).contains("protocol"));
    std::fs::write(dir.join("gate.csv"), reference.lines().next().unwrap()).unwrap();
    assert!(fails(&dir, &gate).contains("holds no cell"));
    std::fs::write(dir.join("gate.csv"), &reference).unwrap();

    // A cell that fails shuts it, and is never accepted.
    let index = dir.join("out/index.json");
    let mut run: Value = serde_json::from_slice(&std::fs::read(&index).unwrap()).unwrap();
    let row = run["rows"][0].as_object_mut().unwrap();
    row.insert("outcome".to_owned(), "not-run".into());
    row.insert("scores".to_owned(), Value::Array(Vec::new()));
    std::fs::create_dir(dir.join("failed")).unwrap();
    std::fs::write(dir.join("failed/index.json"), run.to_string()).unwrap();
    let judged = ["gate", "--plan", "gate.toml", "--reference", "gate.csv", "--run", "failed"];
    assert!(fails(&dir, &judged).contains("not run"));
    assert!(fails(&dir, &[&judged[..], &["--accept"]].concat()).contains("cannot be accepted"));
    assert_eq!(std::fs::read_to_string(dir.join("gate.csv")).unwrap(), reference);
    assert!(fails(&dir, &with(&["--fresh", "2"])).contains("no margin"));
}

/// Scores an estimate of the tiny scene and returns the lines of a result CSV, one seed after the other.
fn fake(dir: &Path, name: &str, estimate: &Estimate) -> String {
    let truth = finished().join("out").join(SCENE).join("render/truth");
    strandbench_io::write_estimate(&dir.join(name), estimate).unwrap();
    let mut csv = "scene,variant,seed,metric,unit,value,coverage,protocol\n".to_owned();
    ok(dir, &["score", name, "--truth", truth.to_str().unwrap(), "--out", "score"]);
    let file: Value = serde_json::from_slice(&std::fs::read(dir.join("score/scores.json")).unwrap()).unwrap();
    // What a fake method scores is known beforehand for these alone; on six scenes alike.
    let known = ["A1.median", "A1.over_2mm", "A1.over_5mm", "A3.completeness"];
    for scene in 0..6 {
        for s in file["scores"].as_array().unwrap() {
            let metric = s["metric"].as_str().unwrap();
            if s["subject"] == "method" && known.contains(&metric) {
                let value = s["value"].as_f64().map_or(String::new(), |v| format!("{:.3}", v));
                let (unit, coverage) = (s["unit"].as_str().unwrap(), s["coverage"].as_f64().unwrap());
                csv += &format!("scene {scene},{name},1,{metric},{unit},{value},{coverage},v0\n");
            }
        }
    }
    std::fs::write(dir.join(format!("{name}.csv")), &csv).unwrap();
    csv
}

#[test]
fn fake_methods_compare_as_expected() {
    let dir = folder("compare-fakes");
    let view = strandbench_io::read_truth(&finished().join("out").join(SCENE).join("render/truth"))
        .unwrap()
        .views
        .swap_remove(0);
    let moved = |mm: f32| {
        let raw = view.depth_50.raw().map(|z| z + mm);
        Estimate { depth: Some(DepthMap::from_raw(raw)), ..Estimate::default() }
    };
    let (width, height) = view.mask.size();
    fake(&dir, "oracle", &moved(0.0));
    let shifted = fake(&dir, "shifted", &moved(3.0));
    fake(&dir, "empty", &Estimate { depth: Some(DepthMap::empty(width, height)), ..Estimate::default() });
    let crash: Vec<&str> = shifted.lines().filter(|l| !l.starts_with("scene 3")).collect();
    std::fs::write(dir.join("crash.csv"), crash.join("\n")).unwrap();

    let mut report = String::new();
    for (a, b, more) in [
        ("oracle", "shifted", &[][..]),
        ("shifted", "oracle", &[]),
        ("shifted", "empty", &[]),
        ("shifted", "shifted", &[]),
        ("shifted", "crash", &[]),
        ("shifted", "crash", &["--allow-unequal"]),
    ] {
        let (a, b) = (format!("{a}.csv"), format!("{b}.csv"));
        let out = strandbench(&dir, &[&["compare", &a, &b, "--markdown", "--to", "page"], more].concat());
        report += &format!(
            "$ compare {a} {b} {}\nexit code {}\n{}{}\n",
            more.join(" "),
            out.status.code().unwrap(),
            text(&out.stderr),
            text(&out.stdout)
        );
    }
    insta::assert_snapshot!("fakes", report);
}

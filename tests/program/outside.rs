//! Methods from outside: fakes with known outcomes through the same run as any method, and what each row says.
#![cfg(target_os = "linux")]

use crate::sequence;
use crate::support::{
    SCENE, copy, copy_of_finished, fails, folder, json, ok, reused, strandbench, tiny_args,
};
use serde_json::Value;
use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;
use strandbench_types::Plane;

/// `sh fake.sh WHICH {input} {output}`.
const FAKE: &str = r#"
case $1 in
answer-*) cp -r "answers/${1#answer-}/." "$3" ;;
spy) (cd "$2" && find . -type f | sort) >spied.txt; echo "$STRANDBENCH_SPY" >>spied.txt; cp -r answers/constant/. "$3" ;;
silent) echo "nothing to say" >&2 ;;
crash) echo "loading weights" >&2; echo "Segmentation fault (core not dumped)" >&2; exit 3 ;;
killed) kill -9 $$ ;;
slow) echo "epoch 1 of 1000" >&2; sleep 60 & wait ;;
hog) echo "allocating" >&2; head -c 400000000 /dev/zero | tail -c 400000000 | (sleep 30; cat) >/dev/null ;;
frames) for f in 000000 000001 000003 000004; do cp -r answers/constant "$3/$f"; done ;;
stray) cp -r answers/constant "$3/000099" ;;
esac
"#;

/// Every fake, and what else its table in the configuration says.
const FAKES: [(&str, &str); 14] = [
    ("answer-constant", ""),
    ("answer-shifted", ""),
    ("answer-mesh", ""),
    ("answer-nan", ""),
    ("answer-garbage", ""),
    ("answer-frame", ""),
    ("answer-strands", ""),
    ("answer-two", ""),
    ("spy", ""),
    ("silent", ""),
    ("crash", ""),
    ("killed", ""),
    ("slow", "time_limit_s = 1"),
    ("hog", "memory_limit_mib = 100\ntime_limit_s = 20"),
];

fn pfm(depth: &Plane<f32>) -> Vec<u8> {
    let mut bytes = format!("Pf\n{} {}\n-1.0\n", depth.width, depth.height).into_bytes();
    let rows = depth.data.chunks(depth.width).rev();
    rows.flatten().for_each(|v| bytes.extend(v.to_le_bytes()));
    bytes
}

fn configured(dir: &Path, more: &[(&str, &str)]) {
    let mut config = String::new();
    for (name, limits) in FAKES.iter().chain(more) {
        let _ = writeln!(
            config,
            "[method.{name}]\ncommand = \"sh fake.sh {name} {{input}} {{output}}\"\n{limits}"
        );
    }
    config.push_str("[method.missing]\ncommand = [\"./no-such-program\", \"{input}\", \"{output}\"]\n");
    std::fs::write(dir.join("strandbench.toml"), config).unwrap();
    std::fs::write(dir.join("fake.sh"), FAKE).unwrap();
    let answer = |name: &str, file: &str, bytes: Vec<u8>| {
        std::fs::create_dir_all(dir.join("answers").join(name)).unwrap();
        std::fs::write(dir.join("answers").join(name).join(file), bytes).unwrap();
    };
    let (w, h) = (96, 72);
    answer("constant", "depth.pfm", pfm(&Plane::filled(w, h, 820.0)));
    answer("nan", "depth.pfm", pfm(&Plane::filled(w, h, f32::NAN)));
    answer("garbage", "depth.pfm", b"I am a depth map, honestly".to_vec());
    answer("frame", "depth.pfm", pfm(&Plane::filled(w / 2, h / 2, 820.0)));
    answer("two", "depth.pfm", pfm(&Plane::filled(w, h, 820.0)));
    answer("two", "depth.exr", vec![]);
    // A wall across the reference camera's axis at 0.82 m: the same depth as a mesh.
    let wall = "v -9 -9 0.82\nv 9 -9 0.82\nv 9 9 0.82\nv -9 9 0.82\nf 1 2 3 4\n";
    answer("mesh", "mesh.obj", wall.into());
    answer("mesh", "units.json", br#"{"mm_per_unit": 1000, "frame": "reference-camera"}"#.to_vec());
    let mut strands = String::from("v 0 0 0\nv 0 9 0\n");
    (0..1_000_001).for_each(|_| strands.push_str("l 1 2\n"));
    answer("strands", "strands.obj", strands.into());
    let truth = dir.join("out").join(SCENE).join("render/truth");
    if truth.is_dir() {
        let truth = strandbench_io::read_truth(&truth).unwrap();
        answer("shifted", "depth.pfm", pfm(&truth.views[0].depth_50.raw().map(|z| z + 3.0)));
    }
}

pub fn args<'a>(names: &[&'a str]) -> Vec<&'a str> {
    let mut args: Vec<&str> = tiny_args("run", &["--out", "out"]);
    let at = args.iter().position(|a| a.starts_with("recon.")).unwrap();
    args.drain(at - 1..=at);
    names.iter().for_each(|name| args.extend(["--variant", name]));
    args
}

/// A row as people read it: the outcome in words, and the method's figures to four digits.
fn line(row: &Value) -> String {
    let mut text = format!("{}: {}", row["variant"].as_str().unwrap(), row["outcome"].as_str().unwrap());
    for key in ["stage", "limit_s", "message"] {
        if !row[key].is_null() {
            let _ = write!(text, ", {key} {}", row[key]);
        }
    }
    for metric in ["A1.median", "A1.bias_median", "A3.completeness"] {
        let all = row["scores"].as_array().unwrap().iter();
        for s in all.filter(|s| s["metric"] == metric && s["subject"] == "method") {
            let value = s["value"].as_f64().map_or("none".to_owned(), |v| format!("{v:.4}"));
            let _ = write!(text, ", {metric} {value}");
        }
    }
    text
}

#[test]
fn every_fake_has_the_row_that_it_deserves() {
    let dir = copy_of_finished("outside");
    configured(&dir, &[]);
    let names: Vec<&str> = FAKES.iter().map(|f| f.0).chain(["missing"]).collect();
    let mut command = Command::new(env!("CARGO_BIN_EXE_strandbench"));
    let all = [&args(&names)[..], &["--json", "--threads", "2"]].concat();
    let out = command.current_dir(&dir).env("STRANDBENCH_SPY", "seen").args(all).output().unwrap();
    assert_eq!(out.status.code(), Some(1), "{}", String::from_utf8_lossy(&out.stderr));
    let summary: Value = serde_json::from_slice(&out.stdout).unwrap();
    let rows: Vec<String> = summary["rows"].as_array().unwrap().iter().map(line).collect();
    let here = std::path::absolute(&dir).unwrap();
    insta::assert_snapshot!("outside", rows.join("\n").replace(here.to_str().unwrap(), "."));

    let index = std::fs::read_to_string(dir.join("out/index.html")).unwrap();
    assert!(index.contains("10 of 15 cells failed"), "a failure is a row");
    for (name, _) in FAKES
        .iter()
        .filter(|f| !["answer-constant", "answer-shifted", "answer-mesh", "answer-nan", "spy"].contains(&f.0))
    {
        assert!(
            !dir.join("out").join(SCENE).join(name).join("reconstruct").exists(),
            "{name} left an answer"
        );
    }
    let spied = std::fs::read_to_string(dir.join("spied.txt")).unwrap();
    assert!(spied.ends_with("\nseen\n"), "the environment is passed on: {spied}");
    assert!(spied.contains("./images/center.png") && spied.contains("./colmap/cameras.txt"));
    for secret in ["truth", "strands", "head", "identity", "radiance"] {
        assert!(!spied.contains(secret), "{secret} is in:\n{spied}");
    }
    let page = dir.join("out").join(SCENE).join("answer-constant/report/report.html");
    let page = std::fs::read_to_string(page).unwrap();
    assert!(
        page.contains("sh fake.sh answer-constant {input} {output}")
            && !page.contains("Energy of the labelling")
    );
}

#[test]
fn an_answer_is_kept_until_the_program_or_the_images_change() {
    let dir = copy_of_finished("outside-kept");
    configured(&dir, &[]);
    let go = || reused(&json(&dir, &args(&["answer-constant"])));
    assert_eq!(go(), ["render"]);
    assert_eq!(go(), ["render", "reconstruct", "score", "report"]);
    std::fs::write(dir.join("fake.sh"), format!("{FAKE}# another program\n")).unwrap();
    // The same answer again, so that its score stands; the report tells of the command's cost.
    let again = go();
    assert!(!again.contains(&"reconstruct".to_owned()) && again.contains(&"score".to_owned()), "{again:?}");
    assert!(go().contains(&"reconstruct".to_owned()));

    let error = fails(&dir, &[&args(&["answer-constant"])[..], &["--set", "recon.lambda=1"]].concat());
    assert!(error.contains("answer-constant is a method from outside"), "{error}");
    let error = fails(&dir, &args(&["answer-constent"]));
    assert!(
        error.contains("answer-constent") && error.contains("the configuration adds answer-constant"),
        "{error}"
    );
    let error = fails(&dir, &[&args(&["luo"])[..], &["--config", "nowhere.toml"]].concat());
    assert!(error.contains("nowhere.toml: cannot read this configuration"), "{error}");
    assert!(ok(&dir, &["variants", "list"]).contains("answer-constant"));
    assert!(ok(&dir, &["variants", "show", "spy"]).contains("fake.sh"));
}

#[test]
fn frames_that_the_program_leaves_out_are_absent() {
    let dir = folder("outside-moving");
    copy(sequence::finished(), &dir);
    configured(&dir, &[("frames", ""), ("stray", "")]);
    let mut run =
        vec!["run", "--scene", "moving.toml", "--out", "out", "--variant", "frames", "--variant", "stray"];
    run.extend(["--set", "render.samples_per_pixel=8", "--set", "render.max_samples_per_pixel=8", "--json"]);
    let out = strandbench(&dir, &run);
    assert_eq!(out.status.code(), Some(1));
    let summary: Value = serde_json::from_slice(&out.stdout).unwrap();
    let (some, none) = (line(&summary["rows"][0]), line(&summary["rows"][1]));
    assert!(some.starts_with("frames: ok") && some.contains("A3.completeness"), "{some}");
    assert!(
        none.contains("answered to no frame: it wrote only 000099") && none.contains("{output}/000000"),
        "{none}"
    );
    let answers = dir.join("out").join(sequence::SCENE).join("frames/reconstruct");
    let absent = std::fs::read_to_string(answers.join("000002/absent.json")).unwrap();
    assert!(absent.contains("wrote nothing for it"), "{absent}");
    assert!(answers.join("000003/estimate/depth.exr").is_file());
    assert!(dir.join("out").join(sequence::SCENE).join("frames/report/report.html").is_file());
    run.truncate(7);
    run.extend(["--set", "render.samples_per_pixel=8", "--set", "render.max_samples_per_pixel=8"]);
    assert_eq!(reused(&json(&dir, &run)), ["render", "reconstruct", "score", "report"]);
}

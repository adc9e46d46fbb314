//! A tiny scene, a way to run the program, and a finished run that tests share.

use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;

/// Few and thick strands on a small image: seconds, not minutes. Nothing about accuracy is tested on it.
pub const TINY: &str = r#"description = "a small head of hair for tests"
difficulty = "easy"
stresses = "the harness, not the method"

[groom]
family = "straight"
strands = 1200
radius_mm = 0.45
chord_error_mm = 0.2
max_segment_mm = 20.0

[groom.length]
top_mm = 200.0

[groom.style]
lift_mm = 4.0

[rig]
width_px = 96
height_px = 72
focal_px = 187.5
"#;

/// The label of a tiny cell's folder: what [`tiny_args`] overrides is part of it.
pub const SCENE: &str = "tiny+samples_per_pixel=8+max_samples_per_pixel=8";
pub const VARIANT: &str = "luo+labels=32";

/// An empty folder of its own for a test, kept after the run for looking at.
pub fn folder(name: &str) -> PathBuf {
    let dir = Path::new(env!("CARGO_TARGET_TMPDIR")).join("program").join(name);
    if dir.exists() {
        std::fs::remove_dir_all(&dir).unwrap();
    }
    std::fs::create_dir_all(&dir).unwrap();
    dir
}

/// The program, in `dir`, with two threads.
pub fn strandbench(dir: &Path, args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_strandbench"));
    command.current_dir(dir).args(args);
    if !args.contains(&"--threads") {
        command.args(["--threads", "2"]);
    }
    command.output().unwrap()
}

/// Runs the program and expects success.
pub fn ok(dir: &Path, args: &[&str]) -> String {
    let out = strandbench(dir, args);
    assert!(out.status.success(), "{args:?}: {}\n{}", out.status, text(&out.stderr));
    text(&out.stdout)
}

/// Runs the program with `--json` and expects success and one JSON document.
pub fn json(dir: &Path, args: &[&str]) -> Value {
    let all: Vec<&str> = args.iter().copied().chain(["--json"]).collect();
    let stdout = ok(dir, &all);
    serde_json::from_str(&stdout).unwrap_or_else(|e| panic!("{args:?}: {e}\n{stdout}"))
}

/// Runs the program, expects exit code 1 and nothing on standard output but a table, and returns the error text.
pub fn fails(dir: &Path, args: &[&str]) -> String {
    let out = strandbench(dir, args);
    let stderr = text(&out.stderr);
    assert_eq!(out.status.code(), Some(1), "{args:?}: {stderr}");
    assert!(!stderr.contains("panicked"), "{args:?}: {stderr}");
    stderr
}

pub fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// `command --scene tiny.toml` with little sampling and few labels, then more arguments.
pub fn tiny_args<'a>(command: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    let mut args = vec![command, "--scene", "tiny.toml", "--set", "render.samples_per_pixel=8"];
    args.extend(["--set", "render.max_samples_per_pixel=8"]);
    if command == "run" {
        args.extend(["--set", "recon.labels=32"]);
    }
    args.extend(more);
    args
}

/// A folder with `tiny.toml` in which the whole job has run into `out`; shared, so look and do not touch.
pub fn finished() -> &'static Path {
    static DONE: OnceLock<PathBuf> = OnceLock::new();
    DONE.get_or_init(|| {
        let dir = folder("finished");
        std::fs::write(dir.join("tiny.toml"), TINY).unwrap();
        ok(&dir, &tiny_args("run", &["--out", "out"]));
        dir
    })
}

/// A private copy of [`finished`].
pub fn copy_of_finished(name: &str) -> PathBuf {
    let dir = folder(name);
    copy(finished(), &dir);
    dir
}

pub fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        let target = to.join(entry.file_name());
        if entry.path().is_dir() {
            copy(&entry.path(), &target);
        } else {
            std::fs::copy(entry.path(), target).unwrap();
        }
    }
}

/// Every file below a folder with its content.
pub fn files(dir: &Path) -> BTreeMap<String, Vec<u8>> {
    fn walk(dir: &Path, prefix: &str, into: &mut BTreeMap<String, Vec<u8>>) {
        for entry in std::fs::read_dir(dir).unwrap() {
            let entry = entry.unwrap();
            let name = format!("{prefix}{}", entry.file_name().to_string_lossy());
            if entry.path().is_dir() {
                walk(&entry.path(), &format!("{name}/"), into);
            } else {
                into.insert(name, std::fs::read(entry.path()).unwrap());
            }
        }
    }
    let mut into = BTreeMap::new();
    walk(dir, "", &mut into);
    into
}

/// The files of a run that must not depend on the machine, the threads or the time: all but those that hold
/// costs and provenance.
pub fn results(out: &Path) -> BTreeMap<String, Vec<u8>> {
    let timed = [
        "stage.json",
        "render.json",
        "diagnostics.json",
        "report.json",
        "report.html",
        "index.json",
        "costs.html",
        "history.sqlite",
    ];
    let mut all = files(out);
    all.retain(|name, _| {
        !name.starts_with("jobs/") && !timed.iter().any(|t| name.ends_with(t)) && !name.ends_with(".lock")
    });
    all
}

/// Names of the files that differ or are missing on one side.
pub fn differences(a: &BTreeMap<String, Vec<u8>>, b: &BTreeMap<String, Vec<u8>>) -> Vec<String> {
    let mut names: Vec<String> =
        a.keys().chain(b.keys()).filter(|k| a.get(*k) != b.get(*k)).cloned().collect();
    names.dedup();
    names
}

/// Which stages a run with `--json` re-used.
pub fn reused(summary: &Value) -> Vec<String> {
    let row = &summary["rows"][0]["reused"];
    row.as_array().unwrap().iter().map(|v| v.as_str().unwrap().to_owned()).collect()
}

/// Python with modules to import; says so where there is none, which CI does not accept.
pub fn python(modules: &str) -> Option<String> {
    let python = std::env::var("STRANDBENCH_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let import = format!("import {modules}");
    let there = Command::new(&python).args(["-c", &import]).stderr(std::process::Stdio::null()).status();
    if there.is_ok_and(|s| s.success()) {
        return Some(python);
    }
    assert!(std::env::var_os("CI").is_none(), "CI needs Python with {modules}");
    println!("ignored, no Python with {modules}: run `cargo xtask test`, or set STRANDBENCH_PYTHON");
    None
}

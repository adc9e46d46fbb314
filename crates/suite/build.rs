//! Hashes the sources behind each stage, so that a result is re-used only by the code that made it.

use std::path::{Path, PathBuf};
use std::process::Command;

/// Stage, and what it runs: paths from the workspace root, files or folders.
const STAGES: &[(&str, &[&str])] = &[
    (
        "RENDER",
        &[
            "crates/types",
            "crates/rng",
            "crates/io",
            "scenes/src",
            "scenes/assets",
            "scenes/Cargo.toml",
            "renderer",
            "groundtruth",
            "crates/suite/src/render.rs",
            "crates/suite/src/identity.rs",
            "crates/suite/src/pictures.rs",
            "crates/suite/src/scene_job.rs",
            "crates/suite/src/framing.rs",
            "crates/suite/src/exposure.rs",
            "crates/suite/src/stage.rs",
            "crates/suite/src/sequence/file.rs",
            "crates/suite/src/sequence/render.rs",
        ],
    ),
    (
        "RECONSTRUCT",
        &[
            "crates/types",
            "crates/io",
            "crates/solve",
            "crates/recon",
            "crates/suite/src/reconstruct.rs",
            "crates/suite/src/sequence/reconstruct.rs",
            "crates/suite/src/stage.rs",
        ],
    ),
    (
        "BASELINE",
        &[
            "crates/types",
            "crates/io",
            "crates/solve",
            "crates/baselines",
            "crates/suite/src/field.rs",
            "crates/suite/src/stage.rs",
        ],
    ),
    (
        "SCORE",
        &[
            "crates/types",
            "crates/rng",
            "crates/io",
            "crates/score",
            "crates/suite/src/score.rs",
            "crates/suite/src/sequence/score.rs",
            "crates/suite/src/sequence/whole.rs",
            "crates/suite/src/stage.rs",
        ],
    ),
    (
        "OUTSIDE",
        &[
            "crates/types",
            "crates/io",
            "scenes/src/head",
            "crates/suite/src/outside",
            "crates/suite/src/dataset",
            "crates/suite/src/stage.rs",
        ],
    ),
    ("REPORT", &["crates", "scenes/src", "renderer", "groundtruth"]),
];

/// Folders that hold no code of the program itself.
const SKIPPED: &[&str] = &["tests", "examples", "benches", "fuzz", "target", "snapshots", "mitsuba"];

fn main() {
    let root = PathBuf::from(std::env::var_os("CARGO_MANIFEST_DIR").expect("cargo sets it")).join("../..");
    let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let rustc = output(Command::new(rustc).arg("--version")).unwrap_or_else(|| "unknown".into());
    for (stage, paths) in STAGES {
        let mut files = vec![root.join("Cargo.lock")];
        for path in *paths {
            println!("cargo::rerun-if-changed=../../{path}");
            collect(&root.join(path), &mut files);
        }
        files.sort();
        files.dedup();
        let mut hasher = blake3::Hasher::new();
        hasher.update(rustc.as_bytes());
        hasher.update(std::env::var("TARGET").unwrap_or_default().as_bytes());
        for file in &files {
            let Ok(text) = std::fs::read(file) else { continue };
            let name = file.strip_prefix(&root).unwrap_or(file).to_string_lossy().replace('\\', "/");
            hasher.update(&(name.len() as u64).to_le_bytes());
            hasher.update(name.as_bytes());
            hasher.update(&(text.len() as u64).to_le_bytes());
            hasher.update(&text);
        }
        println!("cargo::rustc-env=STRANDBENCH_CODE_{stage}={}", &hasher.finalize().to_hex()[..32]);
    }
    println!("cargo::rerun-if-changed=../../Cargo.lock");
    println!("cargo::rustc-env=STRANDBENCH_RUSTC={rustc}");
    println!("cargo::rustc-env=STRANDBENCH_PROFILE={}", std::env::var("PROFILE").unwrap_or_default());
    println!("cargo::rustc-env=STRANDBENCH_TARGET={}", std::env::var("TARGET").unwrap_or_default());
    // The commit is a convenience (the code hashes above say exactly what ran): followed in release builds alone.
    if std::env::var("PROFILE").as_deref() == Ok("release") && root.join(".git/logs/HEAD").exists() {
        println!("cargo::rerun-if-changed=../../.git/logs/HEAD");
    }
    let commit = output(Command::new("git").args(["rev-parse", "--short=12", "HEAD"]).current_dir(&root));
    println!("cargo::rustc-env=STRANDBENCH_COMMIT={}", commit.unwrap_or_default());
}

fn output(command: &mut Command) -> Option<String> {
    let done = command.output().ok().filter(|o| o.status.success())?;
    Some(String::from_utf8_lossy(&done.stdout).trim().to_owned())
}

fn collect(path: &Path, files: &mut Vec<PathBuf>) {
    let Ok(entries) = std::fs::read_dir(path) else {
        if path.is_file() {
            files.push(path.to_owned());
        }
        return;
    };
    for entry in entries.flatten() {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        if !name.starts_with('.') && !SKIPPED.contains(&&*name) {
            collect(&entry.path(), files);
        }
    }
}

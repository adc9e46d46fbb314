//! A reader that goes away.

use crate::support::{SCENE, VARIANT, copy_of_finished, text, tiny_args};
use std::path::Path;
use std::process::{Command, Output, Stdio};

/// Runs the program with standard output, or standard error, a pipe that nobody reads any more.
fn unread(dir: &Path, args: &[&str], errors: bool) -> Output {
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let mut command = Command::new(env!("CARGO_BIN_EXE_strandbench"));
    command.current_dir(dir).args(args).args(["--threads", "2"]);
    if errors {
        command.stdout(Stdio::piped()).stderr(writer);
    } else {
        command.stdout(writer).stderr(Stdio::piped());
    }
    command.spawn().unwrap().wait_with_output().unwrap()
}

#[test]
fn output_that_nobody_reads_changes_neither_the_work_nor_the_exit_code() {
    let dir = copy_of_finished("pipe");
    let (render, variant) = (format!("out/{SCENE}/render"), format!("out/{SCENE}/{VARIANT}"));
    let run = tiny_args("run", &["--out", "out"]);
    let commands: [&[&str]; 13] = [
        &["scenes", "list"],
        &["scenes", "show", "straight-blonde", "--json"],
        &["variants", "list"],
        &["baselines", "list"],
        &["ablate", "--list"],
        &["--help"],
        &run,
        &["reconstruct", &render, "--set", "labels=32"],
        &["score", &variant],
        &["report", &variant],
        &["history", "--results", "out"],
        &["history", "--results", "out", "--csv"],
        &["export", &variant, "exported"],
    ];
    for args in commands {
        let out = unread(&dir, args, false);
        assert!(out.status.success(), "{args:?}: {} {}", out.status, text(&out.stderr));
        assert!(!text(&out.stderr).contains("panicked"), "{args:?}: {}", text(&out.stderr));
    }
    for args in [&run[..], &["report", &variant]] {
        let out = unread(&dir, args, true);
        assert!(out.status.success(), "{args:?}: {}", out.status);
    }
    let failed = unread(&dir, &["score", "nowhere"], false);
    assert_eq!(failed.status.code(), Some(1), "what fails fails all the same");
    assert_eq!(unread(&dir, &["score", "nowhere"], true).status.code(), Some(1));
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_an_error() {
    let full = std::fs::File::options().write(true).open("/dev/full").unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_strandbench"));
    let out = command.args(["scenes", "list"]).stdout(full).stderr(Stdio::piped()).output().unwrap();
    assert_eq!(out.status.code(), Some(1));
    assert!(text(&out.stderr).contains("standard output"), "{}", text(&out.stderr));
}

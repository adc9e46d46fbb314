//! A run as a workflow: the same figures and pages, whoever makes the cells and whatever is killed on the way.

use crate::support::{
    SCENE, TINY, VARIANT, differences, fails, finished, folder, json, ok, python, results, strandbench, text,
    tiny_args,
};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// What a merge must write with the same bits as a run.
const REPORT: [&str; 3] = ["results.json", "results.csv", "index.html"];

fn same_report(a: &Path, b: &Path) {
    for name in REPORT {
        let [one, two] = [a, b].map(|dir| std::fs::read_to_string(dir.join(name)).unwrap());
        assert!(one.len() > 500, "{name} says something");
        assert_eq!(one, two, "{name}");
    }
}

/// The keys of renders and cells of a plan.
fn keys(dir: &Path, of: &str) -> Vec<String> {
    let plan: serde_json::Value =
        serde_json::from_slice(&std::fs::read(dir.join("flow/plan.json")).unwrap()).unwrap();
    plan[of].as_array().unwrap().iter().map(|s| s["key"].as_str().unwrap().to_owned()).collect()
}

/// `workflow write` with the arguments of a run.
fn write(dir: &Path, args: &[&str], more: &[&str]) {
    ok(dir, &[&["workflow", "write"], &args[1..], &["--to", "flow"], more].concat());
}

fn start(dir: &Path, args: &[&str]) -> Child {
    let mut command = Command::new(env!("CARGO_BIN_EXE_strandbench"));
    command.current_dir(dir).args(args).args(["--threads", "1"]);
    command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
}

#[test]
fn jobs_by_hand_give_the_report_of_a_run_and_keep_out_of_each_others_way() {
    let dir = folder("workflow-by-hand");
    std::fs::write(dir.join("tiny.toml"), TINY).unwrap();
    write(&dir, &tiny_args("run", &["--out", "out"]), &[]);
    let (render, cell) = (&keys(&dir, "renders")[0], &keys(&dir, "cells")[0]);
    let plan = "flow/plan.json";
    let missing = fails(&dir, &["workflow", "merge", plan]);
    assert!(missing.contains(SCENE) && missing.contains("is missing"), "{missing}");
    for args in [["workflow", "render", plan, render], ["workflow", "cell", plan, cell]] {
        // Two workers, and a third that dies: of the first two one works and the other finds it done.
        let mut workers = [start(&dir, &args), start(&dir, &args), start(&dir, &args)];
        std::thread::sleep(Duration::from_millis(300));
        workers[0].kill().unwrap();
        workers[0].wait().unwrap();
        for worker in &mut workers[1..] {
            assert!(worker.wait().unwrap().success(), "{args:?}");
        }
    }
    let held = std::fs::File::options().write(true).open(dir.join("out/.strandbench.lock")).unwrap();
    held.lock_shared().unwrap();
    assert!(fails(&dir, &tiny_args("run", &["--out", "out"])).contains("another run"), "workers are at it");
    drop(held);
    ok(&dir, &["workflow", "merge", plan]);
    let single = finished().join("out");
    same_report(&single, &dir.join("out"));
    assert_eq!(differences(&results(&single), &results(&dir.join("out"))), [""; 0]);
    let history = json(&dir, &["history", "--results", "out"]);
    assert!(history.as_array().is_some_and(|h| h.len() > 50 && h.iter().all(|e| e["run"] == 1)), "one run");

    let other = fails(&dir, &["workflow", "cell", plan, &cell.replace(&cell[..4], "0000")]);
    assert!(other.contains("names no cell"), "{other}");
    let scores = dir.join("out").join(SCENE).join(VARIANT).join("score/scores.json");
    let text = std::fs::read_to_string(&scores).unwrap();
    std::fs::write(&scores, text.replacen("0.", "1.", 1)).unwrap();
    let damaged = fails(&dir, &["workflow", "merge", plan]);
    assert!(damaged.contains("scores.json is damaged"), "{damaged}");
    std::fs::write(dir.join("tiny.toml"), TINY.replace("1200", "1201")).unwrap();
    let changed = fails(&dir, &["workflow", "cell", plan, cell]);
    assert!(changed.contains("write the workflow again"), "{changed}");
}

#[test]
fn all_says_which_scenes_it_leaves_out_and_takes_them_with_frames() {
    let dir = folder("workflow-all");
    let count = |out: &std::process::Output| -> u64 {
        let value: serde_json::Value = serde_json::from_slice(&out.stdout).unwrap();
        value["cells"].as_u64().unwrap()
    };
    let write = ["workflow", "write", "--all", "--to", "flow", "--json"];
    let still = strandbench(&dir, &write);
    let said = text(&still.stderr);
    assert!(said.contains("moving-still") && said.contains("--all --frames A..B"), "{said}");
    let every = strandbench(&dir, &[&write[..], &["--frames", "0..2"]].concat());
    assert!(!text(&every.stderr).contains("left out"));
    let moving = strandbench_scenes::moving_catalog().len() as u64;
    assert!(moving > 0 && count(&every) == count(&still) + moving);
}

/// Processes of this program that run a job of the plan.
#[cfg(target_os = "linux")]
fn workers(plan: &Path, job: &str) -> Vec<u32> {
    let program = std::fs::canonicalize(env!("CARGO_BIN_EXE_strandbench")).unwrap();
    let of = |pid: u32| -> Option<bool> {
        let at = PathBuf::from(format!("/proc/{pid}"));
        let line = std::fs::read_to_string(at.join("cmdline")).ok()?;
        let words: Vec<&str> = line.split('\0').collect();
        Some(
            std::fs::read_link(at.join("exe")).ok()? == program
                && words.contains(&job)
                && words.contains(&plan.to_str()?),
        )
    };
    let all = std::fs::read_dir("/proc").unwrap().flatten();
    let pids = all.filter_map(|e| e.file_name().to_str()?.parse().ok());
    pids.filter(|&pid| of(pid) == Some(true)).collect()
}

/// Waits until `done` says so; fails after two minutes.
#[cfg(target_os = "linux")]
fn until<T>(what: &str, mut done: impl FnMut() -> Option<T>) -> T {
    let start = Instant::now();
    loop {
        if let Some(value) = done() {
            return value;
        }
        assert!(start.elapsed() < Duration::from_secs(120), "waited in vain for {what}");
        std::thread::sleep(Duration::from_millis(5));
    }
}

#[cfg(target_os = "linux")]
#[test]
fn snakemake_gives_the_report_of_a_run_though_a_worker_and_the_engine_are_killed() {
    let Some(python) = python("snakemake") else { return };
    let motion = "\n[motion]\nframes = 4\n[motion.head]\nkind = \"shake\"\namplitude_deg = 20\nfrequency_hz = 3\n\
                  cycles = 1\nstart_s = 0.0\n[motion.solver]\nguides = 100\n";
    let [single, many] = ["workflow-single", "workflow-many"].map(folder);
    for dir in [&single, &many] {
        std::fs::write(dir.join("tiny.toml"), TINY).unwrap();
        std::fs::write(dir.join("moving.toml"), format!("{TINY}{motion}")).unwrap();
        let away = TINY.replace("focal_px", "target_mm = [9000.0, 0.0, 0.0]\nfocal_px");
        std::fs::write(dir.join("away.toml"), away).unwrap();
    }
    let more = ["--scene", "moving.toml", "--scene", "away.toml", "--variant", "luo", "--variant", "luo-ncc"];
    let args = tiny_args("run", &[&more[..], &["--out", "out"]].concat());
    let run = strandbench(&single, &args);
    assert_eq!(run.status.code(), Some(1), "two of six cells see no hair: {}", text(&run.stderr));

    write(&many, &args, &["--frames-per-job", "2"]);
    let plan = std::path::absolute(many.join("flow/plan.json")).unwrap();
    let log = |name: &str| std::fs::File::create(many.join(name)).unwrap();
    let snakemake = |name: &str| -> Child {
        let mut command = Command::new(&python);
        command.args(["-m", "snakemake", "--profile", "profiles/local", "--cores", "2"]);
        command.current_dir(many.join("flow")).stdout(log(&format!("{name}.out"))).stderr(log(name));
        command.spawn().unwrap()
    };
    let kill = |pid: u32| Command::new("kill").args(["-KILL", &pid.to_string()]).status().unwrap().success();
    let notes = || {
        let jobs = std::fs::read_dir(many.join("out/jobs")).into_iter().flatten().flatten();
        jobs.filter(|e| e.file_name().to_string_lossy().starts_with("cell-")).count()
    };

    let mut first = snakemake("first.log");
    // A worker is killed in the midst of its cell: the engine starts the job again.
    until("a cell at work", || {
        let pid = workers(&plan, "cell").first().copied()?;
        std::thread::sleep(Duration::from_millis(100));
        (workers(&plan, "cell").contains(&pid) && kill(pid)).then_some(())
    });
    until("the engine to see it", || {
        let text = std::fs::read_to_string(many.join("first.log")).unwrap();
        text.contains("restart").then_some(())
    });
    // Then the engine, while its workers go on.
    until("a cell done and another at work", || {
        (notes() >= 1 && !workers(&plan, "cell").is_empty()).then_some(())
    });
    first.kill().unwrap();
    assert!(!first.wait().unwrap().success());
    assert!(notes() < 6 && !many.join("out/results.json").exists(), "it was killed on the way");

    let second = snakemake("second.log").wait().unwrap();
    let said = std::fs::read_to_string(many.join("second.log")).unwrap();
    assert!(second.success(), "{said}");
    assert!(!said.contains("13 of 13"), "what was done is not done again: {said}");
    let (a, b) = (single.join("out"), many.join("out"));
    same_report(&a, &b);
    assert_eq!(differences(&results(&a), &results(&b)), [""; 0], "every file of every cell");
    let again = snakemake("third.log").wait().unwrap();
    assert!(again.success());
    assert!(std::fs::read_to_string(many.join("third.log")).unwrap().contains("Nothing to be done"));
}

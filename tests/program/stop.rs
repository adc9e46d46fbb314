//! Ctrl-C and a second writer.

use crate::support::{TINY, copy_of_finished, fails, files, folder, tiny_args};
use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

#[cfg(unix)]
#[test]
fn ctrl_c_in_a_render_leaves_nothing_half_written_and_exits_130() {
    let dir = folder("ctrl-c");
    std::fs::write(dir.join("tiny.toml"), TINY).unwrap();
    let mut child = Command::new(env!("CARGO_BIN_EXE_strandbench"))
        .current_dir(&dir)
        .args(["run", "--scene", "tiny.toml", "--out", "out", "--threads", "2"])
        .args(["--set", "scene.rig.width_px=1600", "--set", "scene.rig.height_px=1200"])
        .args(["--set", "scene.rig.focal_px=3100", "--set", "render.samples_per_pixel=64"])
        .args(["--set", "render.max_samples_per_pixel=64"])
        .stderr(Stdio::piped())
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(child.stderr.take().unwrap()).lines();
    let first = lines.next().unwrap().unwrap();
    assert!(first.starts_with("render"), "{first}");
    std::thread::sleep(Duration::from_secs(2));
    assert!(
        child.try_wait().unwrap().is_none(),
        "the render must still be at work for this test to say anything"
    );
    let temporary = |out: &std::path::Path| {
        let scene = std::fs::read_dir(out).unwrap().map(|e| e.unwrap().path()).find(|p| p.is_dir());
        scene.map_or(0, |s| std::fs::read_dir(s).unwrap().count())
    };
    assert_eq!(temporary(&dir.join("out")), 1, "it works in a folder beside the final one");
    let asked = Instant::now();
    let sent = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(sent.success());
    let status = loop {
        if let Some(status) = child.try_wait().unwrap() {
            break status;
        }
        if asked.elapsed() > Duration::from_secs(10) {
            child.kill().unwrap();
            panic!("it did not stop within {:?}", asked.elapsed());
        }
        std::thread::sleep(Duration::from_millis(20));
    };
    assert_eq!(status.code(), Some(130));
    assert!(lines.any(|l| l.unwrap().contains("cancelled")));
    let left: Vec<String> = files(&dir.join("out")).into_keys().collect();
    assert_eq!(left, [".strandbench.lock"], "nothing but the lock");
    assert_eq!(temporary(&dir.join("out")), 0);
}

#[test]
fn a_second_run_into_the_same_folder_is_refused() {
    let dir = copy_of_finished("locked");
    let lock = std::fs::File::options().write(true).open(dir.join("out/.strandbench.lock")).unwrap();
    lock.lock().unwrap();
    let error = fails(&dir, &tiny_args("run", &["--out", "out"]));
    assert!(error.contains("another run is writing here"), "{error}");
}

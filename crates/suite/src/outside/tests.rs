use super::process::{End, Limits, run};
use std::path::Path;
use std::process::Command;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use strandbench_types::{Monitor, Silent};

fn shell(script: &str) -> Command {
    let mut command = Command::new("/bin/sh");
    command.args(["-c", script]);
    command
}

fn ended(script: &str, limits: Limits) -> super::Ran {
    let dir = tempfile::tempdir().unwrap();
    run(&mut shell(script), dir.path(), limits, &Silent).unwrap()
}

/// Whether a process is there and no zombie.
fn alive(pid: &str) -> bool {
    std::fs::read_to_string(format!("/proc/{pid}/stat"))
        .is_ok_and(|s| !s[s.rfind(')').unwrap()..].starts_with(") Z"))
}

/// A process that was killed needs a processor to die on.
fn dies(pid: &str) -> bool {
    let start = Instant::now();
    while alive(pid) && start.elapsed() < Duration::from_secs(5) {
        std::thread::sleep(Duration::from_millis(5));
    }
    !alive(pid)
}

/// The number that a script wrote into a file, once it is there.
fn written(path: &Path) -> String {
    let start = Instant::now();
    loop {
        let text = std::fs::read_to_string(path).unwrap_or_default();
        if text.ends_with('\n') {
            return text.trim().to_owned();
        }
        assert!(start.elapsed() < Duration::from_secs(10), "{} was not written", path.display());
        std::thread::sleep(Duration::from_millis(5));
    }
}

#[test]
fn a_program_that_ends_is_quoted_and_so_is_its_exit() {
    let ran = ended("echo one >&2; echo; printf 'two\\a\\n' >&2; exit 3", Limits::default());
    let End::Exited(status) = ran.end else { panic!("{ran:?}") };
    assert_eq!((status.code(), ran.said.as_str()), (Some(3), "one | two "));
    assert!(ended("exit 0", Limits::default()).said.is_empty());
    let long = ended("for i in 1 2 3 4 5 6 7 8 9; do echo line $i >&2; done", Limits::default());
    assert_eq!(long.said, "line 4 | line 5 | line 6 | line 7 | line 8 | line 9");
}

#[cfg(target_os = "linux")]
#[test]
fn time_ends_the_whole_group_even_a_child_that_will_not_listen() {
    let dir = tempfile::tempdir().unwrap();
    let (deaf, plain) = (dir.path().join("deaf"), dir.path().join("plain"));
    let script = format!(
        "sh -c 'trap \"\" TERM; echo $$ >{}; while :; do sleep 0.05; done' & sleep 60 & echo $! >{}; wait",
        deaf.display(),
        plain.display()
    );
    let start = Instant::now();
    let ran = run(&mut shell(&script), dir.path(), Limits { time_s: Some(0.5), memory_mib: None }, &Silent)
        .unwrap();
    assert!(matches!(ran.end, End::Late), "{ran:?}");
    assert!(start.elapsed() < Duration::from_secs(6), "{:?}", start.elapsed());
    for file in [&deaf, &plain] {
        assert!(dies(&written(file)), "{}", file.display());
    }
}

#[cfg(target_os = "linux")]
#[test]
fn what_a_program_leaves_behind_is_ended_with_it() {
    let dir = tempfile::tempdir().unwrap();
    let left = dir.path().join("left");
    let ran = run(
        &mut shell(&format!("sleep 60 & echo $! >{}", left.display())),
        dir.path(),
        Limits::default(),
        &Silent,
    )
    .unwrap();
    assert!(matches!(ran.end, End::Exited(s) if s.success()), "{ran:?}");
    assert!(dies(&written(&left)));
}

#[cfg(target_os = "linux")]
#[test]
fn memory_of_the_whole_group_counts() {
    // Two children of some 40 MiB each: neither is over the limit by itself.
    let hog = "head -c 40000000 /dev/zero | tail -c 40000000 | (sleep 20; cat >/dev/null)";
    let script = format!("({hog}) & ({hog}) & wait");
    let limits = |mib| Limits { time_s: Some(3.0), memory_mib: Some(mib) };
    let ran = ended(&script, limits(60.0));
    assert!(matches!(ran.end, End::Large) && ran.peak_mib.unwrap() > 60.0, "{ran:?}");
    let ran = ended("sleep 0.5", limits(60.0));
    assert!(matches!(ran.end, End::Exited(_)) && ran.peak_mib.unwrap() < 20.0, "{ran:?}");
}

#[cfg(target_os = "linux")]
#[test]
fn a_stop_from_outside_ends_the_group_at_once() {
    struct Stop(AtomicBool);
    impl Monitor for Stop {
        fn begin(&self, _: &str, _: u64) {}
        fn advance(&self, _: u64) {}
        fn cancelled(&self) -> bool {
            self.0.load(Ordering::SeqCst)
        }
    }
    impl crate::Progress for Stop {
        fn stage_begins(&self, _: &str, _: &Path, _: &str) {}
        fn stage_done(&self, _: &crate::Done) {}
    }
    let dir = tempfile::tempdir().unwrap();
    let (stop, pid) = (Stop(AtomicBool::new(false)), dir.path().join("pid"));
    std::thread::scope(|scope| {
        let script = format!("sleep 60 & echo $! >{}; wait", pid.display());
        let (stop, logs) = (&stop, dir.path());
        let job = scope.spawn(move || run(&mut shell(&script), logs, Limits::default(), stop).unwrap());
        let child = written(&pid);
        assert!(alive(&child), "it must be at work for this test to say anything");
        let asked = Instant::now();
        stop.0.store(true, Ordering::SeqCst);
        assert!(matches!(job.join().unwrap().end, End::Stopped));
        assert!(asked.elapsed() < Duration::from_secs(3), "{:?}", asked.elapsed());
        assert!(dies(&child));
    });
}

//! A program in a process group of its own, watched until it ends, takes too long or too much, or is stopped.

use crate::Progress;
use std::fs::File;
use std::io::{Read as _, Seek as _, SeekFrom};
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

/// How often the program is looked at.
const TICK: Duration = Duration::from_millis(20);
/// How long a group that is asked to end may take for it before it is ended.
const GRACE: Duration = Duration::from_secs(2);
/// Most text that a program may write to standard output and error together.
const MAX_TEXT: u64 = 256 << 20;
/// Bytes at the end of standard error that a message shows.
const SAID: u64 = 600;

/// How the program ended.
#[derive(Debug)]
pub(super) enum End {
    /// By itself.
    Exited(ExitStatus),
    /// It took longer than it may.
    Late,
    /// Its group had more resident memory than it may.
    Large,
    /// It wrote more text than it may.
    Talkative,
    /// The work was stopped from outside.
    Stopped,
}

/// What became of a program.
#[derive(Debug)]
pub(super) struct Ran {
    pub end: End,
    /// Most resident memory of its group seen, MiB, looked at every fifth of a second; `None` where the system does
    /// not tell.
    pub peak_mib: Option<f64>,
    /// The end of what it wrote to standard error, on one line.
    pub said: String,
}

/// Limits of a run.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Limits {
    pub time_s: Option<f64>,
    pub memory_mib: Option<f64>,
}

/// Runs a command to its end; what it writes goes into `stdout.txt` and `stderr.txt` in `logs`. Whatever of its process
/// group is left then is ended too.
pub(super) fn run(
    command: &mut Command,
    logs: &Path,
    limits: Limits,
    progress: &dyn Progress,
) -> std::io::Result<Ran> {
    let [out, err] = ["stdout.txt", "stderr.txt"].map(|name| logs.join(name));
    command.stdin(Stdio::null()).stdout(File::create(&out)?).stderr(File::create(&err)?);
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(command, 0);
    let mut child = command.spawn()?;
    let start = Instant::now();
    let mut peak_mib: Option<f64> = None;
    let mut looked = None;
    let end = loop {
        if let Some(status) = child.try_wait()? {
            break End::Exited(status);
        }
        if looked.is_none_or(|at: Instant| at.elapsed() > 10 * TICK) {
            looked = Some(Instant::now());
            let now = group_mib(child.id());
            peak_mib = peak_mib.into_iter().chain(now).reduce(f64::max);
            if let (Some(now), Some(limit)) = (now, limits.memory_mib)
                && now > limit
            {
                break End::Large;
            }
            let size = |p| std::fs::metadata(p).map_or(0, |m| m.len());
            if size(&out) + size(&err) > MAX_TEXT {
                break End::Talkative;
            }
        }
        if limits.time_s.is_some_and(|s| start.elapsed().as_secs_f64() > s) {
            break End::Late;
        }
        if progress.cancelled() {
            break End::Stopped;
        }
        std::thread::sleep(TICK);
    };
    finish(&mut child, matches!(end, End::Large))?;
    Ok(Ran { end, peak_mib, said: tail(&err) })
}

/// Ends what is left of the group: it is asked first, unless there is no time for it.
#[cfg(unix)]
fn finish(child: &mut Child, at_once: bool) -> std::io::Result<()> {
    use nix::sys::signal::{Signal, killpg};
    let group = nix::unistd::Pid::from_raw(child.id() as i32);
    let asked = Instant::now();
    // No process of the group is left: the only error there can be.
    let gone = |signal: Option<Signal>| killpg(group, signal).is_err();
    if !at_once && !gone(Some(Signal::SIGTERM)) {
        while asked.elapsed() < GRACE {
            let _ = child.try_wait()?;
            if gone(None) {
                break;
            }
            std::thread::sleep(TICK);
        }
    }
    let _ = killpg(group, Signal::SIGKILL);
    child.wait()?;
    // The others die a moment later, and stay for as long as nobody asks after them.
    let killed = Instant::now();
    while !gone(None) && killed.elapsed() < 10 * TICK {
        std::thread::sleep(TICK);
    }
    Ok(())
}

#[cfg(not(unix))]
fn finish(child: &mut Child, _at_once: bool) -> std::io::Result<()> {
    let _ = child.kill();
    child.wait().map(|_| ())
}

/// Resident memory of all processes of a group, MiB; pages that several share count for each. Field 5 of
/// /proc/<pid>/stat is the group, VmRSS of /proc/<pid>/status the memory (proc(5)).
#[cfg(target_os = "linux")]
fn group_mib(group: u32) -> Option<f64> {
    let mut kib = 0.0;
    for entry in std::fs::read_dir("/proc").ok()?.flatten() {
        let name = entry.file_name();
        if !name.to_str().is_some_and(|n| n.bytes().all(|b| b.is_ascii_digit())) {
            continue;
        }
        let Ok(stat) = std::fs::read_to_string(entry.path().join("stat")) else { continue };
        let Some(after_name) = stat.rfind(')').map(|i| &stat[i + 1..]) else { continue };
        if after_name.split_ascii_whitespace().nth(2).and_then(|g| g.parse().ok()) == Some(group) {
            let status = std::fs::read_to_string(entry.path().join("status")).unwrap_or_default();
            let line = status.lines().find_map(|l| l.strip_prefix("VmRSS:"));
            kib += line.and_then(|l| l.split_ascii_whitespace().next()?.parse::<f64>().ok()).unwrap_or(0.0);
        }
    }
    Some(kib / 1024.0)
}

#[cfg(not(target_os = "linux"))]
fn group_mib(_group: u32) -> Option<f64> {
    None
}

/// The last lines of a file, on one.
fn tail(path: &Path) -> String {
    let read = || -> std::io::Result<Vec<u8>> {
        let mut file = File::open(path)?;
        let length = file.seek(SeekFrom::End(0))?;
        file.seek(SeekFrom::Start(length.saturating_sub(SAID)))?;
        let mut bytes = Vec::new();
        file.take(SAID).read_to_end(&mut bytes)?;
        Ok(bytes)
    };
    let text = String::from_utf8_lossy(&read().unwrap_or_default()).into_owned();
    let lines: Vec<&str> = text.lines().map(str::trim_end).filter(|l| !l.is_empty()).collect();
    let clean = |c: char| if c.is_control() { ' ' } else { c };
    lines[lines.len().saturating_sub(6)..].join(" | ").chars().map(clean).collect()
}

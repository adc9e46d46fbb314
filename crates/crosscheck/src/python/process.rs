//! Processes with a time limit that can be stopped from outside.

use crate::CrossError;
use std::process::{Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};
use strandbench_types::Monitor;

/// Runs a process to its end and returns what it wrote to standard output.
pub(super) fn finish(
    job: &str,
    command: &mut Command,
    limit: Duration,
    monitor: &dyn Monitor,
) -> Result<String, CrossError> {
    let fault = |how: String, last: String| CrossError::Job { job: job.to_owned(), how, last };
    // Files and not pipes: a full pipe would stop the process.
    let scratch = || tempfile::tempfile().map_err(|e| fault("has no scratch file".into(), e.to_string()));
    let (out, err) = (scratch()?, scratch()?);
    let clone =
        |f: &std::fs::File| f.try_clone().map_err(|e| fault("has no scratch file".into(), e.to_string()));
    let mut child =
        command.stdin(Stdio::null()).stdout(clone(&out)?).stderr(clone(&err)?).spawn().map_err(|e| {
            fault(format!("did not start ({})", command.get_program().display()), e.to_string())
        })?;
    let start = Instant::now();
    let status: ExitStatus = loop {
        if let Some(status) = child.try_wait().map_err(|e| fault("was lost".into(), e.to_string()))? {
            break status;
        }
        let late = start.elapsed() > limit;
        if late || monitor.cancelled() {
            let _ = child.kill();
            let _ = child.wait();
            monitor.check()?;
            return Err(fault(format!("took longer than {} s", limit.as_secs()), text(err)));
        }
        std::thread::sleep(Duration::from_millis(10));
    };
    if !status.success() {
        return Err(fault(format!("ended with {status}"), text(err)));
    }
    Ok(text(out))
}

/// The end of a scratch file.
fn text(mut file: std::fs::File) -> String {
    use std::io::{Read, Seek, SeekFrom};
    let mut bytes = Vec::new();
    let length = file.seek(SeekFrom::End(0)).unwrap_or(0);
    let _ = file.seek(SeekFrom::Start(length.saturating_sub(4000)));
    let _ = file.take(4000).read_to_end(&mut bytes);
    String::from_utf8_lossy(&bytes).trim().to_owned()
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use strandbench_types::Silent;

    #[test]
    fn processes_that_fail_hang_or_are_stopped_are_reported() {
        let sh = |script: &str, limit, monitor: &dyn Monitor| {
            finish("j", Command::new("/bin/sh").args(["-c", script]), Duration::from_millis(limit), monitor)
        };
        assert_eq!(sh("echo well", 5000, &Silent).unwrap(), "well");
        let e = sh("echo bad >&2; exit 3", 5000, &Silent).unwrap_err().to_string();
        assert!(e.contains("exit status: 3") && e.contains("bad"), "{e}");
        assert!(sh("sleep 20", 50, &Silent).unwrap_err().to_string().contains("took longer"));
        struct Stop;
        impl Monitor for Stop {
            fn begin(&self, _: &str, _: u64) {}
            fn advance(&self, _: u64) {}
            fn cancelled(&self) -> bool {
                true
            }
        }
        assert!(matches!(sh("sleep 20", 5000, &Stop), Err(CrossError::Cancelled(_))));
        // More output than a pipe holds.
        assert!(sh("head -c 300000 /dev/zero | tr '\\0' x", 5000, &Silent).unwrap().len() <= 4000);
    }
}

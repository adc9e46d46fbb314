//! Where and with what a result was made, and what it cost.

use serde::{Deserialize, Serialize};
use std::iter::Sum;
use std::time::Instant;

/// The program and the machine behind a result.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Provenance {
    /// Version of this program.
    pub version: String,
    /// Commit at build time; empty where the sources were not a git checkout.
    pub commit: String,
    /// Compiler.
    pub rustc: String,
    /// Target triple and profile.
    pub target: String,
    /// Processor model.
    pub cpu: String,
    /// Logical processors.
    pub cpus: usize,
    /// Worker threads used.
    pub threads: usize,
    /// Operating system and kernel.
    pub os: String,
    /// Seconds since 1970 (UTC).
    pub unix_time_s: u64,
}

impl Provenance {
    /// Of this process, now.
    pub fn here() -> Provenance {
        let read = |path: &str| std::fs::read_to_string(path).unwrap_or_default();
        let cpu = read("/proc/cpuinfo")
            .lines()
            .find_map(|l| {
                l.strip_prefix("model name").map(|v| v.trim_start_matches([' ', '\t', ':']).to_owned())
            })
            .unwrap_or_else(|| std::env::consts::ARCH.to_owned());
        let kernel = read("/proc/sys/kernel/osrelease");
        Provenance {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            commit: env!("STRANDBENCH_COMMIT").to_owned(),
            rustc: env!("STRANDBENCH_RUSTC").to_owned(),
            target: format!("{}, {}", env!("STRANDBENCH_TARGET"), env!("STRANDBENCH_PROFILE")),
            cpu,
            cpus: std::thread::available_parallelism().map_or(0, usize::from),
            threads: rayon::current_num_threads(),
            os: format!("{} {}", std::env::consts::OS, kernel.trim()).trim().to_owned(),
            unix_time_s: std::time::SystemTime::now()
                .duration_since(std::time::UNIX_EPOCH)
                .map_or(0, |d| d.as_secs()),
        }
    }
}

/// What a piece of work cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Cost {
    /// Wall seconds.
    pub wall_s: f64,
    /// Processor seconds of all threads.
    pub cpu_s: Option<f64>,
    /// Peak resident memory in MiB while it ran (of the whole process where the system cannot reset its peak).
    pub peak_mib: Option<f64>,
}

impl Cost {
    /// An equal part of it, in time; the peak of memory is every part's.
    pub(crate) fn part(self, of: usize) -> Cost {
        let n = of.max(1) as f64;
        Cost { wall_s: self.wall_s / n, cpu_s: self.cpu_s.map(|s| s / n), ..self }
    }
}

impl Sum for Cost {
    /// One after the other: times add up, as far as all are known, and the largest peak of memory counts.
    fn sum<I: Iterator<Item = Cost>>(costs: I) -> Cost {
        let none = Cost { wall_s: 0.0, cpu_s: Some(0.0), peak_mib: None };
        costs.fold(none, |a, b| Cost {
            wall_s: a.wall_s + b.wall_s,
            cpu_s: a.cpu_s.zip(b.cpu_s).map(|(a, b)| a + b),
            peak_mib: a.peak_mib.into_iter().chain(b.peak_mib).reduce(f64::max),
        })
    }
}

/// Measures the cost of what happens until [`Meter::stop`].
pub struct Meter {
    start: Instant,
    cpu_s: Option<f64>,
}

impl Meter {
    /// Starts; the system's peak of resident memory is reset where it lets us (Linux).
    pub fn start() -> Meter {
        // "5" resets the peak resident set size (proc(5), clear_refs); refused on some systems, then the
        // peak is the whole process's.
        let _ = std::fs::write("/proc/self/clear_refs", "5");
        Meter { start: Instant::now(), cpu_s: cpu_seconds() }
    }

    /// Cost since the start.
    pub fn stop(&self) -> Cost {
        Cost {
            wall_s: self.start.elapsed().as_secs_f64(),
            cpu_s: cpu_seconds().zip(self.cpu_s).map(|(now, then)| now - then),
            peak_mib: peak_mib(),
        }
    }
}

fn peak_mib() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    Some(line.trim().trim_end_matches("kB").trim().parse::<f64>().ok()? / 1024.0)
}

/// User and system seconds of the process with all its threads, and of the processes that it started and saw end, from
/// fields 14 to 17 of /proc/self/stat, which count hundredths of a second on every Linux that Rust supports
/// (USER_HZ = 100).
fn cpu_seconds() -> Option<f64> {
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    let after_name = &stat[stat.rfind(')')? + 1..];
    let fields: Vec<&str> = after_name.split_ascii_whitespace().collect();
    let ticks: Option<f64> = (11..15).map(|i| fields.get(i)?.parse::<f64>().ok()).sum();
    Some(ticks? / 100.0)
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;

    #[test]
    fn work_and_memory_are_noticed() {
        let meter = Meter::start();
        let mut block = vec![0u8; 96 << 20];
        let mut x = 1u64;
        while meter.start.elapsed().as_secs_f64() < 0.15 {
            for b in block.iter_mut().step_by(512) {
                x = x.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                *b = (x >> 56) as u8;
            }
        }
        let cost = meter.stop();
        assert!(block.iter().any(|&b| b != 0));
        assert!(cost.wall_s >= 0.15, "{cost:?}");
        assert!(cost.cpu_s.unwrap() > 0.02 && cost.cpu_s.unwrap() < 60.0, "{cost:?}");
        assert!(cost.peak_mib.unwrap() > 96.0, "{cost:?}");
    }
}

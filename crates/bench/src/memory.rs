//! What the operating system says of this process: memory and processor time.

use crate::python::Spent;
use std::time::Instant;

/// Largest resident size so far, bytes; `None` where the system does not tell.
pub fn peak_bytes() -> Option<u64> {
    field(&std::fs::read_to_string("/proc/self/status").ok()?, "VmHWM:")
}

/// Resident size now, bytes; `None` where the system does not tell.
pub fn resident_bytes() -> Option<u64> {
    field(&std::fs::read_to_string("/proc/self/status").ok()?, "VmRSS:")
}

/// Processor seconds that all threads have used; `None` where the system does not tell.
pub fn cpu_s() -> Option<f64> {
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    // After the command, which may hold anything, in parentheses: field 3. User and system time are 14 and 15, in
    // hundredths of a second on every Linux that Rust runs on.
    let mut rest = stat.rsplit_once(')')?.1.split_ascii_whitespace().skip(11);
    let ticks: u64 = rest.next()?.parse::<u64>().ok()? + rest.next()?.parse::<u64>().ok()?;
    Some(ticks as f64 / 100.0)
}

/// What a piece of work takes, and what it gives; where the system does not tell the processor's seconds, the clock's.
pub fn spent<T>(work: impl FnOnce() -> T) -> (Spent, T) {
    let (clock, cpu) = (Instant::now(), cpu_s());
    let made = work();
    let wall_s = clock.elapsed().as_secs_f64();
    let cpu_s = cpu_s().zip(cpu).map_or(wall_s, |(now, before)| now - before);
    (Spent { wall_s, cpu_s }, made)
}

/// A line such as `VmHWM:   5184 kB` of `/proc/self/status`, bytes.
fn field(status: &str, name: &str) -> Option<u64> {
    let line = status.lines().find_map(|l| l.strip_prefix(name))?;
    Some(line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()? * 1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_the_status_file_are_read() {
        let text = "Name:\tx\nVmHWM:\t    5184 kB\nVmRSS:\t 12 kB\nThreads:\t1\n";
        assert_eq!((field(text, "VmHWM:"), field(text, "VmRSS:")), (Some(5_308_416), Some(12_288)));
        assert_eq!((field(text, "VmPeak:"), field(text, "Threads:")), (None, None));
    }
}

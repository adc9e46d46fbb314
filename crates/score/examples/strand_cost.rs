//! What scoring one frame's strands costs: `strand_cost [true strands] [estimated strands]`.
//!
//! Strands of 150 mm hang over an ellipsoid of head size, seen by four cameras of 640 x 480; the estimate is other
//! strands of the same kind, 1.5 mm from vertex to vertex as hair growth leaves them.

#[path = "../tests/common/helmet.rs"]
mod helmet;
#[path = "../tests/common/splat.rs"]
#[allow(dead_code, reason = "shared with the tests")]
mod splat;

use glam::Vec3;
use helmet::hair;
use std::time::Instant;
use strandbench_score::score_strands;
use strandbench_types::{Estimate, Silent};

/// Largest resident set of this process so far, MiB; 0 where the system does not tell.
fn peak_mib() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"));
    line.and_then(|l| l.split_whitespace().next()?.parse::<u64>().ok()).unwrap_or(0) / 1024
}

/// User time of this process, s; 0 where the system does not tell.
fn cpu_s() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let ticks = stat.rsplit(')').next().and_then(|s| s.split_whitespace().nth(11)?.parse::<f64>().ok());
    ticks.unwrap_or(0.0) / 100.0
}

fn main() {
    let number =
        |k: usize, or: u64| std::env::args().nth(k).map_or(or, |a| a.parse().expect("a number of strands"));
    let (n_true, n_estimated) = (number(1, 100_000), number(2, 80_000));
    let start = Instant::now();
    let strands = hair(1, n_true, 150.0, 5.0);
    let (lo, hi) = splat::bounds(&strands);
    let cameras = splat::four_cameras((lo + hi) * 0.5, 900.0, 190.0, (640, 480), 1150.0);
    let truth = splat::truth(strands, cameras, 700.0, 1100.0, 0.0);
    let seen = truth.visibility.seen_by.iter().filter(|b| b.count_ones() >= 2).count();
    println!(
        "truth: {} samples, {seen} in V2, made in {:.1} s",
        truth.visibility.seen_by.len(),
        start.elapsed().as_secs_f64()
    );
    let off = Vec3::new(0.4, 0.2, 0.5);
    let mut strands = hair(2, n_estimated, 150.0, 1.5);
    strands.points.iter_mut().for_each(|p| *p += off);
    let estimate = Estimate { strands: Some(strands), ..Estimate::default() };
    let (start, cpu, before) = (Instant::now(), cpu_s(), peak_mib());
    let sheet = score_strands(&truth, &estimate, 1, &Silent).expect("a valid truth and estimate");
    println!(
        "scored in {:.1} s wall, {:.1} s CPU; peak {} MiB before, {} MiB with scoring",
        start.elapsed().as_secs_f64(),
        cpu_s() - cpu,
        before,
        peak_mib()
    );
    for id in [
        "B1.precision_2mm",
        "B1.recall_2mm",
        "B1.f_2mm",
        "B1.f_2mm.cc",
        "B1.unobserved",
        "B3.idf1",
        "B3.fragmentation",
        "B1.full.recall_2mm",
    ] {
        let row = |s: &str| sheet.get(s, id).ok().and_then(|s| s.value);
        println!("{id}: {:?}", ["method", "N0", "N1", "N2", "C"].map(row));
    }
}

//! What scoring one frame's strands costs: `strand_cost [true strands] [estimated strands]`.
//!
//! Strands of 150 mm hang over an ellipsoid of head size, seen by four cameras of 640 x 480; the estimate is other
//! strands of the same kind, 1.5 mm from vertex to vertex as hair growth leaves them.

#[path = "../tests/common/splat.rs"]
#[allow(dead_code, reason = "shared with the tests")]
mod splat;

use glam::{DVec3, Vec3};
use std::time::Instant;
use strandbench_rng::Rng;
use strandbench_score::score_strands;
use strandbench_types::{Estimate, Silent, StrandSet};

/// Strands that start on the upper part of an ellipsoid and fall round it, `step_mm` from vertex to vertex.
fn hair(seed: u64, strands: u64, step_mm: f64) -> StrandSet {
    let mut set = StrandSet::new();
    for i in 0..strands {
        let mut r = Rng::keyed(&[seed, i]);
        let (turn, up) = (r.f64() * std::f64::consts::TAU, 0.15 + 0.85 * r.f64());
        let radius = DVec3::new(78.0, 100.0, 95.0) + DVec3::splat(25.0 * r.f64().powi(2));
        let flat = (1.0 - up * up).sqrt();
        let mut p = DVec3::new(turn.sin() * flat, up, turn.cos() * flat) * radius;
        let (phase, wave) = (r.f64() * 6.0, 1.0 + r.f64());
        let mut points = vec![p.as_vec3()];
        for k in 0..(150.0 / step_mm) as usize {
            let out = (p / (radius * radius)).normalize();
            let mut d = DVec3::NEG_Y + DVec3::Y * out.y * 0.2;
            d -= out * d.dot(out).min(0.0);
            d +=
                DVec3::new((phase + k as f64 * step_mm * 0.05).sin(), 0.0, (phase * 2.0).cos()) * 0.12 * wave;
            p += d.normalize() * step_mm;
            points.push(p.as_vec3());
        }
        set.push(&points, 0.04);
    }
    set
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
    let strands = hair(1, n_true, 5.0);
    let (lo, hi) = splat::bounds(&strands);
    let cameras = splat::four_cameras((lo + hi) * 0.5, 900.0, 190.0, (640, 480), 1150.0);
    let truth = splat::truth(strands, cameras, 700.0, 1100.0);
    let seen = truth.visibility.seen_by.iter().filter(|b| b.count_ones() >= 2).count();
    println!(
        "truth: {} samples, {seen} in V2, made in {:.1} s",
        truth.visibility.seen_by.len(),
        start.elapsed().as_secs_f64()
    );
    let off = Vec3::new(0.4, 0.2, 0.5);
    let mut strands = hair(2, n_estimated, 1.5);
    strands.points.iter_mut().for_each(|p| *p += off);
    let estimate = Estimate { strands: Some(strands), ..Estimate::default() };
    let (start, cpu) = (Instant::now(), cpu_s());
    let sheet = score_strands(&truth, &estimate, 1, &Silent).expect("a valid truth and estimate");
    println!("scored in {:.1} s wall, {:.1} s CPU", start.elapsed().as_secs_f64(), cpu_s() - cpu);
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

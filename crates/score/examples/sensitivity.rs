//! What each metric makes of a fault of known size, as CSV: `sensitivity [truth folder]`, or on hair from a formula.
//!
//! Columns: fault, size, unit of the size, metric, value, unit. Only the method's figures are printed.

#[path = "../tests/common/helmet.rs"]
mod helmet;
#[path = "../tests/common/splat.rs"]
#[allow(dead_code, reason = "shared with the tests")]
mod splat;

use glam::{DMat3, DVec3, Vec3};
use std::f64::consts::TAU;
use strandbench_rng::Rng;
use strandbench_score::{Score, SequenceScorer, score_strands};
use strandbench_types::{DepthMap, Estimate, Silent, StrandSet, Truth};

/// Frames of a sequence.
const FRAMES: u32 = 30;

fn main() {
    let truth = match std::env::args().nth(1) {
        Some(folder) => strandbench_io::read_truth(std::path::Path::new(&folder)).unwrap_or_else(|e| {
            eprintln!("{e}");
            std::process::exit(1);
        }),
        None => {
            let strands = helmet::hair(1, 2000, 80.0, 4.0);
            let (lo, hi) = splat::bounds(&strands);
            let cameras = splat::four_cameras((lo + hi) * 0.5, 900.0, 190.0, (160, 120), 290.0);
            splat::truth(strands, cameras, 700.0, 1100.0)
        }
    };
    println!("fault,size,size unit,metric,value,unit");
    frames(&truth);
    sequences(&truth);
}

fn print(fault: &str, size: f64, unit: &str, scores: &[Score], of: &[&str]) {
    for s in scores.iter().filter(|s| s.subject == "method" && of.contains(&s.metric.as_str())) {
        let value = s.value.map_or(String::new(), |v| format!("{v:.5}"));
        println!("{fault},{size},{unit},{},{value},{}", s.metric, s.unit);
    }
}

/// A unit vector of a strand's own.
fn direction(seed: u64, k: usize) -> DVec3 {
    let mut r = Rng::keyed(&[seed, k as u64]);
    let (z, a) = (2.0 * r.f64() - 1.0, TAU * r.f64());
    DVec3::new(a.cos() * (1.0 - z * z).sqrt(), a.sin() * (1.0 - z * z).sqrt(), z)
}

fn remade(set: &StrandSet, f: impl Fn(usize, &[Vec3]) -> Vec<Vec<Vec3>>) -> StrandSet {
    let mut out = StrandSet::new();
    for (k, p) in set.iter().enumerate() {
        f(k, p).iter().for_each(|p| out.push(p, 0.04));
    }
    out
}

/// The strand in pieces of one segment, each turned about its middle.
fn turned(k: usize, points: &[Vec3], deg: f64) -> Vec<Vec<Vec3>> {
    let piece = |(j, w): (usize, &[Vec3])| {
        let (m, d) = (w[0].lerp(w[1], 0.5).as_dvec3(), 0.5 * (w[1] - w[0]).as_dvec3());
        let axis = d.cross(direction(3 + j as u64, k)).normalize_or(DVec3::X);
        let d = DMat3::from_axis_angle(axis, deg.to_radians()) * d;
        vec![(m - d).as_vec3(), (m + d).as_vec3()]
    };
    points.windows(2).enumerate().map(piece).collect()
}

fn frames(truth: &Truth) {
    const SHOWN: [&str; 14] = [
        "B1.precision_2mm",
        "B1.recall_2mm",
        "B1.f_1mm",
        "B1.f_2mm",
        "B1.f_2mm.cc",
        "B1.f_3mm",
        "B1.f_4mm",
        "B1.f_auc",
        "B2.to_estimate.distance.median",
        "B2.to_estimate.angle.median",
        "B3.idf1",
        "B3.fragmentation",
        "B4.direction",
        "B6.log2_ratio.median",
    ];
    let show = |fault: &str, size: f64, unit: &str, strands: StrandSet| {
        let estimate = Estimate { strands: Some(strands), ..Estimate::default() };
        match score_strands(truth, &estimate, 1, &Silent) {
            Ok(sheet) => print(fault, size, unit, &sheet.scores, &SHOWN),
            Err(e) => {
                eprintln!("{e}");
                std::process::exit(1);
            }
        }
    };
    let set = &truth.strands;
    let whole = |p: &[Vec3]| vec![p.to_vec()];
    show("none", 0.0, "", set.clone());
    for mm in [0.25, 0.5, 1.0, 2.0, 4.0, 10.0] {
        let by = |k: usize| (direction(1, k) * mm).as_vec3();
        show("moved", mm, "mm", remade(set, |k, p| vec![p.iter().map(|p| *p + by(k)).collect()]));
    }
    for deg in [1.0, 5.0, 10.0, 20.0, 40.0] {
        show("turned", deg, "deg", remade(set, |k, p| turned(k, p, deg)));
    }
    let chosen = |k: usize, share: f64| Rng::keyed(&[2, k as u64]).f64() < share;
    for share in [0.25, 0.5, 1.0] {
        let reversed = |k: usize, p: &[Vec3]| {
            vec![if chosen(k, share) { p.iter().rev().copied().collect() } else { p.to_vec() }]
        };
        show("reversed", share, "share", remade(set, reversed));
        if share < 1.0 {
            show(
                "thinned",
                share,
                "share",
                remade(set, |k, p| if chosen(k, share) { vec![] } else { whole(p) }),
            );
        }
    }
    for pieces in [2usize, 4, 8] {
        let cut = |_: usize, p: &[Vec3]| {
            let n = (p.len() - 1).div_ceil(pieces);
            (0..p.len() - 1).step_by(n).map(|i| p[i..(i + n + 1).min(p.len())].to_vec()).collect()
        };
        show("fragmented", pieces as f64, "pieces", remade(set, cut));
    }
    show("doubled", 2.0, "times", remade(set, |_, p| vec![p.to_vec(), p.to_vec()]));
}

fn normal(key: &[u64]) -> f64 {
    let mut r = Rng::keyed(key);
    let (a, b) = (1.0 - r.f64(), r.f64());
    (-2.0 * a.ln()).sqrt() * (TAU * b).cos()
}

/// The truth in a frame: it sways by 20 mm four times a second across the reference camera's view.
fn swayed(truth: &Truth, frame: f64) -> Vec3 {
    let across = truth.rig.cameras[0].camera_from_world.transpose() * DVec3::X;
    (across * (20.0 * (TAU * 4.0 * frame / truth.rig.frame_rate_hz).sin())).as_vec3()
}

fn sequences(truth: &Truth) {
    const SHOWN: [&str; 8] = [
        "C1.noise_sd",
        "C2.regrown.mean",
        "C3.flicker.p50",
        "C4.drift.median",
        "C4.drift.rate",
        "C5.lag_4hz",
        "C5.log2_gain_4hz",
        "C6.flow.mean",
    ];
    let rate = truth.rig.frame_rate_hz;
    let show = |fault: &str, size: f64, unit: &str, offset: &dyn Fn(usize, u32) -> Vec3, depth_sd: f64| {
        let moved = |set: &StrandSet, by: &dyn Fn(usize) -> Vec3| {
            remade(set, |k, p| vec![p.iter().map(|p| *p + by(k)).collect()])
        };
        let score = || {
            let mut scorer = SequenceScorer::new(truth)?;
            for frame in 0..FRAMES {
                let sway = swayed(truth, f64::from(frame));
                let mut now = truth.clone();
                now.strands.points.iter_mut().for_each(|p| *p += sway);
                let mut depth: DepthMap = truth.views[0].depth_50.clone();
                let (w, h) = depth.size();
                for i in 0..w * h {
                    let noise = depth_sd * normal(&[7, i as u64, u64::from(frame)]);
                    depth.set(i % w, i / w, depth.get_index(i).map(|z| z + noise as f32));
                }
                let estimate = Estimate {
                    depth: Some(depth),
                    strands: Some(moved(&truth.strands, &|k| sway + offset(k, frame))),
                    strand_ids: Some((0..truth.strands.len() as u64).collect()),
                    ..Estimate::default()
                };
                scorer.push(&now, &estimate, &Silent)?;
            }
            scorer.finish(None)
        };
        match score() {
            Ok(sheet) => print(fault, size, unit, &sheet.scores, &SHOWN),
            Err(e) => {
                eprintln!("{e}");
                std::process::exit(1);
            }
        }
    };
    show("none over time", 0.0, "", &|_, _| Vec3::ZERO, 0.0);
    for mm in [0.1, 0.5, 2.0] {
        let noise = |k: usize, frame: u32| {
            let n = |axis: u64| mm * normal(&[5, k as u64, u64::from(frame), axis]);
            DVec3::new(n(0), n(1), n(2)).as_vec3()
        };
        show("noise", mm, "mm", &noise, 0.0);
        show("depth flicker", mm, "mm", &|_, _| Vec3::ZERO, mm);
    }
    for speed in [1.0, 5.0, 20.0] {
        let drift = |k: usize, frame: u32| (direction(1, k) * speed * f64::from(frame) / rate).as_vec3();
        show("drift", speed, "mm/s", &drift, 0.0);
    }
    for frames in [1.0, 2.0] {
        let late =
            |_: usize, frame: u32| swayed(truth, f64::from(frame) - frames) - swayed(truth, f64::from(frame));
        show("late", 1000.0 * frames / rate, "ms", &late, 0.0);
    }
}

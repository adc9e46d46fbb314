//! What each metric makes of a fault of known size, as CSV: `sensitivity [HAIR [HIDES_MM [FAULT]]]`.
//!
//! HAIR is a truth folder, a `.hair` file of the preset `yuksel`, or `helmet`, hair from a formula. Strands that come
//! without rendered truth hide what is behind them to HIDES_MM from their middle (0: lines). With FAULT only faults
//! whose name starts so are made. Columns: hair, fault, size, unit of the size, metric, value, unit; only the method's
//! figures. No value is the worst.

#[path = "../tests/common/helmet.rs"]
mod helmet;
#[path = "../tests/common/splat.rs"]
#[allow(dead_code, reason = "shared with the tests")]
mod splat;

use glam::{DMat3, DVec3, Vec3};
use std::f64::consts::TAU;
use std::path::Path;
use strandbench_io::ImportOptions;
use strandbench_rng::Rng;
use strandbench_score::{Score, ScoreError, SequenceScorer, score_strands};
use strandbench_types::{DepthMap, Estimate, Silent, StrandSet, Truth};

/// Frames of a sequence, and how many a second.
const FRAMES: u32 = 30;
const RATE_HZ: f64 = 25.0;

/// What is made and printed.
struct Ladder {
    hair: String,
    truth: Truth,
    only: String,
}

fn main() {
    if let Err(e) = run() {
        eprintln!("{e}");
        std::process::exit(1);
    }
}

fn run() -> Result<(), Box<dyn std::error::Error>> {
    let argument = |k: usize, or: &str| std::env::args().nth(k).unwrap_or_else(|| or.to_owned());
    let (source, hides_mm) = (argument(1, "helmet"), argument(2, "0").parse()?);
    let path = Path::new(&source);
    let truth = if source == "helmet" {
        let strands = helmet::hair(1, 2000, 80.0, 4.0);
        splatted(strands, (160, 120), 290.0, hides_mm)
    } else if path.is_dir() {
        strandbench_io::read_truth(path)?
    } else {
        let options = ImportOptions::preset("yuksel").expect("a preset");
        splatted(strandbench_io::read_strands(path, &options)?.0, (640, 480), 1100.0, hides_mm)
    };
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let hair = if path.is_dir() { stem.into_owned() } else { format!("{stem} hiding {hides_mm} mm") };
    println!("hair,fault,size,size unit,metric,value,unit");
    let ladder = Ladder { hair, truth, only: argument(3, "") };
    ladder.frames()?;
    ladder.sequences()
}

fn splatted(strands: StrandSet, size: (u32, u32), focal_px: f64, hides_mm: f64) -> Truth {
    let (lo, hi) = splat::bounds(&strands);
    let cameras = splat::four_cameras((lo + hi) * 0.5, 900.0, 190.0, size, focal_px);
    splat::truth(strands, cameras, 600.0, 1200.0, hides_mm)
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

impl Ladder {
    fn print(&self, fault: &str, size: f64, unit: &str, scores: &[Score], of: &[&str]) {
        for s in scores.iter().filter(|s| s.subject == "method" && of.contains(&s.metric.as_str())) {
            let value = s.value.map_or(String::new(), |v| format!("{v:.5}"));
            println!("{},{fault},{size},{unit},{},{value},{}", self.hair, s.metric, s.unit);
        }
    }

    fn frame(&self, fault: &str, size: f64, unit: &str, strands: StrandSet) -> Result<(), ScoreError> {
        const SHOWN: [&str; 24] = [
            "B1.precision_2mm",
            "B1.recall_2mm",
            "B1.f_1mm",
            "B1.f_2mm",
            "B1.f_2mm.cc",
            "B1.f_3mm",
            "B1.f_4mm",
            "B1.f_auc",
            "B1.nearest.f_2mm",
            "B1.voxel.f_2mm",
            "B1.full.precision_3mm",
            "B1.legacy-vertex.f_2mm",
            "B1.unobserved",
            "B2.to_estimate.distance.median",
            "B2.to_estimate.angle.median",
            "B3.idf1",
            "B3.fragmentation",
            "B3.merging",
            "B4.direction",
            "B4.root_error.median",
            "B5.length_w1",
            "B5.curvature_w1",
            "B6.log2_ratio.median",
            "B6.outside",
        ];
        if !fault.starts_with(&self.only) {
            return Ok(());
        }
        let estimate = Estimate { strands: Some(strands), ..Estimate::default() };
        self.print(fault, size, unit, &score_strands(&self.truth, &estimate, 1, &Silent)?.scores, &SHOWN);
        Ok(())
    }

    fn frames(&self) -> Result<(), Box<dyn std::error::Error>> {
        let set = &self.truth.strands;
        self.frame("none", 0.0, "", set.clone())?;
        for mm in [0.25, 0.5, 1.0, 2.0, 4.0, 10.0] {
            let by = |k: usize| (direction(1, k) * mm).as_vec3();
            self.frame("moved", mm, "mm", remade(set, |k, p| vec![p.iter().map(|p| *p + by(k)).collect()]))?;
        }
        let towards = (self.truth.rig.cameras[0].camera_from_world.transpose() * DVec3::NEG_Z).as_vec3();
        for mm in [0.0f32, 2.0, 5.0, 10.0] {
            let layer = splat::visible_layer(&self.truth, towards * mm);
            self.frame("pushed visible layer", mm.into(), "mm", layer)?;
        }
        for deg in [1.0, 5.0, 10.0, 20.0, 40.0] {
            self.frame("turned", deg, "deg", remade(set, |k, p| turned(k, p, deg)))?;
        }
        let chosen = |k: usize, share: f64| Rng::keyed(&[2, k as u64]).f64() < share;
        for share in [0.25, 0.5, 1.0] {
            let reversed = |k: usize, p: &[Vec3]| {
                vec![if chosen(k, share) { p.iter().rev().copied().collect() } else { p.to_vec() }]
            };
            self.frame("reversed", share, "share", remade(set, reversed))?;
        }
        for share in [0.25, 0.5, 0.75] {
            let left = |k: usize, p: &[Vec3]| if chosen(k, share) { vec![] } else { vec![p.to_vec()] };
            self.frame("thinned", share, "share", remade(set, left))?;
        }
        for pieces in [2usize, 4, 8] {
            let cut = |_: usize, p: &[Vec3]| {
                let n = (p.len() - 1).div_ceil(pieces);
                (0..p.len() - 1).step_by(n).map(|i| p[i..(i + n + 1).min(p.len())].to_vec()).collect()
            };
            self.frame("fragmented", pieces as f64, "pieces", remade(set, cut))?;
        }
        self.frame("doubled", 2.0, "times", remade(set, |_, p| vec![p.to_vec(), p.to_vec()]))?;
        Ok(())
    }
}

fn normal(key: &[u64]) -> f64 {
    let mut r = Rng::keyed(key);
    let (a, b) = (1.0 - r.f64(), r.f64());
    (-2.0 * a.ln()).sqrt() * (TAU * b).cos()
}

/// The truth at a time in frames: it sways by 20 mm four times a second across the reference camera's view.
fn swayed(truth: &Truth, frame: f64) -> Vec3 {
    let across = truth.rig.cameras[0].camera_from_world.transpose() * DVec3::X;
    (across * (20.0 * (TAU * 4.0 * frame / RATE_HZ).sin())).as_vec3()
}

/// What is wrong with a sequence: offset of a strand in a frame, standard deviation of the noise of depth, share of
/// strands whose names change every ten frames.
struct Fault<'a> {
    offset: &'a dyn Fn(usize, u32) -> Vec3,
    depth_sd: f64,
    renamed: f64,
}

const NONE: Fault<'static> = Fault { offset: &|_, _| Vec3::ZERO, depth_sd: 0.0, renamed: 0.0 };

impl Ladder {
    fn sequence(&self, fault: &str, size: f64, unit: &str, of: &Fault) -> Result<(), ScoreError> {
        const SHOWN: [&str; 11] = [
            "C1.jitter.mean",
            "C1.noise_sd",
            "C2.regrown.mean",
            "C3.flicker.p50",
            "C4.drift.median",
            "C4.drift.rate",
            "C5.lag_4hz",
            "C5.log2_gain_4hz",
            "C6.flow.mean",
            "C6.flow.p90",
            "C7.survival_1s",
        ];
        if !fault.starts_with(&self.only) {
            return Ok(());
        }
        let mut truth = self.truth.clone();
        truth.rig.frame_rate_hz = RATE_HZ;
        let mut scorer = SequenceScorer::new(&truth)?;
        for frame in 0..FRAMES {
            let sway = swayed(&truth, f64::from(frame));
            let mut now = truth.clone();
            now.strands.points.iter_mut().for_each(|p| *p += sway);
            let mut depth: DepthMap = truth.views[0].depth_50.clone();
            let (w, h) = depth.size();
            for i in 0..w * h {
                let noise = of.depth_sd * normal(&[7, i as u64, u64::from(frame)]);
                depth.set(i % w, i / w, depth.get_index(i).map(|z| z + noise as f32));
            }
            let moved = |k: usize, p: &[Vec3]| {
                let by = sway + (of.offset)(k, frame);
                vec![p.iter().map(|p| *p + by).collect()]
            };
            let name = |k: usize| {
                let renamed = Rng::keyed(&[9, k as u64]).f64() < of.renamed;
                k as u64 + if renamed { u64::from(frame / 10) << 32 } else { 0 }
            };
            let estimate = Estimate {
                depth: Some(depth),
                strands: Some(remade(&truth.strands, moved)),
                strand_ids: Some((0..truth.strands.len()).map(name).collect()),
                ..Estimate::default()
            };
            scorer.push(&now, &estimate, &Silent)?;
        }
        self.print(fault, size, unit, &scorer.finish(None)?.scores, &SHOWN);
        Ok(())
    }

    fn sequences(&self) -> Result<(), Box<dyn std::error::Error>> {
        self.sequence("none over time", 0.0, "", &NONE)?;
        for mm in [0.1, 0.5, 2.0] {
            let noise = |k: usize, frame: u32| {
                let n = |axis: u64| mm * normal(&[5, k as u64, u64::from(frame), axis]);
                DVec3::new(n(0), n(1), n(2)).as_vec3()
            };
            self.sequence("noise over time", mm, "mm", &Fault { offset: &noise, ..NONE })?;
            self.sequence("depth flicker", mm, "mm", &Fault { depth_sd: mm, ..NONE })?;
        }
        for speed in [1.0, 2.0, 5.0] {
            let drift =
                |k: usize, frame: u32| (direction(1, k) * speed * f64::from(frame) / RATE_HZ).as_vec3();
            self.sequence("drift", speed, "mm/s", &Fault { offset: &drift, ..NONE })?;
        }
        let truth = &self.truth;
        for frames in [0.5, 1.0] {
            let late = |_: usize, frame: u32| {
                swayed(truth, f64::from(frame) - frames) - swayed(truth, f64::from(frame))
            };
            self.sequence("late", 1000.0 * frames / RATE_HZ, "ms", &Fault { offset: &late, ..NONE })?;
        }
        for frames in [3i32, 5] {
            let blurred = |_: usize, frame: u32| {
                let around =
                    (-(frames / 2)..=frames / 2).map(|d| swayed(truth, f64::from(frame) + f64::from(d)));
                around.sum::<Vec3>() / frames as f32 - swayed(truth, f64::from(frame))
            };
            self.sequence("blurred", frames.into(), "frames", &Fault { offset: &blurred, ..NONE })?;
        }
        for share in [0.25, 0.5, 1.0] {
            self.sequence("renamed", share, "share", &Fault { renamed: share, ..NONE })?;
        }
        Ok(())
    }
}

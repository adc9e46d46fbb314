//! Tracers timed against each other on the same rays, in rounds that alternate between them.

use crate::embree::{EmbreeScene, flushing_denormals};
use crate::error::BenchError;
use crate::python::{Python, write_array};
use crate::rays::{Kind, Ray, RaySets};
use rayon::prelude::*;
use serde_json::json;
use std::time::Instant;
use strandbench_renderer::accel::{Accel, Hit, LastBlockers};
use strandbench_types::Monitor;

/// Something that answers rays.
pub trait Tracer {
    /// Seconds by the clock, and a distance a ray: that of the first hit (infinite for none), or for shadow rays
    /// 0 where something lies on the ray and infinite where nothing does. With one thread on the calling one, else
    /// on rayon's current pool or the tracer's own.
    ///
    /// # Errors
    /// If the tracer fails.
    fn answer(&self, rays: &[Ray], kind: Kind, threads: usize) -> Result<(f64, Vec<f32>), BenchError>;
}

/// This project's.
pub struct Ours<'a> {
    /// The structure.
    pub accel: &'a Accel,
    /// Whether blockers are kept from ray to ray, as the renderer does.
    pub keeps_blockers: bool,
}

/// Rays that a thread takes at once.
const CHUNK: usize = 4096;

/// Times `part` over all rays.
fn timed(rays: &[Ray], threads: usize, part: impl Fn(&[Ray], &mut Vec<f32>) + Sync) -> (f64, Vec<f32>) {
    let whole = |rays: &[Ray]| {
        let mut t = Vec::with_capacity(rays.len());
        part(rays, &mut t);
        t
    };
    let clock = Instant::now();
    let t = if threads == 1 { whole(rays) } else { rays.par_chunks(CHUNK).flat_map_iter(whole).collect() };
    (clock.elapsed().as_secs_f64(), t)
}

fn sight(blocked: bool) -> f32 {
    if blocked { 0.0 } else { f32::INFINITY }
}

impl Tracer for Ours<'_> {
    fn answer(&self, rays: &[Ray], kind: Kind, threads: usize) -> Result<(f64, Vec<f32>), BenchError> {
        let distance = |hit: Option<Hit>| match hit {
            Some(Hit::Fibre { t, .. } | Hit::Mesh { t, .. }) => t,
            None => f32::INFINITY,
        };
        let blocked = |r: &Ray, last: &mut LastBlockers| {
            if !self.keeps_blockers {
                *last = LastBlockers::default();
            }
            sight(self.accel.occluded(r.origin, r.direction, r.tmax, None, last))
        };
        Ok(timed(rays, threads, |rays, t| match kind {
            Kind::Shadow => {
                let mut last = LastBlockers::default();
                t.extend(rays.iter().map(|r| blocked(r, &mut last)));
            }
            _ => t.extend(rays.iter().map(|r| distance(self.accel.closest(r.origin, r.direction)))),
        }))
    }
}

impl Tracer for EmbreeScene<'_> {
    fn answer(&self, rays: &[Ray], kind: Kind, threads: usize) -> Result<(f64, Vec<f32>), BenchError> {
        let first = |r: &Ray| self.closest(r.origin, r.direction).map_or(f32::INFINITY, |h| h.0);
        Ok(timed(rays, threads, |rays, t| {
            flushing_denormals(|| match kind {
                Kind::Shadow => {
                    t.extend(rays.iter().map(|r| sight(self.occluded(r.origin, r.direction, r.tmax))));
                }
                _ => t.extend(rays.iter().map(first)),
            });
        }))
    }
}

impl Tracer for Python {
    fn answer(&self, rays: &[Ray], kind: Kind, _: usize) -> Result<(f64, Vec<f32>), BenchError> {
        let vectors = |name: &str, of: fn(&Ray) -> [f32; 3]| {
            write_array(self.folder(), name, rays.iter().flat_map(of), f32::to_le_bytes)
        };
        vectors("origins", |r| r.origin.to_array())?;
        vectors("directions", |r| r.direction.to_array())?;
        write_array(self.folder(), "tmax", rays.iter().map(|r| r.tmax), f32::to_le_bytes)?;
        let command = json!({"do": "rays", "folder": self.folder(), "kind": kind});
        Ok((self.timed(command)?.0.wall_s, self.read("t")?))
    }
}

/// One tracer's figures.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Standing {
    /// What the rays were cast at.
    pub scene: String,
    /// The tracer.
    pub tracer: String,
    /// What the rays ask.
    pub kind: Kind,
    /// Threads.
    pub threads: usize,
    /// Rays of a round.
    pub rays: usize,
    /// Median over the rounds, million rays a second.
    pub mrays_per_s: f64,
    /// Median over the rounds of this tracer's speed over that of the one that all are compared with; `None` if
    /// that one is missing.
    pub ratio: Option<f64>,
    /// Share of rays whose answer differs from the first tracer's: hit against miss, or distances more than
    /// 0.05 mm apart (the fibres are 0.06-0.09 mm thick).
    pub differing: f64,
}

/// The middle of the values, 0 of none.
pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    match (values.len(), values.len() / 2) {
        (0, _) => 0.0,
        (n, half) if n % 2 == 1 => values[half],
        (_, half) => 0.5 * (values[half - 1] + values[half]),
    }
}

fn differs(a: f32, b: f32) -> bool {
    // Some tracers say "nothing" with the largest number instead of infinity.
    let far = |t: f32| t.is_nan() || t > 1e30;
    far(a) != far(b) || (!far(a) && (a - b).abs() > 0.05)
}

/// Who competes, and how.
pub struct Contest<'a> {
    /// What the rays are cast at, in words.
    pub scene: String,
    /// Names and tracers.
    pub tracers: Vec<(String, &'a dyn Tracer)>,
    /// Name of the tracer that ratios are against.
    pub reference: &'a str,
    /// Rounds that are timed.
    pub rounds: usize,
    /// Threads.
    pub threads: usize,
}

impl Contest<'_> {
    /// Within a round every tracer casts all rays of one kind once.
    ///
    /// # Errors
    /// If a tracer fails, or the work is stopped.
    pub fn run(&self, rays: &RaySets, monitor: &dyn Monitor) -> Result<Vec<Standing>, BenchError> {
        let mut rows = Vec::new();
        for kind in Kind::ALL {
            let set = rays.of(kind);
            // A round that is not timed: pages, caches and compiled kernels settle.
            let mut first = Vec::new();
            for (_, tracer) in &self.tracers {
                first.push(tracer.answer(set, kind, self.threads)?.1);
            }
            let mut seconds = vec![Vec::new(); self.tracers.len()];
            for _ in 0..self.rounds {
                for ((_, tracer), seconds) in self.tracers.iter().zip(&mut seconds) {
                    monitor.check()?;
                    seconds.push(tracer.answer(set, kind, self.threads)?.0);
                }
                monitor.advance(1);
            }
            let reference = self.tracers.iter().position(|(name, _)| name == self.reference);
            for (k, (name, _)) in self.tracers.iter().enumerate() {
                let speeds = seconds[k].iter().map(|s| set.len() as f64 / s * 1e-6).collect();
                let ratio = reference.map(|reference| {
                    let other = &seconds[reference];
                    median(seconds[k].iter().zip(other).map(|(own, other)| other / own).collect())
                });
                let unlike = first[k].iter().zip(&first[0]).filter(|&(&a, &b)| differs(a, b)).count();
                rows.push(Standing {
                    scene: self.scene.clone(),
                    tracer: name.clone(),
                    kind,
                    threads: self.threads,
                    rays: set.len(),
                    mrays_per_s: median(speeds),
                    ratio,
                    differing: unlike as f64 / set.len().max(1) as f64,
                });
            }
        }
        Ok(rows)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;
    use strandbench_types::Silent;

    #[test]
    fn the_median_is_the_middle() {
        assert_eq!(median(vec![3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(vec![4.0, 1.0, 2.0, 3.0]), 2.5);
        assert_eq!(median(Vec::new()), 0.0);
    }

    /// Takes a fixed time and says that everything is at one distance.
    struct Fixed(f64, f32);

    impl Tracer for Fixed {
        fn answer(&self, rays: &[Ray], _: Kind, _: usize) -> Result<(f64, Vec<f32>), BenchError> {
            Ok((self.0, vec![self.1; rays.len()]))
        }
    }

    #[test]
    fn ratios_say_how_many_times_faster_and_unlike_answers_are_counted() {
        let ray = Ray { origin: Vec3::ZERO, direction: Vec3::X, tmax: 1.0 };
        let sets = RaySets { sets: [vec![ray; 10], vec![ray; 10], vec![ray; 10]] };
        let (quick, slow, wrong) = (Fixed(1e-6, 5.0), Fixed(4e-6, 5.01), Fixed(2e-6, f32::MAX));
        let tracers: Vec<(String, &dyn Tracer)> =
            vec![("quick".into(), &quick), ("slow".into(), &slow), ("wrong".into(), &wrong)];
        let mut contest = Contest { scene: String::new(), tracers, reference: "slow", rounds: 3, threads: 1 };
        let rows = contest.run(&sets, &Silent).unwrap();
        assert_eq!(rows.len(), 9);
        let figures = |k: usize| (rows[k].ratio.unwrap(), rows[k].mrays_per_s, rows[k].differing);
        assert!((figures(0).0 - 4.0).abs() < 1e-9 && (figures(0).1 - 10.0).abs() < 1e-9);
        assert_eq!((figures(1).0, figures(1).2), (1.0, 0.0));
        assert_eq!(figures(2).2, 1.0);
        contest.reference = "absent";
        assert_eq!(contest.run(&sets, &Silent).unwrap()[0].ratio, None);
    }
}

//! Tracers timed against each other on the same rays, in rounds that alternate between them.

use crate::embree::{EmbreeScene, flushing_denormals};
use crate::rays::{Kind, Ray, RaySets};
use rayon::prelude::*;
use std::time::Instant;
use strandbench_renderer::accel::{Accel, Hit, LastBlockers};

/// Something that answers rays.
pub trait Tracer: Sync {
    /// Distances of first hits, infinite for none; one entry a ray.
    fn closest(&self, rays: &[Ray], t: &mut Vec<f32>);
    /// 0 where something lies on the ray, infinite where nothing does; one entry a ray.
    fn occluded(&self, rays: &[Ray], t: &mut Vec<f32>);
}

/// This project's.
pub struct Ours<'a> {
    /// The structure.
    pub accel: &'a Accel,
    /// Whether blockers are kept from ray to ray, as the renderer does.
    pub keeps_blockers: bool,
}

/// Distance of a hit.
fn distance(hit: Option<Hit>) -> f32 {
    match hit {
        Some(Hit::Fibre { t, .. } | Hit::Mesh { t, .. }) => t,
        None => f32::INFINITY,
    }
}

const fn sight(blocked: bool) -> f32 {
    if blocked { 0.0 } else { f32::INFINITY }
}

impl Tracer for Ours<'_> {
    fn closest(&self, rays: &[Ray], t: &mut Vec<f32>) {
        t.extend(rays.iter().map(|r| distance(self.accel.closest(r.origin, r.direction))));
    }

    fn occluded(&self, rays: &[Ray], t: &mut Vec<f32>) {
        let mut last = LastBlockers::default();
        t.extend(rays.iter().map(|r| {
            if !self.keeps_blockers {
                last = LastBlockers::default();
            }
            sight(self.accel.occluded(r.origin, r.direction, r.tmax, None, &mut last))
        }));
    }
}

impl Tracer for EmbreeScene<'_> {
    fn closest(&self, rays: &[Ray], t: &mut Vec<f32>) {
        flushing_denormals(|| {
            t.extend(
                rays.iter().map(|r| {
                    EmbreeScene::closest(self, r.origin, r.direction).map_or(f32::INFINITY, |h| h.0)
                }),
            );
        });
    }

    fn occluded(&self, rays: &[Ray], t: &mut Vec<f32>) {
        flushing_denormals(|| {
            t.extend(rays.iter().map(|r| sight(EmbreeScene::occluded(self, r.origin, r.direction, r.tmax))));
        });
    }
}

/// One tracer's figures.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Standing {
    /// The tracer.
    pub name: String,
    /// What the rays ask.
    pub kind: Kind,
    /// Threads.
    pub threads: usize,
    /// Median over the rounds, million rays a second.
    pub mrays_per_s: f64,
    /// Median over the rounds of this tracer's speed over that of the one that all are compared with.
    pub ratio: f64,
    /// Share of rays whose answer differs from the first tracer's: hit against miss, or distances more than
    /// 0.05 mm apart (the fibres are 0.06-0.09 mm thick).
    pub differing: f64,
}

/// Rays that a thread takes at once.
const CHUNK: usize = 4096;

fn answers(tracer: &dyn Tracer, rays: &[Ray], kind: Kind) -> Vec<f32> {
    let mut t = Vec::with_capacity(rays.len());
    match kind {
        Kind::Shadow => tracer.occluded(rays, &mut t),
        Kind::Primary | Kind::Bounce => tracer.closest(rays, &mut t),
    }
    t
}

fn timed(tracer: &dyn Tracer, rays: &[Ray], kind: Kind, threads: usize) -> (f64, Vec<f32>) {
    let clock = Instant::now();
    let t = if threads == 1 {
        answers(tracer, rays, kind)
    } else {
        rays.par_chunks(CHUNK).flat_map_iter(|c| answers(tracer, c, kind)).collect()
    };
    (clock.elapsed().as_secs_f64(), t)
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
    a.is_finite() != b.is_finite() || (a.is_finite() && (a - b).abs() > 0.05)
}

/// Runs `rounds` rounds; within a round every tracer casts all rays of each kind once. Ratios are against tracer
/// `reference`. With more than one thread the calls run in rayon's current pool, which should have as many.
pub fn contest(
    tracers: &[(String, &dyn Tracer)],
    reference: usize,
    rays: &RaySets,
    rounds: usize,
    threads: usize,
) -> Vec<Standing> {
    let mut rows = Vec::new();
    for kind in Kind::ALL {
        let set = rays.of(kind);
        // A round that is not timed: pages, caches and frequency settle.
        let first: Vec<Vec<f32>> = tracers.iter().map(|(_, t)| timed(*t, set, kind, threads).1).collect();
        let mut seconds = vec![Vec::new(); tracers.len()];
        for _ in 0..rounds {
            for ((_, tracer), seconds) in tracers.iter().zip(&mut seconds) {
                seconds.push(timed(*tracer, set, kind, threads).0);
            }
        }
        for (k, (name, _)) in tracers.iter().enumerate() {
            let speeds = seconds[k].iter().map(|s| set.len() as f64 / s * 1e-6).collect();
            let ratios = seconds[k].iter().zip(&seconds[reference]).map(|(own, other)| other / own);
            let unlike = first[k].iter().zip(&first[0]).filter(|&(&a, &b)| differs(a, b)).count();
            rows.push(Standing {
                name: name.clone(),
                kind,
                threads,
                mrays_per_s: median(speeds),
                ratio: median(ratios.collect()),
                differing: unlike as f64 / set.len().max(1) as f64,
            });
        }
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_is_the_middle() {
        assert_eq!(median(vec![3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(vec![4.0, 1.0, 2.0, 3.0]), 2.5);
        assert_eq!(median(Vec::new()), 0.0);
    }
}

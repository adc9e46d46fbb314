//! Which fibres are simulated, and which of them each fibre follows.

use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::collections::BTreeMap;
use strandbench_types::StrandSet;

/// Guides that a fibre follows at most.
pub(super) const FOLLOWED: usize = 3;

/// Distance (mm) within which guides are equally good to follow.
const ALIKE_MM: f32 = 1.5;

/// Largest turn within a segment of a guide, rad: a dozen segments to a full curl.
const MAX_TURN: f32 = 0.55;

/// Segments of one guide at most.
const MAX_SEGMENTS: usize = 128;

/// Arc lengths (shares of the fibre) at which two fibres are compared.
const STATIONS: [f32; 6] = [0.0, 0.15, 0.35, 0.55, 0.8, 1.0];

/// A simulated fibre in its groomed pose.
#[derive(Clone, Debug)]
pub(super) struct Guide {
    /// Ends of its segments, evenly spaced in arc length, root first, mm.
    pub nodes: Vec<DVec3>,
    /// Arc length of a segment, mm.
    pub step_mm: f32,
    /// Number of fibres that move with it.
    pub fibres: f64,
}

/// Guides that a fibre follows, with weights that sum to 1; unused places have weight 0.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Followed {
    pub guide: [u32; FOLLOWED],
    pub weight: [f32; FOLLOWED],
}

/// Point of a polyline at each of some ascending arc lengths; beyond its end, its end.
fn along(points: &[Vec3], at: impl Iterator<Item = f32>) -> impl Iterator<Item = Vec3> {
    let (mut i, mut s) = (0, 0.0f32);
    at.map(move |want| {
        while i + 2 < points.len() && s + points[i].distance(points[i + 1]) < want {
            s += points[i].distance(points[i + 1]);
            i += 1;
        }
        let d = points[i].distance(points[i + 1]);
        points[i].lerp(points[i + 1], ((want - s) / d.max(1e-9)).clamp(0.0, 1.0))
    })
}

type Shape = [Vec3; STATIONS.len()];

fn shape(points: &[Vec3], length_mm: f32) -> Shape {
    let mut it = along(points, STATIONS.iter().map(|s| s * length_mm));
    std::array::from_fn(|_| it.next().expect("as many as stations"))
}

fn cell_of(p: Vec3, cell_mm: f32) -> [i32; 3] {
    (p / cell_mm).floor().to_array().map(|v| v as i32)
}

/// About `wanted` guides, one for each cell of a lattice over the roots: the strand that is most like the
/// others of its cell, among those that are not much shorter. Also the cell's edge, mm.
pub(super) fn choose(strands: &StrandSet, wanted: usize, segment_mm: f32) -> (Vec<Guide>, f32) {
    let roots: Vec<Vec3> = strands.iter().map(|s| s[0]).collect();
    let lengths: Vec<f32> = (0..strands.len()).into_par_iter().map(|i| strands.length_mm(i) as f32).collect();
    let cells = |cell_mm: f32| {
        let mut cells: BTreeMap<[i32; 3], Vec<u32>> = BTreeMap::new();
        for (i, &p) in roots.iter().enumerate() {
            cells.entry(cell_of(p, cell_mm)).or_default().push(i as u32);
        }
        cells
    };
    // Edge at which about that many cells hold a root.
    let (mut fine, mut coarse) = (0.2f32, 400.0f32);
    for _ in 0..14 {
        let middle = (fine * coarse).sqrt();
        if cells(middle).len() > wanted { fine = middle } else { coarse = middle }
    }
    let cells: Vec<Vec<u32>> = cells(coarse).into_values().collect();
    let guides = cells
        .par_iter()
        .map(|members| {
            let longest = members.iter().map(|&i| lengths[i as usize]).fold(0.0, f32::max);
            let grown: Vec<u32> =
                members.iter().copied().filter(|&i| lengths[i as usize] >= 0.6 * longest).collect();
            let shapes: Vec<Shape> =
                grown.iter().map(|&i| shape(strands.strand(i as usize), lengths[i as usize])).collect();
            // Few enough to compare all with all.
            let step = grown.len().div_ceil(64);
            let apart = |a: &Shape| -> f32 {
                shapes
                    .iter()
                    .step_by(step)
                    .map(|b| a.iter().zip(b).map(|(p, q)| p.distance(*q)).sum::<f32>())
                    .sum()
            };
            let best = (0..grown.len())
                .step_by(step)
                .min_by(|&a, &b| apart(&shapes[a]).total_cmp(&apart(&shapes[b])).then(a.cmp(&b)))
                .expect("a cell has a member");
            let i = grown[best] as usize;
            guide(strands.strand(i), lengths[i], segment_mm)
        })
        .collect();
    (guides, coarse)
}

/// A strand as a chain of segments of equal arc length, short enough for its bends.
fn guide(points: &[Vec3], length_mm: f32, segment_mm: f32) -> Guide {
    let turning: f32 = points
        .windows(3)
        .map(|w| {
            let (a, b) = ((w[1] - w[0]).normalize_or_zero(), (w[2] - w[1]).normalize_or_zero());
            libm::acosf(a.dot(b).clamp(-1.0, 1.0))
        })
        .sum();
    let wanted = (length_mm / segment_mm).max(turning / MAX_TURN).ceil();
    let n = (wanted as usize).clamp(3, MAX_SEGMENTS);
    let step_mm = length_mm / n as f32;
    let mut nodes: Vec<DVec3> =
        along(points, (0..=n).map(|k| k as f32 * step_mm)).map(|p| p.as_dvec3()).collect();
    // A strand that doubles back on itself within a segment must not give one of no length.
    for k in 1..=n {
        if nodes[k].distance(nodes[k - 1]) < 0.05 * f64::from(step_mm) {
            nodes[k] = nodes[k - 1] + DVec3::NEG_Y * (0.05 * f64::from(step_mm));
        }
    }
    Guide { nodes, step_mm, fibres: 0.0 }
}

/// The guides that each strand follows: those nearest to it over its whole length among those that are rooted
/// about it, so that a strand follows its own lock and its own side of a parting. Counts each guide's fibres.
pub(super) fn bind(strands: &StrandSet, guides: &mut [Guide], cell_mm: f32) -> Vec<Followed> {
    let mut cells: BTreeMap<[i32; 3], Vec<u32>> = BTreeMap::new();
    for (g, guide) in guides.iter().enumerate() {
        cells.entry(cell_of(guide.nodes[0].as_vec3(), cell_mm)).or_default().push(g as u32);
    }
    let all: Vec<u32> = (0..guides.len() as u32).collect();
    let bound: Vec<Followed> = (0..strands.len())
        .into_par_iter()
        .map(|i| {
            let points = strands.strand(i);
            let length = strands.length_mm(i) as f32;
            let own = shape(points, length);
            let k = cell_of(points[0], cell_mm);
            let mut near: Vec<u32> = Vec::with_capacity(40);
            for dz in -1..=1 {
                for dy in -1..=1 {
                    for dx in -1..=1 {
                        near.extend(cells.get(&[k[0] + dx, k[1] + dy, k[2] + dz]).into_iter().flatten());
                    }
                }
            }
            let mut ranked: Vec<(f32, u32)> = if near.is_empty() { &all } else { &near }
                .iter()
                .map(|&g| (unlikeness(&own, length, &guides[g as usize]), g))
                .collect();
            ranked.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            follow(&ranked)
        })
        .collect();
    for f in &bound {
        for (&g, &w) in f.guide.iter().zip(&f.weight) {
            guides[g as usize].fibres += f64::from(w);
        }
    }
    bound
}

/// Mean square distance (mm²) between a strand and a guide at equal arc lengths; a guide that ends early counts
/// as if it were further away by what it lacks.
fn unlikeness(own: &Shape, length_mm: f32, guide: &Guide) -> f32 {
    let end = guide.nodes.len() - 1;
    let sum: f32 = STATIONS
        .iter()
        .zip(own)
        .map(|(s, p)| {
            let at = s * length_mm / guide.step_mm;
            let i = (at as usize).min(end - 1);
            let t = f64::from((at - i as f32).min(1.0));
            let q = guide.nodes[i].lerp(guide.nodes[i + 1], t).as_vec3();
            let lacking = (at - end as f32).max(0.0) * guide.step_mm;
            p.distance_squared(q) + lacking * lacking
        })
        .sum();
    sum / STATIONS.len() as f32
}

/// Weights that fall to zero at the first guide that is not followed, so that they are continuous over the scalp.
fn follow(ranked: &[(f32, u32)]) -> Followed {
    let mut out = Followed::default();
    let close = |d2: f32| 1.0 / (d2 + ALIKE_MM * ALIKE_MM);
    let beyond = ranked.get(FOLLOWED).map_or(0.0, |r| close(r.0));
    for (k, r) in ranked.iter().take(FOLLOWED).enumerate() {
        out.guide[k] = r.1;
        out.weight[k] = (close(r.0) - beyond).max(0.0);
    }
    let sum: f32 = out.weight.iter().sum();
    if sum > 0.0 {
        out.weight.iter_mut().for_each(|w| *w /= sum);
    } else {
        out.weight[0] = 1.0;
    }
    out
}

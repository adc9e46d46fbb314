//! B1 and B2: are the strands where the true ones are, and do they run the same way?

use super::curves::{Curves, Hit};
use super::judge::{Candidate, Judged, MOST_TRUE, Reference};
use super::samples::{Sample, Set};
use super::sheet::StrandGrid;
use super::stairs::{GRID_DEG, GRID_MM, NOTHING, Stairs};
use crate::angles::between_axes_deg;
use crate::depth::cell_weights;
use crate::rows::{Asked, Rows};
use crate::stats::Weighted;
use glam::DVec3;
use rayon::prelude::*;
use strandbench_types::StrandSet;
use strandbench_types::nearest::Ordered;

/// Tolerances of the headline figures: name, mm, degrees (all on the grid).
pub(crate) const PAIRS: [(&str, f64, f64); 4] =
    [("1mm", 1.0, 10.0), ("2mm", 2.0, 20.0), ("3mm", 3.0, 30.0), ("4mm", 4.0, 40.0)];

/// What may confirm a sample: any neighbour, or the nearest alone.
const MODES: [(&str, &str); 2] = [("any", ""), ("nearest", "nearest.")];

/// What each of [`MODES`] says.
type Both = [Stairs; 2];

/// A share of weights, per distance and angle of the grid.
type Grid = [[f64; 6]; 7];

fn within(stairs: &Stairs, d: usize, a: usize) -> bool {
    usize::from(stairs[d]) <= a
}

/// What the neighbours of a sample say; `nearest` is the nearest of all, if it is known.
fn stairs(curves: &Curves, s: &Sample, nearest: Option<Hit>) -> Both {
    match nearest.or_else(|| curves.nearest(s.position, s.tangent, GRID_MM[6], 0.0)) {
        Some(hit) => [curves.staircase(s.position, s.tangent, &hit), hit.stairs()],
        None => [NOTHING; 2],
    }
}

/// Recall over the grid: the weight of true samples that an estimated strand confirms, over all weight.
fn recall(samples: &[Sample], found: &[Stairs], weight: impl Fn(usize) -> f64) -> Grid {
    let mut sums = [[0.0; 6]; 7];
    let mut total = 0.0;
    for (i, (_, s)) in samples.iter().zip(found).enumerate() {
        let w = weight(i);
        total += w;
        for (d, row) in sums.iter_mut().enumerate() {
            for (a, sum) in row.iter_mut().enumerate() {
                if within(s, d, a) {
                    *sum += w;
                }
            }
        }
    }
    sums.map(|row| row.map(|s| if total > 0.0 { s / total } else { 0.0 }))
}

/// Precision over the grid: the weight of observed samples that a true strand confirms, over all that is
/// observed; and the share of weight that is observed.
fn precision(set: Set, judged: &[Judged], found: &[Stairs]) -> (Grid, Grid) {
    let (mut right, mut seen) = ([[0.0; 6]; 7], [[0.0; 6]; 7]);
    let mut total = 0.0;
    for (j, s) in judged.iter().zip(found) {
        let w = j.sample.weight_mm;
        total += w;
        let Some(elsewhere) = j.elsewhere(set) else { continue };
        for d in 0..7 {
            for a in 0..6 {
                if !within(&elsewhere, d, a) {
                    seen[d][a] += w;
                    if within(s, d, a) {
                        right[d][a] += w;
                    }
                }
            }
        }
    }
    let share = |x: f64, of: f64| if of > 0.0 { x / of } else { 0.0 };
    let p = std::array::from_fn(|d| std::array::from_fn(|a| share(right[d][a], seen[d][a])));
    (p, seen.map(|row| row.map(|s| share(s, total))))
}

/// Harmonic mean of precision and recall; 0 if either is.
pub(crate) fn f_score(p: f64, r: f64) -> f64 {
    if p + r > 0.0 { 2.0 * p * r / (p + r) } else { 0.0 }
}

/// Place of a tolerance on the grid.
fn place(mm: f64, deg: f64) -> (usize, usize) {
    let at =
        |grid: &[f64], v: f64| grid.iter().position(|&g| g == v).expect("the tolerances are on the grid");
    (at(&GRID_MM, mm), at(&GRID_DEG, deg))
}

/// Mean of F over distances of 0.25 to 4 mm at 20 degrees (trapezoids).
fn area(p: &Grid, r: &Grid) -> f64 {
    let (last, a) = place(4.0, 20.0);
    let f: Vec<f64> = (0..=last).map(|d| f_score(p[d][a], r[d][a])).collect();
    let sum: f64 = (1..=last).map(|d| 0.5 * (f[d - 1] + f[d]) * (GRID_MM[d] - GRID_MM[d - 1])).sum();
    sum / (GRID_MM[last] - GRID_MM[0])
}

/// Adds B1 and B2 for one candidate.
pub(crate) fn score(reference: &Reference, c: &Candidate, rows: &mut Rows, grids: &mut Vec<StrandGrid>) {
    for (set, name) in [(Set::V2, ""), (Set::V1, "v1."), (Set::Full, "full.")] {
        let (own_wanted, own_judged);
        let (wanted, judged) = match set {
            Set::V2 => (&c.wanted, &c.judged),
            _ => {
                own_wanted = Ordered::new(reference.samples(set).thinned(c.most).list, |s| s.position);
                let judged = thin(&c.judged, MOST_TRUE[set as usize] as usize);
                own_judged = Ordered::new(judged, |j| j.sample.position);
                (&own_wanted, &own_judged)
            }
        };
        let known = |i: usize| if set == Set::V2 { c.nearest[i] } else { None };
        let found = wanted.ask(|i, s| stairs(c.curves, s, known(i)));
        let confirmed = confirm(reference, set, judged);
        for (k, (mode, suffix)) in MODES.into_iter().enumerate() {
            let one = |all: &[Both]| all.iter().map(|both| both[k]).collect::<Vec<Stairs>>();
            let (found, confirmed) = (one(&found), one(&confirmed));
            let r = recall(wanted, &found, |i| wanted[i].weight_mm);
            let (p, seen) = precision(set, judged, &confirmed);
            let prefix = format!("B1.{name}{suffix}");
            figures(rows, c.name, &prefix, &p, &r, &seen, (wanted.len(), judged.len()));
            grids.push(StrandGrid {
                subject: c.name.to_owned(),
                set: ["full", "v1", "v2"][set as usize].to_owned(),
                mode: mode.to_owned(),
                precision: p,
                recall: r,
                observed: seen,
            });
            if set == Set::V2 && mode == "any" {
                let asked = asked_area(wanted, judged, &seen, place(2.0, 20.0));
                rows.push(c.name, "B1.f_auc", area(&p, &r), asked);
                let (d, a) = place(2.0, 20.0);
                rows.push(c.name, "B1.unobserved", 1.0 - seen[d][a], asked);
                voxels(reference, c, (wanted, &found), (judged, &confirmed), rows);
            }
        }
        if set == Set::Full {
            legacy(reference, c, rows);
        }
    }
    lateral(c, rows);
}

/// Every k-th of the judged samples, at most `most`.
fn thin(judged: &[Judged], most: usize) -> Vec<Judged> {
    let k = judged.len().div_ceil(most.max(1)).max(1);
    judged.iter().skip(k / 2).step_by(k).copied().collect()
}

/// Stairs of the samples that may be observed; those that are not are not asked for.
fn confirm(reference: &Reference, set: Set, judged: &Ordered<Judged>) -> Vec<Both> {
    let curves = reference.curves(set);
    judged.ask(|_, j| {
        if !(j.in_layer(set) || j.free) {
            return [NOTHING; 2];
        }
        // If the nearest of all true strands belongs to the set, it is the set's nearest too.
        stairs(curves, &j.sample, (j.cameras >= set as u32).then_some(j.nearest))
    })
}

fn asked_area(wanted: &[Sample], judged: &[Judged], seen: &Grid, (d, a): (usize, usize)) -> Asked {
    let answered = (seen[d][a] * wanted.len() as f64).round() as usize;
    Asked { wanted: wanted.len(), answered: if judged.is_empty() { 0 } else { answered.min(wanted.len()) } }
}

fn figures(
    rows: &mut Rows,
    subject: &str,
    prefix: &str,
    p: &Grid,
    r: &Grid,
    seen: &Grid,
    (wanted, judged): (usize, usize),
) {
    for (name, mm, deg) in PAIRS {
        let (d, a) = place(mm, deg);
        let observed = (seen[d][a] * judged as f64).round() as usize;
        let of_truth = Asked { wanted, answered: if judged == 0 { 0 } else { wanted } };
        rows.push(
            subject,
            &format!("{prefix}precision_{name}"),
            p[d][a],
            Asked { wanted: judged, answered: observed },
        );
        rows.push(subject, &format!("{prefix}recall_{name}"), r[d][a], of_truth);
        rows.push(subject, &format!("{prefix}f_{name}"), f_score(p[d][a], r[d][a]), of_truth);
    }
}

/// Positions along the axes of the reference camera, so that cells move with the world.
pub(crate) fn in_reference(reference: &Reference, p: DVec3) -> [f64; 3] {
    reference.strands.truth.rig.cameras[0].to_camera(p).to_array()
}

/// B1 on V2 with weights under which every 5 mm cell counts the same.
fn voxels(
    reference: &Reference,
    c: &Candidate,
    (wanted, found): (&[Sample], &[Stairs]),
    (judged, confirmed): (&[Judged], &[Stairs]),
    rows: &mut Rows,
) {
    let weights = |points: Vec<[f64; 3]>| -> Vec<f64> {
        let grids: Vec<Vec<f64>> = (0..8u32).into_par_iter().map(|s| cell_weights(&points, s)).collect();
        (0..points.len()).map(|i| grids.iter().map(|g| g[i]).sum::<f64>() / 8.0).collect()
    };
    let w = weights(wanted.iter().map(|s| in_reference(reference, s.position)).collect());
    let r = recall(wanted, found, |i| w[i]);
    for (name, mm, deg) in PAIRS {
        let (d, a) = place(mm, deg);
        let seen: Vec<usize> = (0..judged.len()).filter(|&i| judged[i].observed(Set::V2, mm, deg)).collect();
        let w = weights(seen.iter().map(|&i| in_reference(reference, judged[i].sample.position)).collect());
        let p: f64 =
            seen.iter().zip(&w).filter(|(i, _)| within(&confirmed[**i], d, a)).fold(0.0, |s, (_, w)| s + w);
        let of_truth =
            Asked { wanted: wanted.len(), answered: if judged.is_empty() { 0 } else { wanted.len() } };
        let observed = Asked { wanted: judged.len(), answered: seen.len() };
        rows.push(c.name, &format!("B1.voxel.precision_{name}"), p, observed);
        rows.push(c.name, &format!("B1.voxel.recall_{name}"), r[d][a], of_truth);
        rows.push(c.name, &format!("B1.voxel.f_{name}"), f_score(p, r[d][a]), of_truth);
    }
}

/// Most vertices that are asked for.
const MOST_VERTICES: usize = 1 << 15;

/// B1 as vertex sampling has it: both sets reduced to the first points of their segments.
fn legacy(reference: &Reference, c: &Candidate, rows: &mut Rows) {
    let shares = |of: &StrandSet, among: &Curves| -> ([f64; 4], usize) {
        let starts = (0..of.len()).flat_map(|s| of.range(s).start..of.range(s).end - 1);
        let k = (of.points.len() - of.len()).div_ceil(c.most.min(MOST_VERTICES)).max(1);
        let sample = |i: usize| {
            let [position, next] = [i, i + 1].map(|i| of.points[i].as_dvec3());
            let tangent = (next - position).normalize_or_zero();
            Sample { position, tangent, weight_mm: 1.0, strand: 0, point: i as u32, along: 0.0 }
        };
        let vertices = starts.skip(k / 2).step_by(k).map(sample).collect();
        let vertices = Ordered::new(vertices, |s: &Sample| s.position);
        let found = vertices.ask(|_, s| among.vertex_staircase(s.position, s.tangent));
        let grid = recall(&vertices, &found, |_| 1.0);
        let share = |(_, mm, deg)| {
            let (d, a) = place(mm, deg);
            grid[d][a]
        };
        (PAIRS.map(share), vertices.len())
    };
    let (r, wanted) = shares(&reference.strands.truth.strands, c.curves);
    let (p, given) = shares(c.strands, &reference.strands.full);
    let there = |n: usize| Asked { wanted: n, answered: if given == 0 { 0 } else { n } };
    for (k, (name, ..)) in PAIRS.iter().enumerate() {
        rows.push(c.name, &format!("B1.legacy-vertex.precision_{name}"), p[k], there(given));
        rows.push(c.name, &format!("B1.legacy-vertex.recall_{name}"), r[k], there(wanted));
        rows.push(c.name, &format!("B1.legacy-vertex.f_{name}"), f_score(p[k], r[k]), there(wanted));
    }
}

/// B2: distance and angle to the nearest curve, without a tolerance, both ways.
fn lateral(c: &Candidate, rows: &mut Rows) {
    let wanted = &c.wanted;
    let to_estimate: Vec<(f64, f64, f64)> = wanted
        .iter()
        .zip(&c.nearest)
        .map(|(s, hit)| match hit {
            Some(h) => (h.distance_mm, between_axes_deg(s.tangent, h.direction), s.weight_mm),
            None => (f64::INFINITY, f64::INFINITY, s.weight_mm),
        })
        .collect();
    let to_truth: Vec<(f64, f64, f64)> = c
        .judged
        .iter()
        .filter(|j| j.in_layer(Set::V2) || j.free)
        .map(|j| {
            let angle = between_axes_deg(j.sample.tangent, j.nearest.direction);
            (j.nearest.distance_mm, angle, j.sample.weight_mm)
        })
        .collect();
    for (name, errors, asked) in
        [("to_estimate", &to_estimate, wanted.len()), ("to_truth", &to_truth, c.judged.len())]
    {
        let total: f64 = errors.iter().map(|e| e.2).sum();
        let weights: Vec<f64> = errors.iter().map(|e| e.2 / total).collect();
        let answered = errors.iter().filter(|e| e.0.is_finite()).count();
        let asked = Asked { wanted: asked, answered };
        for (what, values) in [
            ("distance", errors.iter().map(|e| e.0).collect::<Vec<f64>>()),
            ("angle", errors.iter().map(|e| e.1).collect()),
        ] {
            let ascending = Weighted::new(&values, &weights);
            for (q, share) in [("median", 0.5), ("p90", 0.9), ("p95", 0.95)] {
                rows.push(c.name, &format!("B2.{name}.{what}.{q}"), ascending.quantile(share), asked);
            }
        }
    }
}

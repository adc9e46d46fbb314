//! B3 and B4: which estimated strand is which true one, and does it run from root to tip?

use super::curves::Hit;
use super::judge::{Candidate, Reference};
use super::matching::Weights;
use super::samples::Set;
use super::stairs::cos_squared;
use crate::rows::{Asked, Rows};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Tolerance of an overlap.
const OVERLAP: (f64, f64) = (2.0, 20.0);

/// Weights are whole micrometres, so that the matching is exact.
const PER_MM: f64 = 1000.0;

/// Lengths of true strands assigned to estimated ones, and the other way round, mm.
struct Overlaps {
    /// By (true strand, estimated strand): length, and the part of it that runs the same way.
    of_true: BTreeMap<(u32, u32), (f64, f64)>,
    /// By (true strand, estimated strand).
    of_estimated: BTreeMap<(u32, u32), f64>,
    /// Length of the V2 set, mm.
    true_mm: f64,
    /// Observed length of the estimate, mm.
    estimated_mm: f64,
}

fn overlaps(reference: &Reference, c: &Candidate) -> Overlaps {
    let (mm, deg) = OVERLAP;
    let strands = &reference.strands;
    let wanted = &c.wanted;
    let overlaps = |h: &Hit| h.distance_mm <= mm && h.cos2 >= cos_squared(deg);
    let mut o = Overlaps {
        of_true: BTreeMap::new(),
        of_estimated: BTreeMap::new(),
        true_mm: wanted.iter().map(|s| s.weight_mm).sum(),
        estimated_mm: 0.0,
    };
    let strand_of_estimate = |point: u32| c.strands.offsets.partition_point(|&o| o <= point) as u32 - 1;
    // The nearest strand of all is the nearest that overlaps, if it does.
    let hits: Vec<Option<(u32, bool)>> = (0..wanted.len())
        .into_par_iter()
        .map(|k| {
            let s = &wanted[k];
            let hit = match c.nearest[k].filter(overlaps) {
                Some(hit) => hit,
                None => c.curves.nearest(s.position, s.tangent, mm, cos_squared(deg))?,
            };
            Some((strand_of_estimate(hit.point), hit.direction.dot(s.tangent) > 0.0))
        })
        .collect();
    for (s, hit) in wanted.iter().zip(hits) {
        if let Some((j, forward)) = hit {
            let sum = o.of_true.entry((s.strand, j)).or_default();
            sum.0 += s.weight_mm;
            sum.1 += if forward { s.weight_mm } else { 0.0 };
        }
    }
    // The other way round: the nearest true piece that overlaps, of whatever set; it counts if it belongs to V2.
    let hits: Vec<Option<(u32, u32)>> = c
        .judged
        .par_iter()
        .map(|j| {
            if !(j.in_layer(Set::V2) || j.free || j.nearest.distance_mm <= mm) {
                return None;
            }
            let s = &j.sample;
            let hit = match Some(j.nearest).filter(overlaps) {
                Some(hit) => hit,
                None => strands.full.nearest(s.position, s.tangent, mm, cos_squared(deg))?,
            };
            Some((strands.strand_of[hit.point as usize], strands.cameras_at(hit.point, hit.along)))
        })
        .collect();
    for (j, hit) in c.judged.iter().zip(hits) {
        match hit {
            Some((i, cameras)) if cameras >= 2 => {
                *o.of_estimated.entry((i, j.sample.strand)).or_default() += j.sample.weight_mm;
                o.estimated_mm += j.sample.weight_mm;
            }
            Some(_) => {}
            None if j.observed(Set::V2, mm, deg) => o.estimated_mm += j.sample.weight_mm,
            None => {}
        }
    }
    o
}

/// Number of equal parts that would share a length as evenly: (Σ l)² / Σ l².
fn effective_number(lengths: &[f64]) -> f64 {
    let sum: f64 = lengths.iter().sum();
    sum * sum / lengths.iter().map(|l| l * l).sum::<f64>()
}

/// Mean effective number of partners, each strand weighing its assigned length.
fn partners(pairs: impl Iterator<Item = ((u32, u32), f64)>, by_true: bool) -> f64 {
    let mut of: BTreeMap<u32, Vec<f64>> = BTreeMap::new();
    for ((i, j), length) in pairs {
        of.entry(if by_true { i } else { j }).or_default().push(length);
    }
    let (mut sum, mut total) = (0.0, 0.0);
    for lengths in of.values() {
        let length: f64 = lengths.iter().sum();
        sum += length * effective_number(lengths);
        total += length;
    }
    if total > 0.0 { sum / total } else { f64::INFINITY }
}

/// Pairs of true and estimated strand that the matching keeps, with their common length in mm.
fn matched(o: &Overlaps, true_strands: usize, estimated: usize) -> Vec<((u32, u32), f64)> {
    let mut weights = Weights { columns: estimated, offsets: vec![0], entries: Vec::new() };
    let mut lengths = Vec::new();
    let mut pairs = o.of_true.iter().peekable();
    for i in 0..true_strands as u32 {
        while let Some((&(_, j), &(length, _))) = pairs.next_if(|((t, _), _)| *t == i) {
            let common = length.min(o.of_estimated.get(&(i, j)).copied().unwrap_or(0.0));
            let whole = (common * PER_MM).round() as u64;
            if whole > 0 {
                weights.entries.push((j, whole));
                lengths.push(common);
            }
        }
        weights.offsets.push(weights.entries.len() as u32);
    }
    let matching = weights.matching();
    let mut out = Vec::new();
    for (i, column) in matching.column.iter().enumerate() {
        let Some(j) = column else { continue };
        let row = weights.offsets[i] as usize..weights.offsets[i + 1] as usize;
        let at = row.clone().find(|&k| weights.entries[k].0 == *j).expect("a pair of the graph");
        out.push(((i as u32, *j), lengths[at]));
    }
    out
}

/// Adds B3, and of B4 what the matching says.
pub(crate) fn score(reference: &Reference, c: &Candidate, rows: &mut Rows) {
    let o = overlaps(reference, c);
    let pairs = matched(&o, reference.strands.truth.strands.len(), c.strands.len());
    let common: f64 = pairs.iter().map(|p| p.1).sum();
    let wanted = c.wanted.len();
    let share = if o.true_mm > 0.0 { (common / o.true_mm).min(1.0) } else { 0.0 };
    let asked = Asked { wanted, answered: (share * wanted as f64).round() as usize };
    let over = |of: f64| if of > 0.0 { common / of } else { 0.0 };
    rows.push(c.name, "B3.idp", over(o.estimated_mm), asked);
    rows.push(c.name, "B3.idr", over(o.true_mm), asked);
    rows.push(c.name, "B3.idf1", over(0.5 * (o.true_mm + o.estimated_mm)), asked);
    let fragments = partners(o.of_true.iter().map(|(k, v)| (*k, v.0)), true);
    rows.push(c.name, "B3.fragmentation", fragments, asked);
    let merged = partners(o.of_estimated.iter().map(|(k, v)| (*k, *v)), false);
    rows.push(c.name, "B3.merging", merged, asked);

    let (mut length, mut forward) = (0.0, 0.0);
    for (pair, _) in &pairs {
        let (all, same) = o.of_true[pair];
        length += all;
        forward += same;
    }
    rows.push(c.name, "B4.direction", if length > 0.0 { forward / length } else { f64::NAN }, asked);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_parts_count_and_crumbs_do_not() {
        assert_eq!(effective_number(&[3.0; 4]), 4.0);
        assert!((effective_number(&[100.0, 1.0]) - 1.02).abs() < 1e-3);
        // Strand 0 of 10 mm in two halves, strand 1 of 30 mm in one piece: (10 x 2 + 30 x 1) / 40.
        let pairs = [((0, 5), 5.0), ((0, 6), 5.0), ((1, 5), 30.0)];
        assert_eq!(partners(pairs.iter().copied(), true), 1.25);
        let by_estimated = partners(pairs.iter().copied(), false);
        assert!((by_estimated - (35.0 * effective_number(&[5.0, 30.0]) + 5.0) / 40.0).abs() < 1e-12);
    }
}

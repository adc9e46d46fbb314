//! B4 at the roots, B5 (length and curvature) and B6 (density): strands as a population.

use super::alignment::in_reference;
use super::judge::{Candidate, Reference};
use super::samples::{Samples, Set, TrueStrands, Walk};
use crate::rows::{Asked, Rows};
use crate::stats::{percentile, share_within, sorted};
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::collections::BTreeMap;
use strandbench_types::nearest::Tree;
use strandbench_types::{StrandSet, TriMesh};

/// Half of the stretch over which curvature is taken, mm.
const HALF_STRETCH_MM: f64 = 2.5;

/// Distances to the scalp within which a strand counts as rooted, mm.
const ROOTED_MM: [f64; 2] = [2.0, 5.0];

/// Edge of the cells of B6, mm.
const CELL_MM: f64 = 5.0;

/// The part of the truth's population that candidates are compared with.
pub(crate) struct Population {
    /// Of all strands, ascending, mm.
    lengths: Vec<f64>,
    /// Ascending, 1/m.
    curvatures: Vec<f64>,
    /// Length of hair in each cell, mm, of all strands.
    cells: BTreeMap<[i32; 3], f64>,
    /// Cells that hold a sample of V2.
    visible: Vec<[i32; 3]>,
    roots: Vec<Vec3>,
    root_tree: (Tree, Vec<u32>),
}

impl Population {
    pub fn new(reference: &Reference, most: u64) -> Population {
        let strands = &reference.strands.truth.strands;
        let all = Samples::of(strands, |_, _| true, most);
        let cells = cells(reference, all.list.par_iter().map(|s| (s.position, s.weight_mm)));
        let seen = &reference.samples(Set::V2).list;
        let mut visible: Vec<[i32; 3]> = seen.iter().map(|s| cell(reference, s.position)).collect();
        visible.sort_unstable();
        visible.dedup();
        // A cell whose true strands were all thinned away cannot be compared.
        visible.retain(|c| cells.contains_key(c));
        let roots: Vec<Vec3> = (0..strands.len()).map(|s| strands.strand(s)[0]).collect();
        let root_tree = Tree::new(roots.len(), |i| [roots[i]; 2]);
        Population {
            lengths: lengths(strands),
            curvatures: curvatures(strands),
            cells,
            visible,
            roots,
            root_tree,
        }
    }
}

fn cell(reference: &Reference, p: DVec3) -> [i32; 3] {
    in_reference(reference, p).map(|v| (v / CELL_MM).floor() as i32)
}

/// Weight in each cell.
fn cells(
    reference: &Reference,
    points: impl IndexedParallelIterator<Item = (DVec3, f64)>,
) -> BTreeMap<[i32; 3], f64> {
    let mut keyed: Vec<([i32; 3], f64)> = points.map(|(p, w)| (cell(reference, p), w)).collect();
    keyed.par_sort_by_key(|k| k.0);
    keyed.chunk_by(|a, b| a.0 == b.0).map(|c| (c[0].0, c.iter().map(|k| k.1).sum())).collect()
}

/// The cells of 5 mm that hold true hair, in the axes of the reference camera.
pub(crate) fn occupied(population: &Population) -> Vec<[i32; 3]> {
    population.cells.keys().copied().collect()
}

/// Lengths of all strands, ascending, mm.
fn lengths(strands: &StrandSet) -> Vec<f64> {
    ascending((0..strands.len()).into_par_iter().map(|s| strands.length_mm(s)).collect())
}

fn ascending(mut values: Vec<f64>) -> Vec<f64> {
    values.par_sort_unstable_by(f64::total_cmp);
    values
}

/// Curvature (1/m) of the circle through three points 2.5 mm apart along the strand, every 2.5 mm, ascending; each weighs
/// the same. Strands shorter than 5 mm have none.
fn curvatures(strands: &StrandSet) -> Vec<f64> {
    let of_strand = |s: usize| {
        let mut walk = Walk::new(strands, s);
        let n = (walk.length / HALF_STRETCH_MM).floor() as usize + 1;
        let points: Vec<DVec3> = if n < 3 {
            Vec::new()
        } else {
            (0..n).map(|i| walk.at(i as f64 * HALF_STRETCH_MM).position).collect()
        };
        points.windows(3).map(|w| 1000.0 * menger(w[0], w[1], w[2])).collect::<Vec<_>>()
    };
    let lists: Vec<Vec<f64>> = (0..strands.len()).into_par_iter().map(of_strand).collect();
    ascending(lists.concat())
}

/// Curvature of the circle through three points: 4 area / (product of the sides).
fn menger(a: DVec3, b: DVec3, c: DVec3) -> f64 {
    let product = a.distance(b) * b.distance(c) * c.distance(a);
    if product > 0.0 { 2.0 * (b - a).cross(c - a).length() / product } else { 0.0 }
}

/// Wasserstein-1 distance between two populations, each in ascending order: the area between their distribution
/// functions. Infinite if one of them is empty and the other not.
fn wasserstein(a: &[f64], b: &[f64]) -> f64 {
    if a.is_empty() || b.is_empty() {
        return if a.is_empty() && b.is_empty() { 0.0 } else { f64::INFINITY };
    }
    let (wa, wb) = (1.0 / a.len() as f64, 1.0 / b.len() as f64);
    let (mut i, mut j) = (0, 0);
    let (mut between, mut area) = (0.0, 0.0);
    let mut last = a[0].min(b[0]);
    while i < a.len() || j < b.len() {
        let from_b = i == a.len() || j < b.len() && b[j] <= a[i];
        let value = if from_b { b[j] } else { a[i] };
        area += f64::abs(between) * (value - last);
        last = value;
        if from_b {
            (between, j) = (between - wb, j + 1);
        } else {
            (between, i) = (between + wa, i + 1);
        }
    }
    area
}

/// Squared distance from a point to a triangle.
fn to_triangle_squared(p: DVec3, [a, b, c]: [DVec3; 3]) -> f64 {
    let n = (b - a).cross(c - a);
    let nn = n.length_squared();
    let inside = |a: DVec3, b: DVec3| (b - a).cross(p - a).dot(n) >= 0.0;
    if nn > 0.0 && inside(a, b) && inside(b, c) && inside(c, a) {
        return (p - a).dot(n).powi(2) / nn;
    }
    let edge = |a: DVec3, b: DVec3| strandbench_types::nearest::point_to_segment_squared(p, &[a, b]);
    edge(a, b).min(edge(b, c)).min(edge(c, a))
}

/// Distances from points to a surface, mm; infinite where it is farther than `within_mm`.
fn to_surface(points: &[Vec3], mesh: &TriMesh, within_mm: f64) -> Vec<f64> {
    let corners = |i: usize| mesh.triangles[i].map(|v| mesh.vertices[v as usize]);
    let (tree, order) = Tree::new(mesh.triangles.len(), |i| {
        let [a, b, c] = corners(i);
        [a.min(b).min(c), a.max(b).max(c)]
    });
    let distance = |p: &Vec3| {
        let (p, within) = (p.as_dvec3(), within_mm * within_mm);
        let mut least = f64::INFINITY;
        tree.walk(p, within, |rank| {
            least = least.min(to_triangle_squared(p, corners(order[rank] as usize).map(Vec3::as_dvec3)));
            least.min(within)
        });
        if least <= within { least.sqrt() } else { f64::INFINITY }
    };
    points.par_iter().map(distance).collect()
}

/// Adds the root figures of B4, and B5 and B6.
pub(crate) fn score(reference: &Reference, population: &Population, c: &Candidate, rows: &mut Rows) {
    roots(reference.strands.truth.head.as_ref(), population, c, rows);
    let n = c.strands.len();
    let asked = Asked {
        wanted: population.lengths.len(),
        answered: if n == 0 { 0 } else { population.lengths.len() },
    };
    rows.push(c.name, "B5.length_w1", wasserstein(&population.lengths, &lengths(c.strands)), asked);
    rows.push(c.name, "B5.curvature_w1", wasserstein(&population.curvatures, &curvatures(c.strands)), asked);

    let own = cells(reference, c.judged.par_iter().map(|j| (j.sample.position, j.sample.weight_mm)));
    let ratio = |k: &[i32; 3]| (own.get(k).copied().unwrap_or(0.0) / population.cells[k]).log2();
    let logs: Vec<f64> = population.visible.iter().map(ratio).collect();
    let answered = logs.iter().filter(|l| l.is_finite()).count();
    let asked = Asked { wanted: logs.len(), answered };
    rows.push(c.name, "B6.log2_ratio.median", percentile(&sorted(logs.clone()), 50), asked);
    let sizes = sorted(logs.iter().map(|l| l.abs()).collect());
    rows.push(c.name, "B6.log2_ratio.error_median", percentile(&sizes, 50), asked);
    rows.push(c.name, "B6.log2_ratio.error_p90", percentile(&sizes, 90), asked);
    let total: f64 = own.values().sum();
    // From zero: the sum of nothing is -0.
    let outside =
        own.iter().filter(|(k, _)| !population.cells.contains_key(*k)).fold(0.0, |sum, (_, w)| sum + w);
    let share = if total > 0.0 { outside / total } else { f64::NAN };
    rows.push(c.name, "B6.outside", share, asked);
    let whole: f64 = population.cells.values().sum();
    rows.push(c.name, "B6.log2_total", (total / whole).log2(), asked);
}

fn roots(head: Option<&TriMesh>, population: &Population, c: &Candidate, rows: &mut Rows) {
    let roots: Vec<Vec3> = (0..c.strands.len()).map(|s| c.strands.strand(s)[0]).collect();
    let asked = Asked { wanted: roots.len(), answered: roots.len() };
    let (tree, order) = &population.root_tree;
    let to_root = |p: &Vec3| {
        let (p, mut least) = (p.as_dvec3(), f64::INFINITY);
        tree.walk(p, f64::INFINITY, |rank| {
            least = least.min(population.roots[order[rank] as usize].as_dvec3().distance_squared(p));
            least
        });
        least.sqrt()
    };
    let errors = sorted(roots.par_iter().map(to_root).collect());
    rows.push(c.name, "B4.root_error.median", percentile(&errors, 50), asked);
    rows.push(c.name, "B4.root_error.p90", percentile(&errors, 90), asked);
    if let Some(head) = head {
        let distances = sorted(to_surface(&roots, head, ROOTED_MM[1]));
        rows.push(c.name, "B4.rooted_2mm", share_within(&distances, ROOTED_MM[0]), asked);
        rows.push(c.name, "B4.rooted_5mm", share_within(&distances, ROOTED_MM[1]), asked);
    }
}

/// Total length of true hair, mm.
pub(crate) fn total_mm(strands: &TrueStrands) -> f64 {
    let set = &strands.truth.strands;
    (0..set.len()).map(|s| set.length_mm(s)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use strandbench_rng::Rng;

    #[test]
    fn circles_have_their_curvature_and_lines_none() {
        let mut set = StrandSet::new();
        let circle = |i: u32| {
            let a = f64::from(i) * 0.01;
            Vec3::new((20.0 * a.cos()) as f32, (20.0 * a.sin()) as f32, 3.0)
        };
        set.push(&(0..300).map(circle).collect::<Vec<_>>(), 0.04);
        set.push(&[Vec3::ZERO, Vec3::X * 30.0], 0.04);
        set.push(&[Vec3::ZERO, Vec3::X * 4.9], 0.04);
        let k = curvatures(&set);
        // A radius of 20 mm is 50 1/m. The middle of a chord of 0.2 mm lies 2.5e-4 mm inside the circle: twice that
        // over the sagitta of 0.156 mm of a stretch of 5 mm is what the curvature may be off by.
        assert_eq!(k.len(), 22 + 11);
        assert!(k[..11].iter().all(|x| *x < 1e-6), "{k:?}");
        assert!(k[11..].iter().all(|x| (x / 50.0 - 1.0).abs() < 3.3e-3), "{k:?}");
    }

    #[test]
    fn populations_differ_by_what_must_be_moved() {
        let a = [1.0, 2.0, 6.0];
        assert!((wasserstein(&a, &a.map(|x| x + 2.5)) - 2.5).abs() < 1e-12);
        assert_eq!(wasserstein(&a, &a), 0.0);
        // Half of the weight moves by 4.
        assert!((wasserstein(&[0.0], &[0.0, 4.0]) - 2.0).abs() < 1e-12);
        assert!((wasserstein(&a, &[1.0, 6.0]) - wasserstein(&[1.0, 6.0], &a)).abs() < 1e-12);
        assert!(
            (wasserstein(&a, &[1.0, 6.0]) - 5.0 / 6.0).abs() < 1e-12,
            "a sixth of it moves by 1 and by 4"
        );
        assert_eq!((wasserstein(&a, &[]), wasserstein(&[], &[])), (f64::INFINITY, 0.0));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(60))]
        #[test]
        fn distance_to_a_triangle_is_the_least_over_its_points(seed in any::<u64>()) {
            let mut r = Rng::keyed(&[seed]);
            let mut v = || Vec3::new(r.range(-3.0, 3.0), r.range(-3.0, 3.0), r.range(-3.0, 3.0));
            let (t, p) = ([v(), v(), v()], v());
            let mesh = TriMesh { vertices: t.to_vec(), triangles: vec![[0, 1, 2]] };
            let got = to_surface(&[p], &mesh, f64::INFINITY)[0];
            let [a, b, c] = t.map(Vec3::as_dvec3);
            let mut least = f64::INFINITY;
            for i in 0..=200 {
                for j in 0..=200 - i {
                    let q = a + (b - a) * (f64::from(i) / 200.0) + (c - a) * (f64::from(j) / 200.0);
                    least = least.min(q.distance(p.as_dvec3()));
                }
            }
            // Points of the lattice are at most a 200th of the longest edge from the nearest.
            let coarse = (a.distance(b).max(b.distance(c)).max(c.distance(a))) / 200.0;
            prop_assert!(got <= least + 1e-9 && got >= least - coarse, "{got} {least}");
            let limited = to_surface(&[p], &mesh, 2.0)[0];
            prop_assert_eq!(limited, if got <= 2.0 { got } else { f64::INFINITY });
        }
    }
}

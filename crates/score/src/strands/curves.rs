//! Strands as curves, ready for nearest and range queries.

use super::cones::{Cone, cones};
use super::stairs::{GRID_COS2, GRID_MM, NOTHING, Staircase, Stairs};
use crate::ScoreError;
use strandbench_types::nearest::{Limit, Tree, outward};

use crate::check::fault;
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::sync::OnceLock;
use strandbench_types::StrandSet;

/// Segments shorter than this have no direction; they are left out and counted, mm (METRICS ground rule 3).
pub(crate) const MIN_SEGMENT_MM: f32 = 1e-6;

/// Two pieces whose distances differ by less count as equally near, mm.
const TIE_MM: f64 = 1e-9;

/// A part of a segment: its index in the points, and where on it the part begins and ends (0 to 1).
pub(crate) type Part = (u32, [f64; 2]);

struct Segment {
    a: Vec3,
    b: Vec3,
    /// Index of `a` in the strand set's points.
    point: u32,
}

/// The point of a curve nearest to a query.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Hit {
    pub distance_mm: f64,
    /// Squared cosine between the query's line and the curve.
    pub cos2: f64,
    /// Unit direction of the curve there, from its first point to its last.
    pub direction: DVec3,
    /// Index of the segment's first point.
    pub point: u32,
    /// Position on that segment, 0 to 1.
    pub along: f64,
}

/// Segments, or parts of segments, in a tree.
pub(crate) struct Curves {
    tree: Tree,
    segments: Vec<Segment>,
    /// Extent of each part; empty if every segment is whole.
    cuts: Vec<[f64; 2]>,
    /// Lines of each node of the tree, once they are asked for.
    cones: OnceLock<Vec<Cone>>,
    /// Segments without a direction, left out.
    pub dropped: u64,
}

impl Curves {
    /// All segments of the strands for which `keep` (by strand) is true.
    pub fn whole(strands: &StrandSet, keep: impl Fn(usize) -> bool) -> Result<Curves, ScoreError> {
        let of_strand = |strand: usize| {
            let range = strands.range(strand);
            let piece = |i: &u32| strands.points[*i as usize].distance(strands.points[*i as usize + 1]);
            let all = range.start as u32..range.end as u32 - 1;
            all.filter(|i| piece(i) >= MIN_SEGMENT_MM).collect::<Vec<u32>>()
        };
        let kept: Vec<usize> = (0..strands.len()).filter(|&s| keep(s)).collect();
        let pieces: usize = kept.iter().map(|&s| strands.range(s).len() - 1).sum();
        let lists: Vec<Vec<u32>> = kept.into_par_iter().map(of_strand).collect();
        let starts = lists.concat();
        let dropped = (pieces - starts.len()) as u64;
        let ends = |i: usize| {
            let p = starts[i] as usize;
            [strands.points[p], strands.points[p + 1]]
        };
        let (tree, order) = Tree::new(starts.len(), |i| {
            let [a, b] = ends(i);
            [a.min(b), a.max(b)]
        });
        let segment = |&i: &u32| {
            let [a, b] = ends(i as usize);
            Segment { a, b, point: starts[i as usize] }
        };
        Ok(Curves::new(tree, order.par_iter().map(segment).collect(), Vec::new(), dropped))
    }

    /// Parts of segments.
    pub fn parts(strands: &StrandSet, parts: &[Part]) -> Curves {
        let ends = |i: usize| {
            let p = parts[i].0 as usize;
            [strands.points[p], strands.points[p + 1]]
        };
        let (tree, order) = Tree::new(parts.len(), |i| {
            let [a, b] = ends(i).map(Vec3::as_dvec3);
            let [from, to] = parts[i].1.map(|t| a + (b - a) * t);
            outward(from.min(to), from.max(to))
        });
        let segment = |&i: &u32| {
            let [a, b] = ends(i as usize);
            Segment { a, b, point: parts[i as usize].0 }
        };
        let cuts = order.iter().map(|&i| parts[i as usize].1).collect();
        Curves::new(tree, order.par_iter().map(segment).collect(), cuts, 0)
    }

    fn new(tree: Tree, segments: Vec<Segment>, cuts: Vec<[f64; 2]>, dropped: u64) -> Curves {
        Curves { tree, segments, cuts, cones: OnceLock::new(), dropped }
    }

    pub fn is_empty(&self) -> bool {
        self.segments.is_empty()
    }

    /// The point of a member nearest to `p`: squared distance, squared cosine with the unit line `t`, position.
    fn member(&self, rank: usize, p: DVec3, t: DVec3) -> (f64, f64, f64) {
        let s = &self.segments[rank];
        let a = s.a.as_dvec3();
        let u = s.b.as_dvec3() - a;
        let uu = u.length_squared();
        let [from, to] = self.cuts.get(rank).copied().unwrap_or([0.0, 1.0]);
        let along = ((p - a).dot(u) / uu).clamp(from, to);
        let tu = t.dot(u);
        ((a + u * along - p).length_squared(), tu * tu / uu, along)
    }

    /// Whether a member's squared cosine with the unit line `t`, as [`Curves::member`] has it, is surely below `cos2`:
    /// found in single precision and without a division, up to more than its rounding (some 1e-6 of the square).
    fn is_beyond(&self, rank: usize, t: Vec3, cos2: f32) -> bool {
        let s = &self.segments[rank];
        let u = s.b - s.a;
        let tu = t.dot(u);
        tu * tu < (cos2 - 1e-5) * u.length_squared()
    }

    fn cones(&self) -> &[Cone] {
        let line = |rank: usize| self.segments[rank].b - self.segments[rank].a;
        self.cones.get_or_init(|| cones(&self.tree, line))
    }

    /// The nearest piece within `reach_mm` whose line is within an angle of the unit line `t` (`cos2_min` is the
    /// square of its cosine); of equally near ones, that of the smallest angle.
    pub fn nearest(&self, p: DVec3, t: DVec3, reach_mm: f64, cos2_min: f64) -> Option<Hit> {
        let mut best: Option<Hit> = None;
        let mut least = f64::INFINITY;
        let reach = reach_mm * reach_mm;
        let mut visit = |rank: usize| {
            let (d2, cos2, along) = self.member(rank, p, t);
            let limit = |least: f64| reach.min((least + TIE_MM).powi(2));
            if d2 > limit(least) || cos2 < cos2_min {
                return limit(least);
            }
            let distance_mm = d2.sqrt();
            let point = self.segments[rank].point;
            let better = best.as_ref().is_none_or(|b| {
                distance_mm < least - TIE_MM
                    || match cos2.total_cmp(&b.cos2) {
                        std::cmp::Ordering::Greater => true,
                        std::cmp::Ordering::Equal => point < b.point,
                        std::cmp::Ordering::Less => false,
                    }
            });
            if better {
                let s = &self.segments[rank];
                let direction = (s.b.as_dvec3() - s.a.as_dvec3()).normalize();
                best = Some(Hit { distance_mm, cos2, direction, point, along });
            }
            least = least.min(distance_mm);
            limit(least)
        };
        if cos2_min <= 0.0 {
            self.tree.walk(p, reach, visit);
        } else {
            let aligned = Aligned { limit: reach, cos2_min, line: t.as_vec3(), cones: self.cones() };
            self.tree.walk_while(p, |rank, a: &mut Aligned<'_>| a.limit = visit(rank), aligned);
        }
        best
    }

    /// First points of the segments nearest to `p`, at most one a strand (of equally near ones its first), at most
    /// `most`, within `reach_mm`, from near to far; `strand_of` tells a point's strand.
    pub fn around(&self, p: DVec3, reach_mm: f64, most: usize, strand_of: &[u32]) -> Vec<u32> {
        let mut found: Vec<(f64, u32)> = Vec::with_capacity(most + 1);
        let limit = |found: &[(f64, u32)]| match found.get(most - 1) {
            Some(farthest) => reach_mm.min(farthest.0 + TIE_MM).powi(2),
            None => reach_mm * reach_mm,
        };
        self.tree.walk(p, reach_mm * reach_mm, |rank| {
            let (d2, ..) = self.member(rank, p, DVec3::X);
            if d2 > limit(&found) {
                return limit(&found);
            }
            let here = (d2.sqrt(), self.segments[rank].point);
            let strand = strand_of[here.1 as usize];
            let same = found.iter().position(|f| strand_of[f.1 as usize] == strand);
            let better = same.is_none_or(|k| {
                let there = found[k];
                here.0 < there.0 - TIE_MM || here.0 <= there.0 + TIE_MM && here.1 < there.1
            });
            if better {
                if let Some(k) = same {
                    found.remove(k);
                }
                let at = found.partition_point(|f| *f < here);
                found.insert(at, here);
                found.truncate(most);
            }
            limit(&found)
        });
        found.into_iter().map(|f| f.1).collect()
    }

    /// The smallest angle with the unit line `t` among the pieces within each distance of the grid, as a place on the
    /// grid of angles; `nearest` is the nearest piece of all.
    pub fn staircase(&self, p: DVec3, t: DVec3, nearest: &Hit) -> Stairs {
        let mut steps = self.no_steps(t);
        // Nothing is nearer, so nothing makes a step at smaller distances: they ask for no boxes.
        steps.lowest = GRID_MM.iter().position(|mm| *mm >= nearest.distance_mm - TIE_MM).unwrap_or(7);
        // Of squares that differ by rounding the walk decides.
        if let Some(level) = GRID_MM.iter().position(|mm| *mm > nearest.distance_mm + TIE_MM) {
            steps.improve(level, nearest.cos2);
        }
        self.climb(p, steps, |rank, steps| {
            let (d2, cos2, _) = self.member(rank, p, t);
            steps.improve_at(d2, cos2);
        })
    }

    /// As [`Curves::staircase`], with distances to each segment's first point alone.
    pub fn vertex_staircase(&self, p: DVec3, t: DVec3) -> Stairs {
        self.climb(p, self.no_steps(t), |rank, steps| {
            let (_, cos2, _) = self.member(rank, p, t);
            steps.improve_at(self.segments[rank].a.as_dvec3().distance_squared(p), cos2);
        })
    }

    fn no_steps(&self, t: DVec3) -> Staircase<'_> {
        Staircase {
            stairs: NOTHING,
            need: std::array::from_fn(|l| if l < 7 { GRID_COS2[5] } else { f64::INFINITY }),
            lowest: 0,
            cos2: &GRID_COS2,
            line: t.as_vec3(),
            cones: self.cones(),
        }
    }

    fn climb(&self, p: DVec3, steps: Staircase<'_>, visit: impl Fn(usize, &mut Staircase<'_>)) -> Stairs {
        let visit = |rank, steps: &mut Staircase<'_>| {
            if !self.is_beyond(rank, steps.line, steps.need[steps.lowest] as f32) {
                visit(rank, steps);
            }
        };
        self.tree.walk_while(p, visit, steps).stairs
    }
}

/// Pieces within a squared distance whose lines may be within an angle.
struct Aligned<'a> {
    limit: f64,
    cos2_min: f64,
    line: Vec3,
    cones: &'a [Cone],
}

impl Limit for Aligned<'_> {
    fn matters(&self, node: u32, distance_squared: f32) -> bool {
        f64::from(distance_squared) <= self.limit
            && self.cos2_min <= self.cones[node as usize].most_cos2(self.line)
    }
}

/// Refuses what no hair is: a strand so long that its samples could not be counted.
pub(crate) fn check_lengths(strands: &StrandSet, whose: &str) -> Result<(), ScoreError> {
    const LONGEST_MM: f64 = 1e5;
    let too_long = |strand: usize| {
        let length = strands.length_mm(strand);
        (length > LONGEST_MM || length.is_nan()).then_some((strand, length))
    };
    match (0..strands.len()).into_par_iter().find_map_first(too_long) {
        Some((strand, length)) => fault(format!(
            "the {whose} strand {strand} is {length} mm long, more than {LONGEST_MM} mm; give points in mm"
        )),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests;

//! A second opinion on every hit: trees that obvhs builds and walks over the same segments, with the same test of a
//! ray against a segment in their leaves.

use glam::{Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::builder::build_cwbvh;
use obvhs::ray::{Ray, RayHit};
use proptest::prelude::*;
use std::time::Duration;
use strandbench_renderer::accel::{Accel, Hit, LastBlockers, Skip};
use strandbench_renderer::cone::RoundCone;
use strandbench_rng::Rng;
use strandbench_types::StrandSet;

fn vector(rng: &mut Rng, size: f32) -> Vec3 {
    Vec3::new(rng.range(-size, size), rng.range(-size, size), rng.range(-size, size))
}

fn direction(rng: &mut Rng) -> Vec3 {
    vector(rng, 1.0).normalize_or(Vec3::X)
}

/// Curly strands with repeated points, radii that jump so that one end holds the other, strands of one place, and
/// copies of earlier strands.
fn strands(rng: &mut Rng, n: usize, size: f32, radius: f32) -> StrandSet {
    let mut set = StrandSet::new();
    let mut earlier = (Vec::new(), Vec::new());
    for i in 0..n {
        let (mut points, mut radii) = (vec![vector(rng, size)], vec![radius]);
        for k in 0..6 {
            let step = if rng.f32() < 0.15 { 0.0 } else { rng.range(0.0, 0.15 * size) };
            points.push(if i % 11 == 0 { points[0] } else { points[k] + direction(rng) * step });
            radii.push(radius * if rng.f32() < 0.05 { 30.0 } else { rng.range(0.01, 1.0) });
        }
        if i % 7 == 0 && !earlier.0.is_empty() {
            (points, radii) = earlier.clone();
        }
        set.push_tapered(&points, &radii);
        earlier = (points, radii);
    }
    set
}

/// Both of obvhs' trees over all segments of a set.
struct Witness {
    binary: Bvh2,
    compressed: CwBvh,
    /// Segments with strand and start point, in the set's order.
    segments: Vec<(RoundCone, u32, u32)>,
    /// Widening of the boxes, mm: rounding moves a ray by a few 6e-8 of the distances involved, and along an axis
    /// that it does not move on, obvhs lets it stay in a box for 8e6 times the distance to the box' face. The
    /// compressed tree passes boxes that the ray has left, or that begin beyond its end, by 1e-4.
    pad: f32,
}

impl Witness {
    fn new(set: &StrandSet, reach: f32) -> Witness {
        let mut segments = Vec::new();
        for strand in 0..set.len() {
            let range = set.range(strand);
            for i in range.start..range.end - 1 {
                let (p, r) = (&set.points, &set.radii_mm);
                segments.push((RoundCone::new(p[i], r[i], p[i + 1], r[i + 1]), strand as u32, i as u32));
            }
        }
        let pad = (1e-6 * reach).max(2e-4);
        let boxes: Vec<Aabb> = segments
            .iter()
            .map(|(cone, ..)| {
                let (low, high) = cone.bounds();
                Aabb::new(Vec3A::from(low - pad), Vec3A::from(high + pad))
            })
            .collect();
        let binary = build_bvh2(&boxes, BvhBuildParams::medium_build(), &mut Duration::default());
        let compressed = build_cwbvh(&boxes, BvhBuildParams::fast_build(), &mut Duration::default());
        Witness { binary, compressed, segments, pad }
    }

    /// Distance and position along a segment, if the ray may meet it.
    fn meet(&self, segment: u32, (o, d): (Vec3, Vec3), skip: Option<Skip>) -> Option<(f32, f32)> {
        let (cone, strand, point) = self.segments[segment as usize];
        let hit = cone.intersect(o, d, 0.0)?;
        let passes = |s: Skip| s.strand == strand && (point.abs_diff(s.point) <= 1 || hit.t < s.near_mm);
        (!skip.is_some_and(passes)).then_some((hit.t, hit.along))
    }

    /// First hits by the binary and by the compressed tree; the lowest identity of equal ones.
    fn closest(&self, way: (Vec3, Vec3), skip: Option<Skip>) -> [Option<Hit>; 2] {
        let ray = Ray::new_inf(Vec3A::from(way.0), Vec3A::from(way.1));
        let mut best: [(f32, u32, f32); 2] = [(f32::INFINITY, u32::MAX, 0.0); 2];
        let mut offer = |which: usize, segment: u32| {
            let best = &mut best[which];
            if let Some((t, along)) = self.meet(segment, way, skip)
                && (t, segment) < (best.0, best.1)
            {
                *best = (t, segment, along);
            }
            // Equals that come later are still to be seen.
            best.0 + self.pad
        };
        self.binary.ray_traverse(ray, &mut RayHit::none(), |_, i| offer(0, self.binary.primitive_indices[i]));
        self.compressed
            .ray_traverse(ray, &mut RayHit::none(), |_, i| offer(1, self.compressed.primitive_indices[i]));
        best.map(|(t, segment, along)| {
            let (_, strand, point) = self.segments.get(segment as usize)?;
            Some(Hit::Fibre { t, strand: *strand, point: *point, along })
        })
    }

    /// Whether something lies before `tmax`, by both trees.
    fn occluded(&self, way: (Vec3, Vec3), tmax: f32, skip: Option<Skip>) -> [bool; 2] {
        let ray = Ray::new(Vec3A::from(way.0), Vec3A::from(way.1), 0.0, tmax + self.pad);
        let distance = |segment: u32| match self.meet(segment, way, skip) {
            Some((t, _)) if t < tmax => t,
            _ => f32::INFINITY,
        };
        [
            !self.binary.ray_traverse_miss(ray, |_, i| distance(self.binary.primitive_indices[i])),
            !self.compressed.ray_traverse_miss(ray, |_, i| distance(self.compressed.primitive_indices[i])),
        ]
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]
    #[test]
    fn obvhs_trees_find_the_same_hits_to_the_bit(
        seed in any::<u64>(),
        n in 1usize..400,
        size in 1.0f32..120.0,
        thickness in 3e-4f32..0.05,
        far in 1.5f32..8.0,
    ) {
        let mut rng = Rng::keyed(&[seed]);
        let (radius, far) = (thickness * size, far * size);
        let set = strands(&mut rng, n, size, radius);
        let wide = Accel::new(&set, &[]).unwrap();
        let narrow = Accel::new(&set, &[]).unwrap().portable();
        let witness = Witness::new(&set, 4.0 * (size + 30.0 * radius + far));
        let eye = direction(&mut rng) * far;
        let mut hits = 0;
        for k in 0..300 {
            // From one eye or from anywhere, at a fibre or anywhere; some along an axis.
            let o = if k % 3 == 0 { vector(&mut rng, 1.5 * size) } else { eye };
            let aim = set.points[rng.below(set.points.len() as u64) as usize] + vector(&mut rng, radius);
            let target = if k % 4 == 0 { vector(&mut rng, size) } else { aim };
            let (o, d) = match k % 10 {
                9 => (aim - Vec3::Z * far, Vec3::Z),
                _ => (o, (target - o).normalize_or(Vec3::Y)),
            };
            let want = witness.closest((o, d), None);
            prop_assert_eq!(want[0], want[1]);
            prop_assert_eq!(wide.closest(o, d), want[0], "ray {} from {} along {}", k, o, d);
            prop_assert_eq!(narrow.closest(o, d), want[0], "ray {}, portable", k);
            let Some(Hit::Fibre { t, strand, point, .. }) = want[0] else { continue };
            hits += 1;
            // From the hit: a light's ray, which ends, and a bounce, which does not.
            let (at, d) = (o + d * t, direction(&mut rng));
            let skip = Some(Skip { strand, point, near_mm: 4.0 * radius });
            let want = witness.closest((at, d), skip);
            prop_assert_eq!(want[0], want[1]);
            prop_assert_eq!(wide.closest_after(at, d, skip), want[0], "bounce {}", k);
            let tmax = rng.range(0.0, 2.0 * size);
            let want = witness.occluded((at, d), tmax, skip);
            prop_assert_eq!(want[0], want[1]);
            let shadow = |a: &Accel| a.occluded(at, d, tmax, skip, &mut LastBlockers::default());
            prop_assert_eq!((shadow(&wide), shadow(&narrow)), (want[0], want[0]), "shadow {}", k);
        }
        prop_assert!(hits > 60, "{} hits", hits);
    }
}

#[test]
fn a_ray_that_passes_a_segment_meets_its_copies() {
    // Thirty strands of one place, six segments each.
    let mut set = StrandSet::new();
    for _ in 0..30 {
        set.push(&[Vec3::ONE; 7], 0.1);
    }
    let accel = Accel::new(&set, &[]).unwrap();
    let way = (Vec3::new(1.0, 1.0, -5.0), Vec3::Z);
    let witness = Witness::new(&set, 10.0);
    for (skip, strand, point) in [
        (Skip { strand: 0, point: 1, near_mm: 0.0 }, 0, 3),
        (Skip { strand: 0, point: 5, near_mm: 0.0 }, 0, 0),
        (Skip { strand: 0, point: 1, near_mm: 9.0 }, 1, 7),
        (Skip { strand: 1, point: 8, near_mm: 9.0 }, 0, 0),
    ] {
        let want = Some(Hit::Fibre { t: 5.9, strand, point, along: 0.5 });
        assert_eq!(witness.closest(way, Some(skip)), [want; 2]);
        assert_eq!(accel.closest_after(way.0, way.1, Some(skip)), want, "{skip:?}");
    }
}

//! Distance to the nearest of many segments.

use super::Tree;
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// A line segment by its ends, mm.
pub type Segment = [DVec3; 2];

/// Segments, ready for nearest queries.
pub struct SegmentIndex {
    tree: Tree,
    /// In the tree's order.
    segments: Vec<Segment>,
    /// Index of each segment in the list that the tree was built from.
    original: Vec<u32>,
}

impl SegmentIndex {
    /// Builds the tree.
    ///
    /// # Panics
    /// If there are no segments.
    pub fn new(segments: Vec<Segment>) -> SegmentIndex {
        assert!(!segments.is_empty(), "no segments");
        let (tree, original) = Tree::new(segments.len(), |i| {
            let [a, b] = segments[i];
            outward(a.min(b), a.max(b))
        });
        let sorted = original.iter().map(|&i| segments[i as usize]).collect();
        SegmentIndex { tree, segments: sorted, original }
    }

    /// Distance (mm) from `p` to the nearest point of any segment.
    pub fn distance(&self, p: DVec3) -> f64 {
        self.search(p, f64::INFINITY).expect("nothing is out of reach").0.sqrt()
    }

    /// The segment nearest to `p`, by its index in the list given to [`SegmentIndex::new`]; of equally near ones the same
    /// every time.
    pub fn nearest(&self, p: DVec3) -> u32 {
        self.original[self.search(p, f64::INFINITY).expect("nothing is out of reach").1]
    }

    /// Distance (mm) to the nearest segment and its index, as [`SegmentIndex::nearest`] gives it, if there is one
    /// nearer than `within_mm`; the narrower the search, the faster.
    pub fn nearest_within(&self, p: DVec3, within_mm: f64) -> Option<(f64, u32)> {
        let (squared, rank) = self.search(p, within_mm * within_mm)?;
        Some((squared.sqrt(), self.original[rank]))
    }

    /// Squared distance to the nearest segment that is nearer than that of `within`, and its rank.
    fn search(&self, p: DVec3, within: f64) -> Option<(f64, usize)> {
        let (mut best, mut found) = (within, None);
        self.tree.walk(p, within, |rank| {
            let d = point_to_segment_squared(p, &self.segments[rank]);
            if d < best {
                (best, found) = (d, Some(rank));
            }
            best
        });
        found.map(|rank| (best, rank))
    }

    /// Distances from many points, in their order.
    pub fn distances(&self, points: &[DVec3]) -> Vec<f64> {
        points.par_iter().map(|&p| self.distance(p)).collect()
    }
}

/// Squared distance from a point to a segment.
pub fn point_to_segment_squared(p: DVec3, [a, b]: &Segment) -> f64 {
    let u = b - a;
    let uu = u.length_squared();
    let t = if uu > 0.0 { ((p - a).dot(u) / uu).clamp(0.0, 1.0) } else { 0.0 };
    (a + u * t - p).length_squared()
}

/// Corners of a box in single precision that holds the given one.
pub fn outward(lo: DVec3, hi: DVec3) -> [Vec3; 2] {
    [lo.as_vec3().map(f32::next_down), hi.as_vec3().map(f32::next_up)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use strandbench_rng::Rng;

    fn random(seed: u64, n: usize, spread: f32) -> Vec<Segment> {
        (0..n as u64)
            .map(|i| {
                let mut r = Rng::keyed(&[seed, i]);
                let mut v = |s: f32| {
                    DVec3::new(
                        f64::from(r.range(-s, s)),
                        f64::from(r.range(-s, s)),
                        f64::from(r.range(-s, s)),
                    )
                };
                let a = v(spread);
                [a, a + v(3.0)]
            })
            .collect()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(200))]
        #[test]
        fn nearest_is_the_nearest_by_brute_force(
            seed in 0..u64::MAX, n in 1..400usize, flat in any::<bool>(),
            x in -60.0..60.0f64, y in -60.0..60.0f64, z in -60.0..60.0f64,
        ) {
            let mut segments = random(seed, n, 40.0);
            if flat {
                // Many equal middles, and segments without length.
                segments.iter_mut().for_each(|s| { s[0].x = 1.0; s[1] = s[0]; s[0].y = s[0].y.round(); s[1].y = s[0].y; });
            }
            let p = DVec3::new(x, y, z);
            let brute = segments.iter().map(|s| point_to_segment_squared(p, s)).fold(f64::INFINITY, f64::min).sqrt();
            let index = SegmentIndex::new(segments.clone());
            prop_assert_eq!(index.distance(p), brute);
            prop_assert_eq!(point_to_segment_squared(p, &segments[index.nearest(p) as usize]).sqrt(), brute);
        }
    }

    #[test]
    fn distance_to_a_segment_is_to_its_ends_or_its_inside() {
        let s = [DVec3::ZERO, DVec3::new(2.0, 0.0, 0.0)];
        for (p, d) in [((1.0, 3.0), 3.0), ((-3.0, 4.0), 5.0), ((5.0, -4.0), 5.0), ((2.0, 0.0), 0.0)] {
            assert_eq!(point_to_segment_squared(DVec3::new(p.0, p.1, 0.0), &s).sqrt(), d);
        }
        let dot = [DVec3::ONE; 2];
        assert_eq!(point_to_segment_squared(DVec3::new(1.0, 1.0, 4.0), &dot), 9.0);
    }

    #[test]
    fn threads_build_the_same_tree() {
        let segments = random(3, 30_000, 100.0);
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| format!("{:?}", SegmentIndex::new(segments.clone()).tree))
        };
        assert!(run(1) == run(3));
    }
}

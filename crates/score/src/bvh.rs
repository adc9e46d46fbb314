//! Distance to the nearest of many segments: a binary tree of boxes, split at the median.

use crate::visible::Piece;
use glam::DVec3;
use rayon::prelude::*;

/// Segments in a leaf, at most.
const LEAF: usize = 4;

/// Subtrees larger than this are built on other threads.
const PARALLEL: usize = 8192;

#[derive(Clone, Copy, Debug)]
struct Node {
    lo: DVec3,
    hi: DVec3,
    /// Inner node: index of the second child (the first follows the node). Leaf: first segment.
    link: u32,
    /// Segments of a leaf; 0 for an inner node.
    count: u32,
}

const EMPTY: Node = Node { lo: DVec3::INFINITY, hi: DVec3::NEG_INFINITY, link: 0, count: 0 };

impl Node {
    /// Squared distance from a point to the box.
    fn distance_squared(&self, p: DVec3) -> f64 {
        (self.lo - p).max(p - self.hi).max(DVec3::ZERO).length_squared()
    }
}

/// Segments, ready for nearest queries.
pub(crate) struct SegmentIndex {
    nodes: Vec<Node>,
    segments: Vec<Piece>,
    /// Index of each segment in the list that the tree was built from.
    original: Vec<u32>,
}

impl SegmentIndex {
    /// # Panics
    /// If there are no segments.
    pub fn new(segments: Vec<Piece>) -> SegmentIndex {
        assert!(!segments.is_empty() && segments.len() < u32::MAX as usize, "{} segments", segments.len());
        let middles: Vec<DVec3> = segments.iter().map(|[a, b]| (a + b) * 0.5).collect();
        let mut order: Vec<u32> = (0..segments.len() as u32).collect();
        let mut nodes = vec![EMPTY; tree_size(segments.len())];
        build(&segments, &middles, &mut order, &mut nodes, 0, 0);
        let sorted = order.iter().map(|&i| segments[i as usize]).collect();
        SegmentIndex { nodes, segments: sorted, original: order }
    }

    /// Distance (mm) from `p` to the nearest point of any segment.
    pub fn distance(&self, p: DVec3) -> f64 {
        self.search(p).0.sqrt()
    }

    /// The segment nearest to `p`, by its index in the list given to [`SegmentIndex::new`]; of equally near ones the same
    /// every time.
    pub fn nearest(&self, p: DVec3) -> u32 {
        self.original[self.search(p).1]
    }

    /// Squared distance to the nearest segment, and which it is.
    fn search(&self, p: DVec3) -> (f64, usize) {
        let (mut best, mut found) = (f64::INFINITY, 0);
        let mut stack = [(0u32, 0.0); 64];
        let mut top = 1;
        while top > 0 {
            top -= 1;
            let (i, d) = stack[top];
            if d >= best {
                continue;
            }
            let node = &self.nodes[i as usize];
            if node.count > 0 {
                for i in node.link as usize..(node.link + node.count) as usize {
                    let d = point_to_segment_squared(p, &self.segments[i]);
                    if d < best {
                        (best, found) = (d, i);
                    }
                }
                continue;
            }
            let (near, far) = (i + 1, node.link);
            let dn = self.nodes[near as usize].distance_squared(p);
            let df = self.nodes[far as usize].distance_squared(p);
            let ((near, dn), (far, df)) =
                if dn <= df { ((near, dn), (far, df)) } else { ((far, df), (near, dn)) };
            stack[top] = (far, df);
            stack[top + 1] = (near, dn);
            top += 2;
        }
        (best, found)
    }

    /// Distances from many points, in their order.
    pub fn distances(&self, points: &[DVec3]) -> Vec<f64> {
        points.par_iter().map(|&p| self.distance(p)).collect()
    }
}

/// Squared distance from a point to a segment.
pub(crate) fn point_to_segment_squared(p: DVec3, [a, b]: &Piece) -> f64 {
    let u = b - a;
    let uu = u.length_squared();
    let t = if uu > 0.0 { ((p - a).dot(u) / uu).clamp(0.0, 1.0) } else { 0.0 };
    (a + u * t - p).length_squared()
}

/// Nodes of a tree over `n` segments: known ahead, because splits are at the median.
fn tree_size(n: usize) -> usize {
    if n <= LEAF { 1 } else { 1 + tree_size(n / 2) + tree_size(n - n / 2) }
}

/// Builds the tree over `order` into `nodes`, which start at `node_base` of the whole tree, as `order` does
/// at `order_base` of the whole order.
fn build(
    segments: &[Piece],
    middles: &[DVec3],
    order: &mut [u32],
    nodes: &mut [Node],
    node_base: u32,
    order_base: u32,
) {
    let n = order.len();
    let (mut lo, mut hi) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for &i in order.iter() {
        let [a, b] = segments[i as usize];
        lo = lo.min(a.min(b));
        hi = hi.max(a.max(b));
    }
    if n <= LEAF {
        nodes[0] = Node { lo, hi, link: order_base, count: n as u32 };
        return;
    }
    let size = hi - lo;
    let axis = if size.x >= size.y && size.x >= size.z { 0 } else { 1 + usize::from(size.z > size.y) };
    let key = |i: &u32| middles[*i as usize][axis];
    order.select_nth_unstable_by(n / 2, |a, b| key(a).total_cmp(&key(b)).then(a.cmp(b)));
    let (left, right) = order.split_at_mut(n / 2);
    let (head, rest) = nodes.split_first_mut().expect("tree_size counted this node");
    let left_size = tree_size(n / 2);
    let (left_nodes, right_nodes) = rest.split_at_mut(left_size);
    let right_base = node_base + 1 + left_size as u32;
    *head = Node { lo, hi, link: right_base, count: 0 };
    let middle = order_base + (n / 2) as u32;
    let mut first = || build(segments, middles, left, left_nodes, node_base + 1, order_base);
    let mut second = || build(segments, middles, right, right_nodes, right_base, middle);
    if n > PARALLEL {
        rayon::join(first, second);
    } else {
        first();
        second();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use strandbench_rng::Rng;

    fn random(seed: u64, n: usize, spread: f32) -> Vec<Piece> {
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
            pool.install(|| format!("{:?}", SegmentIndex::new(segments.clone()).nodes))
        };
        assert!(run(1) == run(3));
    }
}

//! Nearest points: a kd-tree over fixed points.

use glam::DVec3;

const LEAF: usize = 8;

/// A balanced kd-tree. Among equally near points the one with the lower index wins, so that answers do not depend
/// on the tree's shape.
#[derive(Clone, Debug)]
pub struct PointTree {
    /// Points in the tree's order.
    points: Vec<DVec3>,
    /// Index of each before ordering.
    index: Vec<u32>,
    /// Splitting axis of the node that spans a range, found by its middle.
    axis: Vec<u8>,
}

impl PointTree {
    /// A tree over `points`, at most 2^32 of them.
    ///
    /// # Panics
    /// If a coordinate is not finite.
    pub fn new(points: &[DVec3]) -> PointTree {
        assert!(points.iter().all(|p| p.is_finite()), "points of a tree are finite");
        let mut order: Vec<u32> = (0..points.len() as u32).collect();
        let mut axis = vec![0u8; points.len()];
        split(points, &mut order, 0, &mut axis);
        PointTree { points: order.iter().map(|&i| points[i as usize]).collect(), index: order, axis }
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// The point nearest to `query` within `radius`: its index and squared distance.
    pub fn nearest(&self, query: DVec3, radius: f64) -> Option<(usize, f64)> {
        let mut best = [(radius * radius, u32::MAX)];
        self.search(query, 0, self.len(), &mut best);
        (best[0].1 != u32::MAX).then(|| (best[0].1 as usize, best[0].0))
    }

    /// Fills `out` with the nearest points as (squared distance, index), nearest first; entries beyond the number
    /// of points are (infinity, `u32::MAX`).
    pub fn k_nearest(&self, query: DVec3, out: &mut [(f64, u32)]) {
        out.fill((f64::INFINITY, u32::MAX));
        self.search(query, 0, self.len(), out);
    }

    fn search(&self, query: DVec3, lo: usize, hi: usize, best: &mut [(f64, u32)]) {
        if hi - lo <= LEAF {
            for i in lo..hi {
                offer(best, (self.points[i].distance_squared(query), self.index[i]));
            }
            return;
        }
        let middle = lo + (hi - lo) / 2;
        let a = self.axis[middle] as usize;
        let gap = query[a] - self.points[middle][a];
        offer(best, (self.points[middle].distance_squared(query), self.index[middle]));
        let (near, far) =
            if gap < 0.0 { ((lo, middle), (middle + 1, hi)) } else { ((middle + 1, hi), (lo, middle)) };
        self.search(query, near.0, near.1, best);
        if gap * gap <= best[best.len() - 1].0 {
            self.search(query, far.0, far.1, best);
        }
    }
}

fn offer(best: &mut [(f64, u32)], candidate: (f64, u32)) {
    let less = |a: &(f64, u32), b: &(f64, u32)| a.0 < b.0 || (a.0 == b.0 && a.1 < b.1);
    let last = best.len() - 1;
    if !less(&candidate, &best[last]) {
        return;
    }
    best[last] = candidate;
    for i in (0..last).rev() {
        if less(&best[i + 1], &best[i]) {
            best.swap(i, i + 1);
        }
    }
}

fn split(points: &[DVec3], order: &mut [u32], offset: usize, axis: &mut [u8]) {
    if order.len() <= LEAF {
        return;
    }
    let (mut lo, mut hi) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for &i in order.iter() {
        lo = lo.min(points[i as usize]);
        hi = hi.max(points[i as usize]);
    }
    let extent = hi - lo;
    let a = if extent.x >= extent.y && extent.x >= extent.z {
        0
    } else if extent.y >= extent.z {
        1
    } else {
        2
    };
    let middle = order.len() / 2;
    order.select_nth_unstable_by(middle, |&i, &j| {
        points[i as usize][a].total_cmp(&points[j as usize][a]).then(i.cmp(&j))
    });
    axis[offset + middle] = a as u8;
    let (left, right) = order.split_at_mut(middle);
    split(points, left, offset, axis);
    split(points, &mut right[1..], offset + middle + 1, axis);
}

#[cfg(test)]
mod tests {
    use super::*;
    use strandbench_rng::Rng;

    #[test]
    fn answers_are_those_of_brute_force_ties_included() {
        for n in [0usize, 1, 7, 9, 300] {
            let mut rng = Rng::keyed(&[5, n as u64]);
            // A coarse lattice, so that many distances tie.
            let mut at = || f64::from((rng.f32() * 6.0).floor());
            let points: Vec<DVec3> = (0..n).map(|_| DVec3::new(at(), at(), at())).collect();
            let tree = PointTree::new(&points);
            for _ in 0..200 {
                let q = DVec3::new(at() + 0.5, at(), at() - 0.5);
                let mut all: Vec<(f64, u32)> =
                    points.iter().enumerate().map(|(i, p)| (p.distance_squared(q), i as u32)).collect();
                all.sort_by(|a, b| a.partial_cmp(b).unwrap());
                let mut got = [(0.0, 0); 5];
                tree.k_nearest(q, &mut got);
                for k in 0..5 {
                    assert_eq!(got[k], all.get(k).copied().unwrap_or((f64::INFINITY, u32::MAX)), "{n} {k}");
                }
                let near = all.first().filter(|p| p.0 < 0.49).map(|&(d, i)| (i as usize, d));
                assert_eq!(tree.nearest(q, 0.7), near);
            }
        }
    }
}

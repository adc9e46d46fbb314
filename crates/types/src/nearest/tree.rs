//! A tree of boxes over anything that has one, for nearest and range queries.

use glam::{DVec3, Vec3, Vec3A};
use rayon::prelude::*;
use std::ops::Range;

/// Members of a leaf, at most.
const LEAF: usize = 6;

/// Bits of an axis in the order along which members are sorted.
const BITS: u32 = 21;

/// Members from which on a tree's halves are built side by side.
const PARALLEL: usize = 1 << 14;

/// Deepest stack of a walk: one level for each bit of the sorting key, and halving below that.
const STACK: usize = 3 * BITS as usize + 34;

/// What lies below a node.
#[derive(Clone, Copy, Debug)]
struct Node {
    /// Inner node: index of the second child (the first follows the node). Leaf: rank of its first member.
    link: u32,
    /// Members of a leaf; 0 for an inner node.
    count: u32,
}

/// Lowest and highest corner.
#[derive(Clone, Copy, Debug)]
struct Bounds {
    lo: Vec3A,
    hi: Vec3A,
}

/// A point in single precision, and by how much it may be off.
#[derive(Clone, Copy)]
struct Query {
    p: Vec3A,
    slack: Vec3A,
}

impl Query {
    #[inline]
    fn new(p: DVec3) -> Query {
        let rounded = p.as_vec3a();
        Query { p: rounded, slack: f32::EPSILON * rounded.abs() }
    }
}

/// More than rounding takes off a squared distance: of a difference, of the slack off it, of squares and their sum.
const SHORT: f32 = 1.0 - 8.0 * f32::EPSILON;

/// A distance whose square single precision still holds, mm.
const FAR_MM: Vec3A = Vec3A::splat(1e18);

impl Bounds {
    const NONE: Bounds = Bounds { lo: Vec3A::INFINITY, hi: Vec3A::NEG_INFINITY };

    fn grow(&mut self, other: Bounds) {
        *self = Bounds { lo: self.lo.min(other.lo), hi: self.hi.max(other.hi) };
    }

    /// A bound of the squared distance from below, short of it by rounding alone (and beyond [`FAR_MM`]): in single
    /// precision a box takes half the time.
    #[inline]
    fn distance_squared(&self, q: Query) -> f32 {
        let outside = (self.lo - q.p).max(q.p - self.hi) - q.slack;
        outside.clamp(Vec3A::ZERO, FAR_MM).length_squared() * SHORT
    }
}

/// The boxes of members in the tree's own order, a node with its box apart: a walk looks into many more boxes than nodes.
#[derive(Debug, Default)]
pub struct Tree {
    nodes: Vec<Node>,
    bounds: Vec<Bounds>,
}

impl Tree {
    /// Builds the tree over `n` boxes (lowest and highest corner, finite) and says in which order it keeps the
    /// members: Morton order of the boxes' middles, equal ones by index.
    ///
    /// # Panics
    /// If there are 2^32 members or more.
    pub fn new(n: usize, bounds: impl Fn(usize) -> [Vec3; 2] + Sync) -> (Tree, Vec<u32>) {
        assert!(u32::try_from(n).is_ok(), "{n} members");
        if n == 0 {
            return (Tree::default(), Vec::new());
        }
        let keyed = keyed(n, &bounds);
        let (_, size, pieces) = Pieces::build(&keyed, 0, &bounds);
        let mut tree = Tree { nodes: Vec::with_capacity(size), bounds: Vec::with_capacity(size) };
        pieces.put_into(&mut tree);
        (tree, keyed.into_par_iter().map(|k| k.1).collect())
    }

    /// A value of each node: of a leaf from the ranks of its members, of any other from its two children's. `blank` stands
    /// where none is known yet.
    pub fn fold<T: Copy + Send>(
        &self,
        blank: T,
        leaf: impl Fn(Range<usize>) -> T + Sync,
        join: impl Fn(&T, &T) -> T + Sync,
    ) -> Vec<T> {
        let mut found = vec![blank; self.nodes.len()];
        if !found.is_empty() {
            self.fold_below(0, &mut found, &leaf, &join);
        }
        found
    }

    /// The values of a node, `at`, and of all below it, which follow it.
    fn fold_below<T: Copy + Send>(
        &self,
        at: usize,
        found: &mut [T],
        leaf: &(impl Fn(Range<usize>) -> T + Sync),
        join: &(impl Fn(&T, &T) -> T + Sync),
    ) -> T {
        let node = self.nodes[at];
        let first = node.link as usize;
        let value = if node.count > 0 {
            leaf(first..first + node.count as usize)
        } else {
            let parallel = found.len() >= PARALLEL;
            let (left, right) = found[1..].split_at_mut(first - at - 1);
            let (a, b) = if parallel {
                rayon::join(
                    || self.fold_below(at + 1, left, leaf, join),
                    || self.fold_below(first, right, leaf, join),
                )
            } else {
                (self.fold_below(at + 1, left, leaf, join), self.fold_below(first, right, leaf, join))
            };
            join(&a, &b)
        };
        found[0] = value;
        value
    }

    /// Visits members from near boxes to far ones: `visit` gets a member's rank and returns the squared distance
    /// beyond which boxes no longer matter, which is `within` at first.
    pub fn walk(&self, p: DVec3, within: f64, mut visit: impl FnMut(usize) -> f64) {
        self.walk_while(p, |rank, limit| *limit = visit(rank), within);
    }

    /// As [`Tree::walk`], with a test of each box in place of a limit; gives the state as it is in the end.
    pub fn walk_while<S: Limit>(&self, p: DVec3, mut visit: impl FnMut(usize, &mut S), mut state: S) -> S {
        let Some(root) = self.bounds.first() else { return state };
        let q = Query::new(p);
        let mut stack = [(0u32, 0.0f32); STACK];
        stack[0] = (0, root.distance_squared(q));
        let mut top = 1;
        while top > 0 {
            top -= 1;
            let (i, d) = stack[top];
            if !state.matters(i, d) {
                continue;
            }
            let node = &self.nodes[i as usize];
            if node.count > 0 {
                for rank in node.link..node.link + node.count {
                    visit(rank as usize, &mut state);
                }
                continue;
            }
            let (a, b) = (i + 1, node.link);
            let da = self.bounds[a as usize].distance_squared(q);
            let db = self.bounds[b as usize].distance_squared(q);
            let (near, far) = if da <= db { ((a, da), (b, db)) } else { ((b, db), (a, da)) };
            for child in [far, near] {
                if state.matters(child.0, child.1) {
                    stack[top] = child;
                    top += 1;
                }
            }
        }
        state
    }

    /// Appends the subtree over `keyed`, whose first member has rank `base`, and returns its box.
    fn build(
        &mut self,
        keyed: &[(u64, u32)],
        base: usize,
        bounds: &(impl Fn(usize) -> [Vec3; 2] + Sync),
    ) -> Bounds {
        let at = self.nodes.len();
        let mut all = Bounds::NONE;
        self.bounds.push(all);
        if keyed.len() <= LEAF {
            for k in keyed {
                let [lo, hi] = bounds(k.1 as usize).map(Vec3A::from);
                all.grow(Bounds { lo, hi });
            }
            self.nodes.push(Node { link: base as u32, count: keyed.len() as u32 });
            self.bounds[at] = all;
            return all;
        }
        let middle = halves(keyed);
        self.nodes.push(Node { link: 0, count: 0 });
        let (left, right) = keyed.split_at(middle);
        all.grow(self.build(left, base, bounds));
        self.nodes[at].link = self.nodes.len() as u32;
        all.grow(self.build(right, base + middle, bounds));
        self.bounds[at] = all;
        all
    }
}

/// Where to cut members, of which there are two or more, in two: where the highest bit in which their keys differ changes.
fn halves(keyed: &[(u64, u32)]) -> usize {
    match (keyed[0].0 ^ keyed[keyed.len() - 1].0).checked_ilog2() {
        None => keyed.len() / 2,
        Some(bit) => keyed.partition_point(|k| k.0 >> bit & 1 == 0),
    }
}

/// Subtrees built side by side, each by itself, so that every node is moved but once.
enum Pieces {
    One(Tree),
    Both(Bounds, Box<[Pieces; 2]>),
}

impl Pieces {
    /// The box, the number of nodes, and the pieces of the tree over `keyed`, whose first member has rank `base`.
    fn build(
        keyed: &[(u64, u32)],
        base: usize,
        bounds: &(impl Fn(usize) -> [Vec3; 2] + Sync),
    ) -> (Bounds, usize, Pieces) {
        if keyed.len() < PARALLEL {
            let mut own = Tree::default();
            let all = own.build(keyed, base, bounds);
            return (all, own.nodes.len(), Pieces::One(own));
        }
        let middle = halves(keyed);
        let (left, right) = keyed.split_at(middle);
        let (a, b) =
            rayon::join(|| Pieces::build(left, base, bounds), || Pieces::build(right, base + middle, bounds));
        let mut all = a.0;
        all.grow(b.0);
        (all, 1 + a.1 + b.1, Pieces::Both(all, Box::new([a.2, b.2])))
    }

    /// Appends the pieces in the order of the whole tree.
    fn put_into(self, tree: &mut Tree) {
        let at = tree.nodes.len();
        match self {
            Pieces::One(own) => {
                // Links to nodes were counted from the piece's own first node; those of leaves are ranks.
                let link = |n: Node| n.link + if n.count == 0 { at as u32 } else { 0 };
                tree.nodes.extend(own.nodes.into_iter().map(|n| Node { link: link(n), ..n }));
                tree.bounds.extend(own.bounds);
            }
            Pieces::Both(all, halves) => {
                tree.nodes.push(Node { link: 0, count: 0 });
                tree.bounds.push(all);
                let [left, right] = *halves;
                left.put_into(tree);
                tree.nodes[at].link = tree.nodes.len() as u32;
                right.put_into(tree);
            }
        }
    }
}

/// What decides whether a box, at a squared distance or farther, can still hold something of interest.
pub trait Limit {
    /// Whether the box of `node` (its index, as [`Tree::fold`] counts) has to be looked into.
    fn matters(&self, node: u32, distance_squared: f32) -> bool;
}

impl Limit for f64 {
    #[inline]
    fn matters(&self, _: u32, distance_squared: f32) -> bool {
        f64::from(distance_squared) <= *self
    }
}

/// Members with their Morton keys, in ascending order of them; equal ones by index.
pub(super) fn keyed(n: usize, bounds: &(impl Fn(usize) -> [Vec3; 2] + Sync)) -> Vec<(u64, u32)> {
    let join = |a: [Vec3; 2], b: [Vec3; 2]| [a[0].min(b[0]), a[1].max(b[1])];
    let none = [Vec3::INFINITY, Vec3::NEG_INFINITY];
    let all = (0..n).into_par_iter().map(bounds).reduce(|| none, join);
    let (lo, size) = (all[0].as_dvec3(), all[1].as_dvec3() - all[0].as_dvec3());
    let scale = DVec3::splat(f64::from((1u32 << BITS) - 1)) / size.max(DVec3::splat(f64::MIN_POSITIVE));
    let mut keyed: Vec<(u64, u32)> = (0..n)
        .into_par_iter()
        .map(|i| {
            let [a, b] = bounds(i);
            let q = ((a.as_dvec3() + b.as_dvec3()) * 0.5 - lo) * scale;
            (spread(q.x) << 2 | spread(q.y) << 1 | spread(q.z), i as u32)
        })
        .collect();
    keyed.par_sort_unstable();
    keyed
}

/// The low [`BITS`] bits of a coordinate, three apart.
fn spread(v: f64) -> u64 {
    let mut x = v as u64 & ((1 << BITS) - 1);
    for (shift, mask) in [
        (32, 0x001f_0000_0000_ffff),
        (16, 0x001f_0000_ff00_00ff),
        (8, 0x100f_00f0_0f00_f00f),
        (4, 0x10c3_0c30_c30c_30c3),
        (2, 0x1249_2492_4924_9249),
    ] {
        x = (x | x << shift) & mask;
    }
    x
}

#[cfg(test)]
mod tests;

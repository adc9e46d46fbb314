//! Building the tree from the top: each node's range of primitives is split in two by the surface area heuristic
//! over bins of their boxes' centres (Wald 2007), the part with the largest area first, until there are eight.

use super::bins::{Binning, Bins, Bounds, Prim, SURFACE};
use super::node::{LEAF, Node, WIDTH};
use rayon::prelude::*;

/// A run of primitives with what is known of it.
#[derive(Clone, Copy, Debug)]
struct Part {
    from: usize,
    to: usize,
    bounds: Bounds,
    centres: Bounds,
    /// Splits above it.
    level: u32,
    /// Whether it is known to hold few copies of any primitive.
    distinct: bool,
}

impl Part {
    fn of(prims: &[Prim], level: u32) -> Part {
        let (mut bounds, mut centres) = (Bounds::NONE, Bounds::NONE);
        for p in prims {
            bounds.add_prim(p);
            let c = p.centre();
            centres.add(c, c);
        }
        Part { from: 0, to: prims.len(), bounds, centres, level, distinct: false }
    }

    fn len(&self) -> usize {
        self.to - self.from
    }
}

/// Splits by area above a part after which it is halved by number: what is left then takes at most 28 more.
const MOST_SPLITS: u32 = 40;
/// Parts larger than this are binned and built on all threads.
const PARALLEL: usize = 32_768;

/// Moves primitives for which `upper` holds behind the others; the number of the others.
fn partition(prims: &mut [Prim], upper: impl Fn(&Prim) -> bool) -> usize {
    let (mut i, mut j) = (0, prims.len());
    loop {
        while i < j && !upper(&prims[i]) {
            i += 1;
        }
        while i < j && upper(&prims[j - 1]) {
            j -= 1;
        }
        if i == j {
            return i;
        }
        prims.swap(i, j - 1);
        i += 1;
        j -= 1;
    }
}

/// What the builder asks of primitives beyond their boxes: bits that are equal for coincident ones alone.
pub(super) type Key<'a> = dyn Fn(&Prim) -> [u32; 8] + Sync + 'a;

/// Copies of one strand that are kept: a ray that leaves a segment passes it and its two neighbours, not a fourth.
const OF_ONE: u32 = 4;

/// Moves primitives that coincide with others to the end, but for those that can be the answer to a ray; the number
/// of the others.
///
/// Coincident primitives fall into leaves that every ray to one of them would have to test. The answer is the lowest
/// identity that the ray does not pass ([`super::Skip`]): one of the lowest [`OF_ONE`] of the first strand, or, where
/// the ray passes all of that strand, the lowest of the second.
fn without_copies(prims: &mut [Prim], key: &Key) -> usize {
    let mut keyed: Vec<([u32; 8], Prim)> = prims.iter().map(|p| (key(p), *p)).collect();
    keyed.par_sort_unstable_by_key(|(key, p)| (*key, p.owner, p.item));
    let mut kept = 0;
    let mut copies = Vec::new();
    for same in keyed.chunk_by(|a, b| a.0 == b.0) {
        let first = same[0].1.owner;
        let (mut of_first, mut of_second) = (0, 0);
        for &(_, p) in same {
            let (count, most) = if p.owner == first { (&mut of_first, OF_ONE) } else { (&mut of_second, 1) };
            if *count < most {
                *count += 1;
                prims[kept] = p;
                kept += 1;
            } else {
                copies.push(p);
            }
        }
    }
    prims[kept..].copy_from_slice(&copies);
    kept
}

/// Splits a part of at least two primitives, of which `prims` are the primitives: its halves, or the part itself
/// without copies.
fn split(prims: &mut [Prim], part: &Part, key: &Key) -> (Part, Option<Part>) {
    let mid = if part.len() <= WIDTH {
        // Small enough for a leaf, so it is here because it is mixed.
        partition(prims, |p| p.owner & SURFACE != 0)
    } else {
        let binning = Binning::new(&part.centres, part.len());
        let bins = || {
            if part.len() > 4 * PARALLEL {
                prims.par_chunks(PARALLEL).map(|c| binning.fill(c)).reduce(|| Bins::empty(0), Bins::merged)
            } else {
                binning.fill(prims)
            }
        };
        match (part.level < MOST_SPLITS).then(bins).as_ref().and_then(Bins::cheapest) {
            Some((axis, k)) => partition(prims, |p| binning.of(p.centre())[axis] >= k),
            None => {
                if !part.distinct {
                    let kept = without_copies(prims, key);
                    return (Part { to: part.from + kept, distinct: true, ..*part }, None);
                }
                halve(prims, &part.centres)
            }
        }
    };
    let half = |from: usize, to: usize| {
        let p = Part::of(&prims[from..to], part.level + 1);
        assert!(from < to, "a split of {} left one side empty", part.len());
        Part { from: part.from + from, to: part.from + to, distinct: part.distinct, ..p }
    };
    (half(0, mid), Some(half(mid, prims.len())))
}

/// By number along the longest axis of the centres.
fn halve(prims: &mut [Prim], centres: &Bounds) -> usize {
    let extent = |k: usize| centres.high[k] - centres.low[k];
    let axis = (0..3).fold(0, |a, b| if extent(b) > extent(a) { b } else { a });
    let half = prims.len() / 2;
    prims.select_nth_unstable_by(half, |a, b| {
        a.centre()[axis].total_cmp(&b.centre()[axis]).then((a.owner, a.item).cmp(&(b.owner, b.item)))
    });
    half
}

/// The tree over `prims`, which it reorders, and its levels: the root first. A child that is a leaf has in
/// `children` the place of its first primitive with [`LEAF`] set, and their number in `counts`.
pub(super) fn build(prims: &mut [Prim], key: &Key) -> (Vec<Node>, usize) {
    let whole = Part::of(prims, 0);
    let mut nodes = Vec::new();
    let levels = subtree(prims, whole, key, &mut nodes);
    (nodes, levels)
}

/// Whether a part becomes a leaf.
fn is_leaf(prims: &[Prim]) -> bool {
    let first = prims[0].owner & SURFACE;
    prims.len() <= WIDTH && prims.iter().all(|p| p.owner & SURFACE == first)
}

/// The parts that become the children of one node; `prims` starts with the first of `whole`.
fn children(prims: &mut [Prim], whole: Part, key: &Key) -> Vec<Part> {
    let start = whole.from;
    let mut parts = vec![whole];
    while parts.len() < WIDTH {
        let mut widest: Option<usize> = None;
        for (i, p) in parts.iter().enumerate() {
            if !is_leaf(&prims[p.from - start..p.to - start])
                && widest.is_none_or(|w| p.bounds.half_area() > parts[w].bounds.half_area())
            {
                widest = Some(i);
            }
        }
        let Some(i) = widest else { break };
        let part = parts[i];
        let (low, high) = split(&mut prims[part.from - start..part.to - start], &part, key);
        parts[i] = low;
        if let Some(high) = high {
            parts.insert(i + 1, high);
        }
    }
    parts
}

/// Appends the subtree over `whole` to `nodes`; its levels. `prims` starts with the first of `whole`.
fn subtree(prims: &mut [Prim], whole: Part, key: &Key, nodes: &mut Vec<Node>) -> usize {
    let parts = children(prims, whole, key);
    let root = nodes.len();
    let mut node = Node::default();
    let mut inner = Vec::new();
    let (mut rest, mut at) = (prims, whole.from);
    for (k, p) in parts.iter().enumerate() {
        for axis in 0..3 {
            node.planes[axis][0][k] = p.bounds.low[axis];
            node.planes[axis][1][k] = p.bounds.high[axis];
        }
        let (own, after) = rest[p.from - at..].split_at_mut(p.len());
        (rest, at) = (after, p.to);
        if is_leaf(own) {
            node.children[k] = LEAF | p.from as u32;
            node.counts[k] = p.len() as u8;
        } else {
            inner.push((k, own, *p));
        }
    }
    nodes.push(node);
    let mut levels = 0;
    if whole.len() <= PARALLEL {
        for (k, own, p) in inner {
            nodes[root].children[k] = nodes.len() as u32;
            levels = levels.max(subtree(own, p, key, nodes));
        }
        return levels + 1;
    }
    let make = |(k, own, p): (usize, &mut [Prim], Part)| {
        let mut made = Vec::new();
        let levels = subtree(own, p, key, &mut made);
        (k, made, levels)
    };
    let made: Vec<(usize, Vec<Node>, usize)> = inner.into_par_iter().map(make).collect();
    for (k, subtree, deep) in made {
        let at = nodes.len() as u32;
        nodes[root].children[k] = at;
        levels = levels.max(deep);
        nodes.extend(subtree.into_iter().map(|mut n| {
            for c in 0..WIDTH {
                if n.counts[c] == 0 {
                    n.children[c] += at;
                }
            }
            n
        }));
    }
    levels + 1
}

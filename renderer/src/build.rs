//! Building the BVH: obvhs' clustering, or halving by the median where clustering would make a chain.

use glam::Vec3A;
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::node::Bvh2Node;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::bvh2_to_cwbvh::bvh2_to_cwbvh;
use obvhs::ploc::PlocBuilder;
use rayon::prelude::*;

const PRIMITIVES_PER_LEAF: u32 = 3;
/// Deepest binary tree that is handed to obvhs' conversion, which calls itself once a level.
const DEEPEST: usize = 200;
/// Cells an axis, and centres in one cell, above which clustering is not tried: boxes around one centre are
/// merged one pair a pass, in a time that grows with the square of their number.
const CELLS: f32 = 65_536.0;
const CROWD: usize = 256;

/// The wide tree over `boxes`, at least one.
pub(crate) fn build(boxes: &[Aabb]) -> CwBvh {
    let convert = |binary: Bvh2| bvh2_to_cwbvh(&binary, PRIMITIVES_PER_LEAF, true, false);
    let binary = (!crowded(boxes)).then(|| clustered(boxes)).filter(|b| depth(b) <= DEEPEST);
    if let Some(wide) = binary.map(convert).filter(|w| wide_depth(w) <= MAX_DEPTH) {
        return wide;
    }
    let wide = convert(halved(boxes));
    assert!(
        wide_depth(&wide) <= MAX_DEPTH,
        "halving {} boxes gave {} levels",
        boxes.len(),
        wide_depth(&wide)
    );
    wide
}

/// Levels that obvhs' traversal stack holds.
const MAX_DEPTH: usize = 31;

fn wide_depth(bvh: &CwBvh) -> usize {
    let mut deepest = 0;
    let mut open = vec![(0u32, 1usize)];
    while let Some((at, level)) = open.pop() {
        deepest = deepest.max(level);
        let node = &bvh.nodes[at as usize];
        for child in 0..8 {
            if !node.is_child_empty(child) && !node.is_leaf(child) {
                open.push((node.child_node_index(child), level + 1));
            }
        }
    }
    deepest
}

fn clustered(boxes: &[Aabb]) -> Bvh2 {
    let p = BvhBuildParams::medium_build();
    let indices = (0..boxes.len() as u32).collect();
    let mut bvh = PlocBuilder::with_capacity(boxes.len()).build(
        p.ploc_search_distance,
        boxes,
        indices,
        p.sort_precision,
        p.search_depth_threshold,
    );
    if depth(&bvh) <= DEEPEST {
        ReinsertionOptimizer::default().run(&mut bvh, p.reinsertion_batch_ratio, None);
    }
    bvh
}

fn union(boxes: impl Iterator<Item = Aabb>) -> Aabb {
    boxes.reduce(|a, b| a.union(&b)).unwrap_or(Aabb::new(Vec3A::ZERO, Vec3A::ZERO))
}

/// Whether one cell of a fine grid holds the centres of many boxes.
fn crowded(boxes: &[Aabb]) -> bool {
    let all = union(boxes.iter().copied());
    let scale = CELLS / (all.max - all.min).max_element().max(f32::MIN_POSITIVE);
    let mut cells: Vec<[u32; 3]> = boxes
        .par_iter()
        .map(|b| (((b.min + b.max) * 0.5 - all.min) * scale).to_array().map(|v| v as u32))
        .collect();
    cells.par_sort_unstable();
    cells.chunk_by(|a, b| a == b).any(|run| run.len() > CROWD)
}

/// Levels of the tree; no recursion.
fn depth(bvh: &Bvh2) -> usize {
    let mut deepest = 0;
    let mut open = vec![(0usize, 1usize)];
    while let Some((at, level)) = open.pop() {
        deepest = deepest.max(level);
        if let Some(node) = bvh.nodes.get(at).filter(|n| !n.is_leaf()) {
            let first = node.first_index as usize;
            open.extend([(first, level + 1), (first + 1, level + 1)]);
        }
    }
    deepest
}

/// Halves by number along the longest axis of the centres: log2 n levels, whatever the boxes.
fn halved(boxes: &[Aabb]) -> Bvh2 {
    let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
    let centre = |i: u32| boxes[i as usize].min + boxes[i as usize].max;
    let mut nodes = vec![Bvh2Node::default()];
    let mut open = vec![(0usize, 0usize, boxes.len())];
    while let Some((at, from, to)) = open.pop() {
        let part = &mut order[from..to];
        let bounds = union(part.iter().map(|&i| boxes[i as usize]));
        if part.len() == 1 {
            nodes[at] = Bvh2Node::new(bounds, 1, from as u32);
            continue;
        }
        let spread = union(part.iter().map(|&i| Aabb::new(centre(i), centre(i))));
        let axis = (spread.max - spread.min).max_position();
        let half = part.len() / 2;
        part.select_nth_unstable_by(half, |&a, &b| {
            centre(a)[axis].total_cmp(&centre(b)[axis]).then(a.cmp(&b))
        });
        let first = nodes.len();
        nodes.extend([Bvh2Node::default(); 2]);
        nodes[at] = Bvh2Node::new(bounds, 0, first as u32);
        open.extend([(first, from, from + half), (first + 1, from + half, to)]);
    }
    let max_depth = usize::BITS as usize - boxes.len().leading_zeros() as usize + 2;
    Bvh2 {
        nodes,
        primitive_indices: order,
        children_are_ordered_after_parents: true,
        max_depth,
        ..Bvh2::default()
    }
}

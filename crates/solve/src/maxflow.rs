//! Maximum flow and minimum cut on sparse graphs (Boykov and Kolmogorov, PAMI 2004).
//!
//! Two search trees grow from the terminals over arcs that are not full; where they touch, flow is pushed
//! along the path, and the nodes that this cuts off look for another parent or fall out of their tree. Nodes
//! keep their distance to the terminal with a time stamp, so that near parents are preferred (section 3.2.2 of
//! the paper).

mod orphans;

use std::collections::VecDeque;

use crate::{Cancelled, SolveError};

const NONE: u32 = u32::MAX;
/// Parent of a node that hangs on its terminal.
const TERMINAL: u32 = u32::MAX - 1;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Tree {
    Free,
    Source,
    Sink,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    /// First arc that leaves the node.
    first: u32,
    /// Arc from the node to its parent, [`TERMINAL`], or [`NONE`] for an orphan or a free node.
    parent: u32,
    /// When `distance` was last known to be right.
    stamp: u32,
    distance: u32,
    tree: Tree,
    queued: bool,
    /// What can still flow from the source to the node if positive, from the node to the sink if negative.
    terminal: f64,
}

#[derive(Clone, Copy, Debug)]
struct Arc {
    head: u32,
    /// Next arc that leaves the same node.
    next: u32,
    residual: f64,
}

/// A graph whose maximum flow from the source to the sink is wanted; arcs come in pairs, `a ^ 1` being the
/// reverse of `a`.
///
/// Capacities are f64, infinity included, and must not be NaN or negative. A path's narrowest arc ends at a
/// residual of exactly 0, so rounding can spoil the value of the flow by parts in 10^16 an augmentation, never
/// its end.
#[derive(Debug, Default)]
pub struct MaxFlow {
    nodes: Vec<Node>,
    arcs: Vec<Arc>,
    flow: f64,
    active: VecDeque<u32>,
    orphans: VecDeque<u32>,
    time: u32,
}

impl MaxFlow {
    /// A graph of `nodes` nodes without arcs.
    pub fn new(nodes: usize) -> MaxFlow {
        let mut graph = MaxFlow::default();
        graph.reset(nodes);
        graph
    }

    /// Forgets everything but the memory and starts anew with `nodes` nodes.
    ///
    /// # Panics
    /// If there are more nodes than a u32 can count.
    pub fn reset(&mut self, nodes: usize) {
        assert!(nodes < TERMINAL as usize, "{nodes} nodes do not fit in u32");
        let node = Node {
            first: NONE,
            parent: NONE,
            stamp: 0,
            distance: 0,
            tree: Tree::Free,
            queued: false,
            terminal: 0.0,
        };
        self.nodes.clear();
        self.nodes.resize(nodes, node);
        self.arcs.clear();
        self.active.clear();
        self.orphans.clear();
        self.flow = 0.0;
        self.time = 0;
    }

    /// Adds capacity from the source to `node` and from `node` to the sink; the smaller of the two flows at
    /// once.
    pub fn add_terminal(&mut self, node: usize, from_source: f64, to_sink: f64) {
        debug_assert!(from_source >= 0.0 && to_sink >= 0.0, "capacities {from_source}, {to_sink}");
        let n = &mut self.nodes[node];
        let (mut s, mut t) = (from_source, to_sink);
        if n.terminal > 0.0 {
            s += n.terminal;
        } else {
            t -= n.terminal;
        }
        self.flow += s.min(t);
        // Both infinite: an infinite flow, and nothing that the trees could do about it.
        n.terminal = if s == t { 0.0 } else { s - t };
    }

    /// Adds a pair of arcs of these capacities between `a` and `b`.
    ///
    /// # Panics
    /// If there are more arcs than a u32 can count.
    pub fn add_edge(&mut self, a: usize, b: usize, capacity: f64, reverse: f64) {
        debug_assert!(a != b && capacity >= 0.0 && reverse >= 0.0, "{a}-{b}: {capacity}, {reverse}");
        let arc = self.arcs.len();
        assert!(arc + 2 < TERMINAL as usize, "{arc} arcs do not fit in u32");
        self.arcs.push(Arc { head: b as u32, next: self.nodes[a].first, residual: capacity });
        self.arcs.push(Arc { head: a as u32, next: self.nodes[b].first, residual: reverse });
        self.nodes[a].first = arc as u32;
        self.nodes[b].first = arc as u32 + 1;
    }

    /// Whether `node` is on the source's side of the minimum cut that [`MaxFlow::run`] found; nodes that both
    /// sides could have are on the sink's.
    pub fn on_source_side(&self, node: usize) -> bool {
        self.nodes[node].tree == Tree::Source
    }

    /// Pushes as much flow as there is; the value of the maximum flow, which is that of the minimum cut.
    ///
    /// # Errors
    /// If cancelled; the graph is then of no further use.
    pub fn run(&mut self, cancelled: Cancelled<'_>) -> Result<f64, SolveError> {
        for i in 0..self.nodes.len() {
            let node = &mut self.nodes[i];
            if node.terminal != 0.0 {
                node.tree = if node.terminal > 0.0 { Tree::Source } else { Tree::Sink };
                node.parent = TERMINAL;
                node.distance = 1;
                node.queued = true;
                self.active.push_back(i as u32);
            }
        }
        let mut steps = 0u32;
        while let Some(&i) = self.active.front() {
            steps = steps.wrapping_add(1);
            if steps.is_multiple_of(65_536) && cancelled() {
                return Err(SolveError::Cancelled);
            }
            match self.grow(i) {
                // The node stays active: it may touch the other tree elsewhere too.
                Some(arc) => {
                    self.time += 1;
                    self.augment(arc);
                    self.adopt();
                }
                None => {
                    self.nodes[i as usize].queued = false;
                    self.active.pop_front();
                }
            }
        }
        Ok(self.flow)
    }

    /// What can flow over `arc` away from the terminal of `tree`.
    #[inline(always)]
    fn outward(&self, arc: u32, tree: Tree) -> f64 {
        let arc = if tree == Tree::Source { arc } else { arc ^ 1 };
        self.arcs[arc as usize].residual
    }

    fn activate(&mut self, i: u32) {
        let node = &mut self.nodes[i as usize];
        if !node.queued {
            node.queued = true;
            self.active.push_back(i);
        }
    }

    /// Takes free neighbours into the tree of `i`; an arc from the source's tree to the sink's if one is met.
    fn grow(&mut self, i: u32) -> Option<u32> {
        let me = self.nodes[i as usize];
        if me.tree == Tree::Free {
            return None;
        }
        let mut a = me.first;
        while a != NONE {
            let arc = self.arcs[a as usize];
            if self.outward(a, me.tree) > 0.0 {
                let other = &mut self.nodes[arc.head as usize];
                if other.tree == Tree::Free {
                    other.tree = me.tree;
                    other.parent = a ^ 1;
                    other.stamp = me.stamp;
                    other.distance = me.distance + 1;
                    self.activate(arc.head);
                } else if other.tree != me.tree {
                    return Some(if me.tree == Tree::Source { a } else { a ^ 1 });
                } else if other.stamp <= me.stamp && other.distance > me.distance + 1 {
                    other.parent = a ^ 1;
                    other.stamp = me.stamp;
                    other.distance = me.distance + 1;
                }
            }
            a = arc.next;
        }
        None
    }

    /// Pushes what fits along the path through `middle`, an arc from the source's tree to the sink's.
    fn augment(&mut self, middle: u32) {
        let ends = [self.arcs[(middle ^ 1) as usize].head, self.arcs[middle as usize].head];
        let mut push = self.arcs[middle as usize].residual;
        for (end, tree) in ends.into_iter().zip([Tree::Source, Tree::Sink]) {
            let mut i = end;
            while self.nodes[i as usize].parent != TERMINAL {
                let a = self.nodes[i as usize].parent;
                push = push.min(self.outward(a ^ 1, tree));
                i = self.arcs[a as usize].head;
            }
            push = push.min(self.nodes[i as usize].terminal.abs());
        }
        self.arcs[middle as usize].residual -= push;
        self.arcs[(middle ^ 1) as usize].residual += push;
        for (end, tree) in ends.into_iter().zip([Tree::Source, Tree::Sink]) {
            let mut i = end;
            while self.nodes[i as usize].parent != TERMINAL {
                let a = self.nodes[i as usize].parent;
                // Arc `a` goes to the parent: flow runs against it in the source's tree, along it in the sink's.
                let (full, spare) = if tree == Tree::Source { (a ^ 1, a) } else { (a, a ^ 1) };
                self.arcs[spare as usize].residual += push;
                self.arcs[full as usize].residual -= push;
                if self.arcs[full as usize].residual == 0.0 {
                    self.nodes[i as usize].parent = NONE;
                    self.orphans.push_back(i);
                }
                i = self.arcs[a as usize].head;
            }
            let root = &mut self.nodes[i as usize];
            root.terminal -= if tree == Tree::Source { push } else { -push };
            if root.terminal == 0.0 {
                root.parent = NONE;
                self.orphans.push_back(i);
            }
        }
        self.flow += push;
    }
}

#[cfg(test)]
mod tests;

//! Orphans of the search trees: nodes whose arc to the parent is full.

use super::{MaxFlow, NONE, TERMINAL, Tree};

impl MaxFlow {
    /// Arcs from `i` to the terminal of its tree, or `None` if the way ends at an orphan; stamps the way.
    fn depth(&mut self, i: u32) -> Option<u32> {
        let (mut j, mut steps) = (i, 0);
        let total = loop {
            let node = self.nodes[j as usize];
            if node.stamp == self.time {
                break steps + node.distance;
            }
            match node.parent {
                NONE => return None,
                TERMINAL => {
                    let root = &mut self.nodes[j as usize];
                    root.stamp = self.time;
                    root.distance = 1;
                    break steps + 1;
                }
                a => j = self.arcs[a as usize].head,
            }
            steps += 1;
        };
        let (mut j, mut left) = (i, total);
        while self.nodes[j as usize].stamp != self.time {
            let node = &mut self.nodes[j as usize];
            node.stamp = self.time;
            node.distance = left;
            left -= 1;
            j = self.arcs[node.parent as usize].head;
        }
        Some(total)
    }

    /// Finds each orphan the parent nearest to the terminal, or sets it free and makes its children orphans.
    pub(super) fn adopt(&mut self) {
        while let Some(i) = self.orphans.pop_front() {
            let tree = self.nodes[i as usize].tree;
            let mut best: Option<(u32, u32)> = None;
            let mut a = self.nodes[i as usize].first;
            while a != NONE {
                let arc = self.arcs[a as usize];
                // The parent's arc to this node must have room.
                if self.nodes[arc.head as usize].tree == tree
                    && self.outward(a ^ 1, tree) > 0.0
                    && let Some(d) = self.depth(arc.head)
                    && best.is_none_or(|(least, _)| d < least)
                {
                    best = Some((d, a));
                }
                a = arc.next;
            }
            if let Some((d, a)) = best {
                let node = &mut self.nodes[i as usize];
                node.parent = a;
                node.stamp = self.time;
                node.distance = d + 1;
                continue;
            }
            let mut a = self.nodes[i as usize].first;
            while a != NONE {
                let arc = self.arcs[a as usize];
                let j = arc.head;
                if self.nodes[j as usize].tree == tree {
                    if self.outward(a ^ 1, tree) > 0.0 {
                        self.activate(j);
                    }
                    let parent = self.nodes[j as usize].parent;
                    if parent == (a ^ 1) {
                        self.nodes[j as usize].parent = NONE;
                        self.orphans.push_back(j);
                    }
                }
                a = arc.next;
            }
            let node = &mut self.nodes[i as usize];
            node.tree = Tree::Free;
            node.parent = NONE;
        }
    }
}

//! Active pixels in order of their anti-diagonals.

use crate::GridProblem;

/// Stands for "no such neighbour".
pub(crate) const NONE: u32 = u32::MAX;

/// Active pixels sorted by x + y, then y. Every edge joins neighbouring diagonals and points from the earlier
/// to the later one, as in row-major order, so the nodes of a diagonal may be worked on at the same time
/// with the result of a row-major sweep.
#[derive(Debug)]
pub(crate) struct Layout {
    /// Pixel of each node.
    pub pixel: Vec<u32>,
    /// First node of each diagonal, and the number of nodes at the end.
    pub start: Vec<usize>,
    /// Neighbouring nodes over edges of positive weight, or [`NONE`].
    pub left: Vec<u32>,
    pub up: Vec<u32>,
    pub right: Vec<u32>,
    pub down: Vec<u32>,
    /// Weights of the edges to `right` and `down`; 0 where there is none.
    pub weight_right: Vec<f32>,
    pub weight_down: Vec<f32>,
}

impl Layout {
    /// Of a validated problem.
    pub fn new(problem: &GridProblem<'_>) -> Layout {
        let (w, h) = (problem.width, problem.height);
        let mut node_of = vec![NONE; w * h];
        let mut pixel = Vec::new();
        let mut start = vec![0];
        for d in 0..w + h - 1 {
            for y in d.saturating_sub(w - 1)..=d.min(h - 1) {
                let p = y * w + (d - y);
                if problem.active[p] {
                    node_of[p] = pixel.len() as u32;
                    pixel.push(p as u32);
                }
            }
            if *start.last().expect("starts with one entry") != pixel.len() {
                start.push(pixel.len());
            }
        }
        let n = pixel.len();
        let mut layout = Layout {
            pixel,
            start,
            left: vec![NONE; n],
            up: vec![NONE; n],
            right: vec![NONE; n],
            down: vec![NONE; n],
            weight_right: vec![0.0; n],
            weight_down: vec![0.0; n],
        };
        for i in 0..n {
            let p = layout.pixel[i] as usize;
            if let Some(q) = problem.right_of(p).filter(|_| problem.weight_right[p] > 0.0) {
                let j = node_of[q];
                layout.right[i] = j;
                layout.left[j as usize] = i as u32;
                layout.weight_right[i] = problem.weight_right[p];
            }
            if let Some(q) = problem.below(p).filter(|_| problem.weight_down[p] > 0.0) {
                let j = node_of[q];
                layout.down[i] = j;
                layout.up[j as usize] = i as u32;
                layout.weight_down[i] = problem.weight_down[p];
            }
        }
        layout
    }

    /// Number of nodes.
    pub fn len(&self) -> usize {
        self.pixel.len()
    }

    /// Number of diagonals that have nodes.
    pub fn diagonals(&self) -> usize {
        self.start.len() - 1
    }

    /// Share of a node's cost that each chain through it carries: one over the greater of its numbers of
    /// earlier and later neighbours (Kolmogorov 2006, section 4.1).
    #[inline]
    pub fn gamma(&self, i: usize) -> f32 {
        let earlier = u8::from(self.left[i] != NONE) + u8::from(self.up[i] != NONE);
        let later = u8::from(self.right[i] != NONE) + u8::from(self.down[i] != NONE);
        if earlier.max(later) == 2 { 0.5 } else { 1.0 }
    }
}

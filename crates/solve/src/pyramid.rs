//! The same problem on blocks of 2 x 2 pixels.

use rayon::prelude::*;

use crate::GridProblem;
use crate::message::vectorised;

/// A grid problem that owns its arrays.
#[derive(Debug)]
pub(crate) struct OwnedProblem {
    pub width: usize,
    pub height: usize,
    pub labels: usize,
    pub unary: Vec<f32>,
    pub weight_right: Vec<f32>,
    pub weight_down: Vec<f32>,
    pub active: Vec<bool>,
}

impl OwnedProblem {
    pub fn view(&self) -> GridProblem<'_> {
        GridProblem {
            width: self.width,
            height: self.height,
            labels: self.labels,
            unary: &self.unary,
            weight_right: &self.weight_right,
            weight_down: &self.weight_down,
            active: &self.active,
        }
    }
}

/// One node for each block of 2 x 2 pixels with an active one among them. Its data cost is the sum over the
/// block; the weight between two blocks is half the sum over the edges that join them, as the two edges side
/// by side stand each for two in a row, over which a slope of one label costs half as much as in one step.
pub(crate) fn halve(fine: &GridProblem<'_>) -> OwnedProblem {
    let (width, height, labels) = (fine.width.div_ceil(2), fine.height.div_ceil(2), fine.labels);
    let children = |p: usize| {
        let (x, y) = (2 * (p % width), 2 * (p / width));
        let inside =
            move |(x, y): (usize, usize)| (x < fine.width && y < fine.height).then_some(y * fine.width + x);
        [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)]
            .map(|at| inside(at).filter(|&p| fine.active[p]))
            .into_iter()
            .flatten()
    };
    let n = width * height;
    let active: Vec<bool> = (0..n).map(|p| children(p).next().is_some()).collect();
    let mut unary = vec![0.0f32; n * labels];
    unary.par_chunks_mut(width * labels).enumerate().for_each(|(y, row)| {
        for (x, sum) in row.chunks_exact_mut(labels).enumerate() {
            for q in children(y * width + x) {
                let costs = fine.costs(q);
                vectorised(
                    #[inline(always)]
                    || sum.iter_mut().zip(costs).for_each(|(s, c)| *s += c),
                );
            }
        }
    });
    let (mut weight_right, mut weight_down) = (vec![0.0; n], vec![0.0; n]);
    fine.for_each_edge(|p, q, w| {
        let block = |p: usize| (p / fine.width / 2) * width + p % fine.width / 2;
        let (a, b) = (block(p), block(q));
        if b == a + 1 && q == p + 1 {
            weight_right[a] += 0.5 * w;
        } else if b != a {
            weight_down[a] += 0.5 * w;
        }
    });
    OwnedProblem { width, height, labels, unary, weight_right, weight_down, active }
}

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

#[cfg(test)]
mod tests {
    use super::*;
    use strandbench_rng::Rng;

    #[test]
    fn a_labelling_constant_on_blocks_costs_the_same_but_for_half_the_smoothness() {
        for (width, height, seed) in [(6, 4, 1), (5, 7, 2), (1, 3, 3), (7, 1, 4)] {
            let (n, labels) = (width * height, 5);
            let mut rng = Rng::keyed(&[seed]);
            let unary: Vec<f32> = (0..n * labels).map(|_| rng.below(64) as f32).collect();
            let weights: Vec<f32> = (0..2 * n).map(|_| rng.below(16) as f32).collect();
            let active: Vec<bool> = (0..n).map(|_| rng.f32() < 0.8).collect();
            let no_costs = vec![0.0; n * labels];
            let fine = GridProblem {
                width,
                height,
                labels,
                unary: &unary,
                weight_right: &weights[..n],
                weight_down: &weights[n..],
                active: &active,
            };
            let coarse = halve(&fine);
            let block_labels: Vec<u16> = coarse.active.iter().map(|_| rng.below(5) as u16).collect();
            let fine_labels: Vec<u16> =
                (0..n).map(|p| block_labels[p / width / 2 * coarse.width + p % width / 2]).collect();
            let smooth = |problem: GridProblem<'_>, labels: &[u16]| {
                GridProblem { unary: &no_costs[..problem.unary.len()], ..problem }.energy(labels)
            };
            let fine_smooth = smooth(fine, &fine_labels);
            let coarse_smooth = smooth(coarse.view(), &block_labels);
            assert_eq!(2.0 * coarse_smooth, fine_smooth, "{width} x {height}");
            let fine_costs = fine.energy(&fine_labels) - fine_smooth;
            assert_eq!(coarse.view().energy(&block_labels) - coarse_smooth, fine_costs, "{width} x {height}");
        }
    }
}

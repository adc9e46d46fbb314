//! Graph cut moves (Boykov, Veksler and Zabih, PAMI 2001): expansion of one label, swap of two.

use std::time::Instant;

use crate::maxflow::MaxFlow;
use crate::simple::cheapest;
use crate::{Cancelled, GridProblem, Solution, SolveError};

/// How [`alpha_expansion`] and [`alpha_beta_swap`] work.
#[derive(Clone, Debug, PartialEq)]
pub struct MoveOptions {
    /// Cycles over all labels, or all pairs of labels, at most; fewer if one finds nothing better.
    pub cycles: usize,
    /// Labelling to start from; the cheapest label of every pixel if `None`.
    pub start: Option<Vec<u16>>,
}

impl Default for MoveOptions {
    fn default() -> Self {
        MoveOptions { cycles: 4, start: None }
    }
}

/// Minimises by expansion moves: for each label in turn, the best set of pixels that take it, by one cut.
///
/// The squared difference is no metric. For an edge (p, q) where the label α lies between l_p and l_q, keeping
/// both labels costs more than α at one end and then the other, (l_p - l_q)² > (l_p - α)² + (α - l_q)², and no
/// cut has that term. There the cost of keeping both is lowered to the sum on the right, as Rother, Kumar,
/// Kolmogorov and Blake (CVPR 2005) do: the move is then not the best one, but as only the labelling that is
/// left behind is flattered, no move raises the energy. A move is taken if it lowers the energy in f64.
///
/// # Errors
/// If the problem or the start is malformed, or the work is cancelled.
pub fn alpha_expansion(
    problem: &GridProblem<'_>,
    options: &MoveOptions,
    cancelled: Cancelled<'_>,
) -> Result<Solution, SolveError> {
    let mut search = Search::new(problem, options, cancelled)?;
    for _ in 0..options.cycles {
        let before = search.energy;
        for alpha in 0..problem.labels as u16 {
            let pixels: Vec<u32> = search.pixels(|l| l != alpha);
            search.try_move(&pixels, |l| (l, alpha))?;
        }
        search.note();
        if search.energy >= before {
            break;
        }
    }
    Ok(search.finish())
}

/// Minimises by swap moves: for each pair of labels, the best way to deal them out among the pixels that have
/// one of them, by one cut. Every such move is a proper cut for this energy, so each is the best of its kind.
///
/// # Errors
/// If the problem or the start is malformed, or the work is cancelled.
pub fn alpha_beta_swap(
    problem: &GridProblem<'_>,
    options: &MoveOptions,
    cancelled: Cancelled<'_>,
) -> Result<Solution, SolveError> {
    let mut search = Search::new(problem, options, cancelled)?;
    let labels = problem.labels as u16;
    for _ in 0..options.cycles {
        let before = search.energy;
        for alpha in 0..labels {
            for beta in alpha + 1..labels {
                let pixels: Vec<u32> = search.pixels(|l| l == alpha || l == beta);
                search.try_move(&pixels, |_| (alpha, beta))?;
            }
        }
        search.note();
        if search.energy >= before {
            break;
        }
    }
    Ok(search.finish())
}

/// Stands for "not in this move".
const FIXED: u32 = u32::MAX;

/// A labelling on its way down.
struct Search<'a> {
    problem: &'a GridProblem<'a>,
    cancelled: Cancelled<'a>,
    begin: Instant,
    labels: Vec<u16>,
    energy: f64,
    history: Vec<(f64, f64, Option<f64>)>,
    graph: MaxFlow,
    node_of: Vec<u32>,
}

impl<'a> Search<'a> {
    fn new(
        problem: &'a GridProblem<'a>,
        options: &MoveOptions,
        cancelled: Cancelled<'a>,
    ) -> Result<Search<'a>, SolveError> {
        problem.validate()?;
        let begin = Instant::now();
        let mut labels = match &options.start {
            Some(start) => {
                problem.validate_start(start)?;
                start.clone()
            }
            None => cheapest(problem),
        };
        for (l, _) in labels.iter_mut().zip(problem.active).filter(|&(_, &active)| !active) {
            *l = 0;
        }
        let energy = problem.energy(&labels);
        let node_of = vec![FIXED; problem.pixels()];
        let graph = MaxFlow::default();
        Ok(Search { problem, cancelled, begin, labels, energy, history: Vec::new(), graph, node_of })
    }

    fn note(&mut self) {
        self.history.push((self.begin.elapsed().as_secs_f64(), self.energy, None));
    }

    fn finish(self) -> Solution {
        Solution { labels: self.labels, energy: self.energy, lower_bound: None, history: self.history }
    }

    /// Active pixels whose label is wanted.
    fn pixels(&self, want: impl Fn(u16) -> bool) -> Vec<u32> {
        let active = self.problem.active;
        (0..active.len()).filter(|&p| active[p] && want(self.labels[p])).map(|p| p as u32).collect()
    }

    /// Gives each of `pixels` one of the two labels that `choice` has for its label; keeps the outcome if it
    /// has less energy.
    fn try_move(&mut self, pixels: &[u32], choice: impl Fn(u16) -> (u16, u16)) -> Result<(), SolveError> {
        if (self.cancelled)() {
            return Err(SolveError::Cancelled);
        }
        for (i, &p) in pixels.iter().enumerate() {
            self.node_of[p as usize] = i as u32;
        }
        let second = self.cut(pixels, &choice);
        for &p in pixels {
            self.node_of[p as usize] = FIXED;
        }
        let second = second?;
        let mut before = Vec::new();
        for (&p, second) in pixels.iter().zip(second) {
            let label = &mut self.labels[p as usize];
            let (a, b) = choice(*label);
            let new = if second { b } else { a };
            if new != *label {
                before.push((p, *label));
                *label = new;
            }
        }
        if before.is_empty() {
            return Ok(());
        }
        let energy = self.problem.energy(&self.labels);
        if energy < self.energy {
            self.energy = energy;
        } else {
            for (p, label) in before {
                self.labels[p as usize] = label;
            }
        }
        Ok(())
    }

    /// Whether each of `pixels` takes its second label: those on the source's side of the cut.
    fn cut(&mut self, pixels: &[u32], choice: &impl Fn(u16) -> (u16, u16)) -> Result<Vec<bool>, SolveError> {
        let problem = self.problem;
        self.graph.reset(pixels.len());
        let square = |a: u16, b: u16| (f64::from(a) - f64::from(b)).powi(2);
        // What each pixel pays for its second label less what it pays for its first.
        let mut price = vec![0f64; pixels.len()];
        for (i, &p) in pixels.iter().enumerate() {
            let p = p as usize;
            let (a, b) = choice(self.labels[p]);
            let costs = problem.costs(p);
            price[i] += f64::from(costs[usize::from(b)]) - f64::from(costs[usize::from(a)]);
            for (q, w) in problem.neighbours(p) {
                let w = f64::from(w);
                if self.node_of[q] == FIXED {
                    let fixed = self.labels[q];
                    price[i] += w * (square(b, fixed) - square(a, fixed));
                } else if q > p {
                    let j = self.node_of[q] as usize;
                    let (c, d) = choice(self.labels[q]);
                    let (one, two, both) = (w * square(b, c), w * square(a, d), w * square(b, d));
                    // The truncation: of nothing in a swap, where this is 0 + 0 <= one + two.
                    let none = (w * square(a, c)).min(one + two - both);
                    // E = none + (one - none) x_p + (both - one) x_q + (one + two - none - both) x_q (1 - x_p)
                    price[i] += one - none;
                    price[j] += both - one;
                    let across = one + two - none - both;
                    if across > 0.0 {
                        self.graph.add_edge(i, j, 0.0, across);
                    }
                }
            }
        }
        for (i, &price) in price.iter().enumerate() {
            // On the source's side the node pays what flows to the sink.
            self.graph.add_terminal(i, (-price).max(0.0), price.max(0.0));
        }
        self.graph.run(self.cancelled)?;
        Ok((0..pixels.len()).map(|i| self.graph.on_source_side(i)).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use strandbench_rng::Rng;

    #[test]
    fn a_move_that_needs_no_truncation_is_the_best_of_all_subsets() {
        let (width, height, labels) = (4, 3, 5);
        let n = width * height;
        for seed in 0..30 {
            let mut rng = Rng::keyed(&[seed, 5]);
            let unary: Vec<f32> = (0..n * labels).map(|_| rng.below(200) as f32 / 4.0).collect();
            let weights: Vec<f32> = (0..2 * n).map(|_| rng.below(9) as f32 / 4.0).collect();
            let start: Vec<u16> = (0..n).map(|_| rng.below(labels as u64) as u16).collect();
            let problem = GridProblem {
                width,
                height,
                labels,
                unary: &unary,
                weight_right: &weights[..n],
                weight_down: &weights[n..],
                active: &vec![true; n],
            };
            // Expansions of the outermost labels, and a swap.
            let moves: [&dyn Fn(u16) -> (u16, u16); 3] =
                [&|l| (l, 0), &|l| (l, 4), &|l| if l == 1 || l == 3 { (1, 3) } else { (l, l) }];
            for (kind, choice) in moves.iter().enumerate() {
                let options = MoveOptions { cycles: 1, start: Some(start.clone()) };
                let mut search = Search::new(&problem, &options, &|| false).expect("legal");
                let pixels = search.pixels(|l| kind < 2 || l == 1 || l == 3);
                search.try_move(&pixels, choice).expect("nobody cancels");
                let of = |m: u32| -> Vec<u16> {
                    let pick =
                        |p: usize| if m >> p & 1 == 1 { choice(start[p]).1 } else { choice(start[p]).0 };
                    (0..n).map(pick).collect()
                };
                let best = (0..1 << n).map(|m| problem.energy(&of(m))).fold(f64::INFINITY, f64::min);
                assert_eq!(search.energy, best, "seed {seed}, move {kind}");
            }
        }
    }

    #[test]
    fn a_truncated_expansion_is_the_best_by_the_flattered_energy_and_never_raises_the_true_one() {
        let (width, height, labels) = (4, 3, 7);
        let n = width * height;
        let square = |a: u16, b: u16| (f64::from(a) - f64::from(b)).powi(2);
        let (mut truncated, mut refused) = (0, 0);
        for seed in 0..40 {
            let mut rng = Rng::keyed(&[seed, 6]);
            let unary: Vec<f32> = (0..n * labels).map(|_| rng.below(200) as f32 / 4.0).collect();
            let weights: Vec<f32> = (0..2 * n).map(|_| rng.below(9) as f32 / 4.0).collect();
            let start: Vec<u16> = (0..n).map(|_| rng.below(labels as u64) as u16).collect();
            let problem = GridProblem {
                width,
                height,
                labels,
                unary: &unary,
                weight_right: &weights[..n],
                weight_down: &weights[n..],
                active: &vec![true; n],
            };
            let alpha = 2 + (seed % 3) as u16;
            // Lowered by what keeping both ends of an edge costs more than α at either end in turn.
            let flattery = |m: u32| -> f64 {
                let keeps = |p: usize| m >> p & 1 == 0;
                let edge = |p: usize, q: usize, w: f32| {
                    let (a, b) = (start[p], start[q]);
                    let over = square(a, b) - square(a, alpha) - square(alpha, b);
                    if keeps(p) && keeps(q) { f64::from(w) * over.max(0.0) } else { 0.0 }
                };
                let right = (0..n).filter(|p| p % width + 1 < width).map(|p| edge(p, p + 1, weights[p]));
                let down = (0..n - width).map(|p| edge(p, p + width, weights[n + p]));
                right.sum::<f64>() + down.sum::<f64>()
            };
            let of = |m: u32| -> Vec<u16> {
                (0..n).map(|p| if m >> p & 1 == 1 { alpha } else { start[p] }).collect()
            };
            let moves: Vec<(f64, f64)> = (0..1u32 << n)
                .map(|m| {
                    let energy = problem.energy(&of(m));
                    (energy - flattery(m), energy)
                })
                .collect();
            let least = moves.iter().map(|e| e.0).fold(f64::INFINITY, f64::min);
            let before = problem.energy(&start);
            let allowed: Vec<f64> = moves.iter().filter(|e| e.0 == least).map(|e| e.1.min(before)).collect();
            truncated += usize::from(flattery(0) > 0.0);
            refused += usize::from(allowed.iter().all(|&e| e == before));
            let options = MoveOptions { cycles: 1, start: Some(start.clone()) };
            let mut search = Search::new(&problem, &options, &|| false).expect("legal");
            let pixels = search.pixels(|l| l != alpha);
            search.try_move(&pixels, |l| (l, alpha)).expect("nobody cancels");
            assert!(
                allowed.contains(&search.energy),
                "seed {seed}: {} is none of {allowed:?}",
                search.energy
            );
        }
        assert!(truncated == 40 && refused < 20, "{truncated} truncated, {refused} left as they were");
    }
}

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
mod tests;

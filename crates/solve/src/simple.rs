//! Minimisers that look at one pixel at a time.

use std::time::Instant;

use crate::message::{least, vectorised};
use crate::{Cancelled, GridProblem, Solution, SolveError};

/// The cheapest label of every pixel by itself, the lowest of several; its bound is the sum of these costs,
/// which no labelling can undercut as the smoothness term is never negative.
///
/// # Errors
/// If the problem is malformed.
pub fn winner_take_all(problem: &GridProblem<'_>) -> Result<Solution, SolveError> {
    problem.validate()?;
    let begin = Instant::now();
    let labels = cheapest(problem);
    let energy = problem.energy(&labels);
    let mut bound = 0.0;
    for p in (0..problem.pixels()).filter(|&p| problem.active[p]) {
        bound += f64::from(problem.costs(p)[usize::from(labels[p])]);
    }
    let history = vec![(begin.elapsed().as_secs_f64(), energy, Some(bound))];
    Ok(Solution { labels, energy, lower_bound: Some(bound), history })
}

/// Labels of [`winner_take_all`].
pub(crate) fn cheapest(problem: &GridProblem<'_>) -> Vec<u16> {
    let mut labels = vec![0; problem.pixels()];
    for p in (0..problem.pixels()).filter(|&p| problem.active[p]) {
        let costs = problem.costs(p);
        let min = vectorised(
            #[inline(always)]
            || least(costs),
        );
        labels[p] = costs.iter().position(|&c| c == min).unwrap_or(0) as u16;
    }
    labels
}

/// Iterated conditional modes (Besag 1986): every pixel in turn takes the label that is best for it given its
/// neighbours', until none changes or `sweeps` are done. The energy never rises.
///
/// # Errors
/// If the problem or the start is malformed, or the work is cancelled.
pub fn icm(
    problem: &GridProblem<'_>,
    start: &[u16],
    sweeps: usize,
    cancelled: Cancelled<'_>,
) -> Result<Solution, SolveError> {
    problem.validate()?;
    problem.validate_start(start)?;
    let begin = Instant::now();
    let mut labels: Vec<u16> =
        start.iter().zip(problem.active).map(|(&l, &active)| if active { l } else { 0 }).collect();
    let mut history = Vec::new();
    let mut state = Dirty::all(problem);
    for _ in 0..sweeps {
        if cancelled() {
            return Err(SolveError::Cancelled);
        }
        let changed = state.sweep(problem, &mut labels);
        history.push((begin.elapsed().as_secs_f64(), problem.energy(&labels), None));
        if !changed {
            break;
        }
    }
    Ok(Solution { energy: problem.energy(&labels), labels, lower_bound: None, history })
}

/// At most `sweeps` sweeps of [`icm`] on a labelling known to fit.
pub(crate) fn icm_in_place(problem: &GridProblem<'_>, labels: &mut [u16], sweeps: usize) {
    let mut state = Dirty::all(problem);
    for _ in 0..sweeps {
        if !state.sweep(problem, labels) {
            break;
        }
    }
}

/// Pixels whose neighbourhood changed since they were looked at.
struct Dirty {
    pixel: Vec<bool>,
    cost: Vec<f32>,
}

impl Dirty {
    fn all(problem: &GridProblem<'_>) -> Dirty {
        Dirty { pixel: problem.active.to_vec(), cost: vec![0.0; problem.labels] }
    }

    /// Visits the dirty pixels in row-major order; whether any label changed.
    fn sweep(&mut self, problem: &GridProblem<'_>, labels: &mut [u16]) -> bool {
        let mut any = false;
        for p in 0..problem.pixels() {
            if !std::mem::take(&mut self.pixel[p]) {
                continue;
            }
            // Σ w (l - l_q)² = W (l - mean)² + constant.
            let (mut total, mut moment) = (0f64, 0f64);
            for (q, w) in problem.neighbours(p) {
                total += f64::from(w);
                moment += f64::from(w) * f64::from(labels[q]);
            }
            let mean = if total > 0.0 { moment / total } else { 0.0 };
            let unary = problem.costs(p);
            let best = vectorised(
                #[inline(always)]
                || best_near(unary, total as f32, mean as f32, &mut self.cost),
            );
            // The vector search works in f32; only a gain in f64 is taken, so that the energy cannot rise.
            let at = |l: u16| {
                let d = f64::from(l) - mean;
                f64::from(unary[usize::from(l)]) + total * d * d
            };
            if best != labels[p] && at(best) < at(labels[p]) {
                labels[p] = best;
                any = true;
                for (q, _) in problem.neighbours(p) {
                    self.pixel[q] = true;
                }
            }
        }
        any
    }
}

#[inline(always)]
fn best_near(unary: &[f32], total: f32, mean: f32, cost: &mut [f32]) -> u16 {
    for (l, (c, u)) in cost.iter_mut().zip(unary).enumerate() {
        let d = l as i32 as f32 - mean;
        *c = u + total * d * d;
    }
    let min = least(cost);
    cost.iter().position(|&c| c == min).unwrap_or(0) as u16
}

//! Sequential tree-reweighted message passing (Kolmogorov, PAMI 2006, figure 3) on the diagonals of a grid.

mod nodes;

use std::time::Instant;

use rayon::prelude::*;

use crate::layout::{Layout, NONE};
use crate::message::{stride_of, vectorised};
use crate::simple::icm_in_place;
use crate::{Cancelled, GridProblem, Solution, SolveError};
use nodes::{After, backward_nodes, best_label, forward_nodes};

/// How [`trws`] works.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrwsOptions {
    /// Sweeps forth and back, at most.
    pub iterations: usize,
    /// Ends early once (energy - bound) / |bound| is at most this.
    pub gap: f64,
}

impl Default for TrwsOptions {
    fn default() -> Self {
        TrwsOptions { iterations: 50, gap: 1e-4 }
    }
}

/// Minimises by tree-reweighted message passing over all labels; the best labelling seen, after coordinate
/// descent, and the best bound.
///
/// Memory: two arrays of active pixels x labels x 4 bytes.
///
/// # Errors
/// If the problem is malformed or the work is cancelled.
pub fn trws(
    problem: &GridProblem<'_>,
    options: &TrwsOptions,
    cancelled: Cancelled<'_>,
) -> Result<Solution, SolveError> {
    problem.validate()?;
    let begin = Instant::now();
    let mut sweeper = Sweeper::new(problem);
    let mut best: Option<Solution> = None;
    let mut bound = f64::NEG_INFINITY;
    let mut history = Vec::new();
    for _ in 0..options.iterations.max(1) {
        sweeper.forward(cancelled)?;
        bound = bound.max(sweeper.backward(cancelled)?);
        let mut labels = sweeper.decode();
        icm_in_place(problem, &mut labels, 2);
        let energy = problem.energy(&labels);
        if best.as_ref().is_none_or(|b| energy < b.energy) {
            best = Some(Solution { labels, energy, lower_bound: None, history: Vec::new() });
        }
        let energy = best.as_ref().map_or(energy, |b| b.energy);
        history.push((begin.elapsed().as_secs_f64(), energy, Some(bound)));
        if energy - bound <= options.gap * bound.abs() {
            break;
        }
    }
    let best = best.expect("at least one iteration ran");
    Ok(Solution { lower_bound: Some(bound), history, ..best })
}

/// The state of message passing on one problem.
///
/// Each edge has one message in memory, kept at its earlier end: after a forward sweep the one to the later
/// end, after a backward sweep the one to the earlier end. Whatever the messages are, a backward sweep turns
/// them into a valid lower bound, so any start is legal.
#[derive(Debug)]
pub(crate) struct Sweeper<'a> {
    problem: &'a GridProblem<'a>,
    pub layout: Layout,
    pub stride: usize,
    /// Messages on the edges to the right and down, indexed [node * stride + label].
    pub right: Vec<f32>,
    pub down: Vec<f32>,
    /// Of each node: its part of the bound, and the largest magnitude that went into it.
    bounds: Vec<(f64, f32)>,
}

/// Nodes that one task works on; below twice as many, a diagonal is not split.
fn nodes_per_task(stride: usize) -> usize {
    (4096 / stride).max(1)
}

impl<'a> Sweeper<'a> {
    /// With all messages 0.
    pub fn new(problem: &'a GridProblem<'a>) -> Sweeper<'a> {
        let layout = Layout::new(problem);
        let stride = stride_of(problem.labels);
        let n = layout.len();
        Sweeper {
            problem,
            stride,
            right: vec![0.0; n * stride],
            down: vec![0.0; n * stride],
            bounds: vec![(0.0, 0.0); n],
            layout,
        }
    }

    /// Passes messages to the right and down.
    pub fn forward(&mut self, cancelled: Cancelled<'_>) -> Result<(), SolveError> {
        let (stride, problem, layout) = (self.stride, self.problem, &self.layout);
        for d in 0..layout.diagonals() {
            if d % 64 == 0 && cancelled() {
                return Err(SolveError::Cancelled);
            }
            let (from, to) = (layout.start[d], layout.start[d + 1]);
            let (right_before, right) = self.right.split_at_mut(from * stride);
            let (down_before, down) = self.down.split_at_mut(from * stride);
            let task = |first: usize, right: &mut [f32], down: &mut [f32]| {
                vectorised(
                    #[inline(always)]
                    || {
                        forward_nodes(problem, layout, stride, first, right_before, down_before, right, down);
                    },
                );
            };
            let right = &mut right[..(to - from) * stride];
            let down = &mut down[..(to - from) * stride];
            let per = nodes_per_task(stride);
            if to - from < 2 * per {
                task(from, right, down);
            } else {
                let tasks = right.par_chunks_mut(per * stride).zip(down.par_chunks_mut(per * stride));
                tasks.enumerate().for_each(|(c, (right, down))| task(from + c * per, right, down));
            }
        }
        Ok(())
    }

    /// Passes messages to the left and up; a lower bound of the minimum of the energy.
    ///
    /// The bound is the sum of the minima of the monotone chains into which the messages split the energy
    /// (Kolmogorov 2006, section 3), less what rounding to f32 could have added to it.
    pub fn backward(&mut self, cancelled: Cancelled<'_>) -> Result<f64, SolveError> {
        let (stride, problem, layout) = (self.stride, self.problem, &self.layout);
        let widest = (0..layout.diagonals()).map(|d| layout.start[d + 1] - layout.start[d]).max();
        let mut theta = vec![0.0; widest.unwrap_or(0) * stride];
        let mut theta_after = theta.clone();
        for d in (0..layout.diagonals()).rev() {
            if d % 64 == 0 && cancelled() {
                return Err(SolveError::Cancelled);
            }
            let (from, to) = (layout.start[d], layout.start[d + 1]);
            let (right_before, right) = self.right.split_at_mut(from * stride);
            let (down_before, down) = self.down.split_at_mut(from * stride);
            let (bounds, bounds_after) = self.bounds.split_at_mut(to);
            let after = After { start: to, theta: &theta_after, bounds: bounds_after };
            let before: [&[f32]; 2] = [right_before, down_before];
            let task =
                |first: usize, messages: [&mut [f32]; 2], theta: &mut [f32], bounds: &mut [(f64, f32)]| {
                    vectorised(
                        #[inline(always)]
                        || {
                            backward_nodes(
                                problem, layout, stride, first, &after, before, messages, theta, bounds,
                            )
                        },
                    );
                };
            let right = &mut right[..(to - from) * stride];
            let down = &mut down[..(to - from) * stride];
            let theta_now = &mut theta[..(to - from) * stride];
            let bounds = &mut bounds[from..];
            let per = nodes_per_task(stride);
            if to - from < 2 * per {
                task(from, [right, down], theta_now, bounds);
            } else {
                right
                    .par_chunks_mut(per * stride)
                    .zip(down.par_chunks_mut(per * stride))
                    .zip(theta_now.par_chunks_mut(per * stride).zip(bounds.par_chunks_mut(per)))
                    .enumerate()
                    .for_each(|(c, ((r, d), (t, b)))| task(from + c * per, [r, d], t, b));
            }
            std::mem::swap(&mut theta, &mut theta_after);
        }
        Ok(self.bounds.iter().map(|&(bound, _)| bound).sum())
    }

    /// Node of each pixel, or [`NONE`].
    pub fn node_of(&self) -> Vec<u32> {
        let mut node_of = vec![NONE; self.problem.pixels()];
        for (i, &p) in self.layout.pixel.iter().enumerate() {
            node_of[p as usize] = i as u32;
        }
        node_of
    }

    /// Labels in the order of a forward sweep: each pixel the best given its earlier neighbours' labels and
    /// the messages of its later ones (Kolmogorov 2006, section 4.3). To be called after a backward sweep.
    pub fn decode(&self) -> Vec<u16> {
        let (stride, problem, layout) = (self.stride, self.problem, &self.layout);
        let mut of_node = vec![0u16; layout.len()];
        for d in 0..layout.diagonals() {
            let (from, to) = (layout.start[d], layout.start[d + 1]);
            let (before, now) = of_node.split_at_mut(from);
            let task = |first: usize, now: &mut [u16]| {
                let mut cost = vec![0.0; problem.labels];
                for (k, label) in now.iter_mut().enumerate() {
                    let i = first + k;
                    let m = i * stride..i * stride + problem.labels;
                    let (r, d) = (&self.right[m.clone()], &self.down[m]);
                    let pull = |j: u32, weight: &[f32]| match j {
                        NONE => (0.0, 0.0),
                        j => (weight[j as usize], f32::from(before[j as usize])),
                    };
                    let (wl, xl) = pull(layout.left[i], &layout.weight_right);
                    let (wu, xu) = pull(layout.up[i], &layout.weight_down);
                    let unary = problem.costs(layout.pixel[i] as usize);
                    *label = vectorised(
                        #[inline(always)]
                        || best_label(unary, r, d, [wl, xl, wu, xu], &mut cost),
                    );
                }
            };
            let now = &mut now[..to - from];
            let per = nodes_per_task(stride);
            if to - from < 2 * per {
                task(from, now);
            } else {
                now.par_chunks_mut(per).enumerate().for_each(|(c, now)| task(from + c * per, now));
            }
        }
        let mut labels = vec![0; problem.pixels()];
        for (&p, &l) in layout.pixel.iter().zip(&of_node) {
            labels[p as usize] = l;
        }
        labels
    }
}

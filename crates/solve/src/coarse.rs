//! Message passing over a pyramid of grids: the default minimiser.

use std::time::Instant;

use rayon::prelude::*;

use crate::layout::NONE;
use crate::pyramid::{OwnedProblem, halve};
use crate::simple::icm_in_place;
use crate::trws::Sweeper;
use crate::{Cancelled, GridProblem, Solution, SolveError};

/// How [`coarse_to_fine`] works.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoarseToFineOptions {
    /// Grids coarser than the given one; fewer if a grid of one pixel is reached before.
    pub levels: usize,
    /// Sweeps forth and back on each coarser grid.
    pub coarse_iterations: usize,
    /// Sweeps forth and back on the given grid, at least one.
    pub fine_iterations: usize,
    /// Sweeps of coordinate descent at the end.
    pub icm_sweeps: usize,
}

impl Default for CoarseToFineOptions {
    fn default() -> Self {
        CoarseToFineOptions { levels: 4, coarse_iterations: 3, fine_iterations: 2, icm_sweeps: 5 }
    }
}

/// Minimises by TRW-S on a pyramid of grids with all labels at every level, each level starting from the
/// messages of the coarser one, as Felzenszwalb and Huttenlocher (2006) do for belief propagation; then
/// coordinate descent. The bound comes from the last sweep on the given grid.
///
/// # Errors
/// If the problem is malformed or the work is cancelled.
pub fn coarse_to_fine(
    problem: &GridProblem<'_>,
    options: &CoarseToFineOptions,
    cancelled: Cancelled<'_>,
) -> Result<Solution, SolveError> {
    problem.validate()?;
    let begin = Instant::now();
    let mut pyramid: Vec<OwnedProblem> = Vec::new();
    for _ in 0..options.levels {
        let finest = pyramid.last().map_or(*problem, OwnedProblem::view);
        if finest.pixels() == 1 {
            break;
        }
        let coarser = halve(&finest);
        pyramid.push(coarser);
    }
    let views: Vec<GridProblem<'_>> = pyramid.iter().map(OwnedProblem::view).collect();
    let mut coarser: Option<Sweeper<'_>> = None;
    for view in views.iter().rev() {
        let mut sweeper = start(view, coarser.take());
        for _ in 0..options.coarse_iterations {
            sweeper.forward(cancelled)?;
            sweeper.backward(cancelled)?;
        }
        coarser = Some(sweeper);
    }
    let mut sweeper = start(problem, coarser);
    let mut bound = f64::NEG_INFINITY;
    for _ in 0..options.fine_iterations.max(1) {
        sweeper.forward(cancelled)?;
        bound = bound.max(sweeper.backward(cancelled)?);
    }
    let mut labels = sweeper.decode();
    drop(sweeper);
    icm_in_place(problem, &mut labels, options.icm_sweeps);
    let energy = problem.energy(&labels);
    let history = vec![(begin.elapsed().as_secs_f64(), energy, Some(bound))];
    Ok(Solution { labels, energy, lower_bound: Some(bound), history })
}

/// A sweeper whose messages are those of the coarser grid's blocks, halved: two edges side by side make one
/// coarse edge, whose message carries the costs of both.
fn start<'a>(problem: &'a GridProblem<'a>, coarser: Option<Sweeper<'_>>) -> Sweeper<'a> {
    let mut sweeper = Sweeper::new(problem);
    let Some(coarser) = coarser else { return sweeper };
    let stride = sweeper.stride;
    let coarse_width = problem.width.div_ceil(2);
    let node_of = coarser.node_of();
    let layout = &sweeper.layout;
    for (messages, from, later) in [
        (&mut sweeper.right, &coarser.right, &layout.right),
        (&mut sweeper.down, &coarser.down, &layout.down),
    ] {
        messages.par_chunks_mut(stride).enumerate().for_each(|(i, m)| {
            if later[i] == NONE {
                return;
            }
            let p = layout.pixel[i] as usize;
            let (x, y) = (p % problem.width / 2, p / problem.width / 2);
            let block = node_of[y * coarse_width + x] as usize;
            for (m, c) in m.iter_mut().zip(&from[block * stride..]) {
                *m = 0.5 * c;
            }
        });
    }
    sweeper
}

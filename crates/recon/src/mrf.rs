//! The energy of Eq. 2-4 and its minimisation.

use crate::depth::DepthLabels;
use crate::grid::{Grid, Volume};
use crate::{Minimiser, Parameters, ReconError};
use strandbench_solve::{self as solve, GridProblem, Solution, SolveError};
use strandbench_types::{Cancelled, Monitor};

/// Weights of the edges to the right and down, in units of one label step squared: λ · 2 w_s · step²
/// with the step in pixel footprints. Eq. 3 sums over both ends of each edge, hence the 2.
#[derive(Clone, Debug, PartialEq)]
pub struct Edges {
    /// Edge from (x, y) to (x + 1, y).
    pub right: Vec<f32>,
    /// Edge from (x, y) to (x, y + 1).
    pub down: Vec<f32>,
}

impl Edges {
    /// Edge weights of the grid guided by O_ref (Eq. 4); zero where an end is no hair.
    pub fn new(grid: &Grid, guide: &[(f32, f32)], depths: &DepthLabels, p: &Parameters) -> Edges {
        let step = depths.step_footprints();
        let scale = (2.0 * f64::from(p.lambda) * step * step) as f32;
        let fall = -0.5 / (p.sigma_o * p.sigma_o);
        let weight = |i: usize, j: usize| {
            if !(grid.active[i] && grid.active[j]) {
                return 0.0;
            }
            let (dr, di) = (guide[i].0 - guide[j].0, guide[i].1 - guide[j].1);
            scale * libm::expf((dr * dr + di * di) * fall)
        };
        let w = grid.width;
        let right = (0..grid.pixels()).map(|i| if i % w + 1 < w { weight(i, i + 1) } else { 0.0 });
        let down = (0..grid.pixels()).map(|i| if i + w < grid.pixels() { weight(i, i + w) } else { 0.0 });
        Edges { right: right.collect(), down: down.collect() }
    }
}

/// The labelling that the minimiser finds, with its energy (Eq. 2).
///
/// # Errors
/// If cancelled, or if the minimiser refuses the problem as too large.
pub fn minimise(
    grid: &Grid,
    volume: &Volume,
    edges: &Edges,
    minimiser: Minimiser,
    monitor: &dyn Monitor,
) -> Result<Solution, ReconError> {
    let problem = GridProblem {
        width: grid.width,
        height: grid.height,
        labels: volume.labels,
        unary: &volume.data,
        weight_right: &edges.right,
        weight_down: &edges.down,
        active: &grid.active,
    };
    let stop = || monitor.cancelled();
    let solution = match minimiser {
        Minimiser::CoarseToFine => solve::coarse_to_fine(&problem, &Default::default(), &stop),
        Minimiser::Trws => solve::trws(&problem, &Default::default(), &stop),
        Minimiser::Expansion => solve::alpha_expansion(&problem, &Default::default(), &stop),
        Minimiser::WinnerTakesAll => solve::winner_take_all(&problem),
    };
    solution.map_err(|e| match e {
        SolveError::Cancelled => ReconError::Cancelled(Cancelled),
        other => ReconError::Solve(other),
    })
}

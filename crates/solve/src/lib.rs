//! Solvers that know no hair: labelling on a pixel grid with a weighted quadratic smoothness term, sparse
//! Cholesky factorisation, embedded deformation ([`deform`]), and linear models of shapes ([`Pca`]).
//!
//! | function | what it is | lower bound |
//! |---|---|---|
//! | [`coarse_to_fine`] | TRW-S over a pyramid of grids, then coordinate descent; the default | yes |
//! | [`trws`] | sequential tree-reweighted message passing (Kolmogorov 2006) | yes |
//! | [`exact`] | one cut (Ishikawa 2003), small problems only | tight |
//! | [`alpha_expansion`] | graph cuts as Luo et al. use them (Boykov et al. 2001), truncated | no |
//! | [`alpha_beta_swap`] | the other graph cut move | no |
//! | [`icm`] | coordinate descent | no |
//! | [`winner_take_all`] | the cheapest label of every pixel by itself | of the data term |
//!
//! All in the table give the same bits for the same problem whatever the number of threads.

mod coarse;
pub mod deform;
mod exact;
mod layout;
mod maxflow;
mod message;
mod moves;
mod pca;
mod problem;
mod pyramid;
mod simple;
mod sparse;
mod trws;

pub use coarse::{CoarseToFineOptions, coarse_to_fine};
pub use exact::{MAX_EXACT_EDGES, exact};
pub use maxflow::MaxFlow;
pub use moves::{MoveOptions, alpha_beta_swap, alpha_expansion};
pub use pca::{Pca, PcaError};
pub use problem::{GridProblem, MAX_MAGNITUDE, Solution, SolveError};
pub use simple::{icm, winner_take_all};
pub use sparse::{Cholesky, SparseError};
pub use trws::{TrwsOptions, trws};

/// Says whether the caller wants the work stopped; asked between sweeps, from the calling thread.
pub type Cancelled<'a> = &'a dyn Fn() -> bool;

//! Minimisers that know no hair: labelling on a pixel grid with a weighted quadratic smoothness term.
//!
//! | function | what it is | lower bound |
//! |---|---|---|
//! | [`coarse_to_fine`] | TRW-S over a pyramid, then label bands around the answer; the default | yes |
//! | [`trws`] | sequential tree-reweighted message passing (Kolmogorov 2006) | yes |
//! | [`winner_take_all`] | the cheapest label of every pixel by itself | of the data term |
//!
//! All of them give the same bits for the same problem whatever the number of threads.

mod coarse;
mod layout;
mod message;
mod problem;
mod pyramid;
mod simple;
mod trws;

pub use coarse::{CoarseToFineOptions, coarse_to_fine};
pub use problem::{GridProblem, MAX_MAGNITUDE, Solution, SolveError};
pub use simple::{icm, winner_take_all};
pub use trws::{TrwsOptions, trws};

/// Says whether the caller wants the work stopped; asked between sweeps, from the calling thread.
pub type Cancelled<'a> = &'a dyn Fn() -> bool;

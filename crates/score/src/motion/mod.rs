//! C1 to C7: a sequence of estimates against the true motion.

mod bands;
mod carrier;
mod flicker;
mod metrics;
mod points;
mod rows;
mod sequence;
mod sheet;

pub use metrics::motion_metrics;
pub use sequence::{SequenceScorer, flicker_floor_mm};
pub use sheet::{FrameFigures, SequenceSheet};

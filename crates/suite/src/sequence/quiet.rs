//! Progress of many frames as one bar.

use crate::stage::{Done, Progress};
use std::path::Path;
use strandbench_types::Monitor;

/// Passes a stop on and nothing else: the frames are counted by whoever works on them all.
pub(super) struct Quiet<'a>(pub &'a dyn Progress);

impl Monitor for Quiet<'_> {
    fn begin(&self, _: &str, _: u64) {}
    fn advance(&self, _: u64) {}
    fn cancelled(&self) -> bool {
        self.0.cancelled()
    }
}

impl Progress for Quiet<'_> {
    fn stage_begins(&self, _: &str, _: &Path, _: &str) {}
    fn stage_done(&self, _: &Done) {}
}

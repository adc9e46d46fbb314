//! A limit on the time that a cell may take.

use crate::{Done, Progress};
use std::path::Path;
use std::time::{Duration, Instant};
use strandbench_types::Monitor;

/// Passes progress on, and stops the work once its time is up.
pub(crate) struct Deadline<'a> {
    inner: &'a dyn Progress,
    limit: Option<(Instant, f64)>,
}

impl Deadline<'_> {
    /// A limit in seconds from now; one that no clock can hold is none.
    pub fn new(inner: &dyn Progress, limit_s: Option<f64>) -> Deadline<'_> {
        let until = |s: f64| Instant::now().checked_add(Duration::try_from_secs_f64(s).ok()?);
        Deadline { inner, limit: limit_s.and_then(|s| Some((until(s)?, s))) }
    }

    fn late(&self) -> bool {
        self.limit.is_some_and(|(until, _)| Instant::now() >= until)
    }

    /// The limit, if it and nobody outside stopped the work.
    pub fn passed(&self) -> Option<f64> {
        self.limit.filter(|_| self.late() && !self.inner.cancelled()).map(|(_, s)| s)
    }
}

impl Monitor for Deadline<'_> {
    fn begin(&self, what: &str, total: u64) {
        self.inner.begin(what, total);
    }

    fn advance(&self, steps: u64) {
        self.inner.advance(steps);
    }

    fn cancelled(&self) -> bool {
        self.inner.cancelled() || self.late()
    }
}

impl Progress for Deadline<'_> {
    fn stage_begins(&self, stage: &str, folder: &Path, reason: &str) {
        self.inner.stage_begins(stage, folder, reason);
    }

    fn stage_done(&self, done: &Done) {
        self.inner.stage_done(done);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use strandbench_types::Silent;

    struct Stopped;
    impl Monitor for Stopped {
        fn begin(&self, _: &str, _: u64) {}
        fn advance(&self, _: u64) {}
        fn cancelled(&self) -> bool {
            true
        }
    }
    impl Progress for Stopped {
        fn stage_begins(&self, _: &str, _: &Path, _: &str) {}
        fn stage_done(&self, _: &Done) {}
    }

    #[test]
    fn time_runs_out_and_a_stop_from_outside_is_no_time_out() {
        let (none, long, gone) = (
            Deadline::new(&Silent, None),
            Deadline::new(&Silent, Some(1e6)),
            Deadline::new(&Silent, Some(0.0)),
        );
        assert_eq!([none.cancelled(), long.cancelled(), gone.cancelled()], [false, false, true]);
        assert_eq!([none.passed(), long.passed(), gone.passed()], [None, None, Some(0.0)]);
        let stopped = Deadline::new(&Stopped, Some(0.0));
        assert_eq!((stopped.cancelled(), stopped.passed()), (true, None));
        assert!(!Deadline::new(&Silent, Some(f64::MAX)).cancelled());
    }
}

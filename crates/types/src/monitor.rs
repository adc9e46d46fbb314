//! How long work reports progress and learns that it should stop.

/// The work was stopped from outside before it finished.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("cancelled")]
pub struct Cancelled;

/// Receives progress from any thread; implementations must be cheap.
pub trait Monitor: Sync {
    /// A named piece of work of `total` steps begins.
    fn begin(&self, what: &str, total: u64);
    /// `steps` more steps are done.
    fn advance(&self, steps: u64);
    /// Whether the work should stop; long loops ask now and then and return [`Cancelled`].
    fn cancelled(&self) -> bool {
        false
    }
    /// `Err(Cancelled)` once the work should stop.
    ///
    /// # Errors
    /// [`Cancelled`] if [`Monitor::cancelled`] says so.
    fn check(&self) -> Result<(), Cancelled> {
        if self.cancelled() { Err(Cancelled) } else { Ok(()) }
    }
}

/// Passes on whether to stop and nothing else: for steps of a larger work that counts them itself.
pub struct StopOnly<'a>(pub &'a dyn Monitor);

impl Monitor for StopOnly<'_> {
    fn begin(&self, _what: &str, _total: u64) {}
    fn advance(&self, _steps: u64) {}
    fn cancelled(&self) -> bool {
        self.0.cancelled()
    }
}

/// Ignores progress and never stops.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Monitor for Silent {
    fn begin(&self, _what: &str, _total: u64) {}
    fn advance(&self, _steps: u64) {}
}

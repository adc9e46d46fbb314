//! What a method says about its own work.

use crate::BaselineError;
use std::time::Instant;
use strandbench_types::Monitor;

/// Stages, and what happened in them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Account {
    /// Name and wall seconds of each stage, in order; stages of one name add up.
    pub stages: Vec<(String, f64)>,
    /// What happened, a line each.
    pub notes: Vec<String>,
}

/// Times stages and tells the monitor.
pub(crate) struct Clock<'a> {
    pub monitor: &'a dyn Monitor,
    account: Account,
}

impl<'a> Clock<'a> {
    pub fn new(monitor: &'a dyn Monitor) -> Clock<'a> {
        Clock { monitor, account: Account::default() }
    }

    pub fn stage<T>(
        &mut self,
        name: &str,
        work: impl FnOnce() -> Result<T, BaselineError>,
    ) -> Result<T, BaselineError> {
        self.monitor.check()?;
        self.monitor.begin(name, 1);
        let start = Instant::now();
        let made = work()?;
        self.monitor.advance(1);
        let wall_s = start.elapsed().as_secs_f64();
        match self.account.stages.iter_mut().find(|(n, _)| n == name) {
            Some((_, s)) => *s += wall_s,
            None => self.account.stages.push((name.to_owned(), wall_s)),
        }
        Ok(made)
    }

    pub fn note(&mut self, line: String) {
        self.account.notes.push(line);
    }

    pub fn account(self) -> Account {
        self.account
    }
}

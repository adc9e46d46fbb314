//! Collects figures and brings them into the protocol's order.

use crate::metrics::{CHANCE_CORRECTED, metric, position};
use crate::sheet::Score;
use crate::stats::{percentile, share_within};

/// Order of subjects within a metric.
pub(crate) const SUBJECTS: [&str; 6] = ["method", "N0", "N1", "N2", "NC", "C"];

#[derive(Default)]
pub(crate) struct Rows {
    scores: Vec<Score>,
}

/// How much was wanted, and how much of it answered.
#[derive(Clone, Copy)]
pub(crate) struct Asked {
    pub wanted: usize,
    pub answered: usize,
}

impl Asked {
    /// Counts the finite values.
    pub fn of(errors: &[f64]) -> Asked {
        Asked { wanted: errors.len(), answered: errors.iter().filter(|e| e.is_finite()).count() }
    }

    pub fn coverage(self) -> f64 {
        if self.wanted == 0 { 0.0 } else { self.answered as f64 / self.wanted as f64 }
    }
}

impl Rows {
    /// Adds another's figures behind these.
    pub fn extend(&mut self, other: Rows) {
        self.scores.extend(other.scores);
    }

    /// Adds a figure; an infinite or undefined value becomes `None`.
    pub fn push(&mut self, subject: &str, id: &str, value: f64, asked: Asked) {
        let m = metric(id).expect("every metric computed is in the table");
        self.scores.push(Score {
            subject: subject.to_owned(),
            metric: id.to_owned(),
            value: value.is_finite().then_some(value),
            unit: m.unit.to_owned(),
            lower_is_better: m.lower_is_better,
            coverage: asked.coverage(),
            wanted: asked.wanted as u64,
        });
    }

    /// Median, 90th percentile and the shares within the tolerances of ascending angular errors.
    pub fn angles(&mut self, subject: &str, prefix: &str, ascending: &[f64]) {
        let asked = Asked::of(ascending);
        let mut push = |name: &str, v: f64| self.push(subject, &format!("{prefix}.{name}"), v, asked);
        push("median", percentile(ascending, 50));
        push("p90", percentile(ascending, 90));
        for deg in [10, 20, 30] {
            push(&format!("within_{deg}deg"), share_within(ascending, f64::from(deg)));
        }
    }

    /// Adds (S - N1) / (1 - N1) for every share S that has such a row (METRICS ground rule 8).
    pub fn chance_corrected(&mut self) {
        self.above_chance(CHANCE_CORRECTED);
    }

    /// The same for these shares.
    pub fn above_chance(&mut self, shares: &[(&str, &str)]) {
        for (share, corrected) in shares {
            let good = |s: &Score| s.value.map(|v| if s.lower_is_better { 1.0 - v } else { v });
            let of: Vec<Score> = self.scores.iter().filter(|s| s.metric == *share).cloned().collect();
            let chance = of.iter().find(|s| s.subject == "N1").and_then(good).unwrap_or(f64::NAN);
            for s in &of {
                // Where chance alone is perfect there is nothing to correct and nothing measured: no value.
                let value = good(s).map_or(f64::NAN, |v| (v - chance) / (1.0 - chance));
                let m = metric(corrected).expect("every corrected share is in the table");
                self.scores.push(Score {
                    metric: (*corrected).to_owned(),
                    value: value.is_finite().then_some(value),
                    lower_is_better: m.lower_is_better,
                    unit: m.unit.to_owned(),
                    ..s.clone()
                });
            }
        }
    }

    /// The figures by metric, then by subject.
    pub fn finish(mut self) -> Vec<Score> {
        self.scores.sort_by_cached_key(|s| {
            let subject = SUBJECTS.iter().position(|n| *n == s.subject);
            (position(&s.metric).unwrap_or(usize::MAX), s.metric.len(), s.metric.clone(), subject)
        });
        self.scores
    }
}

//! One figure against its limit.

use serde::{Deserialize, Serialize};

/// What a gate says.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The figure keeps its limit.
    Passed,
    /// It does not.
    Failed,
    /// It was not measured, for this reason; that is no pass.
    Ignored(String),
    /// Shown for people; it has no limit.
    Shown,
}

/// One figure of the cross-check.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Gate {
    /// 0 camera, 1 geometry, 2 scattering, 3 direct light, 4 images.
    pub level: u8,
    /// The reference job that it belongs to.
    pub case: String,
    /// What is measured.
    pub what: String,
    /// The figure; absent if it was not measured.
    pub value: Option<f64>,
    /// Its limit; absent if it has none.
    pub limit: Option<f64>,
    /// Unit of both.
    pub unit: String,
    /// What follows.
    pub verdict: Verdict,
    /// Where the limit comes from, or what the figure is made of.
    pub note: String,
}

impl Gate {
    /// A figure that must not exceed its limit; a figure that is not a number fails.
    pub fn at_most(level: u8, case: &str, what: &str, value: f64, limit: f64, unit: &str) -> Gate {
        let verdict = if value <= limit { Verdict::Passed } else { Verdict::Failed };
        Gate { limit: Some(limit), verdict, ..Gate::shown(level, case, what, value, unit) }
    }

    /// A figure that must not fall below its limit.
    pub fn at_least(level: u8, case: &str, what: &str, value: f64, limit: f64, unit: &str) -> Gate {
        let verdict = if value >= limit { Verdict::Passed } else { Verdict::Failed };
        Gate { limit: Some(limit), verdict, ..Gate::shown(level, case, what, value, unit) }
    }

    /// A figure without a limit.
    pub fn shown(level: u8, case: &str, what: &str, value: f64, unit: &str) -> Gate {
        Gate {
            level,
            case: case.to_owned(),
            what: what.to_owned(),
            value: Some(value),
            limit: None,
            unit: unit.to_owned(),
            verdict: Verdict::Shown,
            note: String::new(),
        }
    }

    /// A check that was not carried out.
    pub fn ignored(level: u8, case: &str, reason: &str) -> Gate {
        Gate {
            level,
            case: case.to_owned(),
            what: "the whole check".to_owned(),
            value: None,
            limit: None,
            unit: String::new(),
            verdict: Verdict::Ignored(reason.to_owned()),
            note: String::new(),
        }
    }

    /// The same with a note.
    #[must_use]
    pub fn because(self, note: impl Into<String>) -> Gate {
        Gate { note: note.into(), ..self }
    }
}

impl std::fmt::Display for Gate {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let word = match &self.verdict {
            Verdict::Passed => "ok     ",
            Verdict::Failed => "FAILED ",
            Verdict::Ignored(_) => "ignored",
            Verdict::Shown => "       ",
        };
        write!(f, "{word} {} {:<18} {:<46}", self.level, self.case, self.what)?;
        if let Some(value) = self.value {
            write!(f, " {:>12}", number(value))?;
        }
        if let Some(limit) = self.limit {
            write!(f, "  limit {}", number(limit))?;
        }
        write!(f, " {}", self.unit)?;
        if let Verdict::Ignored(reason) = &self.verdict {
            write!(f, " {reason}")?;
        }
        Ok(())
    }
}

/// Three digits that count.
pub(crate) fn number(v: f64) -> String {
    match v.abs() {
        0.0 => "0".to_owned(),
        a if a.fract() == 0.0 && a < 1e9 => format!("{v:.0}"),
        1e-2..1e4 => format!("{v:.4}"),
        _ => format!("{v:.2e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_a_number_fails() {
        for gate in [
            Gate::at_most(0, "c", "w", f64::NAN, 1.0, ""),
            Gate::at_least(0, "c", "w", f64::NAN, 1.0, ""),
            Gate::at_most(0, "c", "w", 1.0 + 1e-12, 1.0, ""),
            Gate::at_least(0, "c", "w", 0.5, 1.0, ""),
        ] {
            assert_eq!(gate.verdict, Verdict::Failed);
        }
        assert_eq!(Gate::at_most(0, "c", "w", 1.0, 1.0, "").verdict, Verdict::Passed);
    }
}

//! What an interval says beside a margin.

use crate::{Difference, StatsError};
use serde::{Deserialize, Serialize};

/// What the interval of `b - a` says. "No loss" needs a margin that was declared before looking.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// The whole interval lies on b's better side.
    Better,
    /// The whole interval lies on b's worse side, beyond the margin at least in part.
    Worse,
    /// The whole interval lies within the margin on both sides: equivalent.
    Equivalent,
    /// The interval's worse end lies within the margin: b is not worse than a by more than it.
    NotInferior,
    /// None of these.
    Undecided,
}

/// The verdict of an interval with `margin` (in the metric's unit, 0 for none). With the 95 % interval each one-sided
/// statement has an error rate of 2.5 %. Without an interval it is undecided, which a gate must take as a failure.
///
/// # Errors
/// If the margin is negative or not a number.
pub fn verdict(difference: &Difference, lower_is_better: bool, margin: f64) -> Result<Verdict, StatsError> {
    if !(margin >= 0.0 && margin.is_finite()) {
        let expected = "zero or a positive number in the metric's unit";
        return Err(StatsError::Option { name: "margin", value: margin.to_string(), expected });
    }
    let Some([low, high]) = difference.interval else { return Ok(Verdict::Undecided) };
    // As loss: positive is worse for b.
    let [least, most] = if lower_is_better { [low, high] } else { [-high, -low] };
    Ok(if least > -margin && most < margin || least == 0.0 && most == 0.0 {
        Verdict::Equivalent
    } else if most < 0.0 {
        Verdict::Better
    } else if least > 0.0 {
        Verdict::Worse
    } else if most < margin {
        Verdict::NotInferior
    } else {
        Verdict::Undecided
    })
}

//! The live check.

use crate::{Case, CrossError, Gate, Pictures, Size, Verdict, Witness, cases, judge_with_pictures};
use serde_json::Value;
use std::path::PathBuf;
use std::time::Instant;
use strandbench_types::Monitor;

/// What to check.
#[derive(Clone, Debug)]
pub struct Options {
    /// Levels, each 0..=4.
    pub levels: Vec<u8>,
    /// How much of each.
    pub size: Size,
    /// Folder of the report and of what the two sides exchange.
    pub out: PathBuf,
    /// A Python that has the witnesses; found or made if absent.
    pub python: Option<PathBuf>,
    /// Whether missing witnesses are an error, as in CI, instead of a reason to ignore every check.
    pub required: bool,
}

/// One case: gates, and how long each side took.
#[derive(Clone, Debug)]
pub struct Judged {
    /// The case.
    pub case: Case,
    /// Images, at level 4.
    pub pictures: Option<Pictures>,
    /// What follows.
    pub gates: Vec<Gate>,
    /// Wall seconds of the witness, with starting its process.
    pub witness_s: f64,
    /// Wall seconds of our side and the comparison.
    pub ours_s: f64,
}

/// All that was checked.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Case by case.
    pub judged: Vec<Judged>,
    /// The witnesses' versions; null if they are missing.
    pub versions: Value,
    /// Why nothing could be checked, if so.
    pub missing: Option<String>,
}

impl Outcome {
    /// All gates.
    pub fn gates(&self) -> impl Iterator<Item = &Gate> {
        self.judged.iter().flat_map(|j| &j.gates)
    }

    /// How many gates have the verdict that `test` accepts.
    pub fn count(&self, test: impl Fn(&Verdict) -> bool) -> usize {
        self.gates().filter(|g| test(&g.verdict)).count()
    }
}

/// Runs the cases of the levels asked for. Where the witnesses are missing and not required, every case is
/// ignored with the reason.
///
/// # Errors
/// If a job ends badly, the work is cancelled, or the witnesses are missing and required.
pub fn run(options: &Options, monitor: &dyn Monitor) -> Result<Outcome, CrossError> {
    run_where(options, |_| true, monitor)
}

/// The same with those cases alone that `wanted` holds for.
///
/// # Errors
/// As [`run`].
pub fn run_where(
    options: &Options,
    wanted: impl Fn(&Case) -> bool,
    monitor: &dyn Monitor,
) -> Result<Outcome, CrossError> {
    std::fs::create_dir_all(&options.out).map_err(|e| CrossError::file(&options.out, e))?;
    let mut all = Vec::new();
    for &level in &options.levels {
        all.extend(cases(level, options.size)?.into_iter().filter(&wanted));
    }
    let witness = match Witness::find(options.python.as_deref(), &options.out, monitor) {
        Ok(witness) => witness,
        Err(e @ CrossError::Missing { .. }) if !options.required => {
            return Ok(without_witness(all, &e.to_string()));
        }
        Err(e) => return Err(e),
    };
    monitor.begin("cross-check", all.len() as u64);
    let mut judged = Vec::new();
    for case in all {
        monitor.check()?;
        judged.push(one(case, &witness, monitor)?);
        monitor.advance(1);
    }
    let mut versions = witness.versions.clone();
    versions["llvm"] = Value::from(witness.has_llvm());
    Ok(Outcome { judged, versions, missing: None })
}

fn one(case: Case, witness: &Witness, monitor: &dyn Monitor) -> Result<Judged, CrossError> {
    let start = Instant::now();
    let answer = witness.answer(&case, monitor)?;
    let witness_s = start.elapsed().as_secs_f64();
    let start = Instant::now();
    let (gates, pictures) = judge_with_pictures(&case, &answer)?;
    Ok(Judged { case, pictures, gates, witness_s, ours_s: start.elapsed().as_secs_f64() })
}

fn without_witness(all: Vec<Case>, reason: &str) -> Outcome {
    let ignored = |case: Case| {
        let gates = vec![Gate::ignored(case.level, &case.name, reason)];
        Judged { case, pictures: None, gates, witness_s: 0.0, ours_s: 0.0 }
    };
    Outcome {
        judged: all.into_iter().map(ignored).collect(),
        versions: Value::Null,
        missing: Some(reason.to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use strandbench_types::Silent;

    #[test]
    fn without_witnesses_nothing_passes_and_where_they_are_required_it_is_an_error() {
        let out = tempfile::tempdir().unwrap();
        let options = Options {
            levels: vec![2, 3],
            size: Size::Quick,
            out: out.path().to_owned(),
            python: Some("/nowhere/python".into()),
            required: false,
        };
        let outcome = run(&options, &Silent).unwrap();
        assert!(outcome.missing.as_ref().is_some_and(|m| m.contains("mitsuba==")), "{:?}", outcome.missing);
        assert_eq!(outcome.gates().count(), 4);
        assert_eq!(outcome.count(|v| matches!(v, Verdict::Ignored(_))), 4);
        let e = run(&Options { required: true, ..options }, &Silent).unwrap_err();
        assert!(matches!(e, CrossError::Missing { .. }), "{e}");
    }
}

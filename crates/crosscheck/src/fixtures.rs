//! Committed answers of the witness.
//!
//! `renderer/mitsuba/make_fixtures.py` makes them: the example `export` writes the inputs, the jobs answer, and
//! the answer is kept with the hash of its input and the versions that gave it.

use crate::{Bundle, Case, CrossError, Gate, Size, cases, judge};
use std::path::{Path, PathBuf};

/// Levels that have fixtures.
pub const LEVELS: std::ops::RangeInclusive<u8> = 0..=3;

/// The cases of a level that have fixtures.
///
/// # Errors
/// As [`cases`].
pub fn fixture_cases(level: u8) -> Result<Vec<Case>, CrossError> {
    cases(level, Size::Fixture)
}

/// File of a case's answer in the folder of fixtures.
pub fn path_of(folder: &Path, case: &Case) -> PathBuf {
    folder.join(format!("level{}-{}.safetensors", case.level, case.name))
}

/// Writes each case's input to `folder`, with the case's job and hash in its metadata.
///
/// # Errors
/// If a file cannot be written.
pub fn export(folder: &Path) -> Result<Vec<PathBuf>, CrossError> {
    std::fs::create_dir_all(folder).map_err(|e| CrossError::file(folder, e))?;
    let mut written = Vec::new();
    for level in LEVELS {
        for case in fixture_cases(level)? {
            let path = path_of(folder, &case);
            let hash = case.input.hash();
            let input = case.input.with_meta("job", case.job).with_meta("input_hash", hash);
            input.write(&path)?;
            written.push(path);
        }
    }
    Ok(written)
}

/// Judges a case by its committed answer.
///
/// # Errors
/// If the fixture is not there, or was made for another input than the code makes now.
pub fn check(folder: &Path, case: &Case) -> Result<Vec<Gate>, CrossError> {
    let path = path_of(folder, case);
    let answer = Bundle::read(&path, &case.name)?;
    let made_for: String = answer.meta("input_hash")?;
    let hash = case.input.hash();
    if made_for != hash {
        return Err(CrossError::file(
            &path,
            format!(
                "it answers input {made_for}, the code now makes {hash}; if the change is meant, make the fixtures again with renderer/mitsuba/make_fixtures.py"
            ),
        ));
    }
    judge(case, &answer)
}

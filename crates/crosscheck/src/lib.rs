//! The renderer against witnesses that share no code with it: Mitsuba 3, Embree, and Marschner's model written
//! a second time from the paper.
//!
//! Level 0 compares cameras, 1 first hits and shadows, 2 scattering functions, 3 direct light without random
//! numbers, 4 images by their statistics. Each reference is a [`Case`]: arrays that our side makes, a job that
//! answers them in a process of its own, and a judge that works out our answer and holds both against limits
//! ([`Gate`]). The same cases are judged against committed answers ([`fixtures`]), so that most of it needs no
//! Mitsuba.

mod bundle;
mod camera;
mod direct;
mod error;
mod fixed;
pub mod fixtures;
mod gate;
mod geometry;
mod images;
mod python;
mod referee;
mod report;
mod run;
mod setting;
mod stats;
mod tables;

pub use bundle::{Array, Bundle, Element};
pub use error::CrossError;
pub use gate::{Gate, Verdict};
pub use images::Pictures;
pub use python::{Witness, environment};
pub use report::{as_json, write_report};
pub use run::{Judged, Options, Outcome, run, run_where};

/// How much is compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Size {
    /// What is committed as a fixture.
    Fixture,
    /// Minutes on two cores.
    Quick,
    /// On demand.
    Full,
}

/// One reference job and what it is asked.
#[derive(Clone, Debug)]
pub struct Case {
    /// 0..=4.
    pub level: u8,
    /// Unique name.
    pub name: String,
    /// Which job of the witness answers it.
    pub job: &'static str,
    /// What both sides work on.
    pub input: Bundle,
}

/// The cases of one level.
///
/// # Errors
/// If a scene of the catalogue cannot be built.
pub fn cases(level: u8, size: Size) -> Result<Vec<Case>, CrossError> {
    match level {
        0 => camera::cases(size),
        1 => geometry::cases(size),
        2 => Ok(tables::cases(size)),
        3 => Ok(direct::cases(size)),
        4 => Ok(images::cases(size)),
        _ => Ok(Vec::new()),
    }
}

/// Holds our answer against the witness'.
///
/// # Errors
/// If the answer lacks what the judge needs, or our side refuses the scene.
pub fn judge(case: &Case, answer: &Bundle) -> Result<Vec<Gate>, CrossError> {
    judge_with_pictures(case, answer).map(|j| j.0)
}

/// The same, with the images of level 4.
///
/// # Errors
/// As [`judge`].
pub fn judge_with_pictures(
    case: &Case,
    answer: &Bundle,
) -> Result<(Vec<Gate>, Option<Pictures>), CrossError> {
    let gates = match case.job {
        "image" => return images::judge(case, answer).map(|(g, p)| (g, Some(p))),
        "camera" => camera::judge(case, answer),
        "direct" => direct::judge(case, answer),
        "chiang" | "marschner" => tables::judge(case, answer),
        "geometry" | "triangles" => geometry::judge(case, answer),
        other => unreachable!("no judge for job {other}"),
    };
    gates.map(|g| (g, None))
}

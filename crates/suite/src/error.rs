//! Why a stage could not finish.

use std::path::{Path, PathBuf};
use strandbench_scenes::MotionError;

/// Why a stage of the main job could not finish. Nothing that it would have replaced has been touched.
#[derive(Debug, thiserror::Error)]
pub enum SuiteError {
    /// The scene cannot be read, built or seen; the text names the file, the place and the remedy.
    #[error("scene {scene}: {problem}")]
    Scene {
        /// Catalogue name or file.
        scene: String,
        /// What is wrong and what to do.
        problem: String,
    },
    /// A `key=value` override is unknown or malformed.
    #[error("--set {setting}: {problem}")]
    Setting {
        /// The override as it was given.
        setting: String,
        /// What is wrong and what to do.
        problem: String,
    },
    /// There is no such variant; the text lists those there are.
    #[error("{0}")]
    Variant(String),
    /// The renderer refused the scene.
    #[error("rendering scene {scene}: {problem}")]
    Render {
        /// Scene name.
        scene: String,
        /// What is wrong.
        problem: String,
    },
    /// The ground truth could not be made.
    #[error("ground truth of scene {scene}: {problem}")]
    Truth {
        /// Scene name.
        scene: String,
        /// What is wrong.
        problem: String,
    },
    /// The method refused the frame.
    #[error("reconstructing {} with {variant}: {problem}", folder.display())]
    Reconstruct {
        /// The frame folder.
        folder: PathBuf,
        /// Variant name.
        variant: String,
        /// What is wrong.
        problem: String,
    },
    /// A method from outside failed.
    #[error("method {method} {problem}{}", quoted(said))]
    Outside {
        /// Its name.
        method: String,
        /// What is wrong.
        problem: String,
        /// The end of what it wrote to standard error.
        said: String,
    },
    /// A method from outside took longer than it may.
    #[error("method {method} took more than the {limit_s} s that it may (time_limit_s){}", quoted(said))]
    OverTime {
        /// Its name.
        method: String,
        /// What it may take, s.
        limit_s: f64,
        /// The end of what it wrote to standard error.
        said: String,
    },
    /// A gate could not decide, which fails it.
    #[error("the gate stays shut: {problem}")]
    Gate {
        /// What is wrong and what to do.
        problem: String,
    },
    /// Two results cannot be compared.
    #[error("{a} and {b}: {problem}")]
    Compare {
        /// Baseline.
        a: String,
        /// The other.
        b: String,
        /// What is wrong and what to do.
        problem: String,
    },
    /// No score could be given.
    #[error("scoring {}: {problem}", folder.display())]
    Score {
        /// The estimate's folder.
        folder: PathBuf,
        /// What is wrong.
        problem: String,
    },
    /// A file or folder of the harness is missing, damaged or cannot be written.
    #[error("{}: {problem}", path.display())]
    File {
        /// The file or folder.
        path: PathBuf,
        /// What is wrong and what to do.
        problem: String,
    },
    /// A file that another crate reads or writes.
    #[error(transparent)]
    Io(#[from] strandbench_io::IoError),
    /// A scene that cannot be read or built.
    #[error(transparent)]
    SceneFile(#[from] strandbench_scenes::SceneError),
    /// A motion that cannot be computed or read back.
    #[error(transparent)]
    Motion(MotionError),
    /// Stopped from outside.
    #[error("cancelled; unfinished folders are removed, finished ones stand")]
    Cancelled,
}

/// What a program said last, if it said anything.
pub(crate) fn quoted(said: &str) -> String {
    if said.is_empty() { String::new() } else { format!("; it last said: {said}") }
}

impl SuiteError {
    pub(crate) fn file(path: &Path, problem: impl std::fmt::Display) -> SuiteError {
        SuiteError::File { path: path.to_owned(), problem: problem.to_string() }
    }
}

impl From<MotionError> for SuiteError {
    fn from(e: MotionError) -> SuiteError {
        match e {
            MotionError::Cancelled(_) => SuiteError::Cancelled,
            other => SuiteError::Motion(other),
        }
    }
}

impl From<strandbench_types::Cancelled> for SuiteError {
    fn from(_: strandbench_types::Cancelled) -> SuiteError {
        SuiteError::Cancelled
    }
}

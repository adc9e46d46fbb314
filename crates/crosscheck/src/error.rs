//! What can go wrong.

use std::path::PathBuf;
use strandbench_types::Cancelled;

/// Why a check could not be carried out. A check that was carried out and failed is no error but a
/// [`crate::Gate`].
#[derive(Debug, thiserror::Error)]
pub enum CrossError {
    /// A file could not be read or written.
    #[error("{path}: {fault}")]
    File {
        /// The file.
        path: PathBuf,
        /// What the system says.
        fault: String,
    },
    /// A bundle lacks an array, or has it in another shape or type than the check needs.
    #[error(
        "array {name} of {job}: {fault}; the two sides of the cross-check are of different versions: make the references again"
    )]
    Array {
        /// The reference job.
        job: String,
        /// The array.
        name: String,
        /// What is wrong.
        fault: String,
    },
    /// A witness is not on this machine.
    #[error("{what}; {remedy}")]
    Missing {
        /// What is missing.
        what: String,
        /// How to get it.
        remedy: String,
    },
    /// A reference job ended badly.
    #[error("reference job {job} {how}: {last}")]
    Job {
        /// The job.
        job: String,
        /// Exit code, signal or time limit.
        how: String,
        /// The last lines that it wrote to standard error.
        last: String,
    },
    /// Our own side refused the scene.
    #[error("{0}")]
    Ours(String),
    /// Stopped from outside.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl CrossError {
    pub(crate) fn file(path: impl Into<PathBuf>, fault: impl ToString) -> CrossError {
        CrossError::File { path: path.into(), fault: fault.to_string() }
    }
}

impl From<strandbench_renderer::RenderError> for CrossError {
    fn from(e: strandbench_renderer::RenderError) -> CrossError {
        CrossError::Ours(e.to_string())
    }
}

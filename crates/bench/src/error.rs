//! What can go wrong with a benchmark as a whole. A tracer that is missing is no error: it is left out, with the
//! reason.

use std::path::{Path, PathBuf};
use strandbench_renderer::RenderError;
use strandbench_types::Cancelled;

/// Why a benchmark did not finish.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// Options that cannot be followed.
    #[error("{0}")]
    Options(String),
    /// A file or folder.
    #[error("{}: {source}", path.display())]
    File {
        /// Which.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// This project's renderer refused the scene.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// Threads could not be started.
    #[error("{threads} threads could not be started: {reason}")]
    Threads {
        /// How many.
        threads: usize,
        /// What the system says.
        reason: String,
    },
    /// Another tracer's process stopped or answered with an error.
    #[error("{tracer}: {reason}")]
    Tracer {
        /// Which.
        tracer: String,
        /// What it said.
        reason: String,
    },
    /// Stopped from outside.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl BenchError {
    pub(crate) fn file(path: &Path) -> impl FnOnce(std::io::Error) -> BenchError {
        move |source| BenchError::File { path: path.into(), source }
    }
}

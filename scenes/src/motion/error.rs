//! Why a motion cannot be had.

use crate::SceneError;
use std::path::PathBuf;
use strandbench_io::IoError;
use strandbench_types::Cancelled;

/// Why a scene's motion cannot be computed, kept or read back.
#[derive(Debug, thiserror::Error)]
pub enum MotionError {
    /// The scene itself cannot be built.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The scene has no `[motion]`.
    #[error("scene {scene} has one pose; add [motion] with the number of frames")]
    Still {
        /// Name of the scene.
        scene: String,
    },
    /// A file of motion cannot be written.
    #[error(transparent)]
    Write(#[from] IoError),
    /// A file of motion cannot be used.
    #[error("{}: {problem}", path.display())]
    Cache {
        /// The file.
        path: PathBuf,
        /// What is wrong and what to do.
        problem: String,
    },
    /// A frame beyond the last was asked for.
    #[error("scene {scene} has frames 0 to {last}, not {frame}")]
    NoFrame {
        /// Name of the scene.
        scene: String,
        /// Frame asked for.
        frame: u32,
        /// Last frame there is.
        last: u32,
    },
    /// Stopped from outside.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

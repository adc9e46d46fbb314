//! Why a scene cannot be had.

use std::path::PathBuf;
use strandbench_io::IoError;

/// Why a scene cannot be read or built.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// The text is not TOML, has an unknown or a missing key, or a value of the wrong type.
    #[error("{}, line {line}: {problem}", path.display())]
    Syntax {
        /// The scene file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// What is wrong.
        problem: String,
    },
    /// A value is out of range.
    #[error("{}, line {line}: {key}: {problem}", path.display())]
    Value {
        /// The scene file.
        path: PathBuf,
        /// Line of the key, or of its table where the value is a default, from 1; 0 if neither is there.
        line: usize,
        /// Dotted key.
        key: String,
        /// What is wrong and what would be right.
        problem: String,
    },
    /// A scene built from values, not from a file, has one out of range.
    #[error("scene {scene}: {key}: {problem}")]
    Spec {
        /// Name of the scene.
        scene: String,
        /// Dotted key.
        key: String,
        /// What is wrong and what would be right.
        problem: String,
    },
    /// The hair or the head mesh of the scene cannot be read.
    #[error("scene {scene}: {source}")]
    File {
        /// Name of the scene.
        scene: String,
        /// What is wrong with the file.
        source: IoError,
    },
    /// The hair or the head mesh was read but does not make a scene.
    #[error("scene {scene}, {}: {problem}", path.display())]
    Hair {
        /// Name of the scene.
        scene: String,
        /// The file.
        path: PathBuf,
        /// What is wrong and what to do.
        problem: String,
    },
}

//! What can be wrong with a face.

use std::path::PathBuf;

/// Why a face cannot be had.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FaceError {
    /// The asset of the face is damaged.
    #[error("the face's asset, byte {at}: {problem}; derive it again with scenes/assets/derive_face.py")]
    Asset {
        /// Where reading stopped.
        at: usize,
        /// What is wrong.
        problem: String,
    },
    /// An expression that the face does not have.
    #[error("the face has no expression {name:?}; it has {known}")]
    Unknown {
        /// The name asked for.
        name: String,
        /// The names there are.
        known: String,
    },
    /// A weight of an expression out of range.
    #[error("expression {name}: weight {weight} is not between 0 and 1")]
    Weight {
        /// The expression.
        name: String,
        /// The weight.
        weight: f32,
    },
    /// A value of the description out of range.
    #[error("face.{key}: {value} is not between {low} and {high}")]
    Value {
        /// Key within the face's table.
        key: &'static str,
        /// The value.
        value: f64,
        /// Lowest that is right.
        low: f64,
        /// Highest that is right.
        high: f64,
    },
    /// A value of a patch of hair out of range, or hair that cannot be grown.
    #[error("{key}: {problem}")]
    Hair {
        /// Dotted key within the scene.
        key: String,
        /// What is wrong.
        problem: String,
    },
    /// A folder or file of a face model from outside is not one.
    #[error("{}: {problem}", path.display())]
    File {
        /// The file or folder.
        path: PathBuf,
        /// What is wrong and what to do.
        problem: String,
    },
}

//! What can be wrong with a file.

use std::path::{Path, PathBuf};

/// What is wrong with a file, where, and what to do.
#[derive(Debug, thiserror::Error)]
#[error("{}: {problem}", path.display())]
pub struct IoError {
    /// The file or folder.
    pub path: PathBuf,
    /// Place, fault and remedy.
    pub problem: String,
}

/// What is wrong with the content of a file, before the file has a name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{place}: {fault}; {remedy}")]
pub struct FormatError {
    /// Byte, line, strand, element or option at fault.
    pub place: String,
    /// What is wrong there.
    pub fault: String,
    /// What the user can do.
    pub remedy: String,
}

pub(crate) type Result<T> = std::result::Result<T, IoError>;
pub(crate) type Parsed<T> = std::result::Result<T, FormatError>;

impl FormatError {
    pub(crate) fn new(place: impl Into<String>, fault: impl Into<String>, remedy: impl Into<String>) -> Self {
        FormatError { place: place.into(), fault: fault.into(), remedy: remedy.into() }
    }

    pub(crate) fn at_byte(offset: usize, fault: impl Into<String>, remedy: impl Into<String>) -> Self {
        FormatError::new(format!("byte {offset}"), fault, remedy)
    }

    pub(crate) fn at_strand(strand: usize, fault: impl Into<String>, remedy: impl Into<String>) -> Self {
        FormatError::new(format!("strand {strand}"), fault, remedy)
    }

    pub(crate) fn in_file(self, path: &Path) -> IoError {
        IoError::new(path, self.to_string())
    }
}

impl IoError {
    pub(crate) fn new(path: &Path, problem: impl Into<String>) -> IoError {
        IoError { path: path.to_owned(), problem: problem.into() }
    }

    pub(crate) fn os(path: &Path, verb: &str, error: &std::io::Error) -> IoError {
        let remedy = match error.kind() {
            std::io::ErrorKind::NotFound => "check the path",
            std::io::ErrorKind::PermissionDenied => "check the permissions",
            std::io::ErrorKind::StorageFull => "free some space",
            _ => "see the system's message",
        };
        IoError::new(path, format!("cannot {verb}: {error}; {remedy}"))
    }
}

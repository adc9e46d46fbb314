//! One writer at a time in an output folder.

use crate::SuiteError;
use std::fs::{File, TryLockError};
use std::path::Path;

/// The file that marks an output folder as this program's, and is locked while something writes there.
pub const LOCK_FILE: &str = ".strandbench.lock";

/// Holds an output folder until dropped, or until the process ends in any way.
#[derive(Debug)]
pub struct Lock {
    _file: File,
}

impl Lock {
    /// Makes the folder if need be and takes it.
    ///
    /// # Errors
    /// If the folder cannot be made, or another process is writing there.
    pub fn take(out: &Path) -> Result<Lock, SuiteError> {
        std::fs::create_dir_all(out)
            .map_err(|e| SuiteError::file(out, format!("cannot make this folder: {e}")))?;
        let path = out.join(LOCK_FILE);
        let file = File::options()
            .create(true)
            .truncate(false)
            .write(true)
            .open(&path)
            .map_err(|e| SuiteError::file(&path, e))?;
        match file.try_lock() {
            Ok(()) => Ok(Lock { _file: file }),
            Err(TryLockError::WouldBlock) => {
                Err(SuiteError::file(out, "another run is writing here; wait for it or choose another --out"))
            }
            Err(TryLockError::Error(e)) => Err(SuiteError::file(&path, e)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_second_writer_is_refused_until_the_first_is_done() {
        let dir = tempfile::tempdir().unwrap();
        let out = dir.path().join("out");
        let first = Lock::take(&out).unwrap();
        assert!(Lock::take(&out).unwrap_err().to_string().contains("another run"));
        drop(first);
        Lock::take(&out).unwrap();
    }
}

//! One writer at a time in an output folder, or several workers that keep out of each other's way.

use crate::stage::Progress;
use crate::{SuiteError, hash};
use std::fs::{File, TryLockError};
use std::path::Path;
use std::time::Duration;

/// The file that marks an output folder as this program's, and is locked while something writes there.
pub const LOCK_FILE: &str = ".strandbench.lock";

/// Holds an output folder until dropped, or until the process ends in any way.
#[derive(Debug)]
pub struct Lock {
    _file: File,
}

/// Folder of the locks that [`Lock::part`] takes.
const PARTS: &str = ".locks";

/// Who else may hold a lock meanwhile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Hold {
    /// Nobody: something is written.
    Alone,
    /// Others that only read.
    Shared,
}

impl Lock {
    /// Makes the folder if need be and takes it as its only writer.
    ///
    /// # Errors
    /// If the folder cannot be made, or another process is writing there.
    pub fn take(out: &Path) -> Result<Lock, SuiteError> {
        Lock::now(out, Hold::Alone)
    }

    /// Makes the folder if need be and takes it as one of several workers, each of which holds the parts that it
    /// writes ([`Lock::part`]).
    ///
    /// # Errors
    /// If the folder cannot be made, or a run has taken it for itself.
    pub fn share(out: &Path) -> Result<Lock, SuiteError> {
        Lock::now(out, Hold::Shared)
    }

    /// As [`Lock::take`], but waits for the workers that hold it.
    ///
    /// # Errors
    /// If the folder cannot be made, or the wait is cancelled.
    pub fn wait(out: &Path, progress: &dyn Progress) -> Result<Lock, SuiteError> {
        Lock::patient(open(out, LOCK_FILE)?, out, Hold::Alone, progress)
    }

    /// Waits for a part of an output folder, whatever its name, whoever holds it. Held until dropped, or until the
    /// process ends in any way.
    ///
    /// # Errors
    /// If the lock's file cannot be made, or the wait is cancelled.
    pub fn part(out: &Path, name: &str, hold: Hold, progress: &dyn Progress) -> Result<Lock, SuiteError> {
        let file = format!("{}.lock", hash::of_bytes(name.as_bytes()));
        Lock::patient(open(&out.join(PARTS), &file)?, &out.join(name), hold, progress)
    }

    fn now(out: &Path, hold: Hold) -> Result<Lock, SuiteError> {
        let file = open(out, LOCK_FILE)?;
        if attempt(&file, out, hold)? {
            return Ok(Lock { _file: file });
        }
        Err(SuiteError::file(out, "another run is writing here; wait for it or choose another --out"))
    }

    fn patient(file: File, shown: &Path, hold: Hold, progress: &dyn Progress) -> Result<Lock, SuiteError> {
        while !attempt(&file, shown, hold)? {
            progress.check()?;
            std::thread::sleep(PATIENCE);
        }
        Ok(Lock { _file: file })
    }
}

/// Time between two looks at a lock that another process holds.
const PATIENCE: Duration = Duration::from_millis(100);

fn open(dir: &Path, name: &str) -> Result<File, SuiteError> {
    std::fs::create_dir_all(dir)
        .map_err(|e| SuiteError::file(dir, format!("cannot make this folder: {e}")))?;
    let path = dir.join(name);
    let file = File::options().create(true).truncate(false).write(true).open(&path);
    file.map_err(|e| SuiteError::file(&path, e))
}

fn attempt(file: &File, shown: &Path, hold: Hold) -> Result<bool, SuiteError> {
    let held = match hold {
        Hold::Alone => file.try_lock(),
        Hold::Shared => file.try_lock_shared(),
    };
    match held {
        Ok(()) => Ok(true),
        Err(TryLockError::WouldBlock) => Ok(false),
        Err(TryLockError::Error(e)) => Err(SuiteError::file(shown, e)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use strandbench_types::Silent;

    #[test]
    fn a_second_writer_is_refused_until_the_first_is_done() {
        let dir = tempfile::tempdir().unwrap();
        let out = dir.path().join("out");
        let first = Lock::take(&out).unwrap();
        assert!(Lock::take(&out).unwrap_err().to_string().contains("another run"));
        drop(first);
        Lock::take(&out).unwrap();
    }

    #[test]
    fn workers_share_a_folder_that_no_run_may_take_and_a_part_has_one_writer() {
        let dir = tempfile::tempdir().unwrap();
        let out = dir.path();
        let (one, two) = (Lock::share(out).unwrap(), Lock::share(out).unwrap());
        assert!(Lock::take(out).is_err());
        let part = Lock::part(out, "scene/render", Hold::Alone, &Silent).unwrap();
        Lock::part(out, "another", Hold::Alone, &Silent).unwrap();
        let waited = std::thread::scope(|scope| {
            let start = std::time::Instant::now();
            let waits = scope.spawn(move || {
                Lock::part(out, "scene/render", Hold::Shared, &Silent).unwrap();
                start.elapsed()
            });
            std::thread::sleep(PATIENCE * 3);
            drop(part);
            waits.join().unwrap()
        });
        assert!(waited >= PATIENCE * 3, "{waited:?}");
        drop((one, two));
        let alone = Lock::wait(out, &Silent).unwrap();
        assert!(Lock::share(out).is_err());
        drop(alone);
    }
}

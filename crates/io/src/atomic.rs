//! Files and folders that are there whole or not at all.

use crate::error::{IoError, Result};
use std::ffi::OsStr;
use std::fs;
use std::io::{self, BufWriter, Write};
use std::path::Path;

/// Stands in a folder while its files are being exchanged; a reader refuses such a folder.
pub(crate) const INCOMPLETE: &str = ".incomplete";

fn parent_of(path: &Path) -> Result<&Path> {
    match (path.parent(), path.file_name()) {
        (Some(p), Some(_)) if p.as_os_str().is_empty() => Ok(Path::new(".")),
        (Some(p), Some(_)) => Ok(p),
        _ => Err(IoError::new(path, "this path names no file or folder of its own; give one with a name")),
    }
}

/// Runs `make` on a builder of temporary names beside `path`, with the permissions of a plain create.
fn beside<T>(
    path: &Path,
    mode: u32,
    make: impl FnOnce(&tempfile::Builder<'_, '_>) -> io::Result<T>,
) -> io::Result<T> {
    let mut prefix = OsStr::new(".").to_owned();
    prefix.push(path.file_name().unwrap_or_default());
    prefix.push(".");
    let mut builder = tempfile::Builder::new();
    builder.prefix(&prefix).suffix(".part");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        // The system applies the umask to it.
        builder.permissions(fs::Permissions::from_mode(mode));
    }
    #[cfg(not(unix))]
    let _ = mode;
    make(&builder)
}

/// Writes a file beside its place and renames it there, so that it is never seen half-written.
///
/// # Errors
/// If the folder does not exist or the file cannot be written; an old file is then as it was.
pub fn atomic_write(path: &Path, fill: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<()> {
    let os = |e: io::Error| IoError::os(path, "write", &e);
    let parent = parent_of(path)?;
    let mut temp = beside(path, 0o666, |b| b.tempfile_in(parent)).map_err(os)?;
    {
        let mut w = BufWriter::with_capacity(1 << 20, temp.as_file_mut());
        fill(&mut w).map_err(os)?;
        w.flush().map_err(os)?;
    }
    temp.persist(path).map_err(|e| os(e.error))?;
    Ok(())
}

/// Lets `fill` write into a new folder beside `dir` and puts it in the place of `dir` at the end; whatever
/// `dir` held before is gone then, and untouched until then. If `fill` fails, nothing is left behind.
///
/// # Errors
/// What `fill` returns, or if the folder cannot be created or moved.
pub fn atomic_folder<T, E: From<IoError>>(
    dir: &Path,
    fill: impl FnOnce(&Path) -> std::result::Result<T, E>,
) -> std::result::Result<T, E> {
    let os = |verb, e: &io::Error| IoError::os(dir, verb, e);
    let parent = parent_of(dir)?;
    fs::create_dir_all(parent).map_err(|e| os("create the parent folder", &e))?;
    if dir.exists() && !dir.is_dir() {
        return Err(IoError::new(dir, "a file stands where a folder should go; move it away").into());
    }
    let temp = beside(dir, 0o777, |b| b.tempdir_in(parent)).map_err(|e| os("create a folder beside", &e))?;
    let value = fill(temp.path())?;
    if dir.exists() {
        let old = beside(dir, 0o777, |b| b.tempdir_in(parent)).map_err(|e| os("move the old folder", &e))?;
        let kept = old.path().join("old");
        fs::rename(dir, &kept).map_err(|e| os("move the old folder", &e))?;
        if let Err(e) = fs::rename(temp.path(), dir) {
            // The old folder goes back where it was; should that fail too, it is kept.
            if fs::rename(&kept, dir).is_err() {
                let _ = old.keep();
            }
            return Err(os("move the new folder", &e).into());
        }
    } else {
        fs::rename(temp.path(), dir).map_err(|e| os("move the new folder", &e))?;
    }
    // The path of `temp` is gone, so its clean-up has nothing to do.
    let _ = temp.keep();
    Ok(value)
}

/// Lets `fill` write files into a folder beside `dir`, then moves them into `dir`, leaving what else `dir`
/// holds except files for which `stale` says that they belong to an older writing of the same kind. A new
/// `dir` appears whole; in an old one a marker stands while files are exchanged.
pub(crate) fn merge_folder(
    dir: &Path,
    stale: impl Fn(&str) -> bool,
    fill: impl FnOnce(&Path) -> Result<()>,
) -> Result<()> {
    if !dir.exists() {
        return atomic_folder(dir, fill);
    }
    let os = |verb, e: &io::Error| IoError::os(dir, verb, e);
    if !dir.is_dir() {
        return Err(IoError::new(dir, "a file stands where a folder should go; move it away"));
    }
    let parent = parent_of(dir)?;
    let staged =
        beside(dir, 0o777, |b| b.tempdir_in(parent)).map_err(|e| os("create a folder beside", &e))?;
    fill(staged.path())?;
    let list = |d: &Path| -> io::Result<Vec<std::ffi::OsString>> {
        fs::read_dir(d)?.map(|e| e.map(|e| e.file_name())).collect()
    };
    let new = list(staged.path()).map_err(|e| os("list the new files", &e))?;
    let old = list(dir).map_err(|e| os("list", &e))?;
    let marker = dir.join(INCOMPLETE);
    fs::write(&marker, b"files of this folder are being exchanged\n").map_err(|e| os("write into", &e))?;
    for name in old.iter().filter(|n| !new.contains(n) && n.to_str().is_some_and(&stale)) {
        fs::remove_file(dir.join(name)).map_err(|e| os("remove an older file", &e))?;
    }
    for name in &new {
        fs::rename(staged.path().join(name), dir.join(name)).map_err(|e| os("move a new file", &e))?;
    }
    fs::remove_file(&marker).map_err(|e| os("remove the marker", &e))
}

/// Refuses what is not a folder, and a folder that a writer left half exchanged.
pub(crate) fn check_folder(dir: &Path) -> Result<()> {
    if !dir.is_dir() {
        return Err(IoError::new(
            dir,
            "there is no such folder; check the path or run the stage that makes it",
        ));
    }
    if dir.join(INCOMPLETE).exists() {
        return Err(IoError::new(dir, "the folder was left half-written; run the stage that makes it again"));
    }
    Ok(())
}

#[cfg(test)]
mod tests;

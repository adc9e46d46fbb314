//! Virtual environments of programs in Python.

use super::INSTALL_LIMIT;
use super::process::finish;
use crate::CrossError;
use std::path::{Path, PathBuf};
use std::process::Command;
use strandbench_types::Monitor;

/// The Python of a virtual environment with these pinned requirements (the text of a `requirements.txt`), made once per
/// content below the user's cache folder, or below `out` where there is none.
///
/// # Errors
/// [`CrossError::Missing`] with the remedy if there is no Python or no package index, or if stopped from outside.
pub fn environment(
    name: &str,
    requirements: &str,
    out: &Path,
    monitor: &dyn Monitor,
) -> Result<PathBuf, CrossError> {
    let hash = blake3::hash(requirements.as_bytes()).to_hex()[..12].to_owned();
    let cache = std::env::var_os("XDG_CACHE_HOME")
        .map(PathBuf::from)
        .or_else(|| std::env::var_os("LOCALAPPDATA").map(PathBuf::from))
        .or_else(|| std::env::var_os("HOME").map(|h| PathBuf::from(h).join(".cache")));
    let folder = match cache {
        Some(c) => c.join("strandbench").join(format!("{name}-{hash}")),
        None => out.join(".venv"),
    };
    let python = folder.join(if cfg!(windows) { "Scripts/python.exe" } else { "bin/python" });
    let stamp = folder.join("installed-requirements.txt");
    if python.exists() && std::fs::read_to_string(&stamp).is_ok_and(|have| have == requirements) {
        return Ok(python);
    }
    monitor.begin("install Python packages", 1);
    let missing = |what: &str, e: CrossError| match e {
        CrossError::Cancelled(_) => e,
        e => CrossError::Missing {
            what: format!("{what} ({e})"),
            remedy: format!(
                "Python 3.9 or newer with venv and pip is needed, and a package index; or name a Python in STRANDBENCH_PYTHON \
                 that has {}",
                requirements.lines().filter(|l| !l.starts_with('#')).collect::<Vec<_>>().join(", ")
            ),
        },
    };
    let starter = std::env::var_os("STRANDBENCH_BASE_PYTHON").unwrap_or_else(|| "python3".into());
    let mut venv = Command::new(starter);
    venv.args(["-m", "venv", "--clear"]).arg(&folder);
    finish("venv", &mut venv, INSTALL_LIMIT, monitor).map_err(|e| missing("no virtual environment", e))?;
    let list = folder.join("requirements.txt");
    std::fs::write(&list, requirements).map_err(|e| CrossError::file(&list, e))?;
    let mut pip = Command::new(&python);
    pip.args(["-m", "pip", "--quiet", "--disable-pip-version-check", "install", "-r"]).arg(&list);
    finish("pip", &mut pip, INSTALL_LIMIT, monitor)
        .map_err(|e| missing("the packages were not installed", e))?;
    std::fs::write(&stamp, requirements).map_err(|e| CrossError::file(&stamp, e))?;
    monitor.advance(1);
    Ok(python)
}

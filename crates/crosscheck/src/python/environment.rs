//! The virtual environment of the witnesses.

use super::process::finish;
use super::{INSTALL_LIMIT, REQUIREMENTS};
use crate::CrossError;
use std::path::{Path, PathBuf};
use std::process::Command;
use strandbench_types::Monitor;

/// A virtual environment with the pinned requirements, made once per content of their file.
pub(super) fn environment(out: &Path, monitor: &dyn Monitor) -> Result<PathBuf, CrossError> {
    let hash = blake3::hash(REQUIREMENTS.as_bytes()).to_hex()[..12].to_owned();
    let cache = std::env::var_os("XDG_CACHE_HOME")
        .map(PathBuf::from)
        .or_else(|| std::env::var_os("LOCALAPPDATA").map(PathBuf::from))
        .or_else(|| std::env::var_os("HOME").map(|h| PathBuf::from(h).join(".cache")));
    let folder = match cache {
        Some(c) => c.join("strandbench").join(format!("witness-{hash}")),
        None => out.join(".venv"),
    };
    let python = folder.join(if cfg!(windows) { "Scripts/python.exe" } else { "bin/python" });
    let stamp = folder.join("installed-requirements.txt");
    if python.exists() && std::fs::read_to_string(&stamp).is_ok_and(|have| have == REQUIREMENTS) {
        return Ok(python);
    }
    monitor.begin("install Mitsuba", 1);
    let missing = |what: &str, e: CrossError| {
        match e {
        CrossError::Cancelled(_) => e,
        e => CrossError::Missing {
            what: format!("{what} ({e})"),
            remedy: "the cross-check needs Python 3.9 or newer with venv and pip, and a package index; or name a Python that has the packages of renderer/mitsuba/requirements.txt in STRANDBENCH_PYTHON".into(),
        },
    }
    };
    let starter = std::env::var_os("STRANDBENCH_BASE_PYTHON").unwrap_or_else(|| "python3".into());
    let mut venv = Command::new(starter);
    venv.args(["-m", "venv", "--clear"]).arg(&folder);
    finish("venv", &mut venv, INSTALL_LIMIT, monitor).map_err(|e| missing("no virtual environment", e))?;
    let list = out.join("witness/requirements.txt");
    std::fs::write(&list, REQUIREMENTS).map_err(|e| CrossError::file(&list, e))?;
    let mut pip = Command::new(&python);
    pip.args(["-m", "pip", "--quiet", "--disable-pip-version-check", "install", "-r"]).arg(&list);
    finish("pip", &mut pip, INSTALL_LIMIT, monitor).map_err(|e| missing("Mitsuba was not installed", e))?;
    std::fs::write(&stamp, REQUIREMENTS).map_err(|e| CrossError::file(&stamp, e))?;
    monitor.advance(1);
    Ok(python)
}

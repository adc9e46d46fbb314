//! Methods of the field, in Python, that come with the program and are run as methods from outside.

use crate::SuiteError;
use crate::outside::CONFIG_FILE;
use std::path::{Path, PathBuf};

/// A method of the field.
#[derive(Clone, Copy, Debug)]
pub struct Baseline {
    /// Name of the method in the configuration.
    pub name: &'static str,
    /// What it asks or is.
    pub asks: &'static str,
    /// Arguments of Python: a program of [`PROGRAMS`] and what it takes.
    pub arguments: &'static [&'static str],
    /// Longest that it may work on a cell, s: ten times what the largest scene of the catalogue takes.
    pub time_limit_s: u32,
}

/// The baselines, in order of the table.
pub const BASELINES: &[Baseline] = &[
    Baseline {
        name: "opencv-sgbm",
        asks: "OpenCV's semi-global matching in the three pairs with the reference camera, fused by the median",
        arguments: &["opencv_sgbm.py", "{input}", "{output}"],
        time_limit_s: 600,
    },
    Baseline {
        name: "beeler-ncc",
        asks: "pyramid stereo by NCC with refinement of the surface, after Beeler et al. 2010 (Fig. 14)",
        arguments: &["beeler_ncc.py", "{input}", "{output}"],
        time_limit_s: 1800,
    },
    Baseline {
        name: "plane-sweep",
        asks: "the worked example: plane sweep with NCC over all cameras, no smoothness",
        arguments: &["plane_sweep.py", "{input}", "{output}"],
        time_limit_s: 600,
    },
];

/// The programs of [`BASELINES`] with their text, so that they are there without the source tree.
pub const PROGRAMS: &[(&str, &str)] = &[
    ("dataset.py", include_str!("../../../reports/baselines/dataset.py")),
    ("opencv_sgbm.py", include_str!("../../../reports/baselines/opencv_sgbm.py")),
    ("beeler_ncc.py", include_str!("../../../reports/baselines/beeler_ncc.py")),
    ("plane_sweep.py", include_str!("../../../reports/baselines/plane_sweep.py")),
];

/// What their Python needs.
pub const REQUIREMENTS: &str = include_str!("../../../reports/baselines/requirements.txt");

/// Writes the programs and a configuration that runs them with `python` into a folder; other files of it stay.
/// Returns the configuration.
///
/// # Errors
/// If there is a configuration of somebody else in it, or a file cannot be written.
pub fn write(out: &Path, python: &Path) -> Result<PathBuf, SuiteError> {
    const MARK: &str = "# Written by `strandbench baselines config`";
    let path = out.join(CONFIG_FILE);
    if std::fs::read_to_string(&path).is_ok_and(|text| !text.starts_with(MARK)) {
        return Err(SuiteError::file(&path, "is another configuration; choose another folder"));
    }
    std::fs::create_dir_all(out).map_err(|e| SuiteError::file(out, e))?;
    let put = |name: &str, text: &str| {
        let path = out.join(name);
        strandbench_io::atomic_write(&path, |w| w.write_all(text.as_bytes()))
    };
    for (name, text) in PROGRAMS.iter().chain(&[("requirements.txt", REQUIREMENTS)]) {
        put(name, text)?;
    }
    let mut text = format!("{MARK}: methods of the field as programs of their own.\n");
    for b in BASELINES {
        let python = python.display().to_string();
        let words: Vec<toml::Value> = std::iter::once(python.as_str())
            .chain(b.arguments.iter().copied())
            .map(toml::Value::from)
            .collect();
        text.push_str(&format!(
            "\n[method.{}]\nasks = {}\ncommand = {}\ntime_limit_s = {}\nmemory_limit_mib = 8000\nfiles = [\"dataset.py\", \"requirements.txt\"]\n",
            b.name,
            toml::Value::from(b.asks),
            toml::Value::from(words),
            b.time_limit_s
        ));
        if !cfg!(target_os = "linux") {
            text = text.replace("memory_limit_mib = 8000\n", "");
        }
    }
    put(CONFIG_FILE, &text)?;
    Ok(path)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::outside::Config;

    #[test]
    fn the_configuration_that_is_written_is_read_and_another_is_left_alone() {
        let dir = tempfile::tempdir().unwrap();
        let python = Path::new("/opt/a \"b\"/python");
        let path = write(dir.path(), python).unwrap();
        let config = Config::load(Some(&path)).unwrap();
        assert_eq!(config.methods.len(), BASELINES.len());
        for b in BASELINES {
            let m = config.method(b.name).unwrap();
            assert_eq!(Path::new(&m.command[0]), python);
            assert!(m.folder.join(&m.command[1]).is_file(), "{}", b.name);
            assert!(!m.head, "the same as the built-in methods are given");
        }
        write(dir.path(), python).unwrap();
        std::fs::write(&path, "# mine\n").unwrap();
        assert!(write(dir.path(), python).unwrap_err().to_string().contains("another configuration"));
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "# mine\n");
    }
}

//! The witnesses' Python: found or made, asked what it has, and run one process a job.

mod environment;
mod process;

use crate::{Bundle, Case, CrossError};
pub use environment::environment;
use process::finish;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;
use strandbench_types::Monitor;

/// What the environment is made of.
pub const REQUIREMENTS: &str = include_str!("../../../../renderer/mitsuba/requirements.txt");

/// The programs, so that they are there without the source tree.
const PROGRAMS: &[(&str, &str)] = &[
    ("exchange.py", include_str!("../../../../renderer/mitsuba/exchange.py")),
    ("jobs.py", include_str!("../../../../renderer/mitsuba/jobs.py")),
    ("marschner.py", include_str!("../../../../renderer/mitsuba/marschner.py")),
    ("marschner_bsdf.py", include_str!("../../../../renderer/mitsuba/marschner_bsdf.py")),
    ("probe.py", include_str!("../../../../renderer/mitsuba/probe.py")),
    ("rays.py", include_str!("../../../../renderer/mitsuba/rays.py")),
    ("scene.py", include_str!("../../../../renderer/mitsuba/scene.py")),
    ("witness.py", include_str!("../../../../renderer/mitsuba/witness.py")),
];

/// Oldest Mitsuba that is a witness: before it, sampling of hair has numeric faults.
const OLDEST_MITSUBA: [u32; 3] = [3, 9, 1];
/// How long one job may take.
const JOB_LIMIT: Duration = Duration::from_secs(3600);
/// How long making the environment may take.
const INSTALL_LIMIT: Duration = Duration::from_secs(900);
/// Where libLLVM 19 or 22 may lie; 14 is refused by drjit, 15 and 16 end the process on some processors.
const LLVM_PLACES: &[&str] = &[
    "/usr/lib/x86_64-linux-gnu/libLLVM.so.22.1",
    "/usr/lib/llvm-22/lib/libLLVM.so",
    "/usr/lib/x86_64-linux-gnu/libLLVM.so.19.1",
    "/usr/lib/aarch64-linux-gnu/libLLVM.so.19.1",
    "/usr/lib/llvm-19/lib/libLLVM.so",
    "/usr/lib64/libLLVM.so.19.1",
    "/opt/homebrew/opt/llvm@19/lib/libLLVM.dylib",
    "/opt/homebrew/opt/llvm/lib/libLLVM.dylib",
];

/// A Python that has the witnesses.
#[derive(Clone, Debug)]
pub struct Witness {
    python: PathBuf,
    programs: PathBuf,
    work: PathBuf,
    /// libLLVM for the vectorised variant, if one that works was found.
    llvm: Option<PathBuf>,
    /// Versions, as it says itself.
    pub versions: Value,
}

impl Witness {
    /// Finds the witnesses or makes an environment for them: `python` if given, `STRANDBENCH_PYTHON` if it
    /// has them, else a virtual environment in the user's cache folder (in `out` where there is none). Programs
    /// and exchanged files go below `out`.
    ///
    /// # Errors
    /// [`CrossError::Missing`] with the remedy if there is no Python, no package index, or an old Mitsuba.
    pub fn find(python: Option<&Path>, out: &Path, monitor: &dyn Monitor) -> Result<Witness, CrossError> {
        let programs = out.join("witness");
        let work = out.join("exchange");
        for folder in [&programs, &work] {
            std::fs::create_dir_all(folder).map_err(|e| CrossError::file(folder, e))?;
        }
        for (name, text) in PROGRAMS {
            let path = programs.join(name);
            std::fs::write(&path, text).map_err(|e| CrossError::file(&path, e))?;
        }
        let at = |python: &Path| Witness {
            python: python.to_owned(),
            programs: programs.clone(),
            work: work.clone(),
            llvm: None,
            versions: Value::Null,
        };
        if let Some(python) = python {
            return at(python).probed(monitor);
        }
        if let Some(python) = std::env::var_os("STRANDBENCH_PYTHON")
            && let Ok(witness) = at(Path::new(&python)).probed(monitor)
        {
            return Ok(witness);
        }
        at(&environment("witness", REQUIREMENTS, out, monitor)?).probed(monitor)
    }

    /// Whether the vectorised variant can be used.
    pub fn has_llvm(&self) -> bool {
        self.llvm.is_some()
    }

    fn probe(&self, variant: &str, llvm: Option<&Path>, monitor: &dyn Monitor) -> Result<Value, CrossError> {
        let mut command = self.command("probe.py");
        command.arg(variant);
        if let Some(llvm) = llvm {
            command.env("DRJIT_LIBLLVM_PATH", llvm);
        }
        let text = finish("probe", &mut command, Duration::from_secs(120), monitor)?;
        serde_json::from_str(&text).map_err(|e| CrossError::Job {
            job: "probe".into(),
            how: "answered no JSON".into(),
            last: e.to_string(),
        })
    }

    fn probed(self, monitor: &dyn Monitor) -> Result<Witness, CrossError> {
        let remedy = || {
            format!(
                "install what renderer/mitsuba/requirements.txt names into it, or leave STRANDBENCH_PYTHON unset so that an environment is made ({})",
                REQUIREMENTS.lines().filter(|l| !l.starts_with('#')).collect::<Vec<_>>().join(", ")
            )
        };
        let missing = |what: String| CrossError::Missing { what, remedy: remedy() };
        let shown = self.python.display().to_string();
        let versions = self.probe("", None, monitor).map_err(|e| match e {
            CrossError::Cancelled(_) => e,
            e => missing(format!("{shown} cannot say what it has ({e})")),
        })?;
        for package in ["mitsuba", "drjit", "embreex", "numpy", "safetensors"] {
            let Some(version) = versions[package].as_str() else {
                return Err(missing(format!("{shown} has no {package}")));
            };
            if package == "mitsuba" && numbers(version) < OLDEST_MITSUBA {
                return Err(missing(format!("{shown} has Mitsuba {version}, which is older than 3.9.1")));
            }
        }
        self.probe("scalar_rgb", None, monitor)
            .map_err(|e| missing(format!("{shown}: Mitsuba does not start ({e})")))?;
        let named = std::env::var_os("DRJIT_LIBLLVM_PATH").map(PathBuf::from);
        let places = named.into_iter().chain(LLVM_PLACES.iter().map(PathBuf::from)).filter(|p| p.exists());
        let mut llvm = None;
        for place in places {
            if self.probe("llvm_ad_rgb", Some(&place), monitor).is_ok() {
                llvm = Some(place);
                break;
            }
        }
        Ok(Witness { versions, llvm, ..self })
    }

    fn command(&self, program: &str) -> Command {
        let mut command = Command::new(&self.python);
        // -B: no bytecode beside the programs. -P is not used, since they import each other.
        command.arg("-B").arg(self.programs.join(program));
        command.env("PYTHONNOUSERSITE", "1").env_remove("PYTHONPATH");
        command
    }

    /// Has the case answered, in a process of its own.
    ///
    /// # Errors
    /// If the process ends badly, takes longer than an hour, or is stopped from outside.
    pub fn answer(&self, case: &Case, monitor: &dyn Monitor) -> Result<Bundle, CrossError> {
        let source = self.work.join(format!("{}-{}.in.safetensors", case.level, case.name));
        let target = self.work.join(format!("{}-{}.out.safetensors", case.level, case.name));
        case.input.write(&source)?;
        if target.exists() {
            std::fs::remove_file(&target).map_err(|e| CrossError::file(&target, e))?;
        }
        // One ray at a time is as fast for shared rays and needs no LLVM; images gain from it.
        let vectorised = case.job == "image" && self.llvm.is_some();
        let mut command = self.command("witness.py");
        command.arg(case.job).arg(if vectorised { "llvm_ad_rgb" } else { "scalar_rgb" });
        command.arg(&source).arg(&target);
        if let Some(llvm) = &self.llvm {
            command.env("DRJIT_LIBLLVM_PATH", llvm);
        }
        finish(&case.name, &mut command, JOB_LIMIT, monitor)?;
        Bundle::read(&target, &case.name)
    }
}

/// The numbers of a version; what is no number counts as 0.
fn numbers(version: &str) -> [u32; 3] {
    let mut parts = version.split('.').map(|p| p.parse().unwrap_or(0));
    std::array::from_fn(|_| parts.next().unwrap_or(0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use strandbench_types::Silent;

    #[test]
    fn versions_are_ordered_as_numbers() {
        assert!(numbers("3.9.1") >= OLDEST_MITSUBA && numbers("3.10.0") > OLDEST_MITSUBA);
        assert!(numbers("3.9.0") < OLDEST_MITSUBA && numbers("3.8") < OLDEST_MITSUBA);
        assert!(numbers("rubbish") < OLDEST_MITSUBA);
    }

    #[cfg(unix)]
    #[test]
    fn a_python_without_witnesses_and_none_at_all_are_missing_with_a_remedy() {
        let out = tempfile::tempdir().unwrap();
        for (python, word) in [("/nowhere/python", "did not start"), ("/bin/false", "ended with")] {
            let e = Witness::find(Some(Path::new(python)), out.path(), &Silent).unwrap_err();
            assert!(matches!(e, CrossError::Missing { .. }), "{e}");
            let said = e.to_string();
            assert!(said.contains(word) && said.contains("mitsuba==3.9.1"), "{said}");
        }
    }

    #[cfg(unix)]
    #[test]
    fn an_old_mitsuba_is_told_from_a_new_one() {
        use std::os::unix::fs::PermissionsExt;
        let out = tempfile::tempdir().unwrap();
        let fake = out.path().join("python");
        let say = |mitsuba: &str| {
            let json = format!(
                r#"{{"mitsuba": {mitsuba}, "drjit": "1", "embreex": "4", "numpy": "2", "safetensors": "0"}}"#
            );
            std::fs::write(&fake, format!("#!/bin/sh\necho '{json}'\n")).unwrap();
            std::fs::set_permissions(&fake, std::fs::Permissions::from_mode(0o755)).unwrap();
            Witness::find(Some(&fake), out.path(), &Silent)
        };
        assert!(say("\"3.9.0\"").unwrap_err().to_string().contains("older than 3.9.1"));
        assert!(say("null").unwrap_err().to_string().contains("has no mitsuba"));
        assert_eq!(say("\"3.9.1\"").unwrap().versions["mitsuba"], "3.9.1");
    }
}

//! The workflow's files.

use super::Plan;
use crate::SuiteError;
use std::path::{Path, PathBuf};
use strandbench_io::atomic_write;

/// The file of [`Plan`], which is the engine's configuration too.
pub const PLAN: &str = "plan.json";

const SNAKEFILE: &str = include_str!("files/Snakefile");
const LOCAL: &str = include_str!("files/local.yaml");
const SLURM: &str = include_str!("files/slurm.yaml");
const README: &str = include_str!("files/README.md");
/// Versions that the tests use.
const REQUIREMENTS: &str = include_str!("../../../../reports/workflow/requirements.txt");

/// What was written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Files {
    /// The plan.
    pub plan: PathBuf,
    /// All files, the plan included.
    pub all: Vec<PathBuf>,
}

/// Writes the workflow of a plan into `folder`; one that is there already is brought up to date, and what the engine keeps
/// beside it stays.
///
/// # Errors
/// If there is a Snakefile that this program did not write, or a file cannot be written.
pub fn write(plan: &Plan, folder: &Path) -> Result<Files, SuiteError> {
    let mark = SNAKEFILE.lines().next().unwrap_or_default();
    let snakefile = folder.join("Snakefile");
    if std::fs::read_to_string(&snakefile).is_ok_and(|text| !text.starts_with(mark)) {
        return Err(SuiteError::file(&snakefile, "is not of this program; choose another folder"));
    }
    let json =
        serde_json::to_string_pretty(plan).map_err(|e| SuiteError::file(&folder.join(PLAN), e))? + "\n";
    let absolute = std::path::absolute(folder).map_err(|e| SuiteError::file(folder, e))?;
    let readme = README
        .replace("{snakemake}", version("snakemake"))
        .replace("{slurm}", version("snakemake-executor-plugin-slurm"))
        .replace("{folder}", &absolute.display().to_string())
        .replace("{out}", &plan.root.join(&plan.out).display().to_string())
        .replace("{cells}", &plan.cells.len().to_string())
        .replace("{renders}", &plan.renders.len().to_string());
    let mut all = Vec::new();
    for (name, text) in [
        (PLAN, json.as_str()),
        ("Snakefile", SNAKEFILE),
        ("README.md", &readme),
        ("profiles/local/config.yaml", LOCAL),
        ("profiles/slurm/config.yaml", SLURM),
    ] {
        let path = folder.join(name);
        let parent = path.parent().unwrap_or(folder);
        std::fs::create_dir_all(parent).map_err(|e| SuiteError::file(parent, e))?;
        atomic_write(&path, |w| w.write_all(text.as_bytes()))?;
        all.push(path);
    }
    Ok(Files { plan: folder.join(PLAN), all })
}

/// The version of a package in the list of what the tests use, in which a comment may name it too.
fn version(package: &str) -> &'static str {
    let lines = REQUIREMENTS.lines().map(|l| l.trim_start_matches('#').trim());
    lines.filter_map(|l| l.strip_prefix(package)?.strip_prefix("==")).next().unwrap_or_default()
}

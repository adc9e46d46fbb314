//! A stage reads folders and writes one folder, whole or not at all, and is not repeated while nothing changed.

use crate::machine::{Cost, Meter, Provenance};
use crate::{SuiteError, hash};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use strandbench_types::Monitor;

/// The file in every stage's folder that says what is in it and how it came about.
pub const RECORD_FILE: &str = "stage.json";

/// Progress of a job: steps of the running stage, and stages as they finish. Costs are for people to read:
/// no result depends on them.
pub trait Progress: Monitor {
    /// A stage is about to work (it is not announced when its folder is re-used).
    fn stage_begins(&self, stage: &str, folder: &Path, reason: &str);
    /// A stage's folder is complete.
    fn stage_done(&self, done: &Done);
}

impl Progress for strandbench_types::StopOnly<'_> {
    fn stage_begins(&self, _: &str, _: &Path, _: &str) {}
    fn stage_done(&self, _: &Done) {}
}

impl Progress for strandbench_types::Silent {
    fn stage_begins(&self, _: &str, _: &Path, _: &str) {}
    fn stage_done(&self, _: &Done) {}
}

/// `stage.json`: what a folder holds and what it was made from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Record {
    /// `render`, `reconstruct`, `score` or `report`.
    pub stage: String,
    /// Hash of `inputs`: equal keys mean equal results.
    pub key: String,
    /// Everything that the result depends on, by name: parameters as text, files and code as hashes.
    pub inputs: BTreeMap<String, String>,
    /// Hash of every other file in the folder, by path.
    pub files: BTreeMap<String, String>,
    /// What it cost to make.
    pub cost: Cost,
    /// Who made it.
    pub provenance: Provenance,
}

/// A finished stage.
#[derive(Clone, Debug)]
pub struct Done {
    /// The folder.
    pub folder: PathBuf,
    /// What `stage.json` says.
    pub record: Record,
    /// Whether an earlier result was found whole and unchanged.
    pub reused: bool,
    /// Why the stage had to work; empty when re-used.
    pub reason: String,
}

impl Done {
    /// Hash of the files below a sub-folder of the result, as [`hash::of_folder`] gives it: for the next
    /// stage's key.
    pub fn content(&self, sub: &str) -> String {
        let prefix = format!("{sub}/");
        let part = self.record.files.iter();
        let part =
            part.filter_map(|(name, hash)| Some((name.strip_prefix(&prefix)?.to_owned(), hash.clone())));
        hash::of_map(&part.collect())
    }
}

/// Reads a folder's record.
///
/// # Errors
/// If there is none or it cannot be understood.
pub fn read_record(folder: &Path) -> Result<Record, SuiteError> {
    let path = folder.join(RECORD_FILE);
    let text = std::fs::read_to_string(&path)
        .map_err(|e| SuiteError::file(&path, format!("{e}; this is not a finished stage's folder")))?;
    serde_json::from_str(&text).map_err(|e| SuiteError::file(&path, e))
}

/// Brings `folder` to the state that `inputs` ask for: keeps it if it is whole and was made from the same
/// inputs, else lets `work` fill an empty folder beside it and puts that in its place at the end.
///
/// # Errors
/// Whatever `work` returns, or what stops the folder from being written; `folder` is then as it was before.
pub fn run(
    stage: &str,
    folder: &Path,
    inputs: BTreeMap<String, String>,
    progress: &dyn Progress,
    work: impl FnOnce(&Path) -> Result<(), SuiteError>,
) -> Result<Done, SuiteError> {
    progress.check()?;
    match current(stage, folder, &inputs) {
        Ok(done) => {
            progress.stage_done(&done);
            Ok(done)
        }
        Err(reason) => write(stage, folder, inputs, None, reason, progress, work),
    }
}

/// The folder as it stands, if [`run`] would keep it; else why not, in words.
pub(crate) fn current(stage: &str, folder: &Path, inputs: &BTreeMap<String, String>) -> Result<Done, String> {
    let record = still_good(folder, stage, &hash::of_map(inputs), inputs)?;
    Ok(Done { folder: folder.to_owned(), record, reused: true, reason: String::new() })
}

/// What [`run`] does with a folder that is not kept, for `reason`. `before` is what the work has cost already.
///
/// # Errors
/// As [`run`].
pub(crate) fn write(
    stage: &str,
    folder: &Path,
    inputs: BTreeMap<String, String>,
    before: Option<Cost>,
    reason: String,
    progress: &dyn Progress,
    work: impl FnOnce(&Path) -> Result<(), SuiteError>,
) -> Result<Done, SuiteError> {
    let key = hash::of_map(&inputs);
    if !ours(folder) {
        let problem = format!(
            "exists, is not empty and holds no {RECORD_FILE}: not a folder of this program, so it is left \
             alone. Choose another --out or remove it"
        );
        return Err(SuiteError::file(folder, problem));
    }
    progress.stage_begins(stage, folder, &reason);
    let meter = Meter::start();
    let parent = folder.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    std::fs::create_dir_all(parent).map_err(|e| SuiteError::file(parent, e))?;
    sweep(parent);
    let temp = tempfile::Builder::new()
        .prefix(&format!("{TEMP_PREFIX}{}{}-", host(), std::process::id()))
        .tempdir_in(parent)
        .map_err(|e| SuiteError::file(parent, format!("cannot make a folder here: {e}")))?;
    let fresh = temp.path().join("new");
    std::fs::create_dir(&fresh).map_err(|e| SuiteError::file(&fresh, e))?;
    work(&fresh)?;
    let record = Record {
        stage: stage.to_owned(),
        key,
        inputs,
        files: hash::files(&fresh)?,
        cost: before.into_iter().chain([meter.stop()]).sum(),
        provenance: Provenance::here(),
    };
    write_json(&fresh.join(RECORD_FILE), &record)?;
    progress.check()?;
    replace(folder, &fresh, &temp.path().join("old"))?;
    let done = Done { folder: folder.to_owned(), record, reused: false, reason };
    progress.stage_done(&done);
    Ok(done)
}

const TEMP_PREFIX: &str = ".strandbench-tmp-";

/// Whether a folder may be replaced: it is absent or empty, has a record, or lies in an output folder that this
/// program has marked.
fn ours(folder: &Path) -> bool {
    let empty = std::fs::read_dir(folder)
        .map_or_else(|e| e.kind() == std::io::ErrorKind::NotFound, |mut entries| entries.next().is_none());
    empty
        || folder.join(RECORD_FILE).exists()
        || folder.ancestors().skip(1).take(3).any(|a| a.join(crate::lock::LOCK_FILE).exists())
}

/// Puts `fresh` in the place of `folder`; what was there goes to `old`, and back if the move fails.
fn replace(folder: &Path, fresh: &Path, old: &Path) -> Result<(), SuiteError> {
    let had = folder.symlink_metadata().is_ok();
    if had {
        std::fs::rename(folder, old).map_err(|e| SuiteError::file(folder, e))?;
    }
    std::fs::rename(fresh, folder).map_err(|e| {
        if had {
            let _ = std::fs::rename(old, folder);
        }
        SuiteError::file(folder, e)
    })
}

/// This machine's name as it stands in temporary folders' names, with a dash behind: a process of another machine that
/// works in the same folder is not known here. Empty where the system does not say it.
fn host() -> String {
    let name = std::fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
    let safe: String = name.trim().chars().filter(|c| c.is_ascii_alphanumeric()).collect();
    if safe.is_empty() { safe } else { safe + "-" }
}

/// Removes what killed runs left behind: temporary folders whose process, of this machine, is gone.
fn sweep(parent: &Path) {
    let Ok(entries) = std::fs::read_dir(parent) else { return };
    let prefix = format!("{TEMP_PREFIX}{}", host());
    for entry in entries.flatten() {
        let name = entry.file_name();
        let pid = name.to_str().and_then(|n| n.strip_prefix(&prefix)).and_then(|n| n.split('-').next());
        if let Some(pid) = pid.and_then(|p| p.parse::<u32>().ok())
            && Path::new("/proc/self").exists()
            && !Path::new(&format!("/proc/{pid}")).exists()
        {
            let _ = std::fs::remove_dir_all(entry.path());
        }
    }
}

/// The record, if the folder may be kept; else why not, in words.
fn still_good(
    folder: &Path,
    stage: &str,
    key: &str,
    inputs: &BTreeMap<String, String>,
) -> Result<Record, String> {
    if !folder.exists() {
        return Err("no earlier result".into());
    }
    let record = read_record(folder).map_err(|_| "the earlier result is incomplete".to_owned())?;
    if record.stage != stage {
        return Err(format!("the folder holds a {} result", record.stage));
    }
    if record.key != key {
        let differs =
            inputs.keys().chain(record.inputs.keys()).find(|k| inputs.get(*k) != record.inputs.get(*k));
        return Err(match differs {
            Some(name) => format!("{name} changed"),
            None => format!("its {RECORD_FILE} is damaged"),
        });
    }
    let mut found = hash::files(folder).map_err(|e| e.to_string())?;
    found.remove(RECORD_FILE);
    match found.keys().chain(record.files.keys()).find(|k| found.get(*k) != record.files.get(*k)) {
        Some(name) if found.contains_key(name) && record.files.contains_key(name) => {
            Err(format!("{name} is damaged"))
        }
        Some(name) if found.contains_key(name) => Err(format!("{name} does not belong there")),
        Some(name) => Err(format!("{name} is missing")),
        None => Ok(record),
    }
}

/// Writes a value as indented JSON with a final newline.
pub(crate) fn write_json(path: &Path, value: &impl Serialize) -> Result<(), SuiteError> {
    let mut text = serde_json::to_string_pretty(value).map_err(|e| SuiteError::file(path, e))?;
    text.push('\n');
    std::fs::write(path, text).map_err(|e| SuiteError::file(path, e))
}

/// Reads a JSON file.
pub(crate) fn read_json<T: serde::de::DeserializeOwned>(path: &Path) -> Result<T, SuiteError> {
    let text = std::fs::read(path).map_err(|e| SuiteError::file(path, e))?;
    serde_json::from_slice(&text).map_err(|e| SuiteError::file(path, e))
}

#[cfg(test)]
#[path = "stage_tests.rs"]
mod tests;

//! The method sees a frame folder, its parameters, and nothing else.

use crate::stage::{self, Done, Progress, write_json};
use crate::{SuiteError, hash};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;
use strandbench_recon::{ReconError, Variant};

/// Sub-folder of the result that holds the estimate.
pub const ESTIMATE: &str = "estimate";
/// File of the result that holds the method's own account of its work.
pub const DIAGNOSTICS: &str = "diagnostics.json";

/// Reconstructs the frame in `frame_dir` (as [`strandbench_io::write_frame`] lays it out) into `out`:
/// `estimate/` and `diagnostics.json`.
///
/// # Errors
/// If the frame cannot be read, the method refuses it, or the work is cancelled; `out` is then untouched.
pub fn reconstruct(
    frame_dir: &Path,
    variant: &Variant,
    out: &Path,
    progress: &dyn Progress,
) -> Result<Done, SuiteError> {
    if !frame_dir.is_dir() {
        return Err(SuiteError::file(
            frame_dir,
            "there is no such frame folder; `strandbench render` makes one",
        ));
    }
    let mut inputs = flat("recon", variant);
    inputs.insert("frame".into(), hash::of_folder(frame_dir)?);
    inputs.insert("code".into(), env!("STRANDBENCH_CODE_RECONSTRUCT").into());
    stage::run("reconstruct", out, inputs, progress, |dir| {
        let (rig, frame) = strandbench_io::read_frame(frame_dir)?;
        let made = strandbench_recon::reconstruct(&rig, &frame, variant, progress).map_err(|e| match e {
            ReconError::Cancelled(_) => SuiteError::Cancelled,
            other => SuiteError::Reconstruct {
                folder: frame_dir.to_owned(),
                variant: variant.name.to_owned(),
                problem: other.to_string(),
            },
        })?;
        strandbench_io::write_estimate(&dir.join(ESTIMATE), &made.estimate)?;
        write_json(&dir.join(DIAGNOSTICS), &made.diagnostics)
    })
}

/// A value's fields by dotted name, each as JSON text: what a key and a report list.
///
/// # Panics
/// If the value cannot be JSON (a map with keys that are not text).
pub(crate) fn flat(prefix: &str, value: &impl Serialize) -> BTreeMap<String, String> {
    fn walk(name: &str, value: &serde_json::Value, into: &mut BTreeMap<String, String>) {
        match value {
            serde_json::Value::Object(fields) if !fields.is_empty() => {
                for (key, field) in fields {
                    walk(&format!("{name}.{key}"), field, into);
                }
            }
            serde_json::Value::String(text) => {
                into.insert(name.to_owned(), text.clone());
            }
            other => {
                into.insert(name.to_owned(), other.to_string());
            }
        }
    }
    let mut into = BTreeMap::new();
    walk(prefix, &serde_json::to_value(value).expect("parameters are plain data"), &mut into);
    into
}

//! Which variant, with which overrides.

use crate::SuiteError;
use crate::settings::{Part, Setting, label};
use strandbench_recon::{VARIANTS, Variant};

/// A variant to run.
#[derive(Clone, Debug)]
pub struct Method {
    /// The row of the table, overrides applied.
    pub variant: Variant,
    /// Folder name and name in reports: the variant's name and what was overridden.
    pub label: String,
}

impl Method {
    /// A row of [`VARIANTS`] by name, with the overrides of [`Part::Recon`].
    ///
    /// # Errors
    /// If there is no such row or no such parameter, or a value does not fit.
    pub fn find(name: &str, settings: &[Setting]) -> Result<Method, SuiteError> {
        let mut variant = Variant::named(name).map_err(|e| SuiteError::Variant(e.to_string()))?;
        let mut changes = Vec::new();
        for setting in settings.iter().filter(|s| s.part == Part::Recon) {
            variant = variant.with(&setting.key, &setting.value).map_err(|e| setting.fault(e))?;
            changes.push(format!("{}={}", setting.key, setting.value));
        }
        Ok(Method { variant, label: label(name, &changes) })
    }
}

/// The variants table as text: name, question, and each parameter that differs from the first row's.
pub fn variants_table() -> String {
    let base = VARIANTS[0].entries();
    let mut text = String::new();
    for variant in VARIANTS {
        text.push_str(&format!("{:<22} {}\n", variant.name, variant.asks));
        for (entry, of_base) in variant.entries().iter().zip(&base) {
            if variant.name == VARIANTS[0].name || entry != of_base {
                text.push_str(&format!("    {} = {}\n", entry.0, entry.1));
            }
        }
    }
    text
}

//! Which method, with which overrides.

use crate::outside::{self, Config, Outside};
use crate::render::FRAME;
use crate::sequence::{Sequence, reconstruct_sequence};
use crate::settings::{Part, Setting, label};
use crate::stage::{Done, Progress};
use crate::{SuiteError, field, reconstruct};
use std::path::Path;
use strandbench_baselines::{BASELINES, Baseline};
use strandbench_recon::{VARIANTS, Variant};

/// What answers.
#[derive(Clone, Debug)]
pub enum Solver {
    /// A row of the variants table, overrides applied.
    Variant(Box<Variant>),
    /// A method of the field, overrides applied.
    Baseline(Box<Baseline>),
    /// A program of its own.
    Outside(Box<Outside>),
}

/// A method to run.
#[derive(Clone, Debug)]
pub struct Method {
    /// What answers.
    pub solver: Solver,
    /// Folder name and name in reports: the variant's name and what was overridden.
    pub label: String,
}

impl Method {
    /// A row of [`VARIANTS`] or [`BASELINES`] by name, with the overrides of [`Part::Recon`].
    ///
    /// # Errors
    /// If there is no such row or no such parameter, or a value does not fit.
    pub fn find(name: &str, settings: &[Setting]) -> Result<Method, SuiteError> {
        let overrides = || settings.iter().filter(|s| s.part == Part::Recon);
        let solver = if let Some(mut baseline) = Baseline::named(name) {
            for setting in overrides() {
                baseline = baseline.with(&setting.key, &setting.value).map_err(|e| setting.fault(e))?;
            }
            Solver::Baseline(Box::new(baseline))
        } else {
            let unknown = |e: strandbench_recon::ReconError| {
                let names: Vec<&str> = BASELINES.iter().map(|b| b.name).collect();
                SuiteError::Variant(format!("{e}; baselines are {}", names.join(", ")))
            };
            let mut variant = Variant::named(name).map_err(unknown)?;
            for setting in overrides() {
                variant = variant.with(&setting.key, &setting.value).map_err(|e| setting.fault(e))?;
            }
            Solver::Variant(Box::new(variant))
        };
        let changes: Vec<String> = overrides().map(|s| format!("{}={}", s.key, s.value)).collect();
        Ok(Method { solver, label: label(name, &changes) })
    }

    /// As [`Method::find`], the methods of a configuration included; these have no parameters here.
    ///
    /// # Errors
    /// As [`Method::find`], and if a parameter is set for a method from outside.
    pub fn find_in(name: &str, settings: &[Setting], config: &Config) -> Result<Method, SuiteError> {
        if let Some(outside) = config.method(name) {
            if let Some(setting) = settings.iter().find(|s| s.part == Part::Recon) {
                let problem = format!("{name} is a method from outside; say so in its command");
                return Err(setting.fault(problem));
            }
            return Ok(Method { solver: Solver::Outside(Box::new(outside.clone())), label: name.to_owned() });
        }
        Method::find(name, settings).map_err(|e| match e {
            SuiteError::Variant(text) if !config.methods.is_empty() => {
                let names: Vec<&str> = config.methods.iter().map(|m| m.name.as_str()).collect();
                SuiteError::Variant(format!("{text}; the configuration adds {}", names.join(", ")))
            }
            other => other,
        })
    }

    /// Lets the method answer to a render folder (of one frame or of a sequence) or to a frame folder.
    ///
    /// # Errors
    /// If the frames cannot be read, the method fails, or the work is cancelled.
    pub fn reconstruct(
        &self,
        folder: &Path,
        out: &Path,
        progress: &dyn Progress,
    ) -> Result<Done, SuiteError> {
        let variant = match &self.solver {
            Solver::Outside(method) => return outside::reconstruct(method, folder, out, progress),
            Solver::Baseline(baseline) => return field::reconstruct(baseline, folder, out, progress),
            Solver::Variant(variant) => variant,
        };
        if Sequence::is(folder) {
            return Ok(reconstruct_sequence(folder, variant, out, progress)?.whole());
        }
        let inner = folder.join(FRAME);
        reconstruct(if inner.is_dir() { &inner } else { folder }, variant, out, progress)
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

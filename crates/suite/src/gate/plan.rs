//! What a gate runs, and how far a figure may move.

use crate::settings::Setting;
use crate::{Cell, Method, SceneJob, SuiteError};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::Path;
use strandbench_score::metric;

/// `gate.toml`.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plan {
    /// Scenes of the catalogue, or files.
    pub scenes: Vec<String>,
    /// Variants.
    pub variants: Vec<String>,
    /// Fixed seeds of the numeric gate.
    pub seeds: Vec<u64>,
    /// Changed values, as in `--set`.
    #[serde(default)]
    pub settings: Vec<String>,
    /// How far a figure may move, in its unit, by metric, or by unit for all metrics in it; 0 where none is given.
    #[serde(default)]
    pub tolerance: BTreeMap<String, f64>,
    /// Loss that the statistical gate lets pass, in the metric's unit; only these metrics are judged.
    #[serde(default)]
    pub margin: BTreeMap<String, f64>,
}

impl Plan {
    /// Reads and checks a plan.
    ///
    /// # Errors
    /// If the file cannot be read, has an unknown key, an unknown metric or a value out of range, or asks for no cell.
    pub fn read(path: &Path) -> Result<Plan, SuiteError> {
        let wrong = |problem: String| SuiteError::file(path, problem);
        let text = std::fs::read_to_string(path).map_err(|e| SuiteError::file(path, e))?;
        let plan: Plan = toml::from_str(&text).map_err(|e| SuiteError::file(path, e))?;
        if plan.scenes.is_empty() || plan.variants.is_empty() || plan.seeds.is_empty() {
            return Err(wrong("names no scene, no variant or no seed: it would evaluate nothing".to_owned()));
        }
        let mut seeds = plan.seeds.clone();
        seeds.sort_unstable();
        seeds.dedup();
        if seeds.len() < plan.seeds.len() {
            return Err(wrong("names a seed twice".to_owned()));
        }
        let units: Vec<&str> = strandbench_score::METRICS.iter().map(|m| m.unit).collect();
        for (name, limit) in plan.tolerance.iter().chain(&plan.margin) {
            let unit = plan.tolerance.contains_key(name) && units.contains(&name.as_str());
            if !unit {
                metric(name).map_err(|e| wrong(e.to_string()))?;
            }
            if !(*limit >= 0.0 && limit.is_finite()) {
                return Err(wrong(format!("{name} = {limit}: a limit is zero or a positive number")));
            }
        }
        Ok(plan)
    }

    /// How far this metric may move, in its unit.
    pub fn tolerance_of(&self, metric: &str, unit: &str) -> f64 {
        self.tolerance.get(metric).or_else(|| self.tolerance.get(unit)).copied().unwrap_or(0.0)
    }

    /// The cells of these seeds.
    ///
    /// # Errors
    /// If a scene, a variant or a setting is unknown.
    pub fn cells(&self, seeds: &[u64]) -> Result<Vec<Cell>, SuiteError> {
        let settings: Vec<Setting> = self.settings.iter().map(|s| s.parse()).collect::<Result<_, _>>()?;
        let methods: Vec<Method> =
            self.variants.iter().map(|v| Method::find(v, &settings)).collect::<Result<_, _>>()?;
        let scenes: Vec<SceneJob> =
            self.scenes.iter().map(|name| SceneJob::open(name, &settings)).collect::<Result<_, _>>()?;
        Cell::matrix(&scenes, &methods, seeds, &settings, None)
    }
}

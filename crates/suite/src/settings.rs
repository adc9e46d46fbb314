//! `key=value` overrides: of the scene (`scene.`), the renderer (`render.`) and the method (`recon.`).

use crate::SuiteError;
use serde::{Deserialize, Serialize};
use std::str::FromStr;

/// Which part of a job an override changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// A key of the scene file, for example `scene.rig.baseline_x_mm`.
    Scene,
    /// A field of [`strandbench_renderer::Settings`], for example `render.samples_per_pixel`.
    Render,
    /// A parameter of the method, for example `recon.lambda`; `recon.` may be left out.
    Recon,
}

/// One override; as `key=value` where it is stored.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Setting {
    /// What it changes.
    pub part: Part,
    /// Dotted key within the part.
    pub key: String,
    /// Value as text.
    pub value: String,
}

impl FromStr for Setting {
    type Err = SuiteError;

    fn from_str(text: &str) -> Result<Setting, SuiteError> {
        let fault =
            |problem: &str| SuiteError::Setting { setting: text.to_owned(), problem: problem.to_owned() };
        let (key, value) =
            text.split_once('=').ok_or_else(|| fault("expected key=value, for example recon.lambda=0.2"))?;
        let (key, value) = (key.trim(), value.trim());
        let (part, key) = match key.split_once('.') {
            Some(("scene", rest)) => (Part::Scene, rest),
            Some(("render", rest)) => (Part::Render, rest),
            Some(("recon", rest)) => (Part::Recon, rest),
            _ => (Part::Recon, key),
        };
        if key.is_empty() || key.split('.').any(str::is_empty) {
            return Err(fault("the key is empty"));
        }
        if value.is_empty() {
            return Err(fault("the value is empty"));
        }
        Ok(Setting { part, key: key.to_owned(), value: value.to_owned() })
    }
}

impl TryFrom<String> for Setting {
    type Error = SuiteError;

    fn try_from(text: String) -> Result<Setting, SuiteError> {
        text.parse()
    }
}

impl From<Setting> for String {
    fn from(setting: Setting) -> String {
        setting.to_string()
    }
}

impl std::fmt::Display for Setting {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let part = match self.part {
            Part::Scene => "scene",
            Part::Render => "render",
            Part::Recon => "recon",
        };
        write!(f, "{part}.{}={}", self.key, self.value)
    }
}

impl Setting {
    pub(crate) fn fault(&self, problem: impl std::fmt::Display) -> SuiteError {
        SuiteError::Setting { setting: self.to_string(), problem: problem.to_string() }
    }

    /// The value as TOML: a number, truth value, array or quoted text as written, anything else as text.
    pub(crate) fn toml_value(&self) -> toml::Value {
        toml::from_str::<toml::Table>(&format!("v = {}", self.value))
            .ok()
            .and_then(|mut t| t.remove("v"))
            .unwrap_or_else(|| toml::Value::String(self.value.clone()))
    }
}

/// Puts a value at a dotted key of a TOML table, making tables on the way; `name[2]` or a bare number as a
/// part of the key picks an element of an array.
pub(crate) fn put(table: &mut toml::Table, setting: &Setting) -> Result<(), SuiteError> {
    let mut parts = setting.key.split('.').peekable();
    let mut here = table;
    while let Some(part) = parts.next() {
        if parts.peek().is_none() {
            let value = match (here.get(part), setting.toml_value()) {
                // 900 for a key that holds 900.0 is no mistake of the user.
                (Some(toml::Value::Float(_)), toml::Value::Integer(i)) => toml::Value::Float(i as f64),
                (_, value) => value,
            };
            here.insert(part.to_owned(), value);
            return Ok(());
        }
        here = here
            .entry(part)
            .or_insert_with(|| toml::Value::Table(toml::Table::new()))
            .as_table_mut()
            .ok_or_else(|| setting.fault(format!("{part} is a value, not a table")))?;
    }
    Ok(())
}

/// What else than the scene a render's folder name tells ([`crate::Cell::suffix`]): another seed than 1, other sampling.
pub fn render_suffix(seed: u64, settings: &[Setting]) -> String {
    let seed = (seed != 1).then(|| format!("+seed={seed}"));
    let sampling = settings.iter().filter(|s| s.part == Part::Render);
    seed.into_iter().chain(sampling.map(|s| format!("+{}={}", s.key, s.value))).collect()
}

/// Renderer settings with the overrides of [`Part::Render`] applied.
///
/// # Errors
/// If a key is unknown or a value does not fit.
pub fn render_settings(settings: &[Setting]) -> Result<strandbench_renderer::Settings, SuiteError> {
    render_settings_from(strandbench_renderer::Settings::default(), settings)
}

/// As [`render_settings`], with other defaults.
pub(crate) fn render_settings_from(
    mut made: strandbench_renderer::Settings,
    settings: &[Setting],
) -> Result<strandbench_renderer::Settings, SuiteError> {
    for setting in settings.iter().filter(|s| s.part == Part::Render) {
        let mut fields = serde_json::to_value(&made).map_err(|e| setting.fault(e))?;
        let value = serde_json::from_str(&setting.value)
            .unwrap_or_else(|_| serde_json::Value::String(setting.value.clone()));
        fields[&setting.key] = value;
        // Not the keys of `fields`: of some, the usual value is left out.
        made = serde_json::from_value(fields).map_err(|e| setting.fault(e))?;
    }
    Ok(made)
}

/// A folder name from a name and what was overridden: letters, digits and `._-+=` alone, at most 100 of them.
pub(crate) fn label(name: &str, overrides: &[String]) -> String {
    let full =
        std::iter::once(name.to_owned()).chain(overrides.iter().cloned()).collect::<Vec<_>>().join("+");
    let safe: String = full
        .chars()
        .map(|c| if c.is_ascii_alphanumeric() || "._-+=".contains(c) { c } else { '_' })
        .collect();
    let safe = safe.trim_start_matches('.').to_owned();
    if safe.len() <= 100 && !safe.is_empty() {
        return safe;
    }
    let hash = crate::hash::of_bytes(full.as_bytes());
    format!("{}~{}", safe.chars().take(80).collect::<String>(), &hash[..12])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn setting(text: &str) -> Setting {
        text.parse().unwrap()
    }

    #[test]
    fn parts_keys_and_values() {
        assert_eq!(setting("lambda=0.2"), setting("recon.lambda = 0.2"));
        let s = setting("scene.rig.baseline_x_mm=200");
        assert_eq!((s.part, s.key.as_str()), (Part::Scene, "rig.baseline_x_mm"));
        for bad in ["lambda", "=1", "scene.=1", "lambda=", "scene.a..b=1"] {
            let e = bad.parse::<Setting>().unwrap_err().to_string();
            assert!(e.contains(bad), "{e}");
        }
    }

    #[test]
    fn a_scene_table_takes_nested_values_and_keeps_floats() {
        let mut t: toml::Table = toml::from_str("seed = 1\n[rig]\ndistance_mm = 900.0\n").unwrap();
        put(&mut t, &setting("scene.rig.distance_mm=800")).unwrap();
        put(&mut t, &setting("scene.rig.note=far off")).unwrap();
        put(&mut t, &setting("scene.hair.colour=[1, 2]")).unwrap();
        assert_eq!(t["rig"]["distance_mm"].as_float(), Some(800.0));
        assert_eq!(t["rig"]["note"].as_str(), Some("far off"));
        assert_eq!(t["hair"]["colour"][1].as_integer(), Some(2));
        assert!(put(&mut t, &setting("scene.seed.x=1")).unwrap_err().to_string().contains("not a table"));
    }

    #[test]
    fn render_settings_know_their_keys() {
        let made = render_settings(&[setting("render.samples_per_pixel=7"), setting("recon.x=1")]).unwrap();
        assert_eq!(made.samples_per_pixel, 7);
        let unknown = render_settings(&[setting("render.samples=7")]).unwrap_err().to_string();
        assert!(unknown.contains("samples_per_pixel"), "{unknown}");
        assert!(render_settings(&[setting("render.samples_per_pixel=-1")]).is_err());
        let made =
            render_settings(&[setting("render.sensor_noise=1"), setting("render.skin_paths=8")]).unwrap();
        assert_eq!((made.sensor_noise, made.skin_paths), (1.0, 8), "usual values are not written, but known");
    }

    #[test]
    fn labels_are_safe_folder_names() {
        assert_eq!(label("bob", &[]), "bob");
        assert_eq!(label("bob", &["rig.x_mm=2.5".into(), "a/b=../c".into()]), "bob+rig.x_mm=2.5+a_b=.._c");
        assert_eq!(label("../up", &[]), "_up");
        let long = label("bob", &["x".repeat(300)]);
        assert!(long.len() <= 100 && long != label("bob", &["x".repeat(301)]));
    }
}

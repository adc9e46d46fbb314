//! The baselines by name, and their parameters as text.

use crate::{BaselineError, ConstantDepth, PatchStereo, VisualHull};
use serde::Serialize;
use serde_json::Value;

/// Which method, with its numbers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Kind {
    /// Patches grown from features, and a surface through them.
    PatchStereo(PatchStereo),
    /// What the masks allow.
    VisualHull(VisualHull),
    /// One depth.
    ConstantDepth(ConstantDepth),
}

/// A method of the field; a row of [`BASELINES`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Baseline {
    /// Name on the command line and in reports.
    pub name: &'static str,
    /// What it is.
    pub asks: &'static str,
    /// The method and its numbers.
    pub kind: Kind,
}

/// Every baseline.
pub const BASELINES: &[Baseline] = &[
    Baseline {
        name: "pmvs-poisson",
        asks: "patch-based stereo and screened Poisson, after Furukawa and Ponce 2010, Kazhdan and Hoppe 2013 (Fig. 14)",
        kind: Kind::PatchStereo(PatchStereo::TUNED),
    },
    Baseline {
        name: "visual-hull",
        asks: "the front of what the masks of all cameras allow",
        kind: Kind::VisualHull(VisualHull::DEFAULT),
    },
    Baseline {
        name: "constant-depth",
        asks: "all hair at the depth that the cameras are aimed at",
        kind: Kind::ConstantDepth(ConstantDepth {}),
    },
];

impl Baseline {
    /// The row of that name.
    pub fn named(name: &str) -> Option<Baseline> {
        BASELINES.iter().find(|b| b.name == name).copied()
    }

    /// Every parameter as text, by name.
    pub fn entries(&self) -> Vec<(String, String)> {
        let fields = serde_json::to_value(self.kind).unwrap_or_default();
        let fields = fields.as_object().cloned().unwrap_or_default();
        fields.into_iter().map(|(key, value)| (key, value.to_string())).collect()
    }

    /// This row with one parameter replaced.
    ///
    /// # Errors
    /// If the key is unknown (the error lists the keys) or the value does not fit.
    pub fn with(self, key: &str, value: &str) -> Result<Baseline, BaselineError> {
        let wrong =
            |wanted: String| BaselineError::Parameter { key: key.into(), value: value.into(), wanted };
        let mut fields = serde_json::to_value(self.kind).map_err(|e| wrong(e.to_string()))?;
        let known = fields.as_object().is_some_and(|o| o.contains_key(key));
        if !known {
            let known: Vec<String> = self.entries().into_iter().map(|(k, _)| k).collect();
            let known = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
            return Err(BaselineError::UnknownKey { key: key.into(), name: self.name, known });
        }
        let number: Value = serde_json::from_str(value).map_err(|_| wrong("a number".into()))?;
        fields[key] = number;
        let fault = |e: serde_json::Error| wrong(e.to_string());
        let kind = match self.kind {
            Kind::PatchStereo(_) => Kind::PatchStereo(serde_json::from_value(fields).map_err(fault)?),
            Kind::VisualHull(_) => Kind::VisualHull(serde_json::from_value(fields).map_err(fault)?),
            Kind::ConstantDepth(_) => Kind::ConstantDepth(serde_json::from_value(fields).map_err(fault)?),
        };
        let made = Baseline { kind, ..self };
        made.validate()?;
        Ok(made)
    }

    /// Checks every parameter's range.
    ///
    /// # Errors
    /// The first parameter out of range, and what is wanted.
    pub fn validate(&self) -> Result<(), BaselineError> {
        let fault = match &self.kind {
            Kind::PatchStereo(p) => p.fault(),
            Kind::VisualHull(p) => p.fault(),
            Kind::ConstantDepth(_) => None,
        };
        let Some((key, wanted)) = fault else { return Ok(()) };
        let value = self.entries().into_iter().find(|(k, _)| k == key).map(|(_, v)| v).unwrap_or_default();
        Err(BaselineError::Parameter { key: key.into(), value, wanted: wanted.into() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_named_once_valid_and_read_back_what_they_print() {
        for (i, b) in BASELINES.iter().enumerate() {
            b.validate().unwrap();
            assert!(BASELINES[..i].iter().all(|o| o.name != b.name));
            assert_eq!(Baseline::named(b.name), Some(*b));
            for (key, value) in b.entries() {
                assert_eq!(b.with(&key, &value).unwrap(), *b, "{key}={value}");
            }
        }
    }

    #[test]
    fn overrides_change_one_value_and_refuse_the_rest() {
        let b = BASELINES[0].with("level", "2").unwrap();
        let Kind::PatchStereo(p) = b.kind else { panic!("{b:?}") };
        assert_eq!(p, PatchStereo { level: 2, ..PatchStereo::TUNED });
        let unknown = b.with("lambda", "1").unwrap_err().to_string();
        assert!(unknown.contains("lambda") && unknown.contains("screening"), "{unknown}");
        assert!(BASELINES[2].with("depth", "1").unwrap_err().to_string().contains("none"));
        for (key, value) in [
            ("level", "9"),
            ("level", "-1"),
            ("level", "1.5"),
            ("window_px", "6"),
            ("window_px", "99"),
            ("min_images", "1"),
            ("ncc_after", "NaN"),
            ("ncc_after", "2"),
            ("screening", "0"),
            ("trim", "inf"),
            ("surface_cell_mm", "0"),
            ("rounds", "0"),
            ("rounds", ""),
            ("angle_deg", "90"),
            ("company", "true"),
        ] {
            assert!(
                matches!(b.with(key, value), Err(BaselineError::Parameter { .. })),
                "{key}={value} was taken"
            );
        }
    }
}

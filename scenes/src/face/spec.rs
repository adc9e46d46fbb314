//! What a scene says of its face.

use super::{Act, FaceError, FaceModel};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A person, a fixed expression, and what the person performs: the table `[face]` of a scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct FaceSpec {
    /// Seed of the person: the same number is the same person, whatever is performed.
    pub identity: u64,
    /// 0 female, 1 male; drawn where absent, as are age and weight.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub male: Option<f32>,
    /// 0 young (about 25 years), 1 old (about 90).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub age: Option<f32>,
    /// -1 lean, 0 average, 1 heavy.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub weight: Option<f32>,
    /// How far the details of the face depart from the mean: 0 not at all, 1 as people do.
    pub variety: f32,
    /// Weights in 0..1 by ARKit names, added to what is performed.
    pub expressions: BTreeMap<String, f32>,
    /// What the face does; still where absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub performance: Option<Act>,
}

impl Default for FaceSpec {
    fn default() -> FaceSpec {
        FaceSpec {
            identity: 0,
            male: None,
            age: None,
            weight: None,
            variety: 1.0,
            expressions: BTreeMap::new(),
            performance: None,
        }
    }
}

impl FaceSpec {
    /// Says what is out of range, if anything is.
    ///
    /// # Errors
    /// [`FaceError::Value`], [`FaceError::Unknown`], [`FaceError::Weight`], each with the name at fault.
    pub fn check(&self) -> Result<(), FaceError> {
        let within = |key: &'static str, value: Option<f32>, low: f32, high: f32| match value {
            Some(v) if !(low..=high).contains(&v) => {
                Err(FaceError::Value { key, value: v.into(), low: low.into(), high: high.into() })
            }
            _ => Ok(()),
        };
        within("male", self.male, 0.0, 1.0)?;
        within("age", self.age, 0.0, 1.0)?;
        within("weight", self.weight, -1.0, 1.0)?;
        within("variety", Some(self.variety), 0.0, 1.5)?;
        let weights = self.expressions.iter().map(|(name, &w)| (name.as_str(), w));
        FaceModel::embedded().weights(weights).map(|_| ())
    }
}

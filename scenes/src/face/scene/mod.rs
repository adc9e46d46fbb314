//! A scene of a face: its description, and every moment of it as a [`Scene`].

mod catalog;
mod check;
mod rig;
mod stage;
#[cfg(test)]
mod tests;

pub use catalog::catalog;
pub use rig::{FaceRigSpec, Frame, LedSpec};
pub use stage::{FaceMoment, FaceStage};

use super::{FaceSpec, FacialHairSpec, SkinTexture};
use crate::spec::checked;
use crate::{FibreOptics, SceneError, Sensor, SkinOptics};
use serde::de::{DeserializeOwned, Error as _};
use serde::{Deserialize, Deserializer, Serialize};
use std::path::Path;

/// A face's scene as its TOML file states it: the table `[face]` tells it from a scene of hair.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FaceScene {
    /// Name; the file's stem where the file gives none.
    #[serde(default)]
    pub name: String,
    /// One line for people.
    #[serde(default)]
    pub description: String,
    /// What the scene is there to stress.
    pub stresses: String,
    /// Seed of the hair; the run's seed is mixed in. The person follows from `face.identity` alone.
    #[serde(default)]
    pub seed: u64,
    /// Radiance behind the face, linear RGB.
    #[serde(default = "background")]
    pub background_rgb: [f32; 3],
    /// Person, expression, performance.
    pub face: FaceSpec,
    /// Beard, moustache, brows, lashes.
    #[serde(default)]
    pub hair: FacialHairSpec,
    /// Pattern of the skin.
    #[serde(default)]
    pub skin_texture: SkinTexture,
    /// Optics of skin; a table that states some values leaves the others as they are for faces.
    #[serde(default = "skin", deserialize_with = "skin_but")]
    pub skin: SkinOptics,
    /// Optics of the fibres.
    #[serde(default)]
    pub optics: FibreOptics,
    /// Cameras.
    #[serde(default)]
    pub rig: FaceRigSpec,
    /// Banks of light.
    #[serde(default)]
    pub lights: LedSpec,
    /// The cameras' response and faults; a table that states some values leaves the others as they are for faces.
    #[serde(default = "sensor", deserialize_with = "sensor_but")]
    pub sensor: Sensor,
}

fn background() -> [f32; 3] {
    [0.02; 3]
}

/// Colours as they are; skin in uniform light of a white card's radiance of 1 stays below a full scale of 0.8.
fn sensor() -> Sensor {
    let (response_rgb, full_scale_radiance) = ([1.0; 3], 0.8);
    Sensor { full_scale_radiance, response_rgb, vignetting: 0.03, gain_spread: 0.01, ..Sensor::default() }
}

/// Light spreads below the skin as far as d'Eon et al. 2007 measured.
fn skin() -> SkinOptics {
    SkinOptics { scatter_mm: 2.72, ..SkinOptics::default() }
}

/// A sensor whose values that are not stated are those of [`sensor`].
fn sensor_but<'de, D: Deserializer<'de>>(stated: D) -> Result<Sensor, D::Error> {
    stated_over(&sensor(), stated)
}

/// Skin whose values that are not stated are those of [`skin`].
fn skin_but<'de, D: Deserializer<'de>>(stated: D) -> Result<SkinOptics, D::Error> {
    stated_over(&skin(), stated)
}

/// A table's values, and of those that it does not state the usual ones.
fn stated_over<'de, T: Serialize + DeserializeOwned, D: Deserializer<'de>>(
    usual: &T,
    stated: D,
) -> Result<T, D::Error> {
    let stated = toml::Table::deserialize(stated)?;
    let mut whole = toml::Table::try_from(usual).map_err(D::Error::custom)?;
    whole.extend(stated);
    whole.try_into().map_err(|e: toml::de::Error| D::Error::custom(e.message()))
}

impl FaceScene {
    /// Reads a face's scene; `path` is named in errors and gives the scene its name where the file has none.
    ///
    /// # Errors
    /// [`SceneError::Syntax`] for text that is not TOML, unknown or missing keys and wrong types,
    /// [`SceneError::Value`] for values out of range; both name file and line.
    pub fn parse(text: &str, path: &Path) -> Result<FaceScene, SceneError> {
        let mut scene: FaceScene = checked(text, path, FaceScene::check)?;
        if scene.name.is_empty() {
            scene.name = path.file_stem().map_or_else(|| "face".into(), |s| s.to_string_lossy().into_owned());
        }
        Ok(scene)
    }

    /// Whether a scene file's text is one of a face: it has a table `[face]`.
    pub fn is(text: &str) -> bool {
        toml::from_str::<toml::Table>(text).is_ok_and(|t| t.contains_key("face"))
    }

    /// Frames of the performance; 1 where the face is still.
    pub fn frames(&self) -> u32 {
        self.face.performance.map_or(1, |act| {
            let length = super::Performance { act, seed: self.face.identity }.duration_s();
            (length * self.rig.frame_rate_hz).floor().max(1.0) as u32
        })
    }

    /// The scene as TOML.
    pub fn to_toml(&self) -> String {
        toml::to_string_pretty(self).expect("a scene has no value that TOML cannot hold")
    }
}

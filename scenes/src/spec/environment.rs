//! Parameters of the light from all around.

use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// Light from infinitely far all around: one radiance, a vertical gradient, or a map from a file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EnvironmentSpec {
    /// Radiance, linear RGB: of every direction, of the horizon of a gradient, or a factor on the map of `file`.
    pub rgb: [f32; 3],
    /// Radiance straight above; the gradient is linear in the sine of the elevation.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub zenith_rgb: Option<[f32; 3]>,
    /// Radiance straight below.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub nadir_rgb: Option<[f32; 3]>,
    /// A lat-long map, relative to the scene file: `.exr` with linear channels R, G and B, twice as wide as high.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<PathBuf>,
    /// Turn of the map about +y, degrees.
    #[serde(default)]
    pub azimuth_deg: f32,
}

//! Ranges of a face scene's values.

use super::{FaceRigSpec, FaceScene, LedSpec};
use crate::face::FaceError;
use crate::spec::{Fault, within};

impl FaceScene {
    /// The first value out of range, as dotted key and problem.
    pub(super) fn check(&self) -> Result<(), Fault> {
        self.face.check().map_err(of_face)?;
        self.hair.check().map_err(of_face)?;
        self.skin_texture.check().map_err(of_face)?;
        for c in self.background_rgb {
            within("background_rgb", c, 0.0, 1e6)?;
        }
        self.optics.check()?;
        self.skin.check()?;
        self.sensor.check()?;
        self.rig.check()?;
        self.lights.check()
    }
}

/// The key at fault and what is wrong with it.
fn of_face(e: FaceError) -> Fault {
    match &e {
        FaceError::Value { key, value, low, high } => {
            let key = if key.contains('.') { (*key).to_owned() } else { format!("face.{key}") };
            (key, format!("{} is not between {low} and {high}", *value as f32))
        }
        FaceError::Hair { key, problem } => (key.clone(), problem.clone()),
        FaceError::Unknown { name, .. } | FaceError::Weight { name, .. } => {
            (format!("face.expressions.{name}"), e.to_string())
        }
        FaceError::Asset { .. } | FaceError::File { .. } => ("face".to_owned(), e.to_string()),
    }
}

impl FaceRigSpec {
    pub(super) fn check(&self) -> Result<(), Fault> {
        let (width, height) = self.size_px();
        within("rig.width_px", width, 8.0, 16_384.0)?;
        within("rig.height_px", height, 8.0, 16_384.0)?;
        within("rig.pixel_mm", self.pixel_mm(), 0.001, 20.0)?;
        within("rig.distance_mm", self.distance_mm, 300.0, 1e4)?;
        within("rig.pair_deg", self.pair_deg, 0.5, 40.0)?;
        for t in self.target_mm().to_array() {
            within("rig.target_mm", t, -1e3, 1e3)?;
        }
        within("rig.far_mm", self.far_mm, 10.0, 1e6)?;
        within("rig.near_mm", self.near_mm, 1.0, self.far_mm - 1.0)?;
        within("rig.frame_rate_hz", self.frame_rate_hz, 0.1, 1e4)?;
        within("rig.exposure_s", self.exposure_s, 0.0, 1.0 / self.frame_rate_hz)?;
        within("rig.exposure_samples", self.exposure_samples, 1.0, 63.0)?;
        if self.exposure_samples.is_multiple_of(2) {
            let n = self.exposure_samples;
            let problem = format!("{n} is even; one more puts a sample at the moment that the truth is of");
            return Err(("rig.exposure_samples".into(), problem));
        }
        if let Some(lens) = &self.lens {
            lens.check(self.distance_mm)?;
        }
        self.calibration_error.check()
    }
}

impl LedSpec {
    fn check(&self) -> Result<(), Fault> {
        within("lights.distance_mm", self.distance_mm, 300.0, 1e5)?;
        for e in self.edges_mm {
            within("lights.edges_mm", e, 1.0, 2e3)?;
        }
        for d in self.rows_deg {
            within("lights.rows_deg", d, -85.0, 85.0)?;
        }
        for d in self.columns_deg {
            within("lights.columns_deg", d, -180.0, 180.0)?;
        }
        within("lights.white_card_radiance", self.white_card_radiance, 1e-9, 1e9)?;
        for c in self.colour_rgb {
            within("lights.colour_rgb", c, 0.0, 1e3)?;
        }
        if self.colour_rgb.iter().sum::<f64>() <= 0.0 {
            return Err(("lights.colour_rgb".into(), "all three are 0: the scene would be dark".into()));
        }
        Ok(())
    }
}

//! Fibres as the reference jobs are told them.

use serde_json::Value;
use strandbench_scenes::{FibreOptics, OpticsModel, OpticsRoots};

#[derive(serde::Deserialize)]
struct Chiang {
    longitudinal_roughness: f32,
    azimuthal_roughness: f32,
    scale_tilt_deg: f32,
    index: f32,
    absorption_rgb: [f32; 3],
}

#[derive(serde::Deserialize)]
struct Marschner {
    index: f32,
    shift_r_deg: f32,
    width_r_deg: f32,
    glint_scale: f32,
    caustic_width_deg: f32,
    fade_range: f32,
    caustic_limit: f32,
    eccentricity: f32,
    roots: OpticsRoots,
    absorption_rgb: [f32; 3],
}

/// The optics of a Chiang fibre as the reference jobs are told them, and its absorption.
pub(crate) fn chiang_optics(told: &Value, mitsuba_bessel: bool) -> Result<(FibreOptics, [f32; 3]), String> {
    let c: Chiang = serde_json::from_value(told.clone()).map_err(|e| e.to_string())?;
    let optics = FibreOptics {
        model: OpticsModel::Chiang,
        index: c.index,
        longitudinal_roughness: Some(c.longitudinal_roughness),
        azimuthal_roughness: Some(c.azimuthal_roughness),
        scale_tilt_deg: Some(c.scale_tilt_deg),
        mitsuba_bessel,
        ..FibreOptics::default()
    };
    Ok((optics, c.absorption_rgb))
}

/// The same for a Marschner fibre.
pub(crate) fn marschner_optics(told: &Value) -> Result<(FibreOptics, [f32; 3]), String> {
    let m: Marschner = serde_json::from_value(told.clone()).map_err(|e| e.to_string())?;
    let optics = FibreOptics {
        model: OpticsModel::Marschner,
        index: m.index,
        shift_r_deg: m.shift_r_deg,
        width_r_deg: m.width_r_deg,
        glint_scale: m.glint_scale,
        caustic_width_deg: m.caustic_width_deg,
        fade_range: m.fade_range,
        caustic_limit: m.caustic_limit,
        eccentricity: m.eccentricity,
        roots: m.roots,
        ..FibreOptics::default()
    };
    Ok((optics, m.absorption_rgb))
}

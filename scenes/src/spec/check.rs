//! Ranges of a scene's values.

use super::{
    CalibrationError, EnvironmentSpec, GroomSpec, LensSpec, LightSpec, MAX_STRANDS, RigSpec, SceneSpec,
};
use crate::{FibreOptics, OpticsModel, Sensor, SkinOptics};

pub(crate) type Fault = (String, String);

/// Says that `key` must lie in a closed range; NaN does not.
pub(crate) fn within<T: Into<f64> + Copy>(key: &str, value: T, low: f64, high: f64) -> Result<(), Fault> {
    let v: f64 = value.into();
    if (low..=high).contains(&v) {
        return Ok(());
    }
    // f32 values are shown as they were written, not widened.
    Err((key.to_owned(), format!("{} is not between {low} and {high}", v as f32)))
}

/// [`within`] of each row of a table: key, value, lowest and highest.
pub(crate) fn all_within<T: Into<f64> + Copy>(
    table: &str,
    rows: &[(&str, T, f64, f64)],
) -> Result<(), Fault> {
    rows.iter().try_for_each(|&(key, value, low, high)| within(&format!("{table}.{key}"), value, low, high))
}

impl SceneSpec {
    /// The first value out of range, as dotted key and problem.
    pub(crate) fn check(&self) -> Result<(), (String, String)> {
        match (&self.groom, &self.hair_file) {
            (None, None) => {
                return Err(("groom".into(), "the scene has no hair; add [groom] or [hair_file]".into()));
            }
            (Some(_), Some(_)) => {
                return Err(("hair_file".into(), "the scene has [groom] too; keep one of the two".into()));
            }
            (Some(groom), None) => {
                groom.check()?;
                if self.head.mesh_file.is_some() || !self.head.embedded {
                    return Err((
                        "head".into(),
                        "procedural hair grows on the embedded head alone; drop mesh_file and embedded"
                            .into(),
                    ));
                }
            }
            (None, Some(file)) => {
                if let Some(radius) = file.import.radius_mm {
                    within("hair_file.import.radius_mm", radius, 0.005, 1.0)?;
                }
                if self.head.embedded && self.head.mesh_file.is_some() {
                    return Err((
                        "head.embedded".into(),
                        "there is a mesh_file too; keep one of the two".into(),
                    ));
                }
            }
        }
        within("head.breadth_mm", self.head.breadth_mm, 80.0, 250.0)?;
        for (key, rgb, high) in
            [("head.albedo_rgb", self.head.albedo_rgb, 1.0), ("background_rgb", self.background_rgb, 1e6)]
        {
            for c in rgb {
                within(key, c, 0.0, high)?;
            }
        }
        let p = &self.pigment;
        within("pigment.eumelanin", p.eumelanin, 0.0, 50.0)?;
        within("pigment.pheomelanin", p.pheomelanin, 0.0, 50.0)?;
        within("pigment.strand_spread", p.strand_spread, 0.0, 2.0)?;
        within("pigment.tuft_spread", p.tuft_spread, 0.0, 2.0)?;
        self.optics.check()?;
        self.skin.check()?;
        self.sensor.check()?;
        if let Some(motion) = &self.motion {
            motion.check()?;
        }
        self.rig.check()?;
        if let Some(environment) = &self.environment {
            environment.check()?;
        }
        self.lights.check()?;
        if self.lights.count == 0 && self.environment.is_none() {
            return Err(("lights.count".into(), "0 without [environment]: the scene would be dark".into()));
        }
        Ok(())
    }
}

impl FibreOptics {
    pub(crate) fn check(&self) -> Result<(), Fault> {
        let o = self;
        within("optics.index", o.index, 1.05, 3.0)?;
        within("optics.shift_r_deg", o.shift_r_deg, -20.0, 20.0)?;
        within("optics.width_r_deg", o.width_r_deg, 0.5, 45.0)?;
        within("optics.glint_scale", o.glint_scale, 0.0, 20.0)?;
        within("optics.caustic_width_deg", o.caustic_width_deg, 1.0, 90.0)?;
        within("optics.fade_range", o.fade_range, 1e-3, 2.0)?;
        within("optics.caustic_limit", o.caustic_limit, 1e-3, 10.0)?;
        within("optics.eccentricity", o.eccentricity, 0.7, 1.0)?;
        for (key, value, low, high) in [
            ("optics.longitudinal_roughness", o.longitudinal_roughness, 0.01, 1.0),
            ("optics.azimuthal_roughness", o.azimuthal_roughness, 0.01, 1.0),
            ("optics.scale_tilt_deg", o.scale_tilt_deg, -20.0, 20.0),
        ] {
            if let Some(value) = value {
                within(key, value, low, high)?;
            }
        }
        if let Some(key) = o.foreign_key() {
            let model = match o.model {
                OpticsModel::Marschner => "marschner",
                OpticsModel::Chiang => "chiang",
            };
            return Err((
                format!("optics.{key}"),
                format!("model \"{model}\" has no such parameter; remove it or choose the other model"),
            ));
        }
        Ok(())
    }
}

impl SkinOptics {
    pub(crate) fn check(&self) -> Result<(), Fault> {
        within("skin.coat_reflectance", self.coat_reflectance, 0.0, 0.5)?;
        within("skin.coat_roughness", self.coat_roughness, 0.02, 1.0)
    }
}

impl Sensor {
    pub(crate) fn check(&self) -> Result<(), Fault> {
        let s = self;
        within("sensor.full_scale_radiance", s.full_scale_radiance, 1e-9, 1e9)?;
        within("sensor.gain_spread", s.gain_spread, 0.0, 0.5)?;
        within("sensor.full_well_e", s.full_well_e, 0.0, 1e9)?;
        within("sensor.read_noise_e", s.read_noise_e, 0.0, 1e6)?;
        within("sensor.vignetting", s.vignetting, 0.0, 1.0)?;
        within("sensor.bits", s.bits, 0.0, 16.0)?;
        for w in s.response_rgb {
            within("sensor.response_rgb", w, 0.0, 10.0)?;
        }
        Ok(())
    }
}

impl RigSpec {
    fn check(&self) -> Result<(), Fault> {
        within("rig.width_px", self.width_px, 8.0, 8192.0)?;
        within("rig.height_px", self.height_px, 8.0, 8192.0)?;
        within("rig.focal_px", self.focal_px, 10.0, 1e5)?;
        within("rig.distance_mm", self.distance_mm, 250.0, 1e5)?;
        within("rig.baseline_x_mm", self.baseline_x_mm, 1.0, self.distance_mm)?;
        within("rig.baseline_y_mm", self.baseline_y_mm, 1.0, self.distance_mm)?;
        for t in self.target_mm {
            within("rig.target_mm", t, -1e4, 1e4)?;
        }
        within("rig.azimuth_deg", self.azimuth_deg, -360.0, 360.0)?;
        within("rig.elevation_deg", self.elevation_deg, -80.0, 80.0)?;
        within("rig.far_mm", self.far_mm, 10.0, 1e6)?;
        within("rig.near_mm", self.near_mm, 1.0, self.far_mm - 1.0)?;
        within("rig.frame_rate_hz", self.frame_rate_hz, 0.1, 1e5)?;
        within("rig.exposure_s", self.exposure_s, 0.0, 1.0 / self.frame_rate_hz)?;
        for k in 0..3 {
            within("rig.motion.velocity_mm_s", self.motion.velocity_mm_s[k], -1e6, 1e6)?;
            within("rig.motion.turn_deg_s", self.motion.turn_deg_s[k], -1e5, 1e5)?;
        }
        if let Some(lens) = &self.lens {
            lens.check(self.distance_mm)?;
        }
        self.calibration_error.check()
    }
}

impl LensSpec {
    /// `distance_mm` is in focus where nothing else is stated.
    pub(crate) fn check(&self, distance_mm: f64) -> Result<(), Fault> {
        within("rig.lens.f_number", self.f_number, 0.5, 1000.0)?;
        within("rig.lens.focal_length_mm", self.focal_length_mm, 0.5, 2000.0)?;
        within("rig.lens.focus_mm", self.focus_mm.unwrap_or(distance_mm), 10.0, 1e6)
    }
}

impl CalibrationError {
    pub(crate) fn check(&self) -> Result<(), Fault> {
        let e = self;
        within("rig.calibration_error.rotation_mdeg", e.rotation_mdeg, 0.0, 5000.0)?;
        within("rig.calibration_error.translation_mm", e.translation_mm, 0.0, 100.0)?;
        within("rig.calibration_error.focal_relative", e.focal_relative, 0.0, 0.1)
    }
}

impl EnvironmentSpec {
    fn check(&self) -> Result<(), Fault> {
        for (key, rgb) in [
            ("environment.rgb", Some(self.rgb)),
            ("environment.zenith_rgb", self.zenith_rgb),
            ("environment.nadir_rgb", self.nadir_rgb),
        ] {
            for c in rgb.into_iter().flatten() {
                within(key, c, 0.0, 1e6)?;
            }
        }
        within("environment.azimuth_deg", self.azimuth_deg, -360.0, 360.0)?;
        if self.file.is_some() && (self.zenith_rgb.is_some() || self.nadir_rgb.is_some()) {
            return Err(("environment.file".into(), "a gradient is stated too; keep one of the two".into()));
        }
        Ok(())
    }
}

impl LightSpec {
    fn check(&self) -> Result<(), Fault> {
        within("lights.count", self.count, 0.0, 64.0)?;
        within("lights.distance_mm", self.distance_mm, 300.0, 1e5)?;
        within("lights.circle_mm", self.circle_mm, 0.0, 1e5)?;
        within("lights.first_deg", self.first_deg, -360.0, 360.0)?;
        within("lights.edge_mm", self.edge_mm, 1.0, 1e4)?;
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

impl GroomSpec {
    fn check(&self) -> Result<(), Fault> {
        within("groom.strands", self.strands, 1.0, f64::from(MAX_STRANDS))?;
        within("groom.radius_mm", self.radius_mm, 0.01, 0.5)?;
        within("groom.radius_spread", self.radius_spread, 0.0, 0.5)?;
        within("groom.tip_radius", self.tip_radius, 0.1, 1.0)?;
        within("groom.chord_error_mm", self.chord_error_mm, 0.002, 1.0)?;
        within("groom.max_segment_mm", self.max_segment_mm, 0.5, 50.0)?;
        let l = &self.length;
        within("groom.length.top_mm", l.top_mm, 5.0, 1000.0)?;
        if let Some(sides) = l.sides_mm {
            within("groom.length.sides_mm", sides, 5.0, 1000.0)?;
        }
        within("groom.length.wisp_spread", l.wisp_spread, 0.0, 1.0)?;
        within("groom.length.strand_spread", l.strand_spread, 0.0, 1.0)?;
        within("groom.length.cut_spread_mm", l.cut_spread_mm, 0.0, 200.0)?;
        if let Some(cut) = l.cut_height_mm {
            within("groom.length.cut_height_mm", cut, -500.0, 60.0)?;
        }
        if let Some(f) = l.fringe {
            within("groom.length.fringe.length_mm", f.length_mm, 5.0, 300.0)?;
            within("groom.length.fringe.half_width_mm", f.half_width_mm, 1.0, 100.0)?;
            within("groom.length.fringe.depth_mm", f.depth_mm, 1.0, 100.0)?;
        }
        let s = &self.style;
        within("groom.style.part_offset_mm", s.part_offset_mm, 0.0, 70.0)?;
        for c in s.comb {
            within("groom.style.comb", c, -1e3, 1e3)?;
        }
        within("groom.style.sweep_back", s.sweep_back, 0.0, 1.0)?;
        within("groom.style.comb_reach_mm", s.comb_reach_mm, 1.0, 1e4)?;
        within("groom.style.emergence_deg", s.emergence_deg, 1.0, 90.0)?;
        within("groom.style.whorl_deg", s.whorl_deg, -90.0, 90.0)?;
        within("groom.style.lift_mm", s.lift_mm, 0.0, 60.0)?;
        within("groom.style.layer_mm", s.layer_mm, 0.0, 100.0)?;
        within("groom.style.gravity", s.gravity, 0.0, 5.0)?;
        within("groom.style.young_gpa", s.young_gpa, 0.05, 50.0)?;
        within("groom.style.cling", s.cling, 0.0, 1.0)?;
        within("groom.style.shoulder_divide_mm", s.shoulder_divide_mm, -300.0, 300.0)?;
        within("groom.style.face_window_mm", s.face_window_mm, 0.0, 100.0)?;
        let c = &self.clumping;
        let ranges = [
            ("tuft_spacing_mm", c.tuft_spacing_mm, 3.0, 100.0),
            ("tuft_strength", c.tuft_strength, 0.0, 1.0),
            ("wisp_spacing_mm", c.wisp_spacing_mm, 1.0, 50.0),
            ("wisp_strength", c.wisp_strength, 0.0, 1.0),
            ("strength_spread", c.strength_spread, 0.0, 2.0),
            ("onset_mm", c.onset_mm, 0.0, 500.0),
            ("reach_mm", c.reach_mm, 1.0, 1000.0),
        ];
        all_within("groom.clumping", &ranges)?;
        let w = &self.wave;
        let ranges = [
            ("radius_mm", w.radius_mm, 0.0, 60.0),
            ("pitch_mm", w.pitch_mm, 3.0, 500.0),
            ("flatness", w.flatness, 0.0, 1.0),
            ("radius_spread", w.radius_spread, 0.0, 1.0),
            ("pitch_spread", w.pitch_spread, 0.0, 0.6),
            ("drift", w.drift, 0.0, 0.6),
            ("coherence_mm", w.coherence_mm, 0.0, 1000.0),
            ("strand_phase_deg", w.strand_phase_deg, 0.0, 360.0),
            ("onset_mm", w.onset_mm, 0.0, 500.0),
            ("reach_mm", w.reach_mm, 1.0, 1000.0),
        ];
        all_within("groom.wave", &ranges)?;
        let d = &self.disorder;
        let ranges = [
            ("tuft_wander_deg", d.tuft_wander_deg, 0.0, 90.0),
            ("wisp_wander_deg", d.wisp_wander_deg, 0.0, 90.0),
            ("strand_wander_deg", d.strand_wander_deg, 0.0, 90.0),
            ("wander_length_mm", d.wander_length_mm, 5.0, 1000.0),
            ("frizz_mm", d.frizz_mm, 0.0, 20.0),
            ("frizz_length_mm", d.frizz_length_mm, 2.0, 500.0),
            ("flyaway_share", d.flyaway_share, 0.0, 1.0),
            ("flyaway_deg", d.flyaway_deg, 0.0, 90.0),
        ];
        all_within("groom.disorder", &ranges)
    }
}

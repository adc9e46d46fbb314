//! Parameters of cameras and lights.

use crate::RigMotion;
use serde::{Deserialize, Serialize};

/// Four cameras in an upside-down T (Luo et al. 2013, section 4.1 and Fig. 3): the reference in the middle, one
/// at its left, one at its right, one above it, all at one distance from the target and turned towards it.
///
/// The paper gives the distance ("roughly 90 cm"), the sensor (640x480, 100 frames a second, 1 ms), and the
/// layout, but no baselines and no lens. Chosen here:
///
/// * **Baselines of 150 mm** to either side and above. At 900 mm that is an angle of 9.5° at the subject: a
///   depth step of 1 mm moves a point by 0.23 px between the reference and any other camera
///   (f b / z² = 1250 · 150 / 900²), about what sub-pixel matching resolves, while hair, which hides itself
///   within a few millimetres, still looks alike from both sides. The sides are 19° apart.
/// * **A focal length of 1250 px**: 480 rows cover 346 mm and 640 columns 461 mm at the target, so that a head
///   of 226 mm with hair to the shoulders fills the image; a pixel is 0.72 mm there.
/// * **A working volume of 700 to 1100 mm**, generous on purpose: the depth of the hair is not given away.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RigSpec {
    /// Columns of every image, px.
    pub width_px: u32,
    /// Rows of every image, px.
    pub height_px: u32,
    /// Focal length, px.
    pub focal_px: f64,
    /// Distance from the reference camera to the target, mm.
    pub distance_mm: f64,
    /// Distance from the reference to the left and to the right camera, mm.
    pub baseline_x_mm: f64,
    /// Distance from the reference to the top camera, mm.
    pub baseline_y_mm: f64,
    /// Point that every camera looks at, mm, world.
    pub target_mm: [f64; 3],
    /// Where the reference stands around the subject, degrees: 0 sees the face, 90 the subject's left, 180 the
    /// back.
    pub azimuth_deg: f64,
    /// Height of the reference above the target, degrees.
    pub elevation_deg: f64,
    /// Nearest depth that a reconstruction may consider, mm.
    pub near_mm: f64,
    /// Farthest depth that a reconstruction may consider, mm.
    pub far_mm: f64,
    /// Frames a second.
    pub frame_rate_hz: f64,
    /// Exposure time, s.
    pub exposure_s: f64,
    /// Motion of the whole rig; matters through the exposure time.
    #[serde(skip_serializing_if = "RigMotion::is_still")]
    pub motion: RigMotion,
    /// Lens with an aperture; pinholes without one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lens: Option<LensSpec>,
    /// Error of the calibration that methods are given.
    pub calibration_error: CalibrationError,
}

impl Default for RigSpec {
    fn default() -> RigSpec {
        RigSpec {
            width_px: 640,
            height_px: 480,
            focal_px: 1250.0,
            distance_mm: 900.0,
            baseline_x_mm: 150.0,
            baseline_y_mm: 150.0,
            target_mm: [0.0, -40.0, 0.0],
            azimuth_deg: 140.0,
            elevation_deg: 8.0,
            near_mm: 700.0,
            far_mm: 1100.0,
            frame_rate_hz: 100.0,
            exposure_s: 0.001,
            motion: RigMotion::default(),
            lens: None,
            calibration_error: CalibrationError::default(),
        }
    }
}

/// A thin lens. The circle of confusion of a point at depth z, px, is `focal_px` times the aperture's diameter
/// times |1/z - 1/focus|; the diameter is `focal_length_mm / f_number`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LensSpec {
    /// Aperture as f-number.
    pub f_number: f64,
    /// Focal length of the glass, mm: `focal_px` times the pixel's pitch.
    pub focal_length_mm: f64,
    /// Depth in focus, mm; the rig's distance if it is not stated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub focus_mm: Option<f64>,
}

/// Standard deviations of what calibration gets wrong about cameras 1 and up; the reference is the gauge and
/// exact. Zero switches a term off. The defaults move a point by about 0.1 px, the residual of a good bundle
/// adjustment of a checkerboard at this resolution.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CalibrationError {
    /// Rotation about each axis of the camera, thousandths of a degree.
    pub rotation_mdeg: f64,
    /// Translation along each axis, mm.
    pub translation_mm: f64,
    /// Focal length, relative.
    pub focal_relative: f64,
}

impl Default for CalibrationError {
    fn default() -> CalibrationError {
        CalibrationError { rotation_mdeg: 3.0, translation_mm: 0.05, focal_relative: 1e-4 }
    }
}

/// Square area lights evenly spread on a circle behind the cameras, about the reference's axis, facing the target.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LightSpec {
    /// Number of lights.
    pub count: u32,
    /// Distance from the target along the reference's axis, mm; behind the cameras if greater than theirs.
    pub distance_mm: f64,
    /// Radius of the circle, mm.
    pub circle_mm: f64,
    /// Where on the circle the first light is, degrees from the right, counter-clockwise seen from the
    /// cameras; 90 is above.
    pub first_deg: f64,
    /// Edge of each light, mm.
    pub edge_mm: f64,
    /// Radiance that all lights together give a white diffuse card at the target that faces the reference.
    pub white_card_radiance: f64,
    /// Colour, linear RGB; only ratios matter.
    pub colour_rgb: [f64; 3],
}

impl Default for LightSpec {
    fn default() -> LightSpec {
        LightSpec {
            count: 3,
            distance_mm: 1300.0,
            circle_mm: 900.0,
            first_deg: 90.0,
            edge_mm: 400.0,
            white_card_radiance: 1.0,
            colour_rgb: [1.0; 3],
        }
    }
}

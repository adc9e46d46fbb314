//! The rig of fourteen cameras and sixteen banks of light (Winberg et al. 2022, section 3 and Fig. 2).

use crate::capture::{card_radiance, rectangle};
use crate::spec::{CalibrationError, LensSpec};
use crate::{AreaLight, Lens};
use glam::DVec3;
use serde::{Deserialize, Serialize};
use strandbench_types::{Camera, Rig};

/// How large the images are and what they show.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Frame {
    /// 12.6 megapixels (3072 x 4096) of the whole face: 0.065 mm a pixel, a hair of 0.1 mm is 1.5 px wide.
    Full,
    /// The same view at half the scale, 3.1 megapixels.
    #[default]
    Scaled,
    /// 12.6 megapixels of mouth and chin: 0.033 mm a pixel, a hair of 0.1 mm is 3 px wide, to which the paper resizes
    /// its images (3.1). Its cameras have 12 to 50 megapixels; the whole face at that scale takes 50.
    Hair,
}

impl Frame {
    /// Columns and rows, px.
    fn size_px(self) -> (u32, u32) {
        match self {
            Frame::Full | Frame::Hair => (3072, 4096),
            Frame::Scaled => (1536, 2048),
        }
    }

    /// What a pixel covers at the target, mm.
    fn pixel_mm(self) -> f64 {
        match self {
            Frame::Full => 0.065,
            Frame::Scaled => 0.13,
            Frame::Hair => 0.033,
        }
    }

    /// The point that all cameras look at, mm: between nose and mouth, or the chin.
    fn target_mm(self) -> [f64; 3] {
        match self {
            Frame::Full | Frame::Scaled => [0.0, -50.0, 60.0],
            Frame::Hair => [0.0, -95.0, 70.0],
        }
    }
}

/// Fourteen cameras round the front of the face: four triplets (front-up, front-below, left, right), each a stereo pair
/// and a cross-polarised camera in the middle between the two, and two cameras for hair between the triplets, one on each
/// side.
///
/// The paper gives the grouping, the number of cameras and lights, "12 to 50 megapixels", and a drawing. Chosen here:
///
/// * **One distance, 900 mm**, and one lens for all: f = 13,850 px at full size is a lens of 48 mm over pixels of 3.45 µm.
/// * **Triplets** 22° above and 24° below the front, and 52° to either side at 4° below. The cameras of a pair stand 13°
///   apart, 204 mm; the pairs in front lie side by side, those at the sides one above the other, so that hair that runs
///   along one baseline lies across another.
/// * **Hair cameras** 26° to either side, 8° below: into the corners of mouth and jaw.
/// * **A working volume of 720 to 1080 mm.**
///
/// Left and right are the subject's.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct FaceRigSpec {
    /// `"full"`, `"scaled"` or `"hair"`: size and field of the images where the keys below do not state them.
    pub frame: Frame,
    /// Columns, px.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub width_px: Option<u32>,
    /// Rows, px.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub height_px: Option<u32>,
    /// What a pixel covers at the target, mm; with the distance it sets the focal length.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pixel_mm: Option<f64>,
    /// Point that every camera looks at, mm, world.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub target_mm: Option<[f64; 3]>,
    /// Distance of all cameras from the target, mm.
    pub distance_mm: f64,
    /// Angle between the two cameras of a stereo pair, degrees.
    pub pair_deg: f64,
    /// Nearest depth that a reconstruction may consider, mm.
    pub near_mm: f64,
    /// Farthest depth that a reconstruction may consider, mm.
    pub far_mm: f64,
    /// Frames a second.
    pub frame_rate_hz: f64,
    /// Exposure time, s; matters with `exposure_samples`.
    pub exposure_s: f64,
    /// Moments within the exposure at which the moving face is rendered, their mean being the image; 1 for none of the
    /// motion blur. Odd: the truth is that of the one in the middle.
    pub exposure_samples: u32,
    /// Lens with an aperture; pinholes without one. Its focus is `distance_mm` if it is not stated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lens: Option<LensSpec>,
    /// Error of the calibration that methods are given. The default moves a point by about 0.1 px at 3 megapixels.
    pub calibration_error: CalibrationError,
}

impl Default for FaceRigSpec {
    fn default() -> FaceRigSpec {
        FaceRigSpec {
            frame: Frame::default(),
            width_px: None,
            height_px: None,
            pixel_mm: None,
            target_mm: None,
            distance_mm: 900.0,
            pair_deg: 13.0,
            near_mm: 720.0,
            far_mm: 1080.0,
            frame_rate_hz: super::super::FRAME_RATE_HZ,
            exposure_s: 0.004,
            exposure_samples: 1,
            lens: None,
            calibration_error: CalibrationError {
                rotation_mdeg: 0.5,
                translation_mm: 0.008,
                focal_relative: 2e-5,
            },
        }
    }
}

/// Where the middle of a group of cameras stands, degrees to the subject's left and up, and whether its pair lies side by
/// side.
const TRIPLETS: [(&str, f64, f64, bool); 4] = [
    ("front-up", 0.0, 22.0, true),
    ("front-below", 0.0, -24.0, true),
    ("left", 52.0, -4.0, false),
    ("right", -52.0, -4.0, false),
];

/// The hair cameras, degrees to the subject's left and up.
const HAIR: [(&str, f64, f64); 2] = [("hair-left", 26.0, -8.0), ("hair-right", -26.0, -8.0)];

/// Direction from the target, by degrees to the subject's left and up.
fn from_target(left_deg: f64, up_deg: f64) -> DVec3 {
    let (a, e) = (left_deg.to_radians(), up_deg.to_radians());
    DVec3::new(libm::sin(a) * libm::cos(e), libm::sin(e), libm::cos(a) * libm::cos(e))
}

impl FaceRigSpec {
    /// Columns and rows of every image, px.
    pub fn size_px(&self) -> (u32, u32) {
        let (w, h) = self.frame.size_px();
        (self.width_px.unwrap_or(w), self.height_px.unwrap_or(h))
    }

    /// What a pixel covers at the target, mm. Where a size alone is stated, the field stays.
    pub fn pixel_mm(&self) -> f64 {
        let (w, _) = self.frame.size_px();
        self.pixel_mm.unwrap_or(self.frame.pixel_mm() * f64::from(w) / f64::from(self.size_px().0))
    }

    /// The point that all cameras look at, mm.
    pub fn target_mm(&self) -> DVec3 {
        DVec3::from_array(self.target_mm.unwrap_or(self.frame.target_mm()))
    }

    /// The rig as it is, and which of its cameras are cross-polarised.
    pub fn rig(&self) -> (Rig, Vec<bool>) {
        let target = self.target_mm();
        let focal_px = self.distance_mm / self.pixel_mm();
        let mut cameras = Vec::new();
        let mut polarised = Vec::new();
        let mut stand = |name: String, towards: DVec3, crossed: bool| {
            let eye = target + towards * self.distance_mm;
            cameras.push(Camera::look_at(&name, self.size_px(), focal_px, eye, target, DVec3::NEG_Y));
            polarised.push(crossed);
        };
        let half = 0.5 * self.pair_deg.to_radians();
        for (name, left, up, level) in TRIPLETS {
            let middle = from_target(left, up);
            let right = DVec3::Y.cross(middle).normalize();
            let across = if level { right } else { middle.cross(right) };
            for (end, angle) in [("a", -half), ("x", 0.0), ("b", half)] {
                // The first of a pair is the right one as the subject sees it, or the lower one.
                let towards = middle * libm::cos(angle) + across * libm::sin(angle);
                stand(format!("{name}-{end}"), towards, end == "x");
            }
        }
        for (name, left, up) in HAIR {
            stand(name.to_owned(), from_target(left, up), false);
        }
        let rig = Rig {
            cameras,
            near_mm: self.near_mm,
            far_mm: self.far_mm,
            frame_rate_hz: self.frame_rate_hz,
            exposure_s: self.exposure_s,
        };
        (rig, polarised)
    }

    /// The lens that all cameras have, if the rig states one.
    pub fn lens(&self) -> Option<Lens> {
        self.lens.map(|l| Lens {
            aperture_radius_mm: 0.5 * l.focal_length_mm / l.f_number,
            focus_mm: l.focus_mm.unwrap_or(self.distance_mm),
        })
    }
}

/// Sixteen banks of LEDs as area lights on the frontal hemisphere, four rows of four, all of one radiance: constant and
/// uniform light (Winberg et al. 2022, section 3). The paper gives their number alone.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LedSpec {
    /// Distance from the point that the cameras look at, mm.
    pub distance_mm: f64,
    /// Edges of a bank, mm: along the row and across.
    pub edges_mm: [f64; 2],
    /// Heights of the four rows, degrees.
    pub rows_deg: [f64; 4],
    /// Banks of a row, degrees to the subject's left.
    pub columns_deg: [f64; 4],
    /// Radiance that all banks together give a white diffuse card at the target that faces +z.
    pub white_card_radiance: f64,
    /// Colour, linear RGB; only ratios matter.
    pub colour_rgb: [f64; 3],
}

impl Default for LedSpec {
    fn default() -> LedSpec {
        LedSpec {
            distance_mm: 1250.0,
            edges_mm: [420.0, 300.0],
            rows_deg: [-42.0, -12.0, 14.0, 46.0],
            columns_deg: [-66.0, -22.0, 22.0, 66.0],
            white_card_radiance: 1.0,
            colour_rgb: [1.0; 3],
        }
    }
}

impl LedSpec {
    /// The banks, facing `target`.
    pub fn lights(&self, target: DVec3) -> Vec<AreaLight> {
        let [along, across] = self.edges_mm.map(|e| 0.5 * e);
        let places = self.rows_deg.iter().flat_map(|&up| self.columns_deg.map(|left| from_target(left, up)));
        let placed: Vec<(DVec3, DVec3, DVec3)> = places
            .map(|towards| {
                rectangle(target + towards * self.distance_mm, target, (DVec3::Y, DVec3::X), [along, across])
            })
            .collect();
        card_radiance(&placed, target, DVec3::Z, self.white_card_radiance, self.colour_rgb)
    }
}

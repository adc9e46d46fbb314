//! Ground truth: the same nouns as an estimate, from geometry. A method is never given a value of these types.

use crate::{DepthMap, Plane, Rig, StrandSet, TriMesh};
use glam::Vec3;

/// Arc length between strand samples for visibility and scoring, mm (METRICS ground rule 3; phase is half of it).
pub const VISIBILITY_STEP_MM: f32 = 0.5;

/// First hit of one sub-pixel ray on a fibre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampleHit {
    /// Strand index in the scene's strand set.
    pub strand: u32,
    /// Segment index within the strand.
    pub segment: u32,
    /// Position along the segment's axis, 0 at its start, 1 at its end.
    pub along: f32,
    /// Depth along the camera's +z, mm.
    pub depth_mm: f32,
}

/// The identity buffer of one view: every sub-pixel ray that hit hair first, grouped by pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct SampleHits {
    /// Image width in pixels.
    pub width: usize,
    /// Image height in pixels.
    pub height: usize,
    /// Sub-pixel rays traced in each pixel, row-major; hits over rays is hair coverage.
    pub rays: Vec<u16>,
    /// Start of each pixel's hits, and their total as the last entry; `width * height + 1` entries.
    pub offsets: Vec<u32>,
    /// Hits, grouped by pixel.
    pub hits: Vec<SampleHit>,
}

impl SampleHits {
    /// Hits of a pixel by row-major index.
    pub fn pixel(&self, i: usize) -> &[SampleHit] {
        &self.hits[self.offsets[i] as usize..self.offsets[i + 1] as usize]
    }
}

/// Truth of one view.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewTruth {
    /// Depth of the first hair hit among a pixel's rays, mm.
    pub depth_first: DepthMap,
    /// Depth at which accumulated hair coverage reaches 5 %, mm.
    pub depth_05: DepthMap,
    /// Depth at which accumulated hair coverage reaches 50 %, mm: A1's reference.
    pub depth_50: DepthMap,
    /// Share of the pixel's rays that hit hair first, 0..1.
    pub coverage: Plane<f32>,
    /// Coverage of at least one half.
    pub mask: Plane<bool>,
    /// Axial mean of the projected fibre tangents, radians in [0, π) from +x towards +y; NaN without hair.
    pub orientation_2d: Plane<f32>,
    /// Length of that axial mean, 0..1: 1 where all fibres of the pixel run alike.
    pub orientation_agreement: Plane<f32>,
    /// Axial mean of the fibre tangents, world, unit; zero without hair.
    pub orientation_3d: Plane<Vec3>,
}

/// Which cameras see which piece of which strand. Strand samples lie at equal arc length
/// [`VISIBILITY_STEP_MM`], phase half a step, strand after strand.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Visibility {
    /// Start of each strand's samples, and their total as the last entry.
    pub offsets: Vec<u32>,
    /// Bit c is set where camera c sees the sample (coverage of at least 5 % of a pixel, and one ray).
    pub seen_by: Vec<u32>,
}

impl Visibility {
    /// Number of samples on a strand of this arc length (mm): those at (i + 1/2) [`VISIBILITY_STEP_MM`] that
    /// lie on it. Sample i stands for the stretch between i and i + 1 steps, the last one also for the rest.
    pub fn samples_on(length_mm: f64) -> usize {
        (length_mm / f64::from(VISIBILITY_STEP_MM) + 0.5).floor() as usize
    }
}

/// Truth of one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Truth {
    /// The rig as it really is; calibration given to a method may differ.
    pub rig: Rig,
    /// Truth of each view, indexed `[camera]`.
    pub views: Vec<ViewTruth>,
    /// Every fibre.
    pub strands: StrandSet,
    /// Visibility of every strand sample; V1 is one bit or more, V2 two or more.
    pub visibility: Visibility,
    /// Head and other solid surfaces, if any.
    pub head: Option<TriMesh>,
}

//! What a camera sees first along the rays through its pixels' centres, and whether it sees a given place.

use crate::{Camera, DepthMap, Plane, StrandSet, TriMesh};
use glam::DVec3;

/// What the ray through a pixel's centre meets first.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum FirstHit {
    /// Nothing.
    #[default]
    Nothing,
    /// A fibre.
    Fibre {
        /// Strand index.
        strand: u32,
        /// Segment index within the strand.
        segment: u32,
        /// Position along the segment's axis of the sphere that touches the hit, 0 at its start, 1 at its end.
        along: f32,
    },
    /// A mesh.
    Mesh {
        /// Surface index; 0 is the skin in scenes of faces.
        surface: u32,
        /// Triangle index in the surface's mesh.
        triangle: u32,
        /// Barycentric weights of the second and third corner; neither is negative, their sum is at most 1.
        uv: [f32; 2],
    },
}

impl FirstHit {
    /// The part of the geometry that was met.
    pub fn element(self) -> Option<Element> {
        match self {
            FirstHit::Nothing => None,
            FirstHit::Fibre { strand, segment, .. } => Some(Element::Segment { strand, segment }),
            FirstHit::Mesh { surface, triangle, .. } => Some(Element::Triangle { surface, triangle }),
        }
    }
}

/// A part of the geometry that a place belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Element {
    /// A segment of a fibre.
    Segment {
        /// Strand index.
        strand: u32,
        /// Segment index within the strand.
        segment: u32,
    },
    /// A triangle of a mesh.
    Triangle {
        /// Surface index.
        surface: u32,
        /// Triangle index in the surface's mesh.
        triangle: u32,
    },
    /// A vertex of a mesh.
    Vertex {
        /// Surface index.
        surface: u32,
        /// Vertex index in the surface's mesh.
        vertex: u32,
    },
}

/// First hits of one camera, indexed `[pixel]`.
#[derive(Clone, Debug, PartialEq)]
pub struct HitPlane {
    /// What is met.
    pub hits: Plane<FirstHit>,
    /// Depth of it along the camera's +z, mm.
    pub depth: DepthMap,
}

/// The geometry of one moment. Strands, surfaces, vertices and triangles keep their indices from moment to moment.
#[derive(Clone, Copy)]
pub struct Moment<'a> {
    /// Fibres, mm, world, root first.
    pub strands: &'a StrandSet,
    /// Meshes, mm, world; the first is the skin.
    pub meshes: &'a [&'a TriMesh],
    /// The follicle's axes of each strand, indexed `[strand]`: a rotation (or, at all moments, a reflected one) that
    /// follows the skin.
    pub follicle_axes: &'a [glam::Mat3],
}

/// Something that knows what hides what at one moment.
pub trait Sight: Sync {
    /// Whether `place` (world, mm), a point of `element`, is the first thing on the ray from the camera's centre to
    /// it. The element itself and what lies within rounding of the place do not hide it. Whether it projects into the
    /// image is not asked.
    fn sees(&self, camera: &Camera, place: DVec3, element: Element) -> bool;
}

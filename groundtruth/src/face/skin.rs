//! Which cameras see which vertex of the skin, and which vertices are under hair.

use super::HairIndex;
use crate::{GroundTruthError, MAX_CAMERAS};
use rayon::prelude::*;
use strandbench_types::{Camera, Element, Sight, SkinCover, TriMesh};

/// A vertex this near to a hair's axis is under hair, mm: about the distance of neighbouring hairs in sparse stubble of
/// 25 hairs per cm².
pub const UNDER_MM: f64 = 2.0;
/// A vertex at least so far from any hair's axis is bare, mm.
pub const BARE_MM: f64 = 10.0;

/// Which cameras see the vertices of a mesh with hair in the way and without, one camera after the other.
#[derive(Clone, Debug)]
pub struct SkinSightings {
    /// Bit c is set where camera c sees the vertex.
    pub seen_by: Vec<u32>,
    /// Bit c is set where camera c would see it without hair.
    pub bare_seen_by: Vec<u32>,
}

impl SkinSightings {
    /// Before any camera has seen any of the vertices.
    pub fn new(vertices: usize) -> SkinSightings {
        SkinSightings { seen_by: vec![0; vertices], bare_seen_by: vec![0; vertices] }
    }

    /// Adds camera number `index`: a vertex is seen if it projects into the image and is the first thing on the ray to it.
    ///
    /// # Errors
    /// If there is no bit for the camera, or the mesh (surface `surface` of both sights) has another number of vertices.
    pub fn add(
        &mut self,
        (index, camera): (usize, &Camera),
        (surface, mesh): (u32, &TriMesh),
        sight: &dyn Sight,
        bare_sight: &dyn Sight,
    ) -> Result<(), GroundTruthError> {
        if index >= MAX_CAMERAS || mesh.vertices.len() != self.seen_by.len() {
            return Err(GroundTruthError::Inconsistent(format!(
                "camera {index} and {} vertices, where there is room for {MAX_CAMERAS} and {}",
                mesh.vertices.len(),
                self.seen_by.len()
            )));
        }
        let bit = 1u32 << index;
        let seen = self.seen_by.par_iter_mut().zip(&mut self.bare_seen_by);
        seen.zip(&mesh.vertices).enumerate().for_each(|(v, ((seen, bare), place))| {
            let place = place.as_dvec3();
            if !camera.project(place).is_some_and(|(px, _)| camera.contains(px)) {
                return;
            }
            let element = Element::Vertex { surface, vertex: v as u32 };
            if sight.sees(camera, place, element) {
                *seen |= bit;
                *bare |= bit;
            } else if bare_sight.sees(camera, place, element) {
                *bare |= bit;
            }
        });
        Ok(())
    }
}

/// Which vertices of the skin are under hair (METRICS D1): those with an axis within [`UNDER_MM`], or that hair hides
/// from a camera that would see them without. Bare, as a control, are those with no axis within [`BARE_MM`] that hair hides
/// from no camera; what is neither belongs to neither.
///
/// # Errors
/// If `sightings` are of another number of vertices.
pub fn skin_cover(
    skin: &TriMesh,
    hair: Option<&HairIndex>,
    sightings: &SkinSightings,
) -> Result<Vec<SkinCover>, GroundTruthError> {
    let (n, a, b) = (skin.vertices.len(), sightings.seen_by.len(), sightings.bare_seen_by.len());
    if (a, b) != (n, n) {
        let text = format!("{n} vertices of the skin have {a} and {b} entries of what cameras see");
        return Err(GroundTruthError::Inconsistent(text));
    }
    let hidden = |v: usize| sightings.seen_by[v] != sightings.bare_seen_by[v];
    Ok((0..n)
        .into_par_iter()
        .map(|v| {
            let p = skin.vertices[v].as_dvec3();
            let near = hair.and_then(|h| h.nearest_within(p, BARE_MM)).map(|(d, _)| d);
            match near {
                _ if hidden(v) => SkinCover::Under,
                Some(d) if d <= UNDER_MM => SkinCover::Under,
                Some(_) => SkinCover::Margin,
                None => SkinCover::Bare,
            }
        })
        .collect())
}

//! Shadows kept at points of fibres and of meshes, shared by all views of a frame.

mod mesh;
mod places;
#[cfg(test)]
mod tests;

use crate::accel::{Hit, LastBlockers, Skip};
use crate::light::WEIGHED;
use crate::path::Work;
use crate::sampler::PixelSampler;
use crate::scene::RenderScene;
use crate::vertex::{NEAR_RADII, SURFACE_OFFSET_MM};
use crate::{RenderError, Settings};
use glam::Vec3;
use places::{MOST, On, Place, Places};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use strandbench_rng::Rng;

/// Shadow rays of a point to each light, stratified over it: of a fibre's and of a mesh's, where fewer lights and fewer
/// points share in a pixel.
const RAYS: [u8; 2] = [8, 16];
/// Lights farther below a mesh's horizon, sine of the angle, light none of the triangles that share a point.
const BELOW: f32 = -0.3;
const SHADOW_KEY: u64 = 0x7368_6164;
/// Lights of a word, a byte each.
const IN_WORD: usize = 8;
const WORDS: usize = WEIGHED / IN_WORD;

/// What shadows depend on beside the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ShadowKey {
    seed: u64,
    spacing: u32,
}

/// How much of each light is seen from points along the fibres' axes and over the meshes' triangles; between them it
/// is interpolated, linearly.
///
/// Found when a view first asks for a point, and the same whoever asks: it depends on the point and the seed alone. Where one
/// of the points that a hit lies between sees no light at all (inside the skin at a root, deep in a beard) nothing is
/// interpolated.
#[derive(Debug)]
pub(crate) struct Shadows {
    places: Places,
    /// Indexed [point][word]: 0 until it is found, then 1 more than the rays that reach each light.
    words: Vec<AtomicU64>,
    seed: u64,
}

/// Share of each light that is seen.
pub(crate) type Visible = [f32; WEIGHED];

impl Shadows {
    /// How much of each light is seen from a hit, the meshes' from their outer side; `None` where it is not known.
    #[inline]
    pub fn at(
        &self,
        scene: &RenderScene<'_>,
        hit: &Hit,
        blockers: &mut [LastBlockers],
        work: &mut Work,
    ) -> Option<Visible> {
        let mut visible = [0.0; WEIGHED];
        for (place, weight) in self.places.around(hit) {
            if weight == 0.0 {
                continue;
            }
            let words = self.found(scene, &place, blockers, work);
            if words.iter().all(|&w| w == u64::from_ne_bytes([1; IN_WORD])) {
                return None;
            }
            let bytes = words.iter().flat_map(|w| w.to_le_bytes());
            let scale = weight / f32::from(place.rays());
            for (v, byte) in visible.iter_mut().zip(bytes) {
                *v += scale * f32::from(byte - 1);
            }
        }
        Some(visible)
    }

    fn found(
        &self,
        scene: &RenderScene<'_>,
        place: &Place,
        blockers: &mut [LastBlockers],
        work: &mut Work,
    ) -> [u64; WORDS] {
        let at = place.index as usize * WORDS;
        let kept: [u64; WORDS] = std::array::from_fn(|i| self.words[at + i].load(Ordering::Relaxed));
        if !kept.contains(&0) {
            return kept;
        }
        let found = self.find(scene, place, blockers);
        for (i, &word) in found.iter().enumerate() {
            let before = self.words[at + i].swap(word, Ordering::Relaxed);
            // Threads that find the same point at the same time count its rays once.
            if i == 0 && before == 0 {
                work.shadow += u64::from(place.rays()) * scene.lights.rectangles() as u64;
            }
        }
        found
    }

    #[cold]
    fn find(&self, scene: &RenderScene<'_>, place: &Place, blockers: &mut [LastBlockers]) -> [u64; WORDS] {
        let (start, skip, outward) = match place.on {
            On::Fibre { strand, point, along } => {
                let (start, skip) = scene.on_fibre(strand, point, along);
                (start, skip, None)
            }
            On::Mesh => {
                let (start, face) = scene.on_mesh(self.places.on_mesh(place.index));
                (start, None, Some(face))
            }
        };
        let sampler =
            PixelSampler::new(Rng::keyed(&[self.seed, SHADOW_KEY, u64::from(place.index)]).next_u64());
        let mut bytes = [[1u8; IN_WORD]; WORDS];
        let points: [[f32; 3]; RAYS[1] as usize] = std::array::from_fn(|n| sampler.light(n as u32));
        for (light, blockers) in (0..scene.lights.rectangles()).zip(blockers.iter_mut()) {
            for &[_, u, v] in &points[..usize::from(place.rays())] {
                let Some(to) = scene.lights.on_rectangle(light, [u, v], start) else { continue };
                if outward.is_some_and(|face| face.dot(to.direction) < BELOW) {
                    continue;
                }
                if !scene.accel.occluded(start, to.direction, to.distance, skip, blockers) {
                    bytes[light / IN_WORD][light % IN_WORD] += 1;
                }
            }
        }
        bytes.map(u64::from_le_bytes)
    }
}

impl Place {
    fn rays(&self) -> u8 {
        match self.on {
            On::Fibre { .. } => RAYS[0],
            On::Mesh => RAYS[1],
        }
    }
}

impl RenderScene<'_> {
    /// Where shadow rays of a place on a fibre start, and what they pass.
    fn on_fibre(&self, strand: u32, point: u32, along: f32) -> (Vec3, Option<Skip>) {
        let strands = &self.scene.strands;
        let i = point as usize;
        let start = match along {
            0.0 => strands.points[i],
            _ => strands.points[i].lerp(strands.points[i + 1], along),
        };
        (start, Some(Skip { strand, point, near_mm: NEAR_RADII * strands.radii_mm[i] }))
    }

    /// Where those of a place on a mesh start, and the triangle's unit normal.
    fn on_mesh(&self, (surface, triangle, uv): (u32, u32, [f32; 2])) -> (Vec3, Vec3) {
        let mesh = &self.scene.surfaces[surface as usize].mesh;
        let [a, b, c] = mesh.triangles[triangle as usize].map(|k| mesh.vertices[k as usize]);
        let (ab, ac) = (b - a, c - a);
        let face = ab.cross(ac).normalize_or_zero();
        (a + ab * uv[0] + ac * uv[1] + face * SURFACE_OFFSET_MM, face)
    }

    /// The places of kept shadows, shared by all views of these settings and this seed; `None` if none are kept.
    pub(crate) fn shadows(
        &self,
        settings: &Settings,
        seed: u64,
    ) -> Result<Option<Arc<Shadows>>, RenderError> {
        let lights = self.lights.rectangles();
        let pixels = settings.shadow_spacing_px;
        if pixels == 0.0 || lights == 0 || lights > WEIGHED || self.lights.len() > lights {
            return Ok(None);
        }
        let spacing_mm = pixels * self.finest_pixel_mm();
        let key = ShadowKey { seed, spacing: spacing_mm.to_bits() };
        let mut slot = self.shadows.lock().map_err(|_| RenderError::Scene("a thread failed".into()))?;
        if let Some((kept, shadows)) = &*slot
            && *kept == key
        {
            return Ok(Some(shadows.clone()));
        }
        let meshes: Vec<_> = self.scene.surfaces.iter().map(|s| &s.mesh).collect();
        let Some(places) = Places::new(&self.scene.strands, &meshes, spacing_mm, MOST) else {
            return Ok(None);
        };
        let words = (0..places.len() * WORDS).map(|_| AtomicU64::new(0)).collect();
        let made = Arc::new(Shadows { places, words, seed });
        *slot = Some((key, made.clone()));
        Ok(Some(made))
    }

    /// Side of the smallest pixel of all cameras, amid the scene, mm.
    fn finest_pixel_mm(&self) -> f32 {
        let (centre, radius) = self.accel.bounding_sphere();
        let side = |c: &strandbench_types::Camera| {
            let distance = (c.centre_mm().as_vec3() - centre).length().max(radius);
            distance / c.focal_px.max_element() as f32
        };
        self.scene.rig.cameras.iter().map(side).fold(f32::INFINITY, f32::min)
    }
}

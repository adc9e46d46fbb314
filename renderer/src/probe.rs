//! First hits through the pixels' centres, and what hides what: geometry alone, without lens, light or time.

use crate::accel::{Accel, Hit, Skip};
use crate::cone::RoundCone;
use crate::lens::RayMaker;
use crate::{RenderError, RenderScene};
use glam::{DVec2, DVec3, Vec3};
use rayon::prelude::*;
use strandbench_scenes::RigMotion;
use strandbench_types::{
    Camera, DepthMap, Element, FirstHit, HitPlane, Monitor, Plane, Sight, StrandSet, TriMesh,
};

/// How far in front of a place something may lie without hiding it, mm. Rays are single precision over some 600 mm,
/// so they pass a place at up to 5e-5 mm; on a surface that is met at 3 degrees this is 1e-3 mm along the ray.
pub const NEAR_MM: f64 = 1e-3;

/// Rows that one task fills.
const BAND: usize = 8;

/// The geometry of one moment, ready for rays from any pinhole.
pub struct Probe<'a> {
    strands: &'a StrandSet,
    meshes: Vec<&'a TriMesh>,
    tree: Tree<'a>,
}

enum Tree<'a> {
    None,
    Own(Accel),
    Shared(&'a Accel),
}

impl<'a> Probe<'a> {
    /// Builds the tree over all fibres and triangles; there may be neither.
    ///
    /// # Errors
    /// If strands or a mesh are not valid, each named.
    pub fn new(strands: &'a StrandSet, meshes: &[&'a TriMesh]) -> Result<Probe<'a>, RenderError> {
        strands.validate().map_err(|e| RenderError::Scene(e.to_string()))?;
        for (i, m) in meshes.iter().enumerate() {
            m.validate().map_err(|e| RenderError::Scene(format!("surface {i}: {e}")))?;
        }
        let empty = strands.is_empty() && meshes.iter().all(|m| m.triangles.is_empty());
        let tree = if empty { Tree::None } else { Tree::Own(Accel::new(strands, meshes)?) };
        Ok(Probe { strands, meshes: meshes.to_vec(), tree })
    }

    /// With the tree of a scene that is rendered too.
    pub fn of(scene: &'a RenderScene<'a>) -> Probe<'a> {
        let meshes = scene.scene.surfaces.iter().map(|s| &s.mesh).collect();
        Probe { strands: &scene.scene.strands, meshes, tree: Tree::Shared(&scene.accel) }
    }

    fn accel(&self) -> Option<&Accel> {
        match &self.tree {
            Tree::None => None,
            Tree::Own(accel) => Some(accel),
            Tree::Shared(accel) => Some(accel),
        }
    }

    /// The first hit through each pixel's centre, all rows in parallel; nothing but the result is held.
    ///
    /// Which element is met is found in single precision, where on it in double: a mesh's hit is the point of the
    /// triangle on the ray (the nearest one of the triangle where rounding takes the ray past its edge), a fibre's is on
    /// the ray, with `along` from the same equations.
    ///
    /// # Errors
    /// If the camera is not valid or the work is stopped.
    pub fn first_hits(&self, camera: &Camera, monitor: &dyn Monitor) -> Result<HitPlane, RenderError> {
        self.fill(camera, monitor, |_| None)
    }

    /// As [`Probe::first_hits`] of a probe without strands, given what a probe of the same meshes with strands met: only
    /// behind hair are rays cast.
    ///
    /// # Errors
    /// As [`Probe::first_hits`], and if `seen` has another size than the camera.
    pub fn behind_hair(
        &self,
        camera: &Camera,
        seen: &HitPlane,
        monitor: &dyn Monitor,
    ) -> Result<HitPlane, RenderError> {
        let size = (camera.width as usize, camera.height as usize);
        if seen.hits.size() != size || seen.depth.size() != size {
            let fault = format!("camera {} is {size:?} px, but the hits are not", camera.name);
            return Err(RenderError::Scene(fault));
        }
        self.fill(camera, monitor, |i| match seen.hits.data[i] {
            FirstHit::Fibre { .. } => None,
            hit => Some((hit, seen.depth.raw().data[i])),
        })
    }

    fn fill(
        &self,
        camera: &Camera,
        monitor: &dyn Monitor,
        known: impl Fn(usize) -> Option<(FirstHit, f32)> + Sync,
    ) -> Result<HitPlane, RenderError> {
        camera.validate().map_err(RenderError::Scene)?;
        let (w, h) = (camera.width as usize, camera.height as usize);
        let mut hits = Plane::filled(w, h, FirstHit::Nothing);
        let mut depth = Plane::filled(w, h, f32::NAN);
        let still = RigMotion::default();
        let rays = self
            .accel()
            .map(|accel| (accel, RayMaker::new(camera, None, &still, 0.0, accel.bounding_sphere())));
        let eye = camera.centre_mm();
        let bands = hits.data.par_chunks_mut(BAND * w).zip(depth.data.par_chunks_mut(BAND * w));
        bands.enumerate().try_for_each(|(band, (hits, depth))| {
            monitor.check()?;
            for (k, (hit, z)) in hits.iter_mut().zip(depth.iter_mut()).enumerate() {
                let i = band * BAND * w + k;
                if let Some(known) = known(i) {
                    (*hit, *z) = known;
                } else if let Some((accel, maker)) = &rays {
                    let pixel = DVec2::new((i % w) as f64 + 0.5, (i / w) as f64 + 0.5);
                    let ray = maker.ray(pixel.x, pixel.y);
                    if let Some(met) = accel.closest(ray.origin, ray.direction) {
                        let d = camera.ray_direction(pixel);
                        let (exact, far) = self.exact(eye, d, met);
                        (*hit, *z) = (exact, far as f32);
                    }
                }
            }
            Ok::<(), RenderError>(())
        })?;
        Ok(HitPlane { hits, depth: DepthMap::from_raw(depth) })
    }

    /// Where on the element the ray from `eye` meets it; `d` has depth 1, so that its parameter is the depth.
    fn exact(&self, eye: DVec3, d: DVec3, met: Hit) -> (FirstHit, f64) {
        match met {
            Hit::Mesh { surface, triangle, .. } => {
                let corners = corners(self.meshes[surface as usize], triangle);
                let [u, v] = place_on(corners, eye, d);
                let uv = [u as f32, v as f32];
                let [a, b, c] = corners;
                let p = a + (b - a) * u + (c - a) * v;
                (FirstHit::Mesh { surface, triangle, uv }, (p - eye).dot(d) / d.length_squared())
            }
            Hit::Fibre { strand, point, along, .. } => {
                let (p, r, i) = (&self.strands.points, &self.strands.radii_mm, point as usize);
                let cone = RoundCone::new(p[i], r[i], p[i + 1], r[i + 1]);
                // From the point of the ray nearest the middle, numbers are small enough for single precision.
                let inverse = 1.0 / d.length();
                let unit = d * inverse;
                let from_middle = eye - cone.middle.as_dvec3();
                let shift = -from_middle.dot(unit);
                let near = (from_middle + unit * shift).as_vec3();
                let centred = RoundCone { middle: Vec3::ZERO, ..cone };
                let hit = centred.intersect(near, unit.as_vec3(), f32::NEG_INFINITY);
                // A ray that only rounding took to the fibre touches it where it is nearest.
                let (along, t) = hit.map_or((along, 0.0), |h| (h.along, f64::from(h.t)));
                let segment = point - self.strands.offsets[strand as usize];
                let along = along.clamp(0.0, 1.0);
                (FirstHit::Fibre { strand, segment, along }, (shift + t) * inverse)
            }
        }
    }
}

fn corners(mesh: &TriMesh, triangle: u32) -> [DVec3; 3] {
    mesh.triangles[triangle as usize].map(|k| mesh.vertices[k as usize].as_dvec3())
}

/// Barycentric weights of the second and third corner where the ray meets the triangle, moved onto it where the ray
/// passes it.
fn place_on([a, b, c]: [DVec3; 3], eye: DVec3, d: DVec3) -> [f64; 2] {
    let (ab, ac, s) = (b - a, c - a, eye - a);
    let p = d.cross(ac);
    let det = ab.dot(p);
    let (u, v) = (s.dot(p) / det, d.dot(s.cross(ab)) / det);
    if !(u.is_finite() && v.is_finite()) {
        return [1.0 / 3.0; 2];
    }
    let (u, v) = (u.max(0.0), v.max(0.0));
    let over = (u + v).max(1.0);
    [u / over, v / over]
}

impl Sight for Probe<'_> {
    /// Hits on the own segment and its neighbours along the strand, on the own triangle or a triangle at the own vertex do
    /// not hide the place: a place on a fibre is seen from all round the fibre. Nor does what lies within [`NEAR_MM`] of
    /// it, or, of the own strand, within three radii.
    fn sees(&self, camera: &Camera, place: DVec3, element: Element) -> bool {
        let Some(accel) = self.accel() else { return true };
        let eye = camera.centre_mm();
        let to = place - eye;
        let distance = to.length();
        if !(distance > 0.0 && distance.is_finite()) {
            return false;
        }
        let unit = to / distance;
        let (centre, radius) = accel.bounding_sphere();
        let start = ((centre.as_dvec3() - eye).dot(unit) - f64::from(radius)).max(0.0);
        let origin = (eye + unit * start).as_vec3();
        let direction = unit.as_vec3().normalize();
        let before = |t: f32| distance - start - f64::from(t);
        let mut hit = accel.closest(origin, direction);
        if let (Element::Segment { strand, segment }, Some(Hit::Fibre { t, strand: s, point, .. })) =
            (element, hit)
            && s == strand
        {
            let own = self.strands.offsets[strand as usize] + segment;
            let near = 3.0 * f64::from(self.strands.radii_mm[own as usize]);
            if own.abs_diff(point) > 1 && before(t) > near {
                return false;
            }
            // The place's own strand comes first; what else may lie between its neighbour and the place?
            let skip = Skip { strand, point: own, near_mm: f32::INFINITY };
            hit = accel.closest_after(origin, direction, Some(skip));
        }
        match (hit, element) {
            (None, _) => true,
            (Some(Hit::Mesh { surface, triangle, .. }), Element::Triangle { surface: s, triangle: k })
                if (s, k) == (surface, triangle) =>
            {
                true
            }
            (Some(Hit::Mesh { surface, triangle, .. }), Element::Vertex { surface: s, vertex })
                if s == surface && self.meshes[s as usize].triangles[triangle as usize].contains(&vertex) =>
            {
                true
            }
            (Some(Hit::Mesh { t, .. } | Hit::Fibre { t, .. }), _) => before(t) <= NEAR_MM,
        }
    }
}

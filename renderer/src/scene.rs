//! A scene prepared for rendering: acceleration structure, fibre tables, lights, normals.

use crate::RenderError;
use crate::accel::{Accel, Hit, LastBlockers, Skip};
use crate::light::{Choice, Lights};
use crate::marschner::{Angles, Fibre, Roots};
use crate::skin;
use glam::Vec3;
use strandbench_scenes::Scene;
use strandbench_types::StrandSet;

/// A scene with its acceleration structure, shared by all views.
pub struct RenderScene<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) accel: Accel,
    fibre: Fibre,
    pub(crate) lights: Lights,
    /// Radiance below which light is sampled more rarely.
    dim: f32,
    /// Absorption per fibre radius, indexed [strand].
    absorption: Vec<[f32; 3]>,
    /// Vertex normals, indexed [surface][vertex].
    normals: Vec<Vec<Vec3>>,
}

impl<'a> RenderScene<'a> {
    /// Builds the acceleration structure.
    ///
    /// # Errors
    /// If the strands are invalid or there is nothing to render; also a mesh, light, pigment, fibre parameter
    /// or camera that is not usable, each named.
    pub fn new(scene: &'a Scene) -> Result<RenderScene<'a>, RenderError> {
        let fail = |what: String| RenderError::Scene(format!("scene {}: {what}", scene.name));
        scene.strands.validate().map_err(|e| fail(e.to_string()))?;
        scene.rig.validate().map_err(&fail)?;
        if scene.pigments.len() != scene.strands.len() {
            return Err(fail(format!(
                "{} strands have {} pigments; each strand needs one",
                scene.strands.len(),
                scene.pigments.len()
            )));
        }
        let absorption: Vec<[f32; 3]> = scene.pigments.iter().map(|p| p.absorption_rgb()).collect();
        if let Some(i) = absorption.iter().position(|a| a.iter().any(|&v| !(v >= 0.0 && v.is_finite()))) {
            return Err(fail(format!("the pigment of strand {i} is negative or not finite")));
        }
        for (i, s) in scene.surfaces.iter().enumerate() {
            s.mesh.validate().map_err(|e| fail(format!("surface {i}: {e}")))?;
            if s.albedo_rgb.iter().any(|a| !(0.0..=1.0).contains(a)) {
                return Err(fail(format!("surface {i}: its albedo must lie in 0..1")));
            }
        }
        if scene.background_rgb.iter().any(|&b| !(b >= 0.0 && b.is_finite())) {
            return Err(fail("the background's radiance is negative or not finite".into()));
        }
        let s = &scene.sensor;
        if !(s.full_scale_radiance > 0.0 && s.full_scale_radiance.is_finite()) {
            return Err(fail("the sensor's full_scale_radiance must be positive".into()));
        }
        if s.response_rgb.iter().any(|&w| !(w >= 0.0 && w.is_finite())) {
            return Err(fail("the sensor's response_rgb is negative or not finite".into()));
        }
        let meshes: Vec<_> = scene.surfaces.iter().map(|s| &s.mesh).collect();
        Ok(RenderScene {
            scene,
            accel: Accel::new(&scene.strands, &meshes)?,
            fibre: Fibre::new(&scene.optics, Roots::Exact).map_err(&fail)?,
            lights: Lights::new(&scene.lights).map_err(&fail)?,
            dim: DIM * s.full_scale_radiance,
            absorption,
            normals: meshes.iter().map(|m| m.vertex_normals()).collect(),
        })
    }

    /// The acceleration structure, for tests and measurements.
    pub fn accel(&self) -> &Accel {
        &self.accel
    }

    /// One estimate of the radiance that leaves `hit` against the ray: direct light from one light point.
    pub(crate) fn shade(
        &self,
        hit: &Hit,
        origin: Vec3,
        direction: Vec3,
        u: [f32; 3],
        blockers: &mut [LastBlockers],
        shadow_rays: &mut u64,
    ) -> [f32; 3] {
        match *hit {
            Hit::Fibre { t, strand, point, along } => {
                let p = origin + direction * t;
                let tangent = fibre_tangent(&self.scene.strands, strand, point, along);
                let to_camera = -direction;
                let sin_r = to_camera.dot(tangent);
                let cos_r = (1.0 - sin_r * sin_r).max(0.0).sqrt();
                let absorption = self.absorption[strand as usize];
                let reflect = |to_light: Vec3| {
                    let sin_i = to_light.dot(tangent);
                    let cos_i = (1.0 - sin_i * sin_i).max(0.0).sqrt();
                    let across = cos_i * cos_r;
                    let cos_phi = if across > 1e-6 {
                        ((to_light.dot(to_camera) - sin_i * sin_r) / across).clamp(-1.0, 1.0)
                    } else {
                        1.0
                    };
                    let cos_2phi_h = if self.scene.optics.eccentricity == 1.0 {
                        0.0
                    } else {
                        cos_2phi_h(tangent, strand, to_light, to_camera)
                    };
                    let angles = Angles { sin_i, sin_r, cos_phi, cos_2phi_h };
                    self.fibre.scatter(&angles, absorption).map(|s| s * cos_i)
                };
                let radius = self.scene.strands.radii_mm[point as usize];
                let skip = Skip { strand, point, near_mm: 4.0 * radius };
                let choices = self.lights.choose(u, p, self.dim, reflect);
                self.unshadowed(p, &choices, Some(skip), blockers, shadow_rays)
            }
            Hit::Mesh { t, surface, triangle, uv } => {
                let s = &self.scene.surfaces[surface as usize];
                let [a, b, c] = s.mesh.triangles[triangle as usize].map(|k| k as usize);
                let (pa, pb, pc) = (s.mesh.vertices[a], s.mesh.vertices[b], s.mesh.vertices[c]);
                let face = (pb - pa).cross(pc - pa).normalize_or_zero();
                // Both sides of a mesh are skin: turn the normals towards the camera.
                let side = if face.dot(direction) > 0.0 { -1.0 } else { 1.0 };
                let n = &self.normals[surface as usize];
                let smooth = n[a] * (1.0 - uv[0] - uv[1]) + n[b] * uv[0] + n[c] * uv[1];
                let face = face * side;
                let normal = (smooth * side).try_normalize().unwrap_or(face);
                let p = origin + direction * t;
                let reflect = |to_light: Vec3| {
                    let cos = normal.dot(to_light);
                    if cos <= 0.0 || face.dot(to_light) <= 0.0 {
                        return [0.0; 3];
                    }
                    skin::scatter(normal, to_light, -direction, s.albedo_rgb).map(|f| f * cos)
                };
                let choices = self.lights.choose(u, p, self.dim, reflect);
                self.unshadowed(p + face * SURFACE_OFFSET_MM, &choices, None, blockers, shadow_rays)
            }
        }
    }

    /// The light of those choices that nothing hides from `start`.
    fn unshadowed(
        &self,
        start: Vec3,
        choices: &[Option<Choice>],
        skip: Option<Skip>,
        blockers: &mut [LastBlockers],
        shadow_rays: &mut u64,
    ) -> [f32; 3] {
        let mut rgb = [0.0; 3];
        for c in choices.iter().flatten() {
            *shadow_rays += 1;
            if !self.accel.occluded(start, c.direction, c.distance, skip, &mut blockers[c.light]) {
                rgb = std::array::from_fn(|k| rgb[k] + c.radiance_rgb[k]);
            }
        }
        rgb
    }
}

/// Unshadowed radiance, relative to the sensor's full scale, below which a point gets fewer shadow rays.
const DIM: f32 = 0.1;
/// Shadow rays leave meshes from this far outside, mm: a fifth of a fibre's radius.
const SURFACE_OFFSET_MM: f32 = 0.008;

/// The fibre's unit tangent (root to tip) at a position along the segment that starts at `point` (index in
/// the strand set): the bisectors of neighbouring segments at both ends, interpolated. Segments without length
/// have no say; a strand without any yields +x.
pub fn fibre_tangent(strands: &StrandSet, strand: u32, point: u32, along: f32) -> Vec3 {
    let range = strands.range(strand as usize);
    let i = point as usize;
    let unit = |k: usize| (strands.points[k + 1] - strands.points[k]).normalize_or_zero();
    let here = unit(i);
    let before = if i > range.start { unit(i - 1) } else { Vec3::ZERO };
    let after = if i + 2 < range.end { unit(i + 1) } else { Vec3::ZERO };
    let bisector = |a: Vec3, b: Vec3| (a + b).try_normalize().unwrap_or(here);
    let (start, end) = (bisector(before, here), bisector(here, after));
    start.lerp(end, along.clamp(0.0, 1.0)).try_normalize().or(here.try_normalize()).unwrap_or(Vec3::X)
}

/// Cosine of φ_i + φ_r, the azimuths measured from the major axis of the strand's cross-section, which is a
/// direction drawn per strand and made perpendicular to the tangent.
fn cos_2phi_h(tangent: Vec3, strand: u32, to_light: Vec3, to_camera: Vec3) -> f32 {
    let mut rng = strandbench_rng::Rng::keyed(&[0x656c_6c69_7073_6500, u64::from(strand)]);
    let axis = Vec3::new(rng.range(-1.0, 1.0), rng.range(-1.0, 1.0), rng.range(-1.0, 1.0));
    let major =
        axis.reject_from_normalized(tangent).try_normalize().unwrap_or(tangent.any_orthonormal_vector());
    let minor = tangent.cross(major);
    let flat = |v: Vec3| {
        let (x, y) = (v.dot(major), v.dot(minor));
        let l = (x * x + y * y).sqrt();
        if l > 0.0 { (x / l, y / l) } else { (1.0, 0.0) }
    };
    let ((xi, yi), (xr, yr)) = (flat(to_light), flat(to_camera));
    xi * xr - yi * yr
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tangents_of_an_arc_follow_the_circle_between_its_points() {
        // Points every 5 degrees: a segment's own direction is off by up to 2.5 degrees, the interpolated one by
        // the third order of half the step.
        let step = 5.0f32.to_radians();
        let at = |a: f32| Vec3::new(20.0 * a.cos(), 20.0 * a.sin(), 3.0);
        let mut strands = StrandSet::new();
        strands.push(&[Vec3::ZERO, Vec3::X], 0.04);
        strands.push(&(0..12).map(|i| at(step * i as f32)).collect::<Vec<_>>(), 0.04);
        for i in 1..10 {
            for along in [0.0, 0.2, 0.5, 0.9, 1.0] {
                let a = step * (i as f32 + along);
                let off =
                    fibre_tangent(&strands, 1, 2 + i, along).angle_between(Vec3::new(-a.sin(), a.cos(), 0.0));
                assert!(off.to_degrees() < 0.05, "segment {i}, {along}: {} degrees off", off.to_degrees());
            }
        }
    }
}

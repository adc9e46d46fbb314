//! A scene prepared for rendering: acceleration structure, fibre tables, lights, normals.

use crate::RenderError;
use crate::accel::{Accel, Hit, LastBlockers, Skip};
use crate::light::Lights;
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
    lights: Lights,
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
        blockers: &mut LastBlockers,
        shadow_rays: &mut u64,
    ) -> [f32; 3] {
        match *hit {
            Hit::Fibre { t, strand, point, along } => {
                let p = origin + direction * t;
                let Some(light) = self.lights.sample(u, p) else { return [0.0; 3] };
                let tangent = fibre_tangent(&self.scene.strands, strand, point, along);
                let to_camera = -direction;
                let sin_i = light.direction.dot(tangent);
                let sin_r = to_camera.dot(tangent);
                let cos_i = (1.0 - sin_i * sin_i).max(0.0).sqrt();
                let cos_r = (1.0 - sin_r * sin_r).max(0.0).sqrt();
                let across = cos_i * cos_r;
                let cos_phi = if across > 1e-6 {
                    ((light.direction.dot(to_camera) - sin_i * sin_r) / across).clamp(-1.0, 1.0)
                } else {
                    1.0
                };
                let cos_2phi_h = if self.scene.optics.eccentricity == 1.0 {
                    0.0
                } else {
                    cos_2phi_h(tangent, strand, light.direction, to_camera)
                };
                let angles = Angles { sin_i, sin_r, cos_phi, cos_2phi_h };
                let s = self.fibre.scatter(&angles, self.absorption[strand as usize]);
                let out: [f32; 3] = std::array::from_fn(|c| s[c] * cos_i * light.weight_rgb[c]);
                if out == [0.0; 3] {
                    return out;
                }
                *shadow_rays += 1;
                let radius = self.scene.strands.radii_mm[point as usize];
                let skip = Skip { strand, point, near_mm: 4.0 * radius };
                if self.accel.occluded(p, light.direction, light.distance, Some(skip), blockers) {
                    return [0.0; 3];
                }
                out
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
                let Some(light) = self.lights.sample(u, p) else { return [0.0; 3] };
                let cos = normal.dot(light.direction);
                if cos <= 0.0 || face.dot(light.direction) <= 0.0 {
                    return [0.0; 3];
                }
                let f = skin::scatter(normal, light.direction, -direction, s.albedo_rgb);
                *shadow_rays += 1;
                let start = p + face * SURFACE_OFFSET_MM;
                if self.accel.occluded(start, light.direction, light.distance, None, blockers) {
                    return [0.0; 3];
                }
                std::array::from_fn(|c| f[c] * cos * light.weight_rgb[c])
            }
        }
    }
}

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

//! A point at which light is scattered: where it is, how it scatters, and how rays leave it.

use crate::accel::{Hit, Skip};
use crate::fibre::{FibrePoint, Toward};
use crate::scene::{RenderScene, fibre_tangent};
use crate::skin::SkinToward;
use glam::Vec3;
use strandbench_scenes::SkinDetail;
use strandbench_scenes::face::{SkinLook, Tissue};
use strandbench_types::StrandSet;

/// Rays leave meshes from this far outside, mm: a fifth of a fibre's radius.
pub(crate) const SURFACE_OFFSET_MM: f32 = 0.008;
/// Relief is no steeper than this, mm per mm, however much a triangle is squeezed.
const STEEPEST: f32 = 1.5;
/// A fibre is passed by the rays that leave it up to this distance, fibre radii.
pub(crate) const NEAR_RADII: f32 = 4.0;

/// The geometry of a hit, mm, world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// Where the ray meets the surface.
    pub position_mm: Vec3,
    /// Unit normal of the surface itself, outward of a fibre, towards the ray's origin on a mesh.
    pub normal: Vec3,
    /// A fibre's unit tangent from root to tip, as shading takes it; zero on a mesh.
    pub tangent: Vec3,
}

/// Scattering seen from the camera or from the vertex before.
pub(crate) enum Lobe<'a> {
    Fibre(Toward<'a>),
    Skin(SkinToward),
}

/// A direction drawn from a [`Lobe`].
pub(crate) struct Drawn {
    pub to_light: Vec3,
    /// `eval / pdf`.
    pub weight_rgb: [f32; 3],
    pub pdf: f32,
}

impl Lobe<'_> {
    /// Scattering times the light's cosine.
    #[inline]
    pub fn eval(&self, to_light: Vec3) -> [f32; 3] {
        match self {
            Lobe::Fibre(f) => f.eval(to_light),
            Lobe::Skin(s) => s.eval(to_light),
        }
    }

    /// The part of [`Lobe::eval`] that a cross-polarised camera sees of a polarised light: not what one reflection at
    /// the surface sends.
    #[inline]
    pub fn depolarised(&self, to_light: Vec3) -> [f32; 3] {
        match self {
            Lobe::Fibre(f) => f.depolarised(to_light),
            Lobe::Skin(s) => s.depolarised(to_light),
        }
    }

    /// The same and the density of [`Lobe::sample`].
    #[inline]
    pub fn eval_pdf(&self, to_light: Vec3) -> ([f32; 3], f32) {
        match self {
            Lobe::Fibre(f) => f.eval_pdf(to_light),
            Lobe::Skin(s) => (s.eval(to_light), s.pdf(to_light)),
        }
    }

    #[inline]
    pub fn sample(&self, u: [f32; 4]) -> Option<Drawn> {
        match self {
            Lobe::Fibre(f) => {
                f.sample(u).map(|s| Drawn { to_light: s.to_light, weight_rgb: s.weight_rgb, pdf: s.pdf })
            }
            Lobe::Skin(s) => s.sample([u[0], u[1], u[3]]).map(|(to_light, weight_rgb, pdf)| Drawn {
                to_light,
                weight_rgb,
                pdf,
            }),
        }
    }
}

/// Where light is scattered.
///
/// Rays leave a fibre from the point itself, whichever way they go: the fibre's own segments next to it are
/// no obstacle at any distance, and the rest of the strand is none within four radii. A ray that goes on through
/// the fibre (TT) therefore comes out at the other side, where the straight line leaves the fibre, and bounce rays
/// and shadow rays follow the same rule. Rays leave a mesh from slightly outside, on the side that was met.
pub(crate) struct Vertex<'a> {
    pub surface: SurfacePoint,
    /// Where rays start.
    pub start: Vec3,
    pub skip: Option<Skip>,
    pub lobe: Lobe<'a>,
    /// Where on the skin it is, if light may spread below it.
    pub below: Option<Below>,
    /// What was met, if it is a fibre or the outside of a mesh.
    pub hit: Option<Hit>,
}

/// A place on skin.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Below {
    pub surface: usize,
    pub corners: [usize; 3],
    pub weights: [f32; 3],
}

impl RenderScene<'_> {
    /// What the ray (unit direction) meets first, as cameras see it. Distances count from `origin`.
    pub fn closest(&self, origin: Vec3, direction: Vec3) -> Option<Hit> {
        self.accel.closest(origin, direction)
    }

    /// Where a hit of that ray is.
    pub fn surface_point(&self, hit: &Hit, origin: Vec3, direction: Vec3) -> SurfacePoint {
        match *hit {
            Hit::Fibre { t, strand, point, along } => {
                let strands = &self.scene.strands;
                let (i, position_mm) = (point as usize, origin + direction * t);
                let (a, b) = (strands.points[i], strands.points[i + 1]);
                let axis = a.lerp(b, along);
                let tangent = if self.flat {
                    segment_tangent(strands, point)
                } else {
                    fibre_tangent(strands, strand, point, along)
                };
                let normal = (position_mm - axis).try_normalize().unwrap_or(-direction);
                SurfacePoint { position_mm, normal, tangent }
            }
            Hit::Mesh { t, surface, triangle, .. } => {
                let mesh = &self.scene.surfaces[surface as usize].mesh;
                let [a, b, c] = mesh.triangles[triangle as usize].map(|k| mesh.vertices[k as usize]);
                let face = (b - a).cross(c - a).normalize_or_zero();
                let normal = if face.dot(direction) > 0.0 { -face } else { face };
                SurfacePoint { position_mm: origin + direction * t, normal, tangent: Vec3::ZERO }
            }
        }
    }

    /// Everything about a hit that scattering needs.
    #[inline]
    pub(crate) fn vertex(&self, hit: &Hit, origin: Vec3, direction: Vec3) -> Vertex<'_> {
        let surface = self.surface_point(hit, origin, direction);
        let to_camera = -direction;
        match *hit {
            Hit::Fibre { strand, point, .. } => {
                let tangent = surface.tangent;
                let across = surface.normal.reject_from_normalized(tangent);
                let normal = across.try_normalize().unwrap_or_else(|| tangent.any_orthonormal_vector());
                let major = if self.elliptic { major_axis(tangent, strand) } else { normal };
                let absorption_rgb = self.absorption[strand as usize];
                let at = FibrePoint { tangent, normal, absorption_rgb, major };
                let radius = self.scene.strands.radii_mm[point as usize];
                Vertex {
                    surface,
                    start: surface.position_mm,
                    skip: Some(Skip { strand, point, near_mm: NEAR_RADII * radius }),
                    lobe: Lobe::Fibre(self.fibre.toward(&at, to_camera)),
                    below: None,
                    hit: Some(*hit),
                }
            }
            Hit::Mesh { surface: which, triangle, uv, .. } => {
                let s = &self.scene.surfaces[which as usize];
                let [a, b, c] = s.mesh.triangles[triangle as usize].map(|k| k as usize);
                let n = &self.normals[which as usize];
                let smooth = n[a] * (1.0 - uv[0] - uv[1]) + n[b] * uv[0] + n[c] * uv[1];
                // Both sides of a mesh are skin: turn the shading normal with the face's.
                let face = surface.normal;
                let corners = [a, b, c].map(|k| s.mesh.vertices[k]);
                let outward = (corners[1] - corners[0]).cross(corners[2] - corners[0]).dot(face) >= 0.0;
                let normal = (if outward { smooth } else { -smooth }).try_normalize().unwrap_or(face);
                let weights = [1.0 - uv[0] - uv[1], uv[0], uv[1]];
                let (skin, normal, albedo_rgb, below) = match &s.detail {
                    None => (self.skin, normal, s.albedo_rgb, None),
                    Some(detail) => {
                        let below = Below { surface: which as usize, corners: [a, b, c], weights };
                        let (look, bend) = textured(detail, &below, corners);
                        let bent =
                            (normal - if outward { bend } else { -bend }).try_normalize().unwrap_or(normal);
                        // Where relief turns a slanted surface away altogether, there is none.
                        let normal = if bent.dot(to_camera) > 0.02 { bent } else { normal };
                        let below = (detail.tissue == Tissue::Skin).then_some(below);
                        (self.skin.varied(look.coat, look.roughness), normal, look.albedo_rgb, below)
                    }
                };
                Vertex {
                    surface,
                    start: surface.position_mm + face * SURFACE_OFFSET_MM,
                    skip: None,
                    lobe: Lobe::Skin(skin.toward(normal, face, to_camera, albedo_rgb)),
                    below,
                    hit: outward.then_some(*hit),
                }
            }
        }
    }
}

/// The look of a place on a triangle with these corners now, and the gradient of its relief along the triangle.
fn textured(detail: &SkinDetail, at: &Below, corners: [Vec3; 3]) -> (SkinLook, Vec3) {
    let rest = at.corners.map(|k| detail.rest[k]);
    let mix = |v: [Vec3; 3]| (0..3).map(|k| v[k] * at.weights[k]).sum::<Vec3>();
    let stubble = (0..3).map(|k| detail.stubble[at.corners[k]] * at.weights[k]).sum();
    let look = detail.look(mix(rest), stubble);
    if look.slope == Vec3::ZERO {
        return (look, Vec3::ZERO);
    }
    // The gradient in the plane of the edges now, whose steps along them are those along the edges at rest.
    let [e, f] = [corners[1] - corners[0], corners[2] - corners[0]];
    let [by_e, by_f] = [rest[1] - rest[0], rest[2] - rest[0]].map(|r| look.slope.dot(r));
    let (ee, ef, ff) = (e.dot(e), e.dot(f), f.dot(f));
    let det = ee * ff - ef * ef;
    let gradient = (e * (ff * by_e - ef * by_f) + f * (ee * by_f - ef * by_e)) / det;
    (look, if gradient.is_finite() { gradient.clamp_length_max(STEEPEST) } else { Vec3::ZERO })
}

/// The direction of a segment alone; +x if it has no length.
fn segment_tangent(strands: &StrandSet, point: u32) -> Vec3 {
    let i = point as usize;
    (strands.points[i + 1] - strands.points[i]).try_normalize().unwrap_or(Vec3::X)
}

/// The major axis of a strand's cross-section: a direction drawn per strand, made perpendicular to the tangent.
fn major_axis(tangent: Vec3, strand: u32) -> Vec3 {
    let mut rng = strandbench_rng::Rng::keyed(&[0x656c_6c69_7073_6500, u64::from(strand)]);
    let axis = Vec3::new(rng.range(-1.0, 1.0), rng.range(-1.0, 1.0), rng.range(-1.0, 1.0));
    axis.reject_from_normalized(tangent).try_normalize().unwrap_or(tangent.any_orthonormal_vector())
}

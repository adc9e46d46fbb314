//! The solid that hair hangs on, moving: the head turns about the neck, the shoulders keep still, and the neck
//! between them follows in part.

use crate::head::{Head, MeshBvh, REFERENCE_BREADTH_MM, Sdf};
use glam::{DQuat, DVec3, Vec3};
use rayon::prelude::*;
use std::sync::OnceLock;
use strandbench_types::TriMesh;

/// Middle of the cervical spine, about which a head turns and nods, mm on a head of reference breadth.
const PIVOT_MM: DVec3 = DVec3::new(0.0, -110.0, -18.0);

/// The neck bends between these heights (mm) below a plane that slants from the chin to the nape.
const NECK_TOP_MM: f32 = -119.0;
const NECK_END_MM: f32 = -196.0;
const NECK_SLANT: f32 = 0.31;

/// Where the head is: a rotation about the pivot, from its pose at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct HeadTurn {
    pub rotation: DQuat,
}

enum Solid {
    Embedded(Head),
    Mesh(Box<Mesh>),
    Nothing,
}

struct Mesh {
    bvh: MeshBvh,
    field: Sdf,
    support: Sdf,
    roughness: Roughness,
}

/// How wrong the sampled distance field may be near the skin: ears are thinner than its cells.
struct Roughness {
    low: Vec3,
    cell_mm: f32,
    size: [usize; 3],
    /// Indexed by cell, x fastest, mm.
    error_mm: Vec<f32>,
}

/// Distance from the skin up to which the field's error is known, mm.
pub(super) const KNOWN_MM: f32 = 6.0;

impl Roughness {
    fn new(
        low: Vec3,
        high: Vec3,
        cell_mm: f32,
        field: impl Fn(Vec3) -> f32 + Sync,
        exact: impl Fn(Vec3) -> f32 + Sync,
    ) -> Roughness {
        let size = ((high - low) / cell_mm).ceil().to_array().map(|n| (n as usize).max(1));
        let error_mm = (0..size.iter().product())
            .into_par_iter()
            .map(|i| {
                let corner = Vec3::new(
                    (i % size[0]) as f32,
                    (i / size[0] % size[1]) as f32,
                    (i / (size[0] * size[1])) as f32,
                );
                let at = |f: Vec3| low + (corner + f) * cell_mm;
                if field(at(Vec3::splat(0.5))).abs() > KNOWN_MM + cell_mm {
                    return 0.0;
                }
                // Eight places within the cell show about two thirds of the largest error.
                let worst = (0..8u32)
                    .map(|c| {
                        let f = |bit: u32| if c >> bit & 1 == 1 { 0.75 } else { 0.25 };
                        let p = at(Vec3::new(f(0), f(1), f(2)));
                        (field(p) - exact(p)).abs()
                    })
                    .fold(0.0, f32::max);
                1.5 * worst + 0.02
            })
            .collect();
        Roughness { low, cell_mm, size, error_mm }
    }

    fn at(&self, p: Vec3) -> f32 {
        let g = ((p - self.low) / self.cell_mm).floor();
        let mut index = 0;
        for (axis, stride) in [(2, self.size[0] * self.size[1]), (1, self.size[0]), (0, 1)] {
            if g[axis] < 0.0 || g[axis] >= self.size[axis] as f32 {
                return self.cell_mm;
            }
            index += g[axis] as usize * stride;
        }
        self.error_mm[index]
    }
}

/// Of the embedded head at reference size.
fn head_roughness() -> &'static Roughness {
    static ROUGHNESS: OnceLock<Roughness> = OnceLock::new();
    ROUGHNESS.get_or_init(|| {
        let head = Head::new(REFERENCE_BREADTH_MM);
        let (low, high) = (Vec3::new(-230.0, -360.0, -190.0), Vec3::new(230.0, 150.0, 190.0));
        Roughness::new(low, high, 5.0, |p| head.distance(p).0, |p| head.exact_distance(p).0)
    })
}

pub(super) struct Body {
    solid: Solid,
    scale: f32,
    pub pivot_mm: DVec3,
}

impl Body {
    pub fn embedded(breadth_mm: f32) -> Body {
        let head = Head::new(breadth_mm);
        let scale = head.scale();
        Body { solid: Solid::Embedded(head), scale, pivot_mm: PIVOT_MM * f64::from(scale) }
    }

    /// A mesh that moves as one about the pivot of a head of the same size, or nothing solid.
    pub fn mesh(mesh: Option<&TriMesh>, breadth_mm: f32) -> Body {
        let scale = breadth_mm / REFERENCE_BREADTH_MM;
        let pivot_mm = PIVOT_MM * f64::from(scale);
        let bounded = mesh.and_then(|m| m.bounds().map(|b| (m, b)));
        let Some((mesh, (low, high))) = bounded else {
            return Body { solid: Solid::Nothing, scale, pivot_mm };
        };
        let bvh = MeshBvh::new(&mesh.vertices, &mesh.triangles);
        let cell = ((high - low).max_element() / 90.0).max(2.0);
        let margin = Vec3::splat(8.0 * cell);
        let field = Sdf::new(&bvh, low - margin, high + margin, cell);
        let support = field.blurred(3);
        let (a, b) = (low - margin, high + margin);
        let roughness = Roughness::new(a, b, cell, |p| field.sample(p).0, |p| bvh.closest(p, None).distance);
        let mesh = Mesh { bvh, field, support, roughness };
        Body { solid: Solid::Mesh(Box::new(mesh)), scale, pivot_mm }
    }

    /// How far a place of the body at rest takes part in the head's motion, 0..1.
    fn share(&self, p: Vec3) -> f32 {
        if !matches!(self.solid, Solid::Embedded(_)) {
            return 1.0;
        }
        let height = p.y + NECK_SLANT * p.z;
        let (top, end) = (NECK_TOP_MM * self.scale, NECK_END_MM * self.scale);
        let t = ((height - end) / (top - end)).clamp(0.0, 1.0);
        t * t * (3.0 - 2.0 * t)
    }

    fn rotation(turn: &HeadTurn, share: f32) -> DQuat {
        if share >= 1.0 {
            return turn.rotation;
        }
        // Between no rotation and the head's, by the normalised chord: within 1 % of the arc below 80°.
        let s = f64::from(share);
        let q = turn.rotation;
        let q = if q.w < 0.0 { -q } else { q };
        DQuat::from_xyzw(q.x * s, q.y * s, q.z * s, 1.0 - s + q.w * s).normalize()
    }

    /// Where a point at rest is carried to when it takes part wholly.
    pub fn carry_with_head(&self, turn: &HeadTurn, rest: DVec3) -> DVec3 {
        if turn.rotation == DQuat::IDENTITY {
            return rest;
        }
        turn.rotation * (rest - self.pivot_mm) + self.pivot_mm
    }

    /// Where a point of the body at rest is carried to.
    pub fn carry(&self, turn: &HeadTurn, rest: Vec3) -> Vec3 {
        if turn.rotation == DQuat::IDENTITY {
            return rest;
        }
        let r = Body::rotation(turn, self.share(rest));
        (r * (rest.as_dvec3() - self.pivot_mm) + self.pivot_mm).as_vec3()
    }

    /// Whether a place near the body as posed moves with the head as one, or keeps still.
    #[cfg(test)]
    pub fn is_rigid(&self, turn: &HeadTurn, world: Vec3) -> bool {
        let share = self.share(self.uncarried(turn, world).0);
        share == 0.0 || share == 1.0
    }

    /// The place at rest of what is now at `world`, and the rotation that brought it there.
    fn uncarried(&self, turn: &HeadTurn, world: Vec3) -> (Vec3, DQuat) {
        if turn.rotation == DQuat::IDENTITY {
            return (world, turn.rotation);
        }
        let p = world.as_dvec3() - self.pivot_mm;
        let back = |r: DQuat| (r.conjugate() * p + self.pivot_mm).as_vec3();
        let whole = back(turn.rotation);
        if self.share(whole) >= 1.0 {
            return (whole, turn.rotation);
        }
        // The share s for which what s carries here has the share s: bracketed, as shares lie in 0..1. Regula falsi
        // with halving (Illinois).
        let excess = |s: f32| self.share(back(Body::rotation(turn, s))) - s;
        let (mut low, mut high) = ((0.0, excess(0.0)), (1.0, excess(1.0)));
        let mut share = 0.0;
        for _ in 0..12 {
            if low.1 <= 0.0 {
                share = low.0;
                break;
            }
            share = (low.0 * high.1 - high.0 * low.1) / (high.1 - low.1);
            let e = excess(share);
            if e.abs() < 1e-5 {
                break;
            }
            if e > 0.0 {
                (low, high.1) = ((share, e), 0.5 * high.1);
            } else {
                (high, low.1) = ((share, e), 0.5 * low.1);
            }
        }
        let r = Body::rotation(turn, share);
        (back(r), r)
    }

    fn moved(&self, turn: &HeadTurn, p: Vec3, field: impl Fn(&Body, Vec3) -> (f32, Vec3)) -> (f32, Vec3) {
        let (rest, r) = self.uncarried(turn, p);
        let (gap, normal) = field(self, rest);
        (gap, (r * normal.as_dvec3()).as_vec3())
    }

    /// Signed distance (mm, negative inside) from the skin as posed, and outward direction; interpolated. In the
    /// bent neck the distance is that at rest.
    pub fn gap(&self, turn: &HeadTurn, p: Vec3) -> (f32, Vec3) {
        self.moved(turn, p, Body::rest_gap)
    }

    /// Distance as [`Body::gap`] has it, and how wrong it may be where it is below [`KNOWN_MM`].
    pub fn rough_gap(&self, turn: &HeadTurn, p: Vec3) -> (f32, f32) {
        let (rest, _) = self.uncarried(turn, p);
        let error = match &self.solid {
            Solid::Embedded(_) => head_roughness().at(rest / self.scale) * self.scale,
            Solid::Mesh(m) => m.roughness.at(rest),
            Solid::Nothing => 0.0,
        };
        (self.rest_gap(rest).0, error)
    }

    /// The same from the mesh itself.
    pub fn exact_gap(&self, turn: &HeadTurn, p: Vec3) -> (f32, Vec3) {
        self.moved(turn, p, Body::exact_rest_gap)
    }

    /// The same of the head as thick hair feels it, without ears and nose.
    pub fn support(&self, turn: &HeadTurn, p: Vec3) -> (f32, Vec3) {
        self.moved(turn, p, Body::rest_support)
    }

    /// Velocity (mm/s) of the body's material at `p` while the head goes from one pose to the other.
    pub fn velocity(&self, turns: [&HeadTurn; 2], p: Vec3, dt: f64) -> DVec3 {
        if turns[0] == turns[1] {
            return DVec3::ZERO;
        }
        let (rest, r) = self.uncarried(turns[1], p);
        let share = self.share(rest);
        let old = Body::rotation(turns[0], share);
        let from_pivot = rest.as_dvec3() - self.pivot_mm;
        (r * from_pivot - old * from_pivot) / dt
    }

    pub fn rest_gap(&self, p: Vec3) -> (f32, Vec3) {
        match &self.solid {
            Solid::Embedded(head) => head.distance(p),
            Solid::Mesh(m) => m.field.sample(p),
            Solid::Nothing => (f32::INFINITY, Vec3::Y),
        }
    }

    pub fn exact_rest_gap(&self, p: Vec3) -> (f32, Vec3) {
        match &self.solid {
            Solid::Embedded(head) => head.exact_distance(p),
            Solid::Mesh(m) => {
                let c = m.bvh.closest(p, None);
                (c.distance, c.normal)
            }
            Solid::Nothing => (f32::INFINITY, Vec3::Y),
        }
    }

    pub fn rest_support(&self, p: Vec3) -> (f32, Vec3) {
        match &self.solid {
            Solid::Embedded(head) => head.support(p),
            Solid::Mesh(m) => m.support.sample(p),
            Solid::Nothing => (f32::INFINITY, Vec3::Y),
        }
    }
}

#[cfg(test)]
mod tests;

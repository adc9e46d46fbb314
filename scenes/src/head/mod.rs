//! The head that hair grows on: its mesh, its distance field and its scalp.
//!
//! World coordinates are mm with the origin in the middle of the cranium, +y up, the face towards +z and the
//! subject's left at +x.

mod asset;
mod bvh;
mod scalp;
mod sdf;

pub(crate) use bvh::MeshBvh;
pub(crate) use scalp::{Root, Scalp};
pub(crate) use sdf::Sdf;

use glam::Vec3;
use std::sync::OnceLock;
use strandbench_types::TriMesh;

/// Breadth of the head as embedded after scaling, mm: the mean of adult men and women is near it.
pub(crate) const REFERENCE_BREADTH_MM: f32 = 155.0;

/// Cell of the sampled distance field, mm. Trilinear interpolation over a skull of radius 80 mm is then wrong
/// by at most 5² / (4 · 80) = 0.08 mm; what needs less asks the mesh.
const CELL_MM: f32 = 5.0;

const SUPPORT_REACH: usize = 3;

struct Model {
    skin: TriMesh,
    eyes: TriMesh,
    bvh: MeshBvh,
    sdf: Sdf,
    /// The field that hair lies on: `sdf` averaged over [`SUPPORT_REACH`] cells either way.
    support: Sdf,
    scalp: Scalp,
}

static MODEL: OnceLock<Model> = OnceLock::new();

fn model() -> &'static Model {
    MODEL.get_or_init(|| {
        let (skin, eyes) = asset::load();
        let (mut skin, eyes) = (skin.subdivided(), eyes.subdivided());
        // Breadth is measured on the cranium, above the ears.
        let half = skin
            .vertices
            .iter()
            .zip(&skin.ear)
            .filter(|(p, ear)| **ear == 0.0 && p.y > 5.0)
            .fold(0.0f32, |m, (p, _)| m.max(p.x.abs()));
        let scale = 0.5 * REFERENCE_BREADTH_MM / half;
        skin.vertices.iter_mut().for_each(|p| *p *= scale);
        let ear = std::mem::take(&mut skin.ear);
        let eyes = TriMesh {
            vertices: eyes.vertices.iter().map(|p| *p * scale).collect(),
            triangles: eyes.triangles(),
        };
        let skin = TriMesh { triangles: skin.triangles(), vertices: skin.vertices };
        let bvh = MeshBvh::new(&skin.vertices, &skin.triangles);
        let sdf = Sdf::new(&bvh, Vec3::new(-230.0, -360.0, -190.0), Vec3::new(230.0, 150.0, 190.0), CELL_MM);
        let scalp = Scalp::new(&skin, &ear);
        let support = sdf.blurred(SUPPORT_REACH);
        Model { skin, eyes, bvh, sdf, support, scalp }
    })
}

/// The embedded head at a given breadth.
#[derive(Clone, Copy)]
pub(crate) struct Head {
    scale: f32,
    model: &'static Model,
}

impl Head {
    /// The head with this breadth in mm.
    pub fn new(breadth_mm: f32) -> Head {
        Head { scale: breadth_mm / REFERENCE_BREADTH_MM, model: model() }
    }

    /// Size relative to a head of [`REFERENCE_BREADTH_MM`].
    pub fn scale(&self) -> f32 {
        self.scale
    }

    /// Head, neck and shoulders.
    pub fn skin(&self) -> TriMesh {
        self.scaled(&self.model.skin)
    }

    /// Both eyeballs.
    pub fn eyes(&self) -> TriMesh {
        self.scaled(&self.model.eyes)
    }

    fn scaled(&self, mesh: &TriMesh) -> TriMesh {
        TriMesh {
            vertices: mesh.vertices.iter().map(|p| *p * self.scale).collect(),
            triangles: mesh.triangles.clone(),
        }
    }

    /// Signed distance (mm, negative inside) and outward direction, interpolated.
    #[inline]
    pub fn distance(&self, p: Vec3) -> (f32, Vec3) {
        let (d, n) = self.model.sdf.sample(p / self.scale);
        (d * self.scale, n)
    }

    /// Distance (mm) and outward direction of the head as thick hair feels it: ears and nose are hardly there.
    #[inline]
    pub fn support(&self, p: Vec3) -> (f32, Vec3) {
        let (d, n) = self.model.support.sample(p / self.scale);
        (d * self.scale, n)
    }

    /// Signed distance (mm) and outward direction, from the mesh itself.
    pub fn exact_distance(&self, p: Vec3) -> (f32, Vec3) {
        let c = self.model.bvh.closest(p / self.scale, None);
        (c.distance * self.scale, c.normal)
    }

    /// Where the hairline crosses the middle of the forehead.
    pub fn front_hairline(&self) -> Vec3 {
        let y = scalp::front_height_mm() * self.scale;
        let (mut inside, mut outside) = (0.0f32, 200.0 * self.scale);
        for _ in 0..32 {
            let z = 0.5 * (inside + outside);
            if self.exact_distance(Vec3::new(0.0, y, z)).0 < 0.0 { inside = z } else { outside = z }
        }
        Vec3::new(0.0, y, outside)
    }

    /// Where hair grows, at the reference size.
    pub fn scalp(&self) -> &'static Scalp {
        &self.model.scalp
    }
}

/// The scalp of the embedded head in any pose: the triangles of `head` that have a corner inside the hairline. `None`
/// for any other mesh, of which nobody knows where its hair grows.
pub fn scalp_of(head: &TriMesh) -> Option<TriMesh> {
    let model = model();
    if head.triangles != model.skin.triangles || head.vertices.len() != model.skin.vertices.len() {
        return None;
    }
    let mut place = vec![u32::MAX; head.vertices.len()];
    let mut scalp = TriMesh::default();
    for &i in model.scalp.indices() {
        scalp.triangles.push(head.triangles[i as usize].map(|v| {
            let at = &mut place[v as usize];
            if *at == u32::MAX {
                *at = scalp.vertices.len() as u32;
                scalp.vertices.push(head.vertices[v as usize]);
            }
            *at
        }));
    }
    Some(scalp)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scalp_is_where_hair_grows_and_another_mesh_has_none() {
        let head = Head::new(160.0);
        let mut skin = head.skin();
        let scalp = scalp_of(&skin).unwrap();
        let area = |m: &TriMesh| -> f32 {
            let corners = m.triangles.iter().map(|t| t.map(|i| m.vertices[i as usize]));
            corners.map(|[a, b, c]| 0.5 * (b - a).cross(c - a).length()).sum()
        };
        let grown = head.scalp().area_mm2() * head.scale() * head.scale();
        assert!((area(&scalp) / grown - 1.0).abs() < 1e-4, "{} mm² for {grown}", area(&scalp));
        let bvh = MeshBvh::new(&scalp.vertices, &scalp.triangles);
        for root in head.scalp().roots(500, head.scale(), &[3], 1) {
            assert!(bvh.closest(root.position, None).distance.abs() < 0.1, "{}", root.position);
        }
        skin.triangles.swap(0, 1);
        assert_eq!(scalp_of(&skin), None);
    }

    #[test]
    fn the_field_agrees_with_the_mesh_and_the_head_has_its_breadth() {
        let head = Head::new(150.0);
        let skin = head.skin();
        let breadth = skin
            .vertices
            .iter()
            .filter(|p| p.y > 5.5)
            .fold((0.0f32, 0.0f32), |m, p| (m.0.max(p.x), m.1.min(p.x)));
        assert!((breadth.0 - breadth.1 - 150.0).abs() < 0.2, "{breadth:?}");
        let mut worst = 0.0f32;
        for i in 0..4000 {
            let mut r = strandbench_rng::Rng::keyed(&[11, i]);
            let direction = Vec3::new(r.range(-1.0, 1.0), r.range(0.0, 1.0), r.range(-1.0, 0.3));
            let p = direction.normalize() * r.range(60.0, 140.0) + Vec3::Y * 10.0;
            let (d, n) = head.distance(p);
            let (e, m) = head.exact_distance(p);
            worst = worst.max((d - e).abs());
            assert!(e.abs() < 3.0 || e < -20.0 || n.dot(m) > 0.97, "{p}: {n} against {m}");
            assert!((d - e).abs() < 0.6, "{p}: {d} against {e}");
        }
        assert!(worst > 1e-4, "the field cannot be exact");
        assert!(head.exact_distance(Vec3::ZERO).0 < -50.0);
    }
}

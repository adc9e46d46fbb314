//! Where a hair stands in the skin.

use super::{FaceModel, PosedFace};
use glam::{Mat3, Vec2, Vec3};

/// A place on the skin that keeps its identity: a triangle and weights of its corners, which sum to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Follicle {
    /// Triangle, of [`FaceModel::triangles`].
    pub triangle: u32,
    /// Weights of the three corners, none negative.
    pub barycentric: [f32; 3],
}

/// Position and axes of the skin at a follicle at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FollicleFrame {
    /// On the skin, mm.
    pub position: Vec3,
    /// Columns: the direction on the skin in which u grows, the one at right angles to it towards growing v, the
    /// outward normal; orthonormal, a rotation where the chart is not mirrored.
    pub axes: Mat3,
}

impl Follicle {
    /// Its place on the texture map.
    pub fn uv(&self, model: &FaceModel) -> Vec2 {
        let corners = model.uv_triangles()[self.triangle as usize].map(|i| model.uvs()[i as usize]);
        (0..3).map(|k| corners[k] * self.barycentric[k]).sum()
    }

    /// Its frame on a posed face. The normal is interpolated between the vertices', the tangent is the triangle's
    /// derivative by u less its part along the normal: both follow the skin as smoothly as its vertices move.
    pub fn frame(&self, model: &FaceModel, face: &PosedFace) -> FollicleFrame {
        let corners = model.triangles()[self.triangle as usize];
        let uv = model.uv_triangles()[self.triangle as usize].map(|i| model.uvs()[i as usize]);
        let p = corners.map(|i| face.vertices[i as usize]);
        let mix = |v: [Vec3; 3]| (0..3).map(|k| v[k] * self.barycentric[k]).sum::<Vec3>();
        let position = mix(p);
        let normal = mix(corners.map(|i| face.normals[i as usize])).normalize_or(Vec3::Z);
        let (d1, d2) = (uv[1] - uv[0], uv[2] - uv[0]);
        let area = d1.perp_dot(d2);
        let along = ((p[1] - p[0]) * d2.y - (p[2] - p[0]) * d1.y) * area.signum();
        let tangent = along.reject_from_normalized(normal).try_normalize();
        let tangent = tangent.unwrap_or_else(|| normal.any_orthonormal_vector());
        let across = normal.cross(tangent) * area.signum();
        FollicleFrame { position, axes: Mat3::from_cols(tangent, across, normal) }
    }
}

impl FollicleFrame {
    /// Where a point fixed to this frame goes when the skin moves to `to`.
    pub fn carry(&self, to: &FollicleFrame, point: Vec3) -> Vec3 {
        to.position + to.axes * (self.axes.transpose() * (point - self.position))
    }
}

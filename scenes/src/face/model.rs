//! The face's topology: control mesh, two steps of subdivision, texture coordinates, parts.

use super::asset::{Asset, FACE_BIN, Kind, Target};
use super::{FaceError, Part};
use crate::groom::quintic;
use crate::subdivision::{Refinement, triangles};
use glam::{Vec2, Vec3};
use std::sync::OnceLock;
use strandbench_types::TriMesh;

/// What all faces share: topology, texture coordinates and targets.
pub struct FaceModel {
    pub(super) asset: Asset,
    pub(super) steps: [Refinement; 2],
    /// Part of the head's turn that a control vertex takes, 0 on the shoulders.
    pub(super) follow: Vec<f32>,
    triangles: Vec<[u32; 3]>,
    uvs: Vec<Vec2>,
    uv_triangles: Vec<[u32; 3]>,
    /// Indexed [triangle].
    parts: Vec<Part>,
}

static EMBEDDED: OnceLock<FaceModel> = OnceLock::new();

impl FaceModel {
    /// The face that comes with the program.
    pub fn embedded() -> &'static FaceModel {
        EMBEDDED.get_or_init(|| FaceModel::parse(FACE_BIN).expect("tested: the embedded face can be read"))
    }

    /// Reads a face from the bytes that `derive_face.py` writes.
    ///
    /// # Errors
    /// [`FaceError::Asset`] with the place: truncation, indices out of range, a uv outside 0..1, numbers not finite,
    /// an edge of more than two quads.
    pub fn parse(bytes: &[u8]) -> Result<FaceModel, FaceError> {
        let asset = Asset::parse(bytes)?;
        let refine = |quads: &[[u32; 4]], vertices: usize| {
            let first = Refinement::new(quads, vertices);
            let second = Refinement::new(&first.quads, first.refined_vertices());
            [first, second]
        };
        let steps = refine(&asset.quads, asset.vertices.len());
        let uv_steps = refine(&asset.uv_quads, asset.uvs.len());
        let uvs = uv_steps[1].smooth(&uv_steps[0].smooth(&asset.uvs));
        let parts = asset.parts.iter().flat_map(|&p| [p; 32]).collect();
        let follow = follow(&asset);
        Ok(FaceModel {
            triangles: triangles(&steps[1].quads),
            uv_triangles: triangles(&uv_steps[1].quads),
            uvs,
            parts,
            follow,
            steps,
            asset,
        })
    }

    /// Vertices of a posed face.
    pub fn vertex_count(&self) -> usize {
        self.steps[1].refined_vertices()
    }

    /// Vertices of the control mesh.
    pub fn control_count(&self) -> usize {
        self.asset.vertices.len()
    }

    /// Corners of each triangle, wound counter-clockwise seen from outside; 32 a quad of the control mesh.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Texture coordinates in 0..1, v upwards; more than vertices, for a vertex on a seam has several.
    pub fn uvs(&self) -> &[Vec2] {
        &self.uvs
    }

    /// Texture coordinates of each triangle's corners, indexed as [`FaceModel::triangles`].
    pub fn uv_triangles(&self) -> &[[u32; 3]] {
        &self.uv_triangles
    }

    /// Part of each triangle, indexed as [`FaceModel::triangles`].
    pub fn parts(&self) -> &[Part] {
        &self.parts
    }

    /// Names of the expressions, ARKit's, in the order of weights.
    pub fn expressions(&self) -> impl Iterator<Item = &str> {
        self.expression_targets().map(|t| t.name.as_str())
    }

    /// Names of the ways in which identities differ beside sex, age, weight and ethnicity.
    pub fn axes(&self) -> impl Iterator<Item = &str> {
        self.asset.axes.iter().map(|a| a.name.as_str())
    }

    pub(super) fn expression_targets(&self) -> impl Iterator<Item = &Target> {
        self.asset.targets.iter().filter(|t| t.kind == Kind::Expression)
    }

    /// The margins of the lids, on which lashes stand: name and vertices from the inner to the outer corner, each
    /// joined to the next by an edge of the control mesh. Control vertices keep their index when posed.
    pub fn lash_lines(&self) -> impl Iterator<Item = (&str, &[u32])> {
        self.asset.curves.iter().map(|(name, path)| (name.as_str(), path.as_slice()))
    }

    /// Vertices of a face of these control vertices.
    pub(super) fn refined(&self, control: &[Vec3]) -> Vec<Vec3> {
        self.steps[1].smooth(&self.steps[0].smooth(control))
    }

    /// The triangles of some parts, for a surface of one appearance.
    pub fn part(&self, parts: &[Part]) -> PartTopology {
        let mut place = vec![u32::MAX; self.vertex_count()];
        let mut out = PartTopology { vertices: Vec::new(), triangles: Vec::new(), faces: Vec::new() };
        let kept = (0u32..).zip(&self.triangles).zip(&self.parts).filter(|(_, p)| parts.contains(p));
        for ((face, t), _) in kept {
            out.faces.push(face);
            out.triangles.push(t.map(|v| {
                let at = &mut place[v as usize];
                if *at == u32::MAX {
                    *at = out.vertices.len() as u32;
                    out.vertices.push(v);
                }
                *at
            }));
        }
        out
    }

    /// The triangles of some parts of a posed face as a mesh of their own.
    pub fn part_mesh(&self, vertices: &[Vec3], parts: &[Part]) -> TriMesh {
        let part = self.part(parts);
        TriMesh { vertices: part.gather(vertices), triangles: part.triangles }
    }
}

/// Which vertices and triangles of the face make up a part of it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PartTopology {
    /// The face's vertex, indexed by the part's.
    pub vertices: Vec<u32>,
    /// Corners of each triangle, vertices of the part.
    pub triangles: Vec<[u32; 3]>,
    /// The face's triangle, indexed by the part's.
    pub faces: Vec<u32>,
}

impl PartTopology {
    /// The part's values of something that each vertex of the face has.
    pub fn gather<T: Copy>(&self, of_face: &[T]) -> Vec<T> {
        self.vertices.iter().map(|&v| of_face[v as usize]).collect()
    }
}

/// How far each control vertex of the mean face follows the head's turn: none on the shoulders, all above the chin and
/// the skull's base, smooth between. The slope takes the throat lower than the nape, as the neck leans forward.
fn follow(asset: &Asset) -> Vec<f32> {
    const SHOULDER_MM: f32 = -205.0;
    const HEAD_MM: f32 = -105.0;
    let mut out: Vec<f32> = asset
        .vertices
        .iter()
        .map(|p| {
            let t = ((p.y + 0.35 * p.z - SHOULDER_MM) / (HEAD_MM - SHOULDER_MM)).clamp(0.0, 1.0);
            quintic(t)
        })
        .collect();
    for (q, part) in asset.quads.iter().zip(&asset.parts) {
        if *part != Part::Skin {
            q.iter().for_each(|&i| out[i as usize] = 1.0);
        }
    }
    out
}

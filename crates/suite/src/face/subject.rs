//! What of a face is the same in all frames: the skin's layout, and the model of faces that a method may use.

use super::FaceJob;
use super::render::make;
use crate::SuiteError;
use crate::stage::write_json;
use glam::Vec3;
use serde::Serialize;
use std::path::Path;
use strandbench_io::{UvMesh, write_npy, write_uv_mesh};
use strandbench_scenes::face::{FaceSpec, FaceStage, Identity};
use strandbench_solve::Pca;
use strandbench_types::{Monitor, TriMesh};

/// Sub-folder of what a method may use: a linear model of other people's hair-free faces.
pub(super) const MODEL: &str = "model";

/// Persons of the model, and the first one's number. Winberg et al. 2022 (3.2) take a database of scanned faces.
const MEMBERS: u64 = 60;
const FIRST_MEMBER: u64 = 1000;
/// Modes that are kept.
const MODES: usize = 40;

/// `model/model.json`.
#[derive(Serialize)]
struct About {
    note: &'static str,
    /// `face.identity` of those whom the model is made of.
    members: Vec<u64>,
    /// `face.identity` of the subject, who is none of them.
    left_out: u64,
    modes: usize,
    vertices: usize,
}

const NOTE: &str = "face = mean + sum of w_k times mode k, mm; mean.obj has the topology and the texture coordinates of \
     all skins; modes.npy is float32 of shape (modes, vertices, 3), orthonormal; variances.npy is mm^2 along each mode, \
     largest first";

/// Writes `skin.obj` (the subject's neutral skin with texture coordinates: truth) and `model/` (mean, modes, variances).
pub(super) fn write(
    job: &FaceJob,
    stage: &FaceStage,
    dir: &Path,
    monitor: &dyn Monitor,
) -> Result<(), SuiteError> {
    let (model, skin) = (stage.model(), stage.skin());
    let with_uv = |vertices: Vec<Vec3>| UvMesh {
        mesh: TriMesh { vertices, triangles: skin.triangles.clone() },
        uvs: model.uvs().to_vec(),
        uv_triangles: skin.faces.iter().map(|&f| model.uv_triangles()[f as usize]).collect(),
    };
    let neutral = stage.moment(0.0)?;
    write_uv_mesh(&dir.join("skin.obj"), &with_uv(neutral.scene.surfaces[0].mesh.vertices.clone()))?;

    let subject = job.spec.face.identity;
    let members: Vec<u64> = (FIRST_MEMBER..).filter(|&i| i != subject).take(MEMBERS as usize).collect();
    monitor.begin("model of faces", members.len() as u64);
    let fault =
        |e: &dyn std::fmt::Display| SuiteError::Scene { scene: job.name.clone(), problem: e.to_string() };
    let mut shapes = Vec::new();
    for &identity in &members {
        monitor.check()?;
        let spec = FaceSpec { identity, ..FaceSpec::default() };
        let person = Identity::draw(model, &spec).map_err(|e| fault(&e))?;
        shapes.push(skin.gather(&person.vertices(model)));
        monitor.advance(1);
    }
    let pca = Pca::fit(&shapes, None).map_err(|e| fault(&e))?;
    let folder = dir.join(MODEL);
    make(&folder)?;
    write_uv_mesh(&folder.join("mean.obj"), &with_uv(pca.mean.clone()))?;
    let (modes, vertices) = (pca.modes.len().min(MODES), pca.mean.len());
    let values: Vec<f32> = pca.modes[..modes].iter().flatten().flat_map(|v| v.to_array()).collect();
    write_npy(&folder.join("modes.npy"), &[modes, vertices, 3], &values)?;
    let variances: Vec<f32> = pca.variances[..modes].iter().map(|&v| v as f32).collect();
    write_npy(&folder.join("variances.npy"), &[modes], &variances)?;
    write_json(&folder.join("model.json"), &About { note: NOTE, members, left_out: subject, modes, vertices })
}

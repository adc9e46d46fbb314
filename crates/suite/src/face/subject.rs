//! What of a face is the same in all frames: the skin's layout, maps of its hair, the model of faces that a method may use.

use super::FaceJob;
use super::render::make;
use crate::SuiteError;
use crate::stage::write_json;
use glam::Vec3;
use serde::Serialize;
use std::path::Path;
use strandbench_io::{UvMesh, write_npy, write_uv_mesh};
use strandbench_scenes::face::{FaceModel, FaceSpec, FaceStage, HairKind, HairMaps, Identity};
use strandbench_solve::Pca;
use strandbench_types::{Monitor, TriMesh};

/// Sub-folder of what a method may use: a linear model of other people's hair-free faces.
pub(super) const MODEL: &str = "model";

/// Sub-folder of maps of the hair over texture coordinates, and their side.
const MAPS: &str = "hair";
const MAP_PX: usize = 1024;

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

/// Writes `skin.obj` (the subject's neutral skin with texture coordinates: truth), `hair/` (maps: truth) and `model/` (mean,
/// modes, variances).
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

    let fault =
        |e: &dyn std::fmt::Display| SuiteError::Scene { scene: job.name.clone(), problem: e.to_string() };
    maps(job, model, &dir.join(MAPS), &fault)?;
    let subject = job.spec.face.identity;
    let members: Vec<u64> = (FIRST_MEMBER..).filter(|&i| i != subject).take(MEMBERS as usize).collect();
    monitor.begin("model of faces", members.len() as u64);
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

/// Density, length and direction of growth of each patch that is a region, over texture coordinates: what
/// `hair.KIND.density_map` and `length_map` take, for users to edit.
fn maps(
    job: &FaceJob,
    model: &FaceModel,
    dir: &Path,
    fault: &dyn Fn(&dyn std::fmt::Display) -> SuiteError,
) -> Result<(), SuiteError> {
    make(dir)?;
    for (kind, patch) in &job.spec.hair.patches {
        if *kind == HairKind::Lash || patch.density_map.is_some() {
            continue;
        }
        let maps = HairMaps::draw(model, *kind, MAP_PX).map_err(|e| fault(&e))?;
        let level = |v: f32| (v.clamp(0.0, 1.0) * 255.0).round() as u8;
        let path = |what: &str| dir.join(format!("{}_{what}.png", kind.name()));
        strandbench_io::write_png_grey(&path("density"), &maps.density.map(|&v| level(v)))?;
        strandbench_io::write_png_grey(&path("length"), &maps.length.map(|&v| level(v)))?;
        strandbench_io::write_png_rgb(&path("direction"), &maps.direction.map(|d| d.map(level)))?;
    }
    Ok(())
}

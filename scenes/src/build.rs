//! From a description to geometry, optics, lights and cameras.

use crate::environment::environment;
use crate::groom::{groom, standard_lognormal};
use crate::head::Head;
use crate::spec::{HairFileSpec, SceneSpec};
use crate::{Pigment, Scene, SceneError, Surface, capture};
use glam::Vec3;
use std::path::{Path, PathBuf};
use strandbench_io::{IoError, read_mesh, read_strands, transform_mesh};
use strandbench_rng::Rng;
use strandbench_types::{StrandSet, TriMesh};

/// Diffuse albedo of the eyes, linear RGB.
const EYE_ALBEDO: [f32; 3] = [0.12, 0.1, 0.09];

/// Hair whose box has a longer or a shorter diagonal than this was imported at a wrong scale, mm.
const PLAUSIBLE_DIAGONAL_MM: std::ops::RangeInclusive<f32> = 40.0..=2500.0;

/// Builds a scene. `seed` is mixed with the scene's own seed; `base_dir` is the folder that the scene's file
/// names are relative to.
///
/// # Errors
/// [`SceneError::Spec`] for a value out of range, [`SceneError::File`] and [`SceneError::Hair`] for files that
/// cannot be read or do not make a scene.
pub fn build(spec: &SceneSpec, seed: u64, base_dir: Option<&Path>) -> Result<Scene, SceneError> {
    let fault = |(key, problem)| SceneError::Spec { scene: spec.name.clone(), key, problem };
    spec.check().map_err(fault)?;
    let seed = Rng::keyed(&[seed, spec.seed]).next_u64();
    let mut surfaces = Vec::new();
    let embedded = spec.head.embedded.then(|| Head::new(spec.head.breadth_mm));
    if let Some(head) = &embedded {
        surfaces.push(Surface::plain(head.skin(), spec.head.albedo_rgb));
        surfaces.push(Surface::plain(head.eyes(), EYE_ALBEDO));
    }
    let (strands, pigments) = match (&spec.groom, &spec.hair_file) {
        (Some(g), _) => {
            let head = embedded.as_ref().expect("checked: procedural hair has the embedded head");
            groom(g, &spec.pigment, head, seed).map_err(|p| fault(("groom".into(), p)))?
        }
        (None, Some(file)) => {
            let (strands, mesh) = import(spec, file, base_dir)?;
            if let Some(mesh) = mesh {
                surfaces.push(Surface::plain(mesh, spec.head.albedo_rgb));
            }
            let pigments = independent_pigments(spec, strands.len(), seed);
            (strands, pigments)
        }
        (None, None) => unreachable!("checked: the scene has hair"),
    };
    let environment = match &spec.environment {
        None => None,
        Some(e) => {
            let file = e.file.as_deref().map(|f| base_dir.map_or_else(|| f.to_owned(), |b| b.join(f)));
            let made = environment(e, file.as_deref());
            Some(made.map_err(|p| fault(("environment.file".into(), p)))?)
        }
    };
    let rig = capture::rig(&spec.rig);
    Ok(Scene {
        name: spec.name.clone(),
        strands,
        pigments,
        optics: spec.optics,
        skin: spec.skin,
        surfaces,
        lights: capture::lights(&spec.lights, &spec.rig),
        calibrated_rig: capture::calibrated(&rig, &spec.rig.calibration_error, seed),
        rig,
        environment,
        lens: capture::lens(&spec.rig),
        motion: spec.rig.motion,
        polarised: Vec::new(),
        sensor: spec.sensor.clone(),
        background_rgb: spec.background_rgb,
        head_breadth_mm: spec.head.breadth_mm,
    })
}

fn independent_pigments(spec: &SceneSpec, n: usize, seed: u64) -> Vec<Pigment> {
    (0..n as u64)
        .map(|i| {
            let tone = standard_lognormal(&mut Rng::keyed(&[seed, 17, i]), spec.pigment.strand_spread);
            let p = spec.pigment.median();
            Pigment { eumelanin: p.eumelanin * tone, pheomelanin: p.pheomelanin * tone }
        })
        .collect()
}

fn import(
    spec: &SceneSpec,
    file: &HairFileSpec,
    base_dir: Option<&Path>,
) -> Result<(StrandSet, Option<TriMesh>), SceneError> {
    let scene = || spec.name.clone();
    let unreadable = |source: IoError| SceneError::File { scene: scene(), source };
    let located = |p: &Path| -> PathBuf { base_dir.map_or_else(|| p.to_owned(), |b| b.join(p)) };
    let path = located(&file.path);
    let (mut strands, report) = read_strands(&path, &file.import).map_err(unreadable)?;
    let bad =
        |path: &Path, problem: String| SceneError::Hair { scene: scene(), path: path.to_owned(), problem };
    if strands.is_empty() {
        return Err(bad(
            &path,
            format!(
                "no strand of any length among {} in the file; is it a hair file of another program?",
                report.strands_in_file
            ),
        ));
    }
    strands.validate().map_err(|e| bad(&path, e.to_string()))?;
    let first = strands.points[0];
    let (low, high) = strands.points.iter().fold((first, first), |(a, b), &p| (a.min(p), b.max(p)));
    let diagonal = low.distance(high);
    if !PLAUSIBLE_DIAGONAL_MM.contains(&diagonal) {
        return Err(bad(
            &path,
            format!(
                "the hair is {diagonal:.1} mm from corner to corner at scale_mm = {}; hair for a human head has \
                 some 500, which scale_mm = {:.3} would give",
                file.import.scale_mm,
                file.import.scale_mm * f64::from(500.0 / diagonal.max(1e-6))
            ),
        ));
    }
    let mesh = match &spec.head.mesh_file {
        None => None,
        Some(name) => {
            let name = located(name);
            let mesh = read_mesh(&name).map_err(unreadable)?;
            let mesh = transform_mesh(&mesh, &file.import).map_err(|p| bad(&name, p))?;
            mesh.validate().map_err(|p| bad(&name, p))?;
            if mesh.triangles.is_empty() {
                return Err(bad(&name, "the head mesh has no triangles; leave it out for hair alone".into()));
            }
            Some(mesh)
        }
    };
    let shift = if file.centre { -(low + high) * 0.5 } else { Vec3::ZERO };
    strands.points.iter_mut().for_each(|p| *p += shift);
    let mesh = mesh.map(|mut m| {
        m.vertices.iter_mut().for_each(|p| *p += shift);
        m
    });
    Ok((strands, mesh))
}

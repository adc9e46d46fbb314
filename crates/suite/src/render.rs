//! A scene's images as the cameras deliver them, and its truth.

use crate::exposure::{self, Metered};
use crate::reconstruct::flat;
use crate::scene_job::SceneJob;
use crate::stage::{self, Done, Progress, read_json, write_json};
use crate::{SuiteError, identity, pictures};
use serde::{Deserialize, Serialize};
use std::path::Path;
use strandbench_renderer::{Render, RenderError, RenderScene, Settings, Stats};
use strandbench_scenes::{AreaLight, FibreOptics, Scene, Sensor};
use strandbench_types::{Frame, Plane, SampleHits, StrandSet};

/// Sub-folder that a method may see: images, masks and the rig as calibrated.
pub const FRAME: &str = "frame";
/// Sub-folder that only the scorer may see.
pub const TRUTH: &str = "truth";
/// What was rendered and how.
pub const RENDER_FILE: &str = "render.json";

/// `render.json`: what stands behind the images, for people and for the report.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RenderFile {
    /// Name that the scene goes by.
    pub scene: String,
    /// Seed of hair, sampling and sensor noise.
    pub seed: u64,
    /// The whole scene as TOML, overrides applied.
    pub toml: String,
    /// Sampling.
    pub settings: Settings,
    /// Number of fibres.
    pub strands: usize,
    /// Number of points of all fibres.
    pub points: usize,
    /// Sum of all fibres' lengths in metres.
    pub length_m: f64,
    /// Head breadth in mm.
    pub head_breadth_mm: f32,
    /// Fibre optics.
    pub optics: FibreOptics,
    /// Emitters.
    pub lights: Vec<AreaLight>,
    /// Sensor and its faults.
    pub sensor: Sensor,
    /// The light meter's reading, if the scene states no exposure.
    pub metered: Option<Metered>,
    /// What else the program decided because nobody said it.
    pub notes: Vec<String>,
    /// Work of each view, indexed `[camera]`.
    pub views: Vec<Stats>,
}

/// Reads `render.json` of a render folder.
///
/// # Errors
/// If it is missing or cannot be understood.
pub fn read_render_file(folder: &Path) -> Result<RenderFile, SuiteError> {
    read_json(&folder.join(RENDER_FILE))
}

/// Builds and renders a scene into `out`: `frame/`, `truth/`, `identity/`, `radiance/`, a picture of each
/// camera and `render.json`.
///
/// # Errors
/// If the scene cannot be built or rendered, a camera sees no hair, or the work is cancelled; `out` is then
/// untouched.
pub fn render(
    job: &SceneJob,
    settings: &Settings,
    seed: u64,
    out: &Path,
    progress: &dyn Progress,
) -> Result<Done, SuiteError> {
    let mut inputs = job.inputs()?;
    inputs.extend(flat("render", settings));
    inputs.insert("seed".into(), seed.to_string());
    inputs.insert("code".into(), env!("STRANDBENCH_CODE_RENDER").into());
    stage::run("render", out, inputs, progress, |dir| {
        progress.begin("growing hair", 1);
        let mut scene = job.build(seed)?;
        progress.advance(1);
        progress.check()?;
        let metered = exposure::meter(job, &mut scene, settings, seed, progress)?;
        let shot = Shot { seed, noise_seed: settings.noise_seed(seed), metered, frame: None };
        render_shot(job, &scene, &shot, settings, dir, progress)
    })
}

/// One exposure of all cameras.
pub(crate) struct Shot {
    /// Seed of the hair.
    pub seed: u64,
    /// Seed of sampling and of the sensor's noise.
    pub noise_seed: u64,
    /// The light meter's reading, for the record.
    pub metered: Option<Metered>,
    /// Index of a frame of a sequence. Of such a frame identity buffers, radiance and what the motion tells of the
    /// truth are not kept, and cameras may see no hair.
    pub frame: Option<u32>,
}

/// Renders a scene whose exposure is set into `dir`.
pub(crate) fn render_shot(
    job: &SceneJob,
    scene: &Scene,
    shot: &Shot,
    settings: &Settings,
    dir: &Path,
    progress: &dyn Progress,
) -> Result<(), SuiteError> {
    let failed = |e: RenderError| match e {
        RenderError::Cancelled(_) => SuiteError::Cancelled,
        other => SuiteError::Render { scene: job.name.clone(), problem: other.to_string() },
    };
    let traced = RenderScene::new(scene).map_err(failed)?;
    let (mut images, mut hits, mut views) = (Vec::new(), Vec::new(), Vec::new());
    for (c, camera) in scene.rig.cameras.iter().enumerate() {
        let render = traced.render(c, settings, shot.noise_seed, progress).map_err(failed)?;
        progress.check()?;
        let image = strandbench_renderer::expose(&scene.sensor, c, &render.radiance_rgb, shot.noise_seed);
        if shot.frame.is_none() {
            write_buffers(dir, &camera.name, &scene.strands, &render)?;
        }
        let picture = pictures::radiance(&render.radiance_rgb);
        strandbench_io::write_png_rgb(&dir.join(format!("{}.png", camera.name)), &picture)?;
        images.push(image);
        views.push(render.stats);
        hits.push(render.hits);
    }
    drop(traced);
    let (frame, truth) = frame_and_truth(job, scene, images, &hits, shot.frame)?;
    drop(hits);
    progress.check()?;
    strandbench_io::write_frame(&dir.join(FRAME), &scene.calibrated_rig, &frame)?;
    match shot.frame {
        None => strandbench_io::write_truth(&dir.join(TRUTH), &truth)?,
        Some(_) => strandbench_io::write_truth_frame(&dir.join(TRUTH), &truth)?,
    }
    let lengths_mm: f64 = (0..scene.strands.len()).map(|i| scene.strands.length_mm(i)).sum();
    let file = RenderFile {
        scene: job.name.clone(),
        seed: shot.seed,
        toml: job.toml.clone(),
        settings: settings.clone(),
        strands: scene.strands.len(),
        points: scene.strands.points.len(),
        length_m: lengths_mm / 1000.0,
        head_breadth_mm: scene.head_breadth_mm,
        optics: scene.optics,
        lights: scene.lights.clone(),
        sensor: scene.sensor.clone(),
        metered: shot.metered,
        notes: job.notes.clone(),
        views,
    };
    write_json(&dir.join(RENDER_FILE), &file)
}

/// Truth from the identity buffers; the frame's masks are the true ones, as careful keying would give.
fn frame_and_truth(
    job: &SceneJob,
    scene: &Scene,
    images: Vec<Plane<f32>>,
    hits: &[SampleHits],
    index: Option<u32>,
) -> Result<(Frame, strandbench_types::Truth), SuiteError> {
    let head = scene.surfaces.first().map(|s| &s.mesh);
    let truth = strandbench_groundtruth::truth(&scene.rig, &scene.strands, head, hits)
        .map_err(|e| SuiteError::Truth { scene: job.name.clone(), problem: e.to_string() })?;
    let masks: Vec<Plane<bool>> = truth.views.iter().map(|v| v.mask.clone()).collect();
    for (camera, mask) in scene.rig.cameras.iter().zip(&masks).filter(|_| index.is_none()) {
        if !mask.data.iter().any(|&hair| hair) {
            let problem = format!(
                "camera {} sees no hair (no pixel is covered by half); check the rig's distance, direction and \
                 focal length, and the hair's scale and place",
                camera.name
            );
            return Err(SuiteError::Scene { scene: job.name.clone(), problem });
        }
    }
    let frame = Frame { index: index.unwrap_or(0), images, masks };
    frame.validate(&scene.rig).map_err(|problem| SuiteError::Render { scene: job.name.clone(), problem })?;
    Ok((frame, truth))
}

/// Linear radiance and the identity buffer.
fn write_buffers(dir: &Path, camera: &str, strands: &StrandSet, render: &Render) -> Result<(), SuiteError> {
    for sub in ["radiance", "identity"] {
        let path = dir.join(sub);
        std::fs::create_dir_all(&path).map_err(|e| SuiteError::file(&path, e))?;
    }
    let [r, g, b] = [0, 1, 2].map(|k| render.radiance_rgb.map(|c| c[k]));
    strandbench_io::write_exr(
        &dir.join(format!("radiance/{camera}.exr")),
        &[("R", &r), ("G", &g), ("B", &b), ("variance", &render.variance)],
    )?;
    Ok(identity::write(&dir.join(format!("identity/{camera}.exr")), &render.hits, strands)?)
}

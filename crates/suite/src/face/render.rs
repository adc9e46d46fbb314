//! Images and truth of every frame of a face.

use super::file::{FACE_FILE, FaceFile, FaceRenderFile};
use super::preview::Previews;
use super::truth::{FrameTruth, Probes, Roots};
use super::{FaceJob, report, subject};
use crate::reconstruct::flat;
use crate::render::{FRAME, RENDER_FILE};
use crate::sequence::{Frames, Stages, frame_name};
use crate::stage::{self, Progress, write_json};
use crate::{Done, SuiteError};
use glam::Mat3;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;
use strandbench_groundtruth::GroundTruthError;
use strandbench_io::{atomic_write, write_colour_image, write_colour_manifest};
use strandbench_renderer::{RenderError, RenderScene, Settings, expose_rgb};
use strandbench_rng::Rng;
use strandbench_scenes::face::{FaceMoment, FaceStage, HairKind};
use strandbench_types::{Plane, SampleHits, StrandSet, TriMesh};

/// Stream of the frames' own seeds.
const FRAME_SEED: u64 = 53;

/// Folder of what is the same in all frames.
const SUBJECT: &str = "subject";

/// A pose without what lights and cameras add.
pub(super) struct Pose {
    pub moment: FaceMoment,
    /// The follicles' axes, indexed `[strand]`.
    pub axes: Vec<Mat3>,
}

impl Pose {
    fn of(moment: FaceMoment) -> Pose {
        let axes = moment.follicles.iter().map(|f| f.axes).collect();
        Pose { moment, axes }
    }

    fn meshes(&self) -> Vec<&TriMesh> {
        self.moment.scene.surfaces.iter().map(|s| &s.mesh).collect()
    }
}

/// Renders the frames asked for of a face, each into a folder of its own below `out`, and makes the page of all of them.
/// No more than one view's images are held at once.
///
/// # Errors
/// If the scene cannot be built or rendered, does not have a frame that is asked for, or the work is cancelled; finished
/// frames then stand, and the next call goes on after them.
pub fn render_face(
    job: &FaceJob,
    settings: &Settings,
    seed: u64,
    frames: Frames,
    out: &Path,
    progress: &dyn Progress,
) -> Result<Done, SuiteError> {
    let fault = |problem: String| SuiteError::Scene { scene: job.name.clone(), problem };
    let indices = frames.indices(job.spec.frames()).map_err(fault)?;
    let mut inputs = job.inputs()?;
    inputs.insert("seed".into(), seed.to_string());
    inputs.insert("code".into(), env!("STRANDBENCH_CODE_RENDER").into());

    let base = if job.names_files() {
        let base = job.base();
        std::path::absolute(base)
            .or_else(|_| std::env::current_dir())
            .map_err(|e| SuiteError::file(base, e))?
    } else {
        PathBuf::new()
    };
    let file = FaceFile::new(job, indices.clone(), base, seed);
    let text = serde_json::to_string_pretty(&file).expect("plain data") + "\n";
    make(out)?;
    atomic_write(&out.join(FACE_FILE), |w| w.write_all(text.as_bytes()))?;

    progress.begin("growing hair", 1);
    let stage = job.stage(seed)?;
    progress.advance(1);
    progress.check()?;
    let (pose, bald) = (Pose::of(stage.moment(0.0)?), StrandSet::new());
    let meshes = pose.meshes();
    let refused = |e: RenderError| SuiteError::Render { scene: job.name.clone(), problem: e.to_string() };
    let reference = Probes::new(&pose, &meshes, &bald).map_err(refused)?;
    let shooter = Shooter { job, stage: &stage, roots: Roots::new(&stage), reference, settings, seed };

    let mut stages = Stages::default();
    stages.done.push(stage::run("subject", &out.join(SUBJECT), inputs.clone(), progress, |dir| {
        subject::write(job, &stage, dir, progress)
    })?);
    inputs.extend(flat("render", settings));
    for &index in &indices {
        let inputs: BTreeMap<String, String> =
            inputs.clone().into_iter().chain([("frame".to_owned(), index.to_string())]).collect();
        let folder = out.join(frame_name(index));
        stages.done.push(stage::run("render", &folder, inputs, progress, |dir| {
            shooter.shoot(index, dir, progress)
        })?);
    }
    report(out, progress)?;
    Ok(stages.whole())
}

/// What all frames share.
pub(super) struct Shooter<'a> {
    job: &'a FaceJob,
    stage: &'a FaceStage,
    pub roots: Roots,
    /// What hides what in the reference frame.
    pub reference: Probes<'a>,
    settings: &'a Settings,
    seed: u64,
}

impl Shooter<'_> {
    pub fn render_error(&self, e: RenderError) -> SuiteError {
        match e {
            RenderError::Cancelled(_) => SuiteError::Cancelled,
            other => SuiteError::Render { scene: self.job.name.clone(), problem: other.to_string() },
        }
    }

    pub fn truth_error(&self, e: GroundTruthError) -> SuiteError {
        match e {
            GroundTruthError::Cancelled(_) => SuiteError::Cancelled,
            other => SuiteError::Truth { scene: self.job.name.clone(), problem: other.to_string() },
        }
    }

    /// The poses within the exposure, the middle one in the middle of the list.
    fn exposure(&self, time_s: f64) -> Result<Vec<Pose>, SuiteError> {
        let n = self.job.spec.rig.exposure_samples;
        (0..n)
            .map(|k| {
                let share = (f64::from(k) + 0.5) / f64::from(n) - 0.5;
                Ok(Pose::of(self.stage.moment(time_s + share * self.job.spec.rig.exposure_s)?))
            })
            .collect()
    }

    fn shoot(&self, index: u32, dir: &Path, progress: &dyn Progress) -> Result<(), SuiteError> {
        let render = |e| self.render_error(e);
        let time_s = self.stage.time_s(index);
        let poses = self.exposure(time_s)?;
        let middle = poses.len() / 2;
        let own_seed =
            Rng::keyed(&[self.settings.noise_seed(self.seed), FRAME_SEED, u64::from(index)]).next_u64();
        let scene = &poses[middle].moment.scene;
        let traced: Vec<RenderScene<'_>> = poses
            .iter()
            .map(|p| RenderScene::new(&p.moment.scene))
            .collect::<Result<_, _>>()
            .map_err(render)?;
        let (meshes, bald) = (poses[middle].meshes(), StrandSet::new());
        let now = Probes::new(&poses[middle], &meshes, &bald).map_err(render)?;
        let mut truth = FrameTruth::new(self, &poses[middle], now)?;
        let share = self.share(poses.len());
        let clock = Instant::now();
        for (k, traced) in traced.iter().enumerate() {
            traced.prepare(&share, pose_seed(own_seed, k), progress).map_err(render)?;
        }
        let skin_light_s = clock.elapsed().as_secs_f64();
        let previews = Previews::new(dir, scene, &self.stage.hair.kinds)?;
        let frame_dir = dir.join(FRAME);
        make(&frame_dir)?;
        let (mut views, mut truth_s) = (Vec::new(), 0.0);
        for (c, camera) in scene.rig.cameras.iter().enumerate() {
            let mut sum: Option<Plane<[f32; 3]>> = None;
            let mut hits: Option<SampleHits> = None;
            for (k, traced) in traced.iter().enumerate() {
                let made = traced.render(c, &share, pose_seed(own_seed, k), progress).map_err(render)?;
                progress.check()?;
                match &mut sum {
                    None => sum = Some(made.radiance_rgb),
                    Some(sum) => add(sum, &made.radiance_rgb),
                }
                if k == middle {
                    hits = Some(made.hits);
                    views.push(made.stats);
                }
            }
            let scale = 1.0 / poses.len() as f32;
            let radiance = sum.expect("at least one pose").map(|c| c.map(|v| v * scale));
            let image = expose_rgb(&scene.sensor, c, &radiance, own_seed);
            drop(radiance);
            write_colour_image(&frame_dir, &camera.name, &image)?;
            previews.image(c, &image)?;
            drop(image);
            let clock = Instant::now();
            let view = truth.view(c, &hits.expect("the middle pose is rendered"), dir, progress)?;
            truth_s += clock.elapsed().as_secs_f64();
            previews.truth(c, &view)?;
        }
        write_colour_manifest(&frame_dir, &scene.calibrated_rig, &scene.polarised, index)?;
        let clock = Instant::now();
        truth.finish(dir, progress)?;
        truth_s += clock.elapsed().as_secs_f64();
        let kinds = HairKind::ALL
            .iter()
            .map(|k| (k.name().to_owned(), self.stage.hair.kinds.iter().filter(|other| *other == k).count()));
        let file = FaceRenderFile {
            frame: index,
            time_s,
            settings: self.settings.clone(),
            hairs: scene.strands.len(),
            kinds: kinds.filter(|k| k.1 > 0).collect(),
            skin_vertices: scene.surfaces[0].mesh.vertices.len(),
            skin_light_s,
            truth_s,
            views,
        };
        write_json(&dir.join(RENDER_FILE), &file)
    }

    /// Sampling of each pose within the exposure: their samples make up those asked for.
    fn share(&self, poses: usize) -> Settings {
        let of = |n: u32| n.div_ceil(poses as u32).max(1);
        let s = self.settings;
        Settings {
            samples_per_pixel: of(s.samples_per_pixel),
            max_samples_per_pixel: of(s.max_samples_per_pixel),
            ..s.clone()
        }
    }
}

/// Seed of the sampling of one pose of a frame.
fn pose_seed(frame: u64, pose: usize) -> u64 {
    Rng::keyed(&[frame, pose as u64]).next_u64()
}

fn add(sum: &mut Plane<[f32; 3]>, more: &Plane<[f32; 3]>) {
    for (a, b) in sum.data.iter_mut().zip(&more.data) {
        *a = std::array::from_fn(|c| a[c] + b[c]);
    }
}

pub(super) fn make(dir: &Path) -> Result<(), SuiteError> {
    std::fs::create_dir_all(dir).map_err(|e| SuiteError::file(dir, e))
}

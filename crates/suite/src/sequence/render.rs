//! The images and the truth of every frame.

use super::Stages;
use super::file::{FORMAT, Frames, SEQUENCE_FILE, Sequence, SequenceFile, VERSION, frame_name};
use crate::exposure::{self, Metered};
use crate::reconstruct::flat;
use crate::render::{Shot, render_shot};
use crate::stage::{self, Progress, read_json, write_json};
use crate::{SceneJob, SuiteError};
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};
use strandbench_io::atomic_write;
use strandbench_renderer::Settings;
use strandbench_rng::Rng;
use strandbench_scenes::{MotionCache, Simulation};
use strandbench_types::StopOnly;

/// Folder of the motion.
pub(super) const MOTION: &str = "motion";
/// The motion of all frames, as [`MotionCache`] keeps it.
pub(super) const MOTION_FILE: &str = "motion.bin";
/// Folder of the light meter's reading.
pub(super) const EXPOSURE: &str = "exposure";
/// The reading, or `null` where the scene states an exposure.
pub(super) const EXPOSURE_FILE: &str = "exposure.json";
/// Stream of the frames' own seeds.
const FRAME_SEED: u64 = 47;

/// Computes the motion of a moving scene, meters its first pose, and renders the frames asked for, each into a folder
/// of its own below `out`. The exposure is the same in all frames; sampling and sensor noise are each frame's own.
///
/// # Errors
/// If the scene has one pose alone, cannot be built or rendered, does not have a frame that is asked for, or the work is
/// cancelled; finished frames then stand, and the next call goes on after them.
pub fn render_sequence(
    job: &SceneJob,
    settings: &Settings,
    seed: u64,
    frames: Frames,
    out: &Path,
    progress: &dyn Progress,
) -> Result<Stages, SuiteError> {
    render_part(job, settings, seed, frames, 0..u32::MAX, out, progress)
}

/// As [`render_sequence`], but of the frames only those in `part`: no frame's images depend on another's. The motion and
/// the exposure, which all share, are always brought up to date.
///
/// # Errors
/// As [`render_sequence`].
pub(crate) fn render_part(
    job: &SceneJob,
    settings: &Settings,
    seed: u64,
    frames: Frames,
    part: Range<u32>,
    out: &Path,
    progress: &dyn Progress,
) -> Result<Stages, SuiteError> {
    let fault = |problem: String| SuiteError::Scene { scene: job.name.clone(), problem };
    let Some(motion) = &job.spec().motion else {
        return Err(fault("has one pose; add [motion] with the number of frames".into()));
    };
    let indices = frames.indices(motion.frames).map_err(fault)?;
    let mut inputs = job.inputs()?;
    inputs.insert("seed".into(), seed.to_string());
    inputs.insert("code".into(), env!("STRANDBENCH_CODE_RENDER").into());

    let moved = stage::run("motion", &out.join(MOTION), inputs.clone(), progress, |dir| {
        let simulation = Simulation::new(job.spec(), seed, job.base(), progress)?;
        Ok(MotionCache::write(&dir.join(MOTION_FILE), simulation, progress)?)
    })?;
    let file = SequenceFile {
        format: FORMAT.into(),
        version: VERSION,
        scene: job.name.clone(),
        frames: indices.clone(),
        frame_rate_hz: job.spec().rig.frame_rate_hz,
        toml: job.toml.clone(),
        base: if job.names_files() {
            let base = job.base().unwrap_or(Path::new(""));
            std::path::absolute(base)
                .or_else(|_| std::env::current_dir())
                .map_err(|e| SuiteError::file(base, e))?
        } else {
            PathBuf::new()
        },
        seed,
    };
    let text = serde_json::to_string_pretty(&file).expect("plain data") + "\n";
    atomic_write(&out.join(SEQUENCE_FILE), |w| w.write_all(text.as_bytes()))?;
    let sequence = Sequence::open(out)?;

    inputs.extend(flat("render", settings));
    let mut stages = Stages { done: vec![moved] };

    stages.done.push(stage::run("exposure", &out.join(EXPOSURE), inputs.clone(), progress, |dir| {
        let mut scene = sequence.pose(0)?.scene;
        let metered = exposure::meter(job, &mut scene, settings, seed, progress)?;
        write_json(&dir.join(EXPOSURE_FILE), &metered)
    })?);
    let metered: Option<Metered> = read_json(&out.join(EXPOSURE).join(EXPOSURE_FILE))?;

    let quiet = StopOnly(progress);
    let indices: Vec<u32> = indices.into_iter().filter(|index| part.contains(index)).collect();
    progress.begin("frames rendered", indices.len() as u64);
    for &index in &indices {
        let inputs: BTreeMap<String, String> =
            inputs.clone().into_iter().chain([("frame".to_owned(), index.to_string())]).collect();
        let own_seed = Rng::keyed(&[settings.noise_seed(seed), FRAME_SEED, u64::from(index)]).next_u64();
        let shot = Shot { seed, noise_seed: own_seed, metered, frame: Some(index) };
        let folder = out.join(frame_name(index));
        let done = stage::run("render", &folder, inputs, &quiet, |dir| {
            let scene = sequence.scene(index)?.scene;
            render_shot(job, &scene, &shot, settings, dir, &quiet)
        })?;
        progress.advance(1);
        stages.done.push(done);
    }
    progress.stage_done(&stages.whole());
    Ok(stages)
}

//! What a face's render folder and its frames say of themselves.

use super::FaceJob;
use crate::stage::read_json;
use crate::{SuiteError, render::RENDER_FILE};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use strandbench_renderer::{Settings, Stats};

/// The file that makes a folder one of a face.
pub const FACE_FILE: &str = "face.json";

const FORMAT: &str = "strandbench-face";
const VERSION: u32 = 1;

/// `face.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FaceFile {
    /// `strandbench-face`.
    pub format: String,
    /// 1.
    pub version: u32,
    /// Name that the scene goes by.
    pub scene: String,
    /// Indices of the frames, ascending; each has a folder of that number in six digits.
    pub frames: Vec<u32>,
    /// The scene as TOML, overrides applied.
    pub toml: String,
    /// Where relative file names of the scene start; empty if it names none.
    #[serde(default)]
    pub base: PathBuf,
    /// Seed of hair, calibration, sampling and noise.
    pub seed: u64,
}

impl FaceFile {
    pub(super) fn new(job: &FaceJob, frames: Vec<u32>, base: PathBuf, seed: u64) -> FaceFile {
        let (format, scene) = (FORMAT.to_owned(), job.name.clone());
        FaceFile { format, version: VERSION, scene, frames, toml: job.toml.clone(), base, seed }
    }

    /// Whether a folder is one of a face.
    pub fn is(folder: &Path) -> bool {
        folder.join(FACE_FILE).is_file()
    }

    /// Reads `face.json` of a render folder.
    ///
    /// # Errors
    /// If it is missing, is none, or its frames are none or not in order.
    pub fn read(folder: &Path) -> Result<FaceFile, SuiteError> {
        let path = folder.join(FACE_FILE);
        let file: FaceFile = read_json(&path)?;
        let problem = if file.format != FORMAT || file.version != VERSION {
            format!("is {} version {}, not {FORMAT} version {VERSION}", file.format, file.version)
        } else if file.frames.is_empty() || file.frames.windows(2).any(|w| w[0] >= w[1]) {
            "its frames are none, or not in ascending order".to_owned()
        } else {
            return Ok(file);
        };
        Err(SuiteError::file(&path, format!("{problem}; render the face again")))
    }

    /// The face again, as it was rendered.
    ///
    /// # Errors
    /// If the scene's text is none.
    pub fn job(&self) -> Result<FaceJob, SuiteError> {
        FaceJob::from_toml(&self.scene, &self.base.join("scene.toml"), &self.toml, &[])
    }
}

/// `render.json` of a frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FaceRenderFile {
    /// Index of the frame.
    pub frame: u32,
    /// Middle of its exposure, s from the beginning of the performance.
    pub time_s: f64,
    /// Sampling.
    pub settings: Settings,
    /// Number of hairs.
    pub hairs: usize,
    /// Hairs of each kind, by name.
    pub kinds: Vec<(String, usize)>,
    /// Vertices of the skin.
    pub skin_vertices: usize,
    /// Wall seconds of the light on the skin, which all views share.
    pub skin_light_s: f64,
    /// Wall seconds of the truth of all views.
    pub truth_s: f64,
    /// Work of each view, indexed `[camera]`.
    pub views: Vec<Stats>,
}

impl FaceRenderFile {
    pub(super) fn read(frame: &Path) -> Result<FaceRenderFile, SuiteError> {
        read_json(&frame.join(RENDER_FILE))
    }
}

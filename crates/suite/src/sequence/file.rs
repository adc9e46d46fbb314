//! Which frames a render folder holds, and how any of them is had again.

use super::render::{EXPOSURE, MOTION, MOTION_FILE};
use crate::exposure::Metered;
use crate::render::TRUTH;
use crate::stage::read_json;
use crate::{SceneJob, SuiteError, hash};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::OnceLock;
use strandbench_scenes::{MotionCache, MotionFrame, Scene};
use strandbench_types::Truth;

/// The file that makes a folder one of a sequence.
pub const SEQUENCE_FILE: &str = "sequence.json";

/// Most frames of a sequence.
const MOST_FRAMES: usize = 100_000;

/// Frames to work on: from the first on, up to but without the last.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Frames {
    /// First frame.
    pub first: u32,
    /// The frame after the last; as many as the scene has where absent.
    pub end: Option<u32>,
}

impl FromStr for Frames {
    type Err = String;

    /// `A..B` (A up to but without B), `A..`, `..B` or a number of frames from the first on.
    fn from_str(text: &str) -> Result<Frames, String> {
        let number = |t: &str| {
            t.trim()
                .parse::<u32>()
                .map_err(|_| format!("{t:?} is no frame; write A..B, A.., ..B or a number"))
        };
        let frames = match text.split_once("..") {
            None => Frames { first: 0, end: Some(number(text)?) },
            Some((a, b)) => Frames {
                first: if a.trim().is_empty() { 0 } else { number(a)? },
                end: if b.trim().is_empty() { None } else { Some(number(b)?) },
            },
        };
        match frames.end {
            Some(end) if end <= frames.first => Err(format!("{text}: holds no frame")),
            _ => Ok(frames),
        }
    }
}

impl Frames {
    /// Indices, given how many frames the scene has.
    ///
    /// # Errors
    /// If a frame is asked for that the scene does not have.
    pub fn indices(&self, of: u32) -> Result<Vec<u32>, String> {
        let end = self.end.unwrap_or(of);
        if end > of || self.first >= of {
            return Err(format!(
                "--frames asks for {}..{end} where the scene has frames 0..{of}",
                self.first
            ));
        }
        Ok((self.first..end).collect())
    }
}

/// `sequence.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SequenceFile {
    /// `strandbench-sequence`.
    pub format: String,
    /// 1.
    pub version: u32,
    /// Name that the scene goes by.
    pub scene: String,
    /// Indices of the frames, ascending; each has a folder of that number in six digits.
    pub frames: Vec<u32>,
    /// Frames a second.
    pub frame_rate_hz: f64,
    /// The scene as TOML, overrides applied; empty for frames from elsewhere, whose motion nobody knows.
    #[serde(default)]
    pub toml: String,
    /// Where relative file names of the scene start; empty if it names none.
    #[serde(default)]
    pub base: PathBuf,
    /// Seed of hair, motion, sampling, noise and nulls.
    #[serde(default)]
    pub seed: u64,
}

pub(super) const FORMAT: &str = "strandbench-sequence";
pub(super) const VERSION: u32 = 1;

/// Name of a frame's folder.
pub fn frame_name(index: u32) -> String {
    format!("{index:06}")
}

/// A render folder of a sequence.
pub struct Sequence {
    /// What it holds.
    pub file: SequenceFile,
    folder: PathBuf,
    motion: OnceLock<MotionCache>,
}

impl Sequence {
    /// Whether a folder is one of a sequence.
    pub fn is(folder: &Path) -> bool {
        folder.join(SEQUENCE_FILE).is_file()
    }

    /// Opens a render folder. Frames are looked at when they are asked for.
    ///
    /// # Errors
    /// If there is no `sequence.json`, or it is not one, or its frames are none, too many or not in order.
    pub fn open(folder: &Path) -> Result<Sequence, SuiteError> {
        let path = folder.join(SEQUENCE_FILE);
        let file: SequenceFile = read_json(&path)?;
        let bad =
            |problem: String| Err(SuiteError::file(&path, format!("{problem}; render the sequence again")));
        if file.format != FORMAT || file.version != VERSION {
            return bad(format!(
                "is {} version {}, not {FORMAT} version {VERSION}",
                file.format, file.version
            ));
        }
        if file.frames.is_empty() || file.frames.len() > MOST_FRAMES {
            return bad(format!("names {} frames, not 1 to {MOST_FRAMES}", file.frames.len()));
        }
        if file.frames.windows(2).any(|w| w[0] >= w[1]) {
            return bad("the frames are not in ascending order".into());
        }
        if !(file.frame_rate_hz.is_finite() && file.frame_rate_hz > 0.0) {
            return bad(format!("{} frames a second", file.frame_rate_hz));
        }
        Ok(Sequence { file, folder: folder.to_owned(), motion: OnceLock::new() })
    }

    /// Folder of a frame.
    pub fn frame_dir(&self, index: u32) -> PathBuf {
        self.folder.join(frame_name(index))
    }

    /// The scene of a frame, exposure metered as it was for the images.
    ///
    /// # Errors
    /// If the motion cannot be read, or belongs to another scene, seed or version of the program.
    pub fn scene(&self, index: u32) -> Result<MotionFrame, SuiteError> {
        let mut frame = self.pose(index)?;
        let metered: Option<Metered> =
            read_json(&self.folder.join(EXPOSURE).join(super::render::EXPOSURE_FILE))?;
        if let Some(metered) = metered {
            frame.scene.sensor.full_scale_radiance = metered.full_scale_radiance;
        }
        Ok(frame)
    }

    /// The truth of a frame: strands and head from the motion, what cameras see of them from the frame's folder.
    ///
    /// # Errors
    /// If the motion or the frame's truth cannot be read.
    pub fn truth(&self, index: u32) -> Result<Truth, SuiteError> {
        self.truth_of(index, &mut self.pose(index)?.scene)
    }

    /// The truth of a frame whose scene is at hand; the strands are moved out of it.
    pub(crate) fn truth_of(&self, index: u32, scene: &mut Scene) -> Result<Truth, SuiteError> {
        let head = scene.surfaces.first().map(|s| s.mesh.clone());
        let dir = self.frame_dir(index).join(TRUTH);
        Ok(strandbench_io::read_truth_frame(&dir, std::mem::take(&mut scene.strands), head)?)
    }

    /// Content of what every pose follows from, as a hash: the scene and its motion.
    pub(crate) fn motion_hash(&self) -> Result<String, SuiteError> {
        let parts = [
            ("motion".to_owned(), hash::of_folder(&self.folder.join(MOTION))?),
            ("sequence".to_owned(), hash::of_file(&self.folder.join(SEQUENCE_FILE))?),
        ];
        Ok(hash::of_map(&parts.into()))
    }

    /// The scene of a frame as the motion has it: nothing is known of its exposure.
    pub(crate) fn pose(&self, index: u32) -> Result<MotionFrame, SuiteError> {
        Ok(self.motion()?.frame(index)?)
    }

    fn motion(&self) -> Result<&MotionCache, SuiteError> {
        if let Some(motion) = self.motion.get() {
            return Ok(motion);
        }
        if self.file.toml.is_empty() {
            let path = self.folder.join(SEQUENCE_FILE);
            return Err(SuiteError::file(
                &path,
                "names no scene: nothing is known about these frames' truth",
            ));
        }
        // A base that is a folder, as SceneJob takes the folder of the scene's file.
        let job =
            SceneJob::from_toml(&self.file.scene, &self.file.base.join("scene.toml"), &self.file.toml, &[])?;
        let path = self.folder.join(MOTION).join(MOTION_FILE);
        let motion = MotionCache::open(&path, job.spec(), self.file.seed, job.base())?;
        Ok(self.motion.get_or_init(|| motion))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_as_people_write_them() {
        let of = |t: &str| t.parse::<Frames>().unwrap().indices(10);
        assert_eq!(of("3").unwrap(), [0, 1, 2]);
        assert_eq!(of("2..5").unwrap(), [2, 3, 4]);
        assert_eq!(of("8..").unwrap(), [8, 9]);
        assert_eq!(of("..2").unwrap(), [0, 1]);
        assert_eq!(Frames::default().indices(3).unwrap(), [0, 1, 2]);
        assert!(of("5..11").unwrap_err().contains("0..10"));
        assert!(of("10..").is_err());
        for bad in ["", "a", "3..3", "5..2", "0", "-1..4"] {
            assert!(bad.parse::<Frames>().is_err(), "{bad}");
        }
    }

    #[test]
    fn what_is_no_sequence_is_refused() {
        let dir = tempfile::tempdir().unwrap();
        let good = SequenceFile {
            format: FORMAT.into(),
            version: VERSION,
            scene: "s".into(),
            frames: vec![0, 1, 5],
            frame_rate_hz: 100.0,
            toml: String::new(),
            base: PathBuf::new(),
            seed: 1,
        };
        let open = |f: &SequenceFile| {
            crate::stage::write_json(&dir.path().join(SEQUENCE_FILE), f).unwrap();
            Sequence::open(dir.path()).map(|_| ()).map_err(|e| e.to_string())
        };
        assert!(!Sequence::is(dir.path()) && Sequence::open(dir.path()).is_err());
        open(&good).unwrap();
        assert!(Sequence::is(dir.path()));
        let bad = |change: fn(&mut SequenceFile)| {
            let mut f = good.clone();
            change(&mut f);
            open(&f).unwrap_err()
        };
        assert!(bad(|f| f.format = "x".into()).contains("strandbench-sequence version 1"));
        assert!(bad(|f| f.version = 2).contains("version 2"));
        assert!(bad(|f| f.frames.clear()).contains("0 frames"));
        assert!(bad(|f| f.frames = vec![1, 1]).contains("ascending"));
        assert!(bad(|f| f.frame_rate_hz = 0.0).contains("0 frames a second"));
        let unknown = Sequence::open(dir.path()).err().map(|_| ());
        assert!(unknown.is_some());
        open(&good).unwrap();
        let text = Sequence::open(dir.path()).unwrap().truth(0).unwrap_err().to_string();
        assert!(text.contains("names no scene"), "{text}");
    }
}

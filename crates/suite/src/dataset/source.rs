//! Where a dataset's frames come from.

use crate::render::{FRAME, TRUTH, read_render_file};
use crate::sequence::Sequence;
use crate::{SuiteError, hash};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use strandbench_types::{Frame, Rig, TriMesh, Truth};

/// Head mesh in a truth folder.
const HEAD: &str = "head.ply";

/// Renders of one frame, a frame folder alone, or renders of a sequence.
pub(crate) enum Source {
    Still { frame: PathBuf, render: Option<PathBuf> },
    Moving(Box<Sequence>),
}

impl Source {
    /// A render folder, or a frame folder, of which nothing but the frame is known.
    pub fn open(folder: &Path) -> Result<Source, SuiteError> {
        if Sequence::is(folder) {
            return Ok(Source::Moving(Box::new(Sequence::open(folder)?)));
        }
        let frame = folder.join(FRAME);
        if frame.is_dir() {
            return Ok(Source::Still { frame, render: Some(folder.to_owned()) });
        }
        if folder.join("frame.json").is_file() {
            return Ok(Source::Still { frame: folder.to_owned(), render: None });
        }
        let problem = "is neither a render folder nor a frame folder; `strandbench render` makes one";
        Err(SuiteError::file(folder, problem))
    }

    pub fn moves(&self) -> bool {
        matches!(self, Source::Moving(_))
    }

    /// Indices of the frames; 0 where nothing moves.
    pub fn frames(&self) -> Vec<u32> {
        match self {
            Source::Still { .. } => vec![0],
            Source::Moving(sequence) => sequence.file.frames.clone(),
        }
    }

    /// The folder with what a method may see.
    pub fn frame_dir(&self, index: u32) -> PathBuf {
        match self {
            Source::Still { frame, .. } => frame.clone(),
            Source::Moving(sequence) => sequence.frame_dir(index).join(FRAME),
        }
    }

    /// Calibrated rig, images and masks.
    pub fn read(&self, index: u32) -> Result<(Rig, Frame), SuiteError> {
        let dir = self.frame_dir(index);
        Ok(match self {
            Source::Still { .. } => strandbench_io::read_frame(&dir)?,
            Source::Moving(_) => strandbench_io::read_frame_of_sequence(&dir)?,
        })
    }

    /// The head, where there is one and it is known.
    pub fn head(&self, index: u32) -> Result<Option<TriMesh>, SuiteError> {
        match self {
            Source::Still { .. } => {
                Ok(self.head_file().map(|p| strandbench_io::read_mesh(&p)).transpose()?)
            }
            Source::Moving(sequence) => {
                Ok(sequence.pose(index)?.scene.surfaces.into_iter().next().map(|s| s.mesh))
            }
        }
    }

    /// Where the head of a scene that does not move lies, if it has one and is known.
    fn head_file(&self) -> Option<PathBuf> {
        let Source::Still { render: Some(render), .. } = self else { return None };
        Some(render.join(TRUTH).join(HEAD)).filter(|p| p.is_file())
    }

    /// Content of everything that a dataset without truth is made from, by name.
    pub fn hashes(&self, head: bool) -> Result<BTreeMap<String, String>, SuiteError> {
        let mut all = BTreeMap::new();
        for index in self.frames() {
            let dir = self.frame_dir(index);
            if !dir.is_dir() {
                let remedy = "this frame is missing; `strandbench render` goes on with it";
                return Err(SuiteError::file(&dir, remedy));
            }
            all.insert(format!("frame {index}"), hash::of_folder(&dir)?);
        }
        match self {
            Source::Moving(sequence) if head => {
                all.insert("head".to_owned(), sequence.motion_hash()?);
            }
            Source::Still { .. } if head => {
                if let Some(path) = self.head_file() {
                    all.insert("head".to_owned(), hash::of_file(&path)?);
                }
            }
            _ => {}
        }
        Ok(all)
    }

    /// The truth of a frame.
    pub fn truth(&self, index: u32) -> Result<Truth, SuiteError> {
        match self {
            Source::Still { render: Some(render), .. } => {
                Ok(strandbench_io::read_truth(&render.join(TRUTH))?)
            }
            Source::Still { frame, render: None } => {
                Err(SuiteError::file(frame, "is a frame folder: there is no truth beside it"))
            }
            Source::Moving(sequence) => sequence.truth(index),
        }
    }

    /// Name of the scene, where it is known.
    pub fn scene(&self) -> Option<String> {
        match self {
            Source::Still { render, .. } => Some(read_render_file(render.as_ref()?).ok()?.scene),
            Source::Moving(sequence) => Some(sequence.file.scene.clone()),
        }
    }

    /// Breadth of the head, mm, where it is known.
    pub fn head_breadth_mm(&self) -> Option<f32> {
        let folder = match self {
            Source::Still { render, .. } => render.clone()?,
            Source::Moving(sequence) => sequence.frame_dir(*sequence.file.frames.first()?),
        };
        Some(read_render_file(&folder).ok()?.head_breadth_mm)
    }
}

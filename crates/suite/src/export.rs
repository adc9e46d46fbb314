//! Strands and envelopes of a finished folder in formats that other programs open.

use crate::SuiteError;
use crate::reconstruct::ESTIMATE;
use crate::render::TRUTH;
use crate::sequence::{Sequence, frame_name};
use crate::stage::Progress;
use serde::Serialize;
use std::path::{Path, PathBuf};
use strandbench_io::usd::{self, At, Content};
use strandbench_io::{ESTIMATE_STRAND_IDS as STRAND_IDS, ESTIMATE_STRANDS as STRANDS};
use strandbench_types::{StrandSet, TriMesh};

/// Endings that strands are exported with.
pub const STRAND_ENDINGS: [&str; 5] = ["usda", "hair", "ply", "data", "obj"];
/// Endings that meshes are exported with.
pub const MESH_ENDINGS: [&str; 3] = ["usda", "ply", "obj"];

/// Frames a second of answers whose renders do not lie beside them: what players of USD assume where a file is silent.
const UNKNOWN_RATE_HZ: f64 = 24.0;

/// What to export, and how.
#[derive(Clone, Debug)]
pub struct Export<'a> {
    /// A variant's folder or an estimate's; with `truth`, a render folder.
    pub folder: &'a Path,
    /// The true strands and the head instead of an answer.
    pub truth: bool,
    /// One of [`STRAND_ENDINGS`].
    pub strands: &'a str,
    /// One of [`MESH_ENDINGS`].
    pub mesh: &'a str,
}

/// What was written.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Exported {
    /// The folder.
    pub folder: PathBuf,
    /// Frames; 1 for a single answer.
    pub frames: usize,
    /// Strands of all frames.
    pub strands: usize,
    /// Meshes.
    pub meshes: usize,
    /// Frames that hold nothing, as the method has no answer to them.
    pub absent: Vec<u32>,
    /// What to open: the files of a single answer, or a sequence's index where the format has one.
    pub open: Vec<PathBuf>,
}

/// What one frame holds.
#[derive(Default)]
struct Found {
    strands: Option<StrandSet>,
    ids: Option<Vec<u64>>,
    mesh: Option<TriMesh>,
}

/// Writes strands and envelopes (or the true strands and the head) into a new folder `out`, which appears whole or not at
/// all: `strands.ENDING` and `envelope.ENDING` (`head.ENDING`) of a single answer; of a sequence a file a frame,
/// `strands/strands.000012.ENDING`, and for `.usda` an index of all frames beside that plays as one animation. Units are
/// millimetres, +y up.
///
/// # Errors
/// If `folder` is neither, an ending is unknown, `out` is there already, a file cannot be read or written, there is nothing
/// to export, or the work is cancelled.
pub fn export(what: &Export<'_>, out: &Path, progress: &dyn Progress) -> Result<Exported, SuiteError> {
    for (ending, known) in [(what.strands, &STRAND_ENDINGS[..]), (what.mesh, &MESH_ENDINGS[..])] {
        if !known.contains(&ending) {
            let problem = format!("{ending:?} is no format to write here; known are {}", known.join(", "));
            return Err(SuiteError::file(out, problem));
        }
    }
    if out.exists() {
        return Err(SuiteError::file(out, "is there already; choose another folder"));
    }
    let source = Source::find(what)?;
    let mesh_name = if what.truth { "head" } else { "envelope" };
    let mut done = Exported { folder: out.to_owned(), frames: source.frames().len(), ..Exported::default() };
    strandbench_io::atomic_folder(out, |dir| -> Result<(), SuiteError> {
        progress.begin("frames exported", source.frames().len() as u64);
        let mut written = [Vec::new(), Vec::new()];
        let all_named = source.all_named();
        for &frame in source.frames() {
            progress.check()?;
            let found = source.read(frame)?;
            if let (Some(index), None, None) = (frame, &found.strands, &found.mesh) {
                done.absent.push(index);
            }
            done.strands += found.strands.as_ref().map_or(0, StrandSet::len);
            done.meshes += usize::from(found.mesh.is_some());
            if let Some(strands) = &found.strands {
                let path = place(dir, "strands", what.strands, frame)?;
                written[0].extend(frame);
                match (what.strands, source.at(frame)) {
                    ("usda", at) => {
                        usd::write_strands(&path, strands, found.ids.as_deref().filter(|_| all_named), at)?
                    }
                    _ => strandbench_io::write_strands(&path, strands)?,
                }
            }
            if let Some(mesh) = &found.mesh {
                let path = place(dir, mesh_name, what.mesh, frame)?;
                written[1].extend(frame);
                match (what.mesh, source.at(frame)) {
                    ("usda", at) => usd::write_mesh(&path, mesh, at)?,
                    _ => strandbench_io::write_mesh(&path, mesh)?,
                }
            }
            progress.advance(1);
        }
        if done.strands == 0 && done.meshes == 0 {
            return Err(SuiteError::file(
                what.folder,
                "holds neither strands nor an envelope; nothing to export",
            ));
        }
        let kinds = [
            ("strands", what.strands, Content::Strands { ids: all_named }),
            (mesh_name, what.mesh, Content::Mesh),
        ];
        for ((name, ending, content), written) in kinds.into_iter().zip(&written) {
            done.open.extend(source.index(dir, name, ending, content, written)?.map(|file| out.join(file)));
        }
        Ok(())
    })?;
    Ok(done)
}

/// The file of one frame, or of a single answer; its folder is made.
fn place(dir: &Path, name: &str, ending: &str, frame: Option<u32>) -> Result<PathBuf, SuiteError> {
    let whole = dir.join(format!("{name}.{ending}"));
    let Some(frame) = frame else { return Ok(whole) };
    let sub = dir.join(name);
    std::fs::create_dir_all(&sub).map_err(|e| SuiteError::file(&sub, e))?;
    if ending == "usda" {
        return Ok(usd::frame_path(&whole, frame));
    }
    Ok(sub.join(format!("{name}.{}.{ending}", frame_name(frame))))
}

/// Where answers or truths are read from.
enum Source {
    /// One estimate folder.
    Estimate(PathBuf),
    /// One truth folder.
    Truth(PathBuf),
    /// Answers of a sequence: a folder a frame, and frames a second, [`UNKNOWN_RATE_HZ`] without the renders.
    Answers(PathBuf, Vec<Option<u32>>, f64),
    /// The truth of a sequence.
    Truths(Box<Sequence>, Vec<Option<u32>>),
}

impl Source {
    fn find(what: &Export<'_>) -> Result<Source, SuiteError> {
        let folder = what.folder;
        let some = |frames: &[u32]| frames.iter().copied().map(Some).collect();
        if what.truth {
            if Sequence::is(folder) {
                let sequence = Sequence::open(folder)?;
                let frames = some(&sequence.file.frames);
                return Ok(Source::Truths(Box::new(sequence), frames));
            }
            let inner = folder.join(TRUTH);
            let dir = if inner.is_dir() { inner } else { folder.to_owned() };
            return Ok(Source::Truth(dir));
        }
        for dir in [folder.join("reconstruct").join(ESTIMATE), folder.join(ESTIMATE)] {
            if dir.is_dir() {
                return Ok(Source::Estimate(dir));
            }
        }
        // A sequence's answers: a folder of six digits for each frame.
        let inner = folder.join("reconstruct");
        let answers = if inner.is_dir() { inner } else { folder.to_owned() };
        let entries = std::fs::read_dir(&answers).map_err(|e| {
            SuiteError::file(
                &answers,
                format!("{e}; give a variant's folder, as `strandbench reconstruct` makes one"),
            )
        })?;
        let mut frames: Vec<u32> = entries
            .flatten()
            .filter(|e| e.path().is_dir())
            .filter_map(|e| e.file_name().to_str().filter(|n| n.len() == 6)?.parse().ok())
            .collect();
        frames.sort_unstable();
        if frames.is_empty() {
            return Ok(Source::Estimate(folder.to_owned()));
        }
        let render = answers.parent().and_then(Path::parent).map(|p| p.join("render"));
        let rate = render
            .filter(|r| Sequence::is(r))
            .map_or(Ok(UNKNOWN_RATE_HZ), |r| Sequence::open(&r).map(|s| s.file.frame_rate_hz))?;
        Ok(Source::Answers(answers, some(&frames), rate))
    }

    fn frames(&self) -> &[Option<u32>] {
        match self {
            Source::Estimate(_) | Source::Truth(_) => &[None],
            Source::Answers(_, frames, _) | Source::Truths(_, frames) => frames,
        }
    }

    fn rate_hz(&self) -> f64 {
        match self {
            Source::Answers(_, _, rate) => *rate,
            Source::Truths(sequence, _) => sequence.file.frame_rate_hz,
            Source::Estimate(_) | Source::Truth(_) => 0.0,
        }
    }

    fn at(&self, frame: Option<u32>) -> Option<At> {
        frame.map(|frame| At { frame, rate_hz: self.rate_hz() })
    }

    /// The estimate folder of a frame; nothing where the truth is read.
    fn answer(&self, frame: Option<u32>) -> Option<PathBuf> {
        match (self, frame) {
            (Source::Answers(dir, ..), Some(index)) => Some(dir.join(frame_name(index)).join(ESTIMATE)),
            (Source::Estimate(dir), _) => Some(dir.clone()),
            _ => None,
        }
    }

    /// Whether every frame that has strands names them, as an index of a sequence must know beforehand.
    fn all_named(&self) -> bool {
        self.frames().iter().all(|&frame| {
            self.answer(frame).is_some_and(|dir| !dir.join(STRANDS).exists() || dir.join(STRAND_IDS).exists())
        })
    }

    fn read(&self, frame: Option<u32>) -> Result<Found, SuiteError> {
        match self {
            Source::Estimate(_) | Source::Answers(..) => {
                let Some(dir) = self.answer(frame).filter(|dir| frame.is_none() || dir.is_dir()) else {
                    return Ok(Found::default());
                };
                let e = strandbench_io::read_estimate(&dir)?;
                Ok(Found { strands: e.strands, ids: e.strand_ids, mesh: e.envelope })
            }
            Source::Truth(dir) => {
                let truth = strandbench_io::read_truth(dir)?;
                Ok(Found { strands: Some(truth.strands), ids: None, mesh: truth.head })
            }
            Source::Truths(sequence, _) => {
                let scene = sequence.scene(frame.unwrap_or_default())?.scene;
                let mesh = scene.surfaces.into_iter().next().map(|s| s.mesh);
                Ok(Found { strands: Some(scene.strands), ids: None, mesh })
            }
        }
    }

    /// Writes the index of a sequence where the format has one, and gives what to open.
    fn index(
        &self,
        dir: &Path,
        name: &str,
        ending: &str,
        content: Content,
        written: &[u32],
    ) -> Result<Option<String>, SuiteError> {
        let file = format!("{name}.{ending}");
        let (Some(&first), Some(&last)) = (written.first(), written.last()) else {
            return Ok(dir.join(&file).exists().then_some(file));
        };
        if ending != "usda" {
            return Ok(Some(name.to_owned()));
        }
        let index = dir.join(&file);
        for frame in (first..=last).filter(|f| !written.contains(f)) {
            // Frames without an answer show nothing.
            let (path, at) = (usd::frame_path(&index, frame), self.at(Some(frame)));
            match content {
                Content::Strands { ids } => {
                    usd::write_strands(&path, &StrandSet::new(), Some(&[][..]).filter(|_| ids), at)?;
                }
                Content::Mesh => usd::write_mesh(&path, &TriMesh::default(), at)?,
            }
        }
        usd::write_index(&index, content, first, last, self.rate_hz())?;
        Ok(Some(file))
    }
}

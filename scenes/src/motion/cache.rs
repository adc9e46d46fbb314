//! A motion on disk: the turns of the guides' segments, frame after frame, eight bytes a segment.
//!
//! Little-endian: `SBMOTION`, version (u32), frames (u32), guides (u32), segments of all guides (u32), fingerprint
//! of what the motion was computed from (u64); then for each frame one code a segment (u64) and a check sum (u64).

use super::model::{Model, fnv};
use super::{MotionError, MotionFrame, Simulation, WIND};
use crate::SceneSpec;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use strandbench_io::atomic_write;
use strandbench_rng::Rng;
use strandbench_types::Monitor;

const MAGIC: [u8; 8] = *b"SBMOTION";
const VERSION: u32 = 1;
const HEADER: u64 = 32;

/// A motion that was computed before; any frame of it can be had.
pub struct MotionCache {
    model: Model,
    path: PathBuf,
    file: Mutex<File>,
    segments: usize,
}

fn sum(frame: u32, codes: &[u64]) -> u64 {
    fnv(std::iter::once(u64::from(frame)).chain(codes.iter().copied()))
}

impl MotionCache {
    /// Computes what is left of a motion that has given no frame yet and keeps it in a file, which appears whole
    /// or not at all.
    ///
    /// # Errors
    /// [`MotionError::Write`] where the file cannot be written, [`MotionError::Cancelled`].
    ///
    /// # Panics
    /// If the simulation has given frames already.
    pub fn write(path: &Path, mut simulation: Simulation, monitor: &dyn Monitor) -> Result<(), MotionError> {
        assert_eq!(simulation.next, 0, "a motion is kept from its first frame on");
        monitor.begin("motion", u64::from(simulation.frames()));
        let mut stopped = None;
        let written = atomic_write(path, |out| {
            out.write_all(&MAGIC)?;
            let (guides, segments) = (simulation.moving.len(), simulation.model.segments());
            for v in [VERSION, simulation.frames(), guides as u32, segments as u32] {
                out.write_all(&v.to_le_bytes())?;
            }
            out.write_all(&simulation.model.fingerprint(simulation.wind_seed).to_le_bytes())?;
            loop {
                match simulation.next_turns(monitor) {
                    Ok(None) => return Ok(()),
                    Ok(Some((frame, codes))) => {
                        for c in &codes {
                            out.write_all(&c.to_le_bytes())?;
                        }
                        out.write_all(&sum(frame, &codes).to_le_bytes())?;
                        monitor.advance(1);
                    }
                    Err(e) => {
                        stopped = Some(e);
                        return Err(io::Error::other("stopped"));
                    }
                }
            }
        });
        match stopped {
            Some(e) => Err(e),
            None => Ok(written?),
        }
    }

    /// Opens a file that was written for this scene and seed; the scene is groomed again.
    ///
    /// # Errors
    /// [`MotionError::Cache`] for a file that cannot be read, is not whole, or belongs to another scene, seed or
    /// version of the program: write it again. Otherwise as [`Simulation::new`].
    pub fn open(
        path: &Path,
        spec: &SceneSpec,
        seed: u64,
        base_dir: Option<&Path>,
    ) -> Result<MotionCache, MotionError> {
        let bad = |problem: String| MotionError::Cache { path: path.to_owned(), problem };
        let os = |e: io::Error| bad(format!("cannot be read: {e}"));
        let mut file = File::open(path).map_err(os)?;
        let size = file.metadata().map_err(os)?.len();
        if size < HEADER {
            return Err(bad(format!("has {size} bytes; a motion has {HEADER} before its first frame")));
        }
        let mut header = [0u8; HEADER as usize];
        file.read_exact(&mut header).map_err(os)?;
        if header[..8] != MAGIC {
            return Err(bad("is not a motion".into()));
        }
        let word = |at: usize| u32::from_le_bytes(header[at..at + 4].try_into().expect("four bytes"));
        let [version, frames, guides, segments] = [8, 12, 16, 20].map(word);
        if version != VERSION {
            return Err(bad(format!("has version {version}, not {VERSION}; compute it again")));
        }
        // In 128 bits nothing overflows; the header is believed only if the file is as long as it says.
        let wanted = u128::from(HEADER) + u128::from(frames) * (u128::from(segments) + 1) * 8;
        if u128::from(size) != wanted {
            return Err(bad(format!(
                "has {size} bytes where {frames} frames of {segments} segments take {wanted}; compute it again"
            )));
        }
        let model = Model::new(spec, seed, base_dir)?;
        let wind_seed = Rng::keyed(&[seed, spec.seed, WIND]).next_u64();
        let fingerprint = u64::from_le_bytes(header[24..32].try_into().expect("eight bytes"));
        let same = frames == model.motion.frames
            && guides as usize == model.guides.len()
            && segments as usize == model.segments()
            && fingerprint == model.fingerprint(wind_seed);
        if !same {
            return Err(bad(format!(
                "belongs to another motion than scene {} with seed {seed}; compute it again",
                spec.name
            )));
        }
        Ok(MotionCache { segments: segments as usize, model, path: path.to_owned(), file: Mutex::new(file) })
    }

    /// Number of frames.
    pub fn frames(&self) -> u32 {
        self.model.motion.frames
    }

    /// A frame, with the bits that the simulation gave it.
    ///
    /// # Errors
    /// [`MotionError::NoFrame`] beyond the last, [`MotionError::Cache`] where the file has been damaged.
    pub fn frame(&self, index: u32) -> Result<MotionFrame, MotionError> {
        if index >= self.frames() {
            let scene = self.model.scene.name.clone();
            return Err(MotionError::NoFrame { scene, frame: index, last: self.frames() - 1 });
        }
        let bad = |problem: String| MotionError::Cache { path: self.path.clone(), problem };
        let mut bytes = vec![0u8; (self.segments + 1) * 8];
        {
            let mut file = self.file.lock().expect("no reader panics");
            file.seek(SeekFrom::Start(HEADER + u64::from(index) * bytes.len() as u64))
                .and_then(|_| file.read_exact(&mut bytes))
                .map_err(|e| bad(format!("frame {index} cannot be read: {e}")))?;
        }
        let mut codes: Vec<u64> =
            bytes.chunks_exact(8).map(|b| u64::from_le_bytes(b.try_into().expect("eight bytes"))).collect();
        let kept = codes.pop().expect("the check sum");
        if kept != sum(index, &codes) {
            return Err(bad(format!("frame {index} is damaged: its check sum is wrong; compute it again")));
        }
        self.model
            .frame(index, &codes)
            .map_err(|k| bad(format!("frame {index}, segment {k} is no rotation; compute it again")))
    }
}

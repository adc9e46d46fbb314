//! What is benchmarked, and how.

use crate::error::BenchError;
use std::path::PathBuf;

/// Which benchmarks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum What {
    /// Building the acceleration structure, and this process's peak of memory.
    Build,
    /// Rays against fibres and triangles, with the time of building.
    Rays,
    /// Whole images at equal noise.
    Frames,
    /// Rays, then frames.
    All,
}

impl What {
    /// Names and values, for the command line.
    pub const NAMES: [(&str, What); 4] =
        [("build", What::Build), ("rays", What::Rays), ("frames", What::Frames), ("all", What::All)];
}

/// Options of a run.
#[derive(Clone, Debug)]
pub struct Options {
    /// Which benchmarks.
    pub what: What,
    /// Strands.
    pub strands: usize,
    /// Segments of each strand.
    pub segments: usize,
    /// Camera rays of a round; as many shadow and bounce rays as camera rays meet hair.
    pub rays: usize,
    /// Rounds of rays that are timed, and seeds of frames.
    pub rounds: usize,
    /// Threads of the runs with more than one.
    pub threads: usize,
    /// Python with mitsuba and embreex; without one `STRANDBENCH_PYTHON`, else `python3`.
    pub python: Option<PathBuf>,
    /// Embree 4; without one the library that the Python package embreex brings, else the system's.
    pub embree: Option<PathBuf>,
}

impl Options {
    /// Refuses what cannot be run.
    pub(crate) fn check(&self) -> Result<(), BenchError> {
        let fail = |what: String| Err(BenchError::Options(what));
        if self.strands == 0 || self.segments == 0 {
            return fail(format!(
                "{} strands of {} segments are no hair; both must be at least 1",
                self.strands, self.segments
            ));
        }
        // Twice what a renderer takes, so that a slip of the finger does not fill the memory.
        if self.strands.saturating_mul(self.segments + 1) > 1 << 28 {
            return fail(format!(
                "{} strands of {} segments are more than 2^28 points; take fewer",
                self.strands, self.segments
            ));
        }
        if self.rounds == 0 || self.rays == 0 || self.threads == 0 {
            return fail(format!(
                "{} rounds of {} rays on {} threads: each must be at least 1",
                self.rounds, self.rays, self.threads
            ));
        }
        if self.rays > 50_000_000 || self.rounds > 10_000 {
            return fail(format!(
                "{} rounds of {} rays: at most 10,000 rounds and 50 million rays",
                self.rounds, self.rays
            ));
        }
        Ok(())
    }

    /// The Python that is asked.
    pub(crate) fn interpreter(&self) -> PathBuf {
        let named = || std::env::var_os("STRANDBENCH_PYTHON").map(PathBuf::from);
        self.python.clone().or_else(named).unwrap_or_else(|| "python3".into())
    }

    /// Where Embree may lie, likeliest first.
    pub(crate) fn embree_places(&self) -> Vec<PathBuf> {
        if let Some(path) = &self.embree {
            return vec![path.clone()];
        }
        let mut places = Vec::new();
        let find = "import embreex, glob, os; d = os.path.dirname(os.path.dirname(embreex.__file__)); \
                    print(*sorted(glob.glob(os.path.join(d, 'embreex.libs', 'libembree4*'))), sep='\\n')";
        if let Ok(out) = std::process::Command::new(self.interpreter()).args(["-c", find]).output() {
            let text = String::from_utf8_lossy(&out.stdout).into_owned();
            places.extend(text.lines().map(PathBuf::from));
        }
        places.extend(["libembree4.so.4", "libembree4.so", "libembree4.dylib"].map(PathBuf::from));
        places
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_run_is_refused() {
        let good = Options {
            what: What::Rays,
            strands: 10,
            segments: 5,
            rays: 100,
            rounds: 1,
            threads: 1,
            python: None,
            embree: None,
        };
        good.check().unwrap();
        for bad in [
            Options { strands: 0, ..good.clone() },
            Options { segments: 0, ..good.clone() },
            Options { rounds: 0, ..good.clone() },
            Options { rays: 0, ..good.clone() },
            Options { threads: 0, ..good.clone() },
            Options { strands: usize::MAX, ..good.clone() },
            Options { rays: usize::MAX, ..good.clone() },
        ] {
            assert!(bad.check().is_err(), "{bad:?}");
        }
    }
}

//! Speed of the renderer beside other ray tracers, on the same hair and the same rays in one run.
//!
//! Others are used where they are installed: Embree 4 is loaded at run time, Mitsuba and embreex run in a Python
//! process. What is missing is left out and said, with the remedy.

pub mod contest;
pub mod curves;
pub mod embree;
mod error;
pub mod frames;
pub mod hair;
pub mod memory;
mod options;
pub mod python;
pub mod rays;
mod report;
mod traversal;

pub use error::BenchError;
pub use options::{Options, What};
pub use report::{Build, Report, Work};
pub use traversal::REFERENCE;

use strandbench_types::Monitor;

/// Runs what the options name. `say` gets lines about what is done while the work goes on: frames take minutes.
///
/// # Errors
/// If the options cannot be followed, a tracer fails in the middle, or the work is stopped.
pub fn run(
    options: &Options,
    monitor: &dyn Monitor,
    say: &(dyn Fn(&str) + Sync),
) -> Result<Report, BenchError> {
    options.check()?;
    let mut report = Report::of_this_machine();
    let folder = tempfile::tempdir().map_err(BenchError::file(&std::env::temp_dir()))?;
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(options.threads)
        .build()
        .map_err(|e| BenchError::Threads { threads: options.threads, reason: e.to_string() })?;
    pool.install(|| match options.what {
        What::Build => traversal::build(options, &mut report),
        What::Rays => traversal::rays(options, folder.path(), &mut report, monitor),
        What::Frames => frames::frames(options, folder.path(), &mut report, monitor, say),
        What::All => traversal::rays(options, folder.path(), &mut report, monitor)
            .and_then(|()| frames::frames(options, folder.path(), &mut report, monitor, say)),
    })?;
    Ok(report)
}

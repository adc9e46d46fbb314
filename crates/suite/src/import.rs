//! Hair files from outside, converted, counted and drawn.

use crate::stage::Progress;
use crate::{SuiteError, pictures};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use strandbench_io::{ImportOptions, ImportReport};
use strandbench_renderer::{RenderError, RenderScene, Settings};
use strandbench_scenes::SceneSpec;
use strandbench_types::StrandSet;

/// What an import found and did.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Imported {
    /// Counts of the reader.
    pub report: ImportReport,
    /// Strands kept.
    pub strands: usize,
    /// Shortest, median and longest strand, mm.
    pub length_mm: [f64; 3],
    /// Longest segment after resampling, mm.
    pub longest_segment_mm: f32,
    /// Smallest and largest fibre radius, mm.
    pub radius_mm: [f32; 2],
    /// The file written.
    pub out: PathBuf,
    /// A picture from the default rig's reference camera.
    pub picture: PathBuf,
}

/// Reads `file`, writes it resampled and in millimetres to `out` (format by ending) and a picture beside it.
///
/// # Errors
/// If the file is refused, cannot be drawn or written, or the work is cancelled.
pub fn import(
    file: &Path,
    out: &Path,
    options: &ImportOptions,
    head: Option<&Path>,
    progress: &dyn Progress,
) -> Result<Imported, SuiteError> {
    let (strands, report) = strandbench_io::read_strands(file, options)?;
    progress.check()?;
    let spec = SceneSpec::from_hair_file(file, options.clone(), head.map(Path::to_owned));
    let scene = strandbench_scenes::build(&spec, 1, None)?;
    let failed = |e: RenderError| match e {
        RenderError::Cancelled(_) => SuiteError::Cancelled,
        other => SuiteError::Render { scene: spec.name.clone(), problem: other.to_string() },
    };
    let settings = Settings { samples_per_pixel: 16, max_samples_per_pixel: 16, ..Settings::default() };
    let render =
        RenderScene::new(&scene).and_then(|s| s.render(0, &settings, 1, progress)).map_err(failed)?;
    let picture = out.with_extension("png");
    progress.check()?;
    strandbench_io::write_strands(out, &strands)?;
    let colours = pictures::radiance(&render.radiance_rgb);
    strandbench_io::write_png_rgb(&picture, &colours)?;
    let (length_mm, longest_segment_mm, radius_mm) = statistics(&strands);
    let (out, strands) = (out.to_owned(), strands.len());
    Ok(Imported { report, strands, length_mm, longest_segment_mm, radius_mm, out, picture })
}

fn statistics(strands: &StrandSet) -> ([f64; 3], f32, [f32; 2]) {
    let mut lengths: Vec<f64> = (0..strands.len()).map(|i| strands.length_mm(i)).collect();
    lengths.sort_by(f64::total_cmp);
    let at = |i: usize| lengths.get(i).copied().unwrap_or(0.0);
    let segments = strands.iter().flat_map(|s| s.windows(2).map(|w| w[0].distance(w[1])));
    let radii = strands.radii_mm.iter().copied();
    let (low, high) = radii.fold((f32::INFINITY, 0.0f32), |(lo, hi), r| (lo.min(r), hi.max(r)));
    let last = lengths.len().saturating_sub(1);
    ([at(0), at(last / 2), at(last)], segments.fold(0.0, f32::max), [low, high])
}

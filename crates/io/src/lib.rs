//! Files in and out: hair formats, meshes, images, and the folders that pass between stages.

use std::path::{Path, PathBuf};
use strandbench_types::{Estimate, Frame, Plane, Rig, StrandSet, TriMesh, Truth};

/// What is wrong with a file, where, and what to do.
#[derive(Debug, thiserror::Error)]
#[error("{}: {problem}", path.display())]
pub struct IoError {
    /// The file or folder.
    pub path: PathBuf,
    /// Place, fault and remedy.
    pub problem: String,
}

/// How strands of a unitless file become millimetres in the world (+y up, face towards +z).
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ImportOptions {
    /// Millimetres per file unit.
    pub scale_mm: f64,
    /// Which axis of the file points up: `x`, `-x`, `y`, `-y`, `z`, `-z`.
    pub up: String,
    /// Which axis of the file the face looks along.
    pub forward: String,
    /// Fibre radius in mm for files that state none, or to replace the file's own.
    pub radius_mm: Option<f32>,
    /// Longest segment after smooth resampling, mm.
    pub max_segment_mm: f32,
}

impl Default for ImportOptions {
    fn default() -> ImportOptions {
        ImportOptions {
            scale_mm: 1.0,
            up: "y".into(),
            forward: "z".into(),
            radius_mm: Some(0.04),
            max_segment_mm: 5.0,
        }
    }
}

/// Counts of what an import dropped or changed; printed to the user.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ImportReport {
    /// Strands in the file.
    pub strands_in_file: usize,
    /// Points in the file.
    pub points_in_file: usize,
    /// Strands dropped because their length is zero.
    pub zero_length_strands: usize,
    /// Repeated points dropped.
    pub repeated_points: usize,
    /// Points after resampling.
    pub points_resampled: usize,
    /// Lowest and highest corner after scaling, mm.
    pub bounds_mm: [[f32; 3]; 2],
}

type Result<T> = std::result::Result<T, IoError>;

fn missing<T>(path: &Path) -> Result<T> {
    Err(IoError { path: path.to_owned(), problem: "not built yet".into() })
}

/// Reads `.hair`, `.data`, `.ply` or `.tfx` strands (by content and ending), in mm, smoothly resampled.
///
/// # Errors
/// Names the file, the place and the remedy for anything truncated, inconsistent or not finite.
pub fn read_strands(path: &Path, _options: &ImportOptions) -> Result<(StrandSet, ImportReport)> {
    missing(path)
}

/// Writes strands by the path's ending: `.hair`, `.data`, `.ply`, `.obj`.
///
/// # Errors
/// If the file cannot be written or the ending is unknown.
pub fn write_strands(path: &Path, _strands: &StrandSet) -> Result<()> {
    missing(path)
}

/// Reads a triangle mesh from `.ply` or `.obj` (polygons are fanned), untransformed.
///
/// # Errors
/// Names the file, the place and the remedy.
pub fn read_mesh(path: &Path) -> Result<TriMesh> {
    missing(path)
}

/// The transform that [`read_strands`] applies, for a mesh in the same file units.
///
/// # Errors
/// If an axis is unknown or the two are parallel; the error names the option.
pub fn transform_mesh(_mesh: &TriMesh, _options: &ImportOptions) -> std::result::Result<TriMesh, String> {
    Err("not built yet".into())
}

/// Writes a mesh as `.ply` (binary) or `.obj` by ending.
///
/// # Errors
/// If the file cannot be written.
pub fn write_mesh(path: &Path, _mesh: &TriMesh) -> Result<()> {
    missing(path)
}

/// Writes named float channels of one size as a linear OpenEXR file (zip compression), atomically.
///
/// # Errors
/// If sizes differ or the file cannot be written.
pub fn write_exr(path: &Path, _channels: &[(&str, &Plane<f32>)]) -> Result<()> {
    missing(path)
}

/// Reads every channel of an OpenEXR file, by name.
///
/// # Errors
/// If the file is truncated, not OpenEXR, or larger than 16,384 pixels a side.
pub fn read_exr(path: &Path) -> Result<Vec<(String, Plane<f32>)>> {
    missing(path)
}

/// Writes an 8-bit RGB PNG.
///
/// # Errors
/// If the file cannot be written.
pub fn write_png_rgb(path: &Path, _image: &Plane<[u8; 3]>) -> Result<()> {
    missing(path)
}

/// Writes an 8-bit grey PNG.
///
/// # Errors
/// If the file cannot be written.
pub fn write_png_grey(path: &Path, _image: &Plane<u8>) -> Result<()> {
    missing(path)
}

/// Reads an 8- or 16-bit grey PNG as 0..1 values, linear in the stored numbers.
///
/// # Errors
/// If the file is not such a PNG.
pub fn read_png_grey(path: &Path) -> Result<Plane<f32>> {
    missing(path)
}

/// Writes what a method may see: `rig.json`, `frame.json`, and per camera `<name>.exr` (channel Y, linear),
/// `<name>.png` (16-bit, linear) and `<name>_mask.png`.
///
/// # Errors
/// If a file cannot be written.
pub fn write_frame(dir: &Path, _rig: &Rig, _frame: &Frame) -> Result<()> {
    missing(dir)
}

/// Reads and validates a frame folder.
///
/// # Errors
/// Names the missing or inconsistent file (a size other than the rig's, a missing camera, an empty mask).
pub fn read_frame(dir: &Path) -> Result<(Rig, Frame)> {
    missing(dir)
}

/// Writes an estimate: `depth.exr`, `orientation.exr`, `orientation_3d.exr`, `envelope.ply`, `strands.hair`,
/// each only if present.
///
/// # Errors
/// If a file cannot be written.
pub fn write_estimate(dir: &Path, _estimate: &Estimate) -> Result<()> {
    missing(dir)
}

/// Reads an estimate folder; whatever file is missing is absent from the estimate.
///
/// # Errors
/// If a file that is there cannot be read, or the folder holds none of them.
pub fn read_estimate(dir: &Path) -> Result<Estimate> {
    missing(dir)
}

/// Writes the truth: `truth_rig.json`, per camera `<name>_truth.exr`, `strands.hair` (exact points and radii),
/// `visibility.bin`, `head.ply`.
///
/// # Errors
/// If a file cannot be written.
pub fn write_truth(dir: &Path, _truth: &Truth) -> Result<()> {
    missing(dir)
}

/// Reads a truth folder, bit for bit what was written.
///
/// # Errors
/// Names the missing or inconsistent file.
pub fn read_truth(dir: &Path) -> Result<Truth> {
    missing(dir)
}

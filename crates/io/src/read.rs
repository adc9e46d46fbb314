//! Whole files in, and strands by format.

use crate::atomic::atomic_write;
use crate::error::{FormatError, IoError, Parsed, Result};
use crate::hair::{encode_hair, looks_like_monohair, parse_hair, parse_monohair};
use crate::obj::{encode_obj_strands, parse_obj_strands};
use crate::options::{ImportOptions, ImportReport};
use crate::ply_strands::{encode_ply_strands, parse_ply_strands};
use crate::strands::RawStrands;
use crate::tfx::parse_tfx;
use crate::usc_data::{encode_usc_data, parse_usc_data};
use std::io::Read as _;
use std::path::Path;
use strandbench_types::StrandSet;

/// Largest file read, bytes.
pub const MAX_FILE_BYTES: u64 = 4 << 30;

/// The path's ending in lower case, without the dot.
pub(crate) fn ending(path: &Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default()
}

/// The whole file, of at most [`MAX_FILE_BYTES`].
pub(crate) fn read_all(path: &Path) -> Result<Vec<u8>> {
    let os = |e| IoError::os(path, "read", &e);
    let file = std::fs::File::open(path).map_err(os)?;
    let length = file.metadata().map_err(os)?.len();
    let too_large = || IoError::new(path, format!("larger than {} GiB; split it", MAX_FILE_BYTES >> 30));
    if length > MAX_FILE_BYTES {
        return Err(too_large());
    }
    let mut bytes = Vec::with_capacity(length as usize);
    // A pipe or device states no length, so the reading is bounded as well.
    file.take(MAX_FILE_BYTES + 1).read_to_end(&mut bytes).map_err(os)?;
    if bytes.len() as u64 > MAX_FILE_BYTES {
        return Err(too_large());
    }
    if bytes.is_empty() {
        return Err(IoError::new(path, "the file is empty; export or fetch it again"));
    }
    Ok(bytes)
}

/// Parses strands by content, and by ending where the content has no magic.
///
/// # Errors
/// As the format's own parser, or if the format is not known.
pub fn parse_strands(bytes: &[u8], ending: &str, points_per_strand: Option<u32>) -> Parsed<RawStrands> {
    if bytes.starts_with(b"HAIR") {
        return parse_hair(bytes);
    }
    if bytes.starts_with(b"ply\n") || bytes.starts_with(b"ply\r") {
        return parse_ply_strands(bytes, points_per_strand);
    }
    match ending {
        "hair" if looks_like_monohair(bytes) => parse_monohair(bytes),
        "hair" => parse_hair(bytes),
        "data" => parse_usc_data(bytes),
        "ply" => parse_ply_strands(bytes, points_per_strand),
        "tfx" => parse_tfx(bytes),
        "obj" => parse_obj_strands(bytes),
        other => Err(FormatError::new(
            "ending",
            format!("{other:?} is not a strand format known here, nor is the content"),
            "give .hair, .data, .ply, .tfx or .obj",
        )),
    }
}

/// Reads `.hair`, `.data`, `.ply`, `.tfx` or `.obj` strands (by content and ending), in mm, smoothly resampled.
///
/// # Errors
/// Names the file, the place and the remedy for anything truncated, inconsistent or not finite.
pub fn read_strands(path: &Path, options: &ImportOptions) -> Result<(StrandSet, ImportReport)> {
    let in_file = |e: FormatError| e.in_file(path);
    options.world_from_file().map_err(in_file)?;
    let bytes = read_all(path)?;
    let raw = parse_strands(&bytes, &ending(path), options.points_per_strand).map_err(in_file)?;
    drop(bytes);
    raw.into_world(options).map_err(in_file)
}

/// Writes strands by the path's ending, atomically: `.hair` (points and radii bit for bit), `.ply` (the same,
/// with edges), `.usda` (the same, as [`crate::usd::write_strands`]; not read back), `.data` and `.obj` (points only).
///
/// # Errors
/// If the strands are not valid, the file cannot be written or the ending is unknown.
pub fn write_strands(path: &Path, strands: &StrandSet) -> Result<()> {
    let refuse = |e: String| IoError::new(path, format!("not written: {e}"));
    strands.validate().map_err(|e| refuse(e.to_string()))?;
    if ending(path) == "usda" {
        return crate::usd::write_strands(path, strands, None, None);
    }
    let bytes = match ending(path).as_str() {
        "hair" => encode_hair(strands).map_err(|e| e.in_file(path))?,
        "data" => encode_usc_data(strands),
        "ply" => encode_ply_strands(strands),
        "obj" => encode_obj_strands(strands),
        other => {
            return Err(refuse(format!(
                "{other:?} is not a strand format; use .hair, .ply, .usda, .data or .obj"
            )));
        }
    };
    atomic_write(path, |w| w.write_all(&bytes))
}

/// Strands of a `.hair` file exactly as they are, in mm.
pub(crate) fn read_exact_hair(path: &Path) -> Result<StrandSet> {
    let bytes = read_all(path)?;
    parse_hair(&bytes).and_then(RawStrands::into_exact).map_err(|e| e.in_file(path))
}

#[cfg(test)]
mod tests;

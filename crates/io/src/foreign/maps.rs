//! Depth maps as NumPy arrays, portable float maps and 16-bit PNG.

use super::units::{UNITS, Units};
use crate::error::{FormatError, IoError, Parsed, Result};
use crate::exr::MAX_SIDE_PX;
use crate::npy;
use crate::png::parse_png_grey;
use crate::read::{ending, read_all};
use std::path::Path;
use strandbench_types::{DepthMap, Plane};

const REMEDY: &str = "write the file again";

/// A depth map by its ending, mm.
pub(super) fn read_depth(path: &Path, units: &Units) -> Result<DepthMap> {
    let bytes = read_all(path)?;
    let (plane, mm) = match ending(path).as_str() {
        "npy" => (parse_npy(&bytes), units.mm_per_unit),
        "pfm" => (parse_pfm(&bytes), units.mm_per_unit),
        _ => {
            let Some(mm) = units.depth_png_mm_per_unit else {
                let fault = format!(
                    "the scale is not stated; write the millimetres of one grey level as \
                     {{\"depth_png_mm_per_unit\": 0.1}} into {UNITS} beside it, zero being no answer"
                );
                return Err(IoError::new(path, fault));
            };
            (parse_levels(&bytes), mm)
        }
    };
    let plane = plane.map_err(|e| e.in_file(path))?;
    Ok(DepthMap::from_raw(plane.map(|&z| (f64::from(z) * mm) as f32)))
}

/// Grey levels 0..65535 of a 16-bit PNG.
fn parse_levels(bytes: &[u8]) -> Parsed<Plane<f32>> {
    let plane = parse_png_grey(bytes)?;
    // The header's ninth byte after its length and name is the depth (PNG, 11.2.2).
    if bytes.get(24) != Some(&16) {
        let remedy = "write 16 bits: 256 levels are too few for a depth";
        return Err(FormatError::new("header", "the image has 8 bits", remedy));
    }
    Ok(plane.map(|v| (v * 65_535.0).round()))
}

fn check_side(w: usize, h: usize) -> Parsed<()> {
    if w == 0 || h == 0 || w > MAX_SIDE_PX || h > MAX_SIDE_PX {
        let fault = format!("size {w}x{h} is outside 1..{MAX_SIDE_PX}");
        return Err(FormatError::new("header", fault, REMEDY));
    }
    Ok(())
}

/// Parses a NumPy array of format 1 to 3 of shape (height, width) and floats of 32 or 64 bits, of either byte order and
/// either order of axes in memory.
///
/// # Errors
/// Names the place: wrong magic, a header that is none, another type or shape, truncation.
pub fn parse_npy(bytes: &[u8]) -> Parsed<Plane<f32>> {
    let array = npy::Array::parse(bytes)?;
    let [h, w] = array.shape[..] else {
        return Err(npy::fault(format!("shape {} is not (height, width)", array.shown_shape())));
    };
    check_side(w, h)?;
    Ok(Plane::from_vec(w, h, array.floats()?))
}

/// Parses a grey portable float map (`Pf`): rows from the bottom, little-endian where the third number is negative. The
/// number's size is ignored, as most programs do.
///
/// # Errors
/// Names the place: wrong magic (`PF` is colour), numbers that are none, truncation.
pub fn parse_pfm(bytes: &[u8]) -> Parsed<Plane<f32>> {
    let bad = |fault: &str| FormatError::new("header", fault, "write a grey PFM: Pf, width and height, -1.0");
    if !bytes.starts_with(b"Pf") {
        return Err(bad(if bytes.starts_with(b"PF") {
            "the map has three colours"
        } else {
            "this is no PFM"
        }));
    }
    let (mut at, mut words) = (2, Vec::new());
    while words.len() < 3 {
        while bytes.get(at).is_some_and(u8::is_ascii_whitespace) {
            at += 1;
        }
        let end = at
            + bytes[at..]
                .iter()
                .take(40)
                .position(u8::is_ascii_whitespace)
                .ok_or_else(|| bad("it is truncated"))?;
        words.push(String::from_utf8_lossy(&bytes[at..end]).into_owned());
        at = end;
    }
    let side = |t: &str| t.parse::<usize>().map_err(|_| bad("width or height is no number"));
    let (w, h) = (side(&words[0])?, side(&words[1])?);
    check_side(w, h)?;
    let scale: f64 = words[2].parse().map_err(|_| bad("the scale is no number"))?;
    if !(scale.is_finite() && scale != 0.0) {
        return Err(bad("the scale is zero or not finite"));
    }
    // One white space ends the header.
    let body = &bytes[at + 1..];
    if body.len() != w * h * 4 {
        let fault = format!("{} bytes of values where {w}x{h} of four bytes are due", body.len());
        return Err(FormatError::at_byte(at + 1, fault, REMEDY));
    }
    let number = |b: &[u8]| {
        let b = [b[0], b[1], b[2], b[3]];
        if scale < 0.0 { f32::from_le_bytes(b) } else { f32::from_be_bytes(b) }
    };
    let rows = body.chunks_exact(4 * w).rev();
    Ok(Plane::from_vec(w, h, rows.flat_map(|row| row.chunks_exact(4).map(number)).collect()))
}

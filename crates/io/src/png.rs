//! PNG images, 8 and 16 bits.

use crate::atomic::atomic_write;
use crate::error::{FormatError, IoError, Parsed, Result};
use crate::exr::MAX_SIDE_PX;
use crate::read::read_all;
use image::codecs::png::{PngDecoder, PngEncoder};
use image::{ColorType, ExtendedColorType, ImageDecoder as _, ImageEncoder as _, Limits};
use std::io::Cursor;
use std::path::Path;
use strandbench_types::Plane;

/// Bytes of pixels a byte of file can unfold to (deflate's limit).
const MAX_UNFOLDING: u64 = 1033;

/// Writes an 8-bit RGB PNG, atomically.
///
/// # Errors
/// If the image is empty or the file cannot be written.
pub fn write_png_rgb(path: &Path, image: &Plane<[u8; 3]>) -> Result<()> {
    encode(path, image.size(), image.data.as_flattened(), ExtendedColorType::Rgb8)
}

/// Writes an 8-bit grey PNG, atomically.
///
/// # Errors
/// If the image is empty or the file cannot be written.
pub fn write_png_grey(path: &Path, image: &Plane<u8>) -> Result<()> {
    encode(path, image.size(), &image.data, ExtendedColorType::L8)
}

/// Writes a 16-bit grey PNG, atomically.
///
/// # Errors
/// If the image is empty or the file cannot be written.
pub fn write_png_grey16(path: &Path, image: &Plane<u16>) -> Result<()> {
    // The encoder takes native-endian samples.
    let bytes: Vec<u8> = image.data.iter().flat_map(|v| v.to_ne_bytes()).collect();
    encode(path, image.size(), &bytes, ExtendedColorType::L16)
}

/// Writes a 16-bit RGB PNG, atomically.
///
/// # Errors
/// If the image is empty or the file cannot be written.
pub fn write_png_rgb16(path: &Path, image: &Plane<[u16; 3]>) -> Result<()> {
    let bytes: Vec<u8> = image.data.as_flattened().iter().flat_map(|v| v.to_ne_bytes()).collect();
    encode(path, image.size(), &bytes, ExtendedColorType::Rgb16)
}

fn encode(path: &Path, (w, h): (usize, usize), data: &[u8], colour: ExtendedColorType) -> Result<()> {
    let refuse = |fault: String| IoError::new(path, format!("not written: {fault}"));
    if w == 0 || h == 0 || w > MAX_SIDE_PX || h > MAX_SIDE_PX {
        return Err(refuse(format!("size {w}x{h} is outside 1..{MAX_SIDE_PX}")));
    }
    let mut bytes = Vec::new();
    PngEncoder::new(&mut bytes)
        .write_image(data, w as u32, h as u32, colour)
        .map_err(|e| refuse(format!("the encoder says {e}")))?;
    atomic_write(path, |f| f.write_all(&bytes))
}

/// Reads an 8- or 16-bit grey PNG as 0..1 values, linear in the stored numbers.
///
/// # Errors
/// If the file is not such a PNG, is truncated, or is larger than 16,384 pixels a side.
pub fn read_png_grey(path: &Path) -> Result<Plane<f32>> {
    parse_png_grey(&read_all(path)?).map_err(|e| e.in_file(path))
}

/// Parses a grey PNG; see [`read_png_grey`].
///
/// # Errors
/// As [`read_png_grey`].
pub fn parse_png_grey(bytes: &[u8]) -> Parsed<Plane<f32>> {
    let ((w, h), values) = decode(bytes, [ColorType::L8, ColorType::L16], "grey")?;
    Ok(Plane::from_vec(w, h, values))
}

/// Reads an 8- or 16-bit RGB PNG as 0..1 values, linear in the stored numbers.
///
/// # Errors
/// As [`read_png_grey`].
pub fn read_png_rgb(path: &Path) -> Result<Plane<[f32; 3]>> {
    parse_png_rgb(&read_all(path)?).map_err(|e| e.in_file(path))
}

/// Parses an RGB PNG; see [`read_png_rgb`].
///
/// # Errors
/// As [`read_png_rgb`].
pub fn parse_png_rgb(bytes: &[u8]) -> Parsed<Plane<[f32; 3]>> {
    let ((w, h), values) = decode(bytes, [ColorType::Rgb8, ColorType::Rgb16], "RGB")?;
    Ok(Plane::from_vec(w, h, values.as_chunks().0.to_vec()))
}

/// Size and values of a PNG of one of two colour types, with 8 and with 16 bits.
fn decode(bytes: &[u8], wanted: [ColorType; 2], named: &str) -> Parsed<((usize, usize), Vec<f32>)> {
    let broken = |e: image::ImageError| {
        FormatError::new(
            "content",
            format!("not a readable PNG ({e})"),
            "it is truncated, damaged or another format: write it again",
        )
    };
    let mut limits = Limits::default();
    limits.max_image_width = Some(MAX_SIDE_PX as u32);
    limits.max_image_height = Some(MAX_SIDE_PX as u32);
    let decoder = PngDecoder::with_limits(Cursor::new(bytes), limits).map_err(broken)?;
    let (w, h) = decoder.dimensions();
    let total = decoder.total_bytes();
    if w == 0 || h == 0 || total > bytes.len() as u64 * MAX_UNFOLDING {
        return Err(FormatError::new(
            "header",
            format!("{w}x{h} pixels do not fit into a file of {} bytes", bytes.len()),
            "it is truncated or damaged: write it again",
        ));
    }
    let colour = decoder.color_type();
    if !wanted.contains(&colour) {
        return Err(FormatError::new(
            "header",
            format!("the colour type is {colour:?}, not {named}"),
            format!("convert it to 8- or 16-bit {named} without alpha"),
        ));
    }
    let mut raw = vec![0u8; total as usize];
    decoder.read_image(&mut raw).map_err(broken)?;
    let values = if colour == wanted[1] {
        raw.chunks_exact(2).map(|b| f32::from(u16::from_ne_bytes([b[0], b[1]])) / 65_535.0).collect()
    } else {
        raw.iter().map(|&b| f32::from(b) / 255.0).collect()
    };
    Ok(((w as usize, h as usize), values))
}

#[cfg(test)]
mod tests;

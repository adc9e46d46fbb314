//! Rasters turned into pictures for people.

use crate::SuiteError;
use std::io::Write as _;
use std::path::Path;
use strandbench_types::{DepthMap, FlowMap, FlowState, OrientationField, Plane};

/// Colour of pixels that are not part of the question.
pub(crate) const PAPER: [u8; 3] = [244, 243, 240];
/// Colour of pixels that were asked for and not answered.
pub(crate) const ABSENT: [u8; 3] = [214, 0, 170];

/// Quality of JPEG pictures.
const JPEG_QUALITY: u8 = 88;

/// The transfer function of sRGB (IEC 61966-2-1), 0..1 to 0..255; what is outside is clipped.
pub(crate) fn srgb(linear: f32) -> u8 {
    let v = linear.clamp(0.0, 1.0);
    let v = if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
    (v * 255.0).round() as u8
}

/// A colour of given lightness, chroma and hue (degrees) in OKLCH (Ottosson 2020), clipped into sRGB.
fn oklch(lightness: f32, chroma: f32, hue_deg: f32) -> [u8; 3] {
    let (sin, cos) = hue_deg.to_radians().sin_cos();
    let (a, b) = (chroma * cos, chroma * sin);
    let l = (lightness + 0.396_337_78 * a + 0.215_803_76 * b).powi(3);
    let m = (lightness - 0.105_561_346 * a - 0.063_854_17 * b).powi(3);
    let s = (lightness - 0.089_484_18 * a - 1.291_485_5 * b).powi(3);
    [
        srgb(4.076_741_7 * l - 3.307_711_6 * m + 0.230_969_94 * s),
        srgb(-1.268_438 * l + 2.609_757_4 * m - 0.341_319_4 * s),
        srgb(-0.004_196_086_3 * l - 0.703_418_6 * m + 1.707_614_7 * s),
    ]
}

/// Sequential scale, 0..1 from light (near) to dark (far): lightness falls evenly.
pub(crate) fn sequential(t: f32) -> [u8; 3] {
    let t = t.clamp(0.0, 1.0);
    oklch(0.95 - 0.68 * t, 0.05 + 0.36 * t * (1.0 - t) + 0.06 * t, 100.0 + 190.0 * t)
}

/// Diverging scale, -1 (blue) over 0 (almost white) to 1 (red).
pub(crate) fn diverging(t: f32) -> [u8; 3] {
    let t = t.clamp(-1.0, 1.0);
    let a = t.abs();
    oklch(0.97 - 0.52 * a, 0.2 * a.powf(0.8), if t < 0.0 { 255.0 } else { 27.0 })
}

/// Hue for an undirected line's angle (radians in [0, π)), brightness for its strength 0..1.
pub(crate) fn line_colour(angle: f32, strength: f32) -> [u8; 3] {
    let s = strength.clamp(0.0, 1.0);
    oklch(0.15 + 0.65 * s, 0.15 * s, 30.0 + 2.0 * angle.to_degrees())
}

/// What to multiply linear values with so that 99 % of the lit ones stay below four fifths of white: an
/// exposure for people, who see little in an image that is right for a machine.
pub(crate) fn exposure(values: impl Iterator<Item = f32>) -> f32 {
    let mut lit: Vec<f32> = values.filter(|v| v.is_finite() && *v > 1e-4).collect();
    lit.sort_by(f32::total_cmp);
    lit.get(lit.len() * 99 / 100).map_or(1.0, |v| 0.8 / v)
}

/// Linear radiance as a photograph, exposed for people.
pub(crate) fn radiance(rgb: &Plane<[f32; 3]>) -> Plane<[u8; 3]> {
    let gain = exposure(rgb.data.iter().map(|c| (c[0] + c[1] + c[2]) / 3.0));
    rgb.map(|c| c.map(|v| srgb(v * gain)))
}

/// A linear-light monochrome image, brightened `gain` times.
pub(crate) fn monochrome(image: &Plane<f32>, gain: f32) -> Plane<[u8; 3]> {
    image.map(|&v| [srgb(v * gain); 3])
}

/// Depth between two limits on the sequential scale, over the pixels of `wanted`.
pub(crate) fn depth(map: &DepthMap, wanted: &Plane<bool>, (near, far): (f32, f32)) -> Plane<[u8; 3]> {
    let mut picture = wanted.map(|&w| if w { ABSENT } else { PAPER });
    for (i, pixel) in picture.data.iter_mut().enumerate() {
        if let Some(z) = map.get_index(i).filter(|_| wanted.data[i]) {
            *pixel = sequential((z - near) / (far - near).max(1e-6));
        }
    }
    picture
}

/// Signed error on the diverging scale, ±`limit_mm` at its ends.
pub(crate) fn signed_error(error_mm: &Plane<f32>, limit_mm: f32) -> Plane<[u8; 3]> {
    error_mm.map(|&e| match e {
        e if e.is_nan() => PAPER,
        e if e.is_infinite() => ABSENT,
        e => diverging(e / limit_mm),
    })
}

/// Draws a frame, black in white, around a square block.
pub(crate) fn frame_block(picture: &mut Plane<[u8; 3]>, (x, y): (usize, usize), size: usize) {
    let (width, height) = picture.size();
    for (out, colour) in [(1, [0; 3]), (2, [255; 3])] {
        let (x0, y0) = (x.saturating_sub(out), y.saturating_sub(out));
        let (x1, y1) = ((x + size + out).min(width), (y + size + out).min(height));
        for v in y0..y1 {
            for u in x0..x1 {
                if u == x0 || v == y0 || u + 1 == x1 || v + 1 == y1 {
                    *picture.at_mut(u, v) = colour;
                }
            }
        }
    }
}

/// An estimated orientation field over the pixels of `wanted`; full brightness at the strength that 95 % of
/// them stay below.
pub(crate) fn orientation(field: &OrientationField, wanted: &Plane<bool>) -> Plane<[u8; 3]> {
    let lines: Vec<_> = (0..wanted.data.len()).map(|i| field.line(i).filter(|_| wanted.data[i])).collect();
    let mut strengths: Vec<f32> = lines.iter().flatten().map(|l| l.1).collect();
    strengths.sort_by(f32::total_cmp);
    let white = strengths.get(strengths.len() * 95 / 100).copied().unwrap_or(1.0).max(f32::MIN_POSITIVE);
    let mut picture = wanted.map(|&w| if w { [0; 3] } else { PAPER });
    for (pixel, line) in picture.data.iter_mut().zip(lines) {
        if let Some((angle, strength)) = line {
            *pixel = line_colour(angle, strength / white);
        }
    }
    picture
}

/// True orientation: brightness is how far the fibres of a pixel agree.
pub(crate) fn true_orientation(
    angle: &Plane<f32>,
    agreement: &Plane<f32>,
    wanted: &Plane<bool>,
) -> Plane<[u8; 3]> {
    let mut picture = wanted.map(|_| PAPER);
    for (i, pixel) in picture.data.iter_mut().enumerate() {
        if wanted.data[i] && angle.data[i].is_finite() {
            *pixel = line_colour(angle.data[i], agreement.data[i]);
        }
    }
    picture
}

/// The legend of [`line_colour`]: a disc whose colour at a direction is that of a line in this direction.
pub(crate) fn orientation_wheel(size: usize) -> Plane<[u8; 3]> {
    let mut wheel = Plane::filled(size, size, [255; 3]);
    let radius = size as f32 * 0.5;
    for y in 0..size {
        for x in 0..size {
            let (dx, dy) = (x as f32 + 0.5 - radius, y as f32 + 0.5 - radius);
            let r = dx.hypot(dy) / radius;
            if r <= 1.0 {
                let angle = dy.atan2(dx).rem_euclid(std::f32::consts::PI);
                *wheel.at_mut(x, y) = line_colour(angle, r);
            }
        }
    }
    wheel
}

/// A picture as a PNG in a `data:` address, for a page that stands alone.
pub(crate) fn data_uri(picture: &Plane<[u8; 3]>) -> String {
    let mut png = std::io::Cursor::new(Vec::new());
    let bytes: Vec<u8> = picture.data.iter().flatten().copied().collect();
    let (width, height) = (picture.width as u32, picture.height as u32);
    image::RgbImage::from_raw(width, height, bytes)
        .expect("three bytes a pixel")
        .write_to(&mut png, image::ImageFormat::Png)
        .expect("memory takes every PNG");
    format!("data:image/png;base64,{}", base64(png.get_ref()))
}

/// The mean of blocks of `by` x `by` pixels; a rest at the right and lower edge is left out.
pub(crate) fn reduced(image: &Plane<[f32; 3]>, by: usize) -> Plane<[f32; 3]> {
    let (w, h) = (image.width / by, image.height / by);
    let scale = 1.0 / (by * by) as f32;
    let block = |i: usize| {
        let (x0, y0) = (i % w * by, i / w * by);
        let mut sum = [0.0f32; 3];
        for y in y0..y0 + by {
            for c in &image.data[y * image.width + x0..y * image.width + x0 + by] {
                (0..3).for_each(|k| sum[k] += c[k]);
            }
        }
        sum.map(|v| v * scale)
    };
    Plane::from_vec(w, h, (0..w * h).map(block).collect())
}

/// Every `by`-th pixel of every `by`-th row, from the middle of the first block on.
pub(crate) fn picked<T: Clone>(image: &Plane<T>, by: usize) -> Plane<T> {
    let (w, h) = (image.width / by, image.height / by);
    let at = |i: usize| image.data[(i / w * by + by / 2) * image.width + i % w * by + by / 2].clone();
    Plane::from_vec(w, h, (0..w * h).map(at).collect())
}

/// Hue for the flow's direction, chroma for its length; `full_px` and more is full colour. What is hidden or outside in
/// the other frame is darker, what is absent is paper.
pub(crate) fn flow(map: &FlowMap, full_px: f32) -> Plane<[u8; 3]> {
    let mut picture = map.state.map(|_| PAPER);
    for (i, pixel) in picture.data.iter_mut().enumerate() {
        let ([u, v], state) = (map.flow_px.data[i], map.state.data[i]);
        if state != FlowState::Absent {
            let share = (u.hypot(v) / full_px.max(1e-6)).min(1.0);
            let lightness = if state == FlowState::Seen { 0.8 } else { 0.45 };
            *pixel = oklch(lightness, 0.16 * share, v.atan2(u).to_degrees());
        }
    }
    picture
}

/// Writes a picture as JPEG.
pub(crate) fn jpeg(path: &Path, picture: &Plane<[u8; 3]>) -> Result<(), SuiteError> {
    let file = std::fs::File::create(path).map_err(|e| SuiteError::file(path, e))?;
    let mut out = std::io::BufWriter::new(file);
    let bytes: Vec<u8> = picture.data.iter().flatten().copied().collect();
    let (w, h) = (picture.width as u32, picture.height as u32);
    image::codecs::jpeg::JpegEncoder::new_with_quality(&mut out, JPEG_QUALITY)
        .encode(&bytes, w, h, image::ExtendedColorType::Rgb8)
        .map_err(|e| SuiteError::file(path, e))?;
    out.flush().map_err(|e| SuiteError::file(path, e))
}

/// Base64 with padding (RFC 4648, section 4).
pub(crate) fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let group = (0..3).fold(0u32, |g, i| g << 8 | u32::from(*chunk.get(i).unwrap_or(&0)));
        for i in 0..4 {
            let digit = DIGITS[(group >> (18 - 6 * i) & 63) as usize] as char;
            text.push(if i <= chunk.len() { digit } else { '=' });
        }
    }
    text
}

#[cfg(test)]
mod tests;

//! OpenEXR: float channels by name, one part, zip compression.

use crate::atomic::atomic_write;
use crate::error::{FormatError, IoError, Parsed, Result};
use crate::read::read_all;
use exr::prelude::*;
use std::io::Cursor;
use std::path::Path;
use strandbench_types::Plane;

/// Most pixels a side of any image read.
pub const MAX_SIDE_PX: usize = 16_384;

/// Most samples of one image over all channels (4 GiB as f32).
const MAX_SAMPLES: usize = 1 << 30;

/// Samples a byte of file can unfold to: deflate reaches 1032 bytes a byte, and constant data in the other
/// codecs no more than a few times that.
const MAX_UNFOLDING: usize = 1100;

/// Writes named float channels of one size as a linear OpenEXR file (zip compression), atomically. Every bit
/// of every value survives, NaN included; names may hold dots.
///
/// # Errors
/// If there is no channel, a name is empty, too long (255 bytes) or used twice, sizes differ, or the file
/// cannot be written.
pub fn write_exr(path: &Path, channels: &[(&str, &Plane<f32>)]) -> Result<()> {
    write_exr_owned(path, channels.iter().map(|(name, plane)| (*name, (*plane).clone())).collect())
}

/// As [`write_exr`], without a copy of the planes.
pub(crate) fn write_exr_owned(path: &Path, channels: Vec<(&str, Plane<f32>)>) -> Result<()> {
    let refuse = |fault: String| IoError::new(path, format!("not written: {fault}"));
    let size = channels.first().ok_or_else(|| refuse("an image needs a channel".into()))?.1.size();
    if size.0 == 0 || size.1 == 0 || size.0 > MAX_SIDE_PX || size.1 > MAX_SIDE_PX {
        return Err(refuse(format!("size {}x{} is outside 1..{MAX_SIDE_PX}", size.0, size.1)));
    }
    for (i, (name, plane)) in channels.iter().enumerate() {
        if plane.size() != size {
            return Err(refuse(format!(
                "channel {name} is {:?} px but the first is {size:?} px",
                plane.size()
            )));
        }
        if name.is_empty() || name.len() > 255 || channels[..i].iter().any(|c| c.0 == *name) {
            return Err(refuse(format!("channel name {name:?} is empty, too long or used twice")));
        }
    }
    let mut list = exr::prelude::SmallVec::new();
    for (name, plane) in channels {
        let text =
            Text::new_or_none(name).ok_or_else(|| refuse(format!("channel name {name:?} is not Latin-1")))?;
        list.push(AnyChannel::new(text, FlatSamples::F32(plane.data)));
    }
    let encoding = Encoding {
        compression: Compression::ZIP16,
        blocks: Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let layer = Layer::new(size, LayerAttributes::default(), encoding, AnyChannels::sort(list));
    let mut bytes = Cursor::new(Vec::new());
    Image::from_layer(layer)
        .write()
        .non_parallel()
        .to_buffered(&mut bytes)
        .map_err(|e| refuse(format!("the encoder says {e}")))?;
    atomic_write(path, |w| w.write_all(bytes.get_ref()))
}

/// Reads every channel of an OpenEXR file, by name, as f32 (half exactly, u32 rounded).
///
/// # Errors
/// If the file is truncated, not OpenEXR, of several parts, deep, cropped, subsampled, or larger than 16,384
/// pixels a side.
pub fn read_exr(path: &Path) -> Result<Vec<(String, Plane<f32>)>> {
    parse_exr(&read_all(path)?).map_err(|e| e.in_file(path))
}

/// Parses an OpenEXR image; see [`read_exr`].
///
/// # Errors
/// As [`read_exr`].
pub fn parse_exr(bytes: &[u8]) -> Parsed<Vec<(String, Plane<f32>)>> {
    const REMEDY: &str = "save it again as single-part, uncropped scan lines";
    let broken = |e: Error| {
        FormatError::new(
            "content",
            format!("not a readable OpenEXR file ({e})"),
            "it is truncated, damaged or another format: write it again",
        )
    };
    let unsupported = |fault: String| FormatError::new("header", fault, REMEDY);
    let meta = exr::meta::MetaData::read_from_buffered(bytes, false).map_err(broken)?;
    let [header] = meta.headers.as_slice() else {
        return Err(unsupported(format!("{} parts instead of one", meta.headers.len())));
    };
    if header.deep {
        return Err(unsupported("deep data".into()));
    }
    let Vec2(w, h) = header.layer_size;
    let n = header.channels.list.len();
    if w == 0 || h == 0 || w > MAX_SIDE_PX || h > MAX_SIDE_PX {
        return Err(unsupported(format!("size {w}x{h} is outside 1..{MAX_SIDE_PX}")));
    }
    let samples = w * h * n;
    if samples > MAX_SAMPLES || samples > bytes.len().saturating_mul(MAX_UNFOLDING) {
        return Err(unsupported(format!(
            "{w}x{h} pixels of {n} channels are too many for a file of {} bytes",
            bytes.len()
        )));
    }
    let display = header.shared_attributes.display_window;
    if header.own_attributes.layer_position != display.position || header.layer_size != display.size {
        return Err(unsupported("the data window differs from the display window".into()));
    }
    if let Some(c) = header.channels.list.iter().find(|c| c.sampling != Vec2(1, 1)) {
        return Err(unsupported(format!("channel {} is subsampled", c.name)));
    }
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(broken)?;
    image
        .layer_data
        .channel_data
        .list
        .into_iter()
        .map(|c| {
            let data = match c.sample_data {
                FlatSamples::F32(v) => v,
                other => other.values_as_f32().collect(),
            };
            if data.len() != w * h {
                return Err(unsupported(format!("channel {} has {} samples", c.name, data.len())));
            }
            Ok((c.name.to_string(), Plane::from_vec(w, h, data)))
        })
        .collect()
}

/// Takes the named channels, in that order, out of an image.
pub(crate) fn pick<const N: usize>(
    path: &Path,
    mut channels: Vec<(String, Plane<f32>)>,
    names: [&str; N],
) -> Result<[Plane<f32>; N]> {
    for name in names {
        if !channels.iter().any(|c| c.0 == name) {
            let there: Vec<&str> = channels.iter().map(|c| c.0.as_str()).collect();
            return Err(IoError::new(
                path,
                format!("channel {name} is missing (there are {}); write it again", there.join(", ")),
            ));
        }
    }
    Ok(names.map(|name| {
        let i = channels.iter().position(|c| c.0 == name).expect("checked above; names differ");
        channels.swap_remove(i).1
    }))
}

#[cfg(test)]
mod tests;

//! The frame folder: all that a method may see.

use crate::atomic::{atomic_write, check_folder, merge_folder};
use crate::error::{IoError, Result};
use crate::exr::{pick, read_exr, write_exr};
use crate::png::{read_png_grey, write_png_grey, write_png_grey16};
use crate::read::{ending, read_all};
use crate::rig_json::{check_rig, check_version, encode_rig, parse_rig};
use serde::{Deserialize, Serialize};
use std::path::Path;
use strandbench_types::{Frame, Plane, Rig};

const FORMAT: &str = "strandbench-frame";
const VERSION: u32 = 1;
const NOTE: &str = "image: linear light, 1.0 at full scale (channel Y of an .exr, or a grey .png); preview: the same \
     as a 16-bit linear .png, clipped to 0..1; mask: white where there is hair; all in rig.json's order";

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FrameFile {
    format: String,
    version: u32,
    #[serde(default)]
    note: String,
    index: u32,
    cameras: Vec<Files>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Files {
    name: String,
    image: String,
    #[serde(default)]
    preview: Option<String>,
    mask: String,
}

impl FrameFile {
    fn parse(path: &Path, bytes: &[u8]) -> Result<FrameFile> {
        let file: FrameFile = serde_json::from_slice(bytes).map_err(|e| {
            IoError::new(path, format!("not a frame: {e}; correct the file or write it again"))
        })?;
        check_version(path, (&file.format, file.version), (FORMAT, VERSION))?;
        for f in file.cameras.iter().flat_map(Files::all) {
            if f.is_empty() || f.contains(['/', '\\']) || f.starts_with('.') {
                return Err(IoError::new(path, format!("{f:?} is not the name of a file in this folder")));
            }
        }
        Ok(file)
    }
}

impl Files {
    fn all(&self) -> impl Iterator<Item = &str> {
        [self.image.as_str(), self.mask.as_str()].into_iter().chain(self.preview.as_deref())
    }
}

/// Parses `frame.json` and returns the names of its files; `path` is for messages only.
///
/// # Errors
/// Names the file, the line and the remedy.
pub fn parse_frame_json(path: &Path, bytes: &[u8]) -> Result<Vec<String>> {
    let file = FrameFile::parse(path, bytes)?;
    Ok(file.cameras.iter().flat_map(Files::all).map(str::to_owned).collect())
}

/// Writes what a method may see: `rig.json` (K, R and t as rows), `frame.json`, and per camera `<name>.exr`
/// (channel Y, linear), `<name>.png` (16-bit, linear) and `<name>_mask.png`. Other files of an existing folder
/// stay; see [`crate::atomic_folder`] for replacing a whole folder.
///
/// # Errors
/// If frame and rig disagree, a camera's name cannot name a file, or a file cannot be written.
pub fn write_frame(dir: &Path, rig: &Rig, frame: &Frame) -> Result<()> {
    check_rig(dir, rig)?;
    frame.validate(rig).map_err(|e| IoError::new(dir, format!("not written: {e}")))?;
    let file = FrameFile {
        format: FORMAT.into(),
        version: VERSION,
        note: NOTE.into(),
        index: frame.index,
        cameras: rig
            .cameras
            .iter()
            .map(|c| Files {
                name: c.name.clone(),
                image: format!("{}.exr", c.name),
                preview: Some(format!("{}.png", c.name)),
                mask: format!("{}_mask.png", c.name),
            })
            .collect(),
    };
    let manifest = dir.join("frame.json");
    let older =
        std::fs::read(&manifest).ok().and_then(|b| parse_frame_json(&manifest, &b).ok()).unwrap_or_default();
    merge_folder(
        dir,
        |name| older.iter().any(|o| o == name),
        |tmp| {
            for ((f, image), mask) in file.cameras.iter().zip(&frame.images).zip(&frame.masks) {
                write_exr(&tmp.join(&f.image), &[("Y", image)])?;
                if let Some(preview) = &f.preview {
                    write_png_grey16(
                        &tmp.join(preview),
                        &image.map(|v| (v.clamp(0.0, 1.0) * 65_535.0).round() as u16),
                    )?;
                }
                write_png_grey(&tmp.join(&f.mask), &mask.map(|&m| if m { 255 } else { 0 }))?;
            }
            atomic_write(&tmp.join("rig.json"), |w| w.write_all(encode_rig(rig).as_bytes()))?;
            let text = serde_json::to_string_pretty(&file).expect("plain data") + "\n";
            atomic_write(&tmp.join("frame.json"), |w| w.write_all(text.as_bytes()))
        },
    )
}

/// Reads and validates a frame folder. The images named in `frame.json` may be `.exr` (channel Y) or grey
/// `.png` (8 or 16 bits, linear); a mask pixel is hair from one half of white.
///
/// # Errors
/// Names the missing or inconsistent file (a size other than the rig's, a missing camera, an empty mask).
pub fn read_frame(dir: &Path) -> Result<(Rig, Frame)> {
    read(dir, false)
}

/// Reads and validates a frame folder as [`read_frame`] does, but lets masks be empty: hair may leave the image for
/// some frames of a sequence, and such a frame is one without an answer.
///
/// # Errors
/// Names the missing or inconsistent file.
pub fn read_frame_of_sequence(dir: &Path) -> Result<(Rig, Frame)> {
    read(dir, true)
}

fn read(dir: &Path, may_be_empty: bool) -> Result<(Rig, Frame)> {
    check_folder(dir)?;
    let rig_path = dir.join("rig.json");
    let rig = parse_rig(&rig_path, &read_all(&rig_path)?)?;
    let manifest = dir.join("frame.json");
    let file = FrameFile::parse(&manifest, &read_all(&manifest)?)?;
    let (listed, cameras) = (file.cameras.len(), rig.cameras.len());
    if listed != cameras {
        return Err(IoError::new(
            &manifest,
            format!(
                "{listed} cameras are listed but rig.json has {cameras}; list them all, in rig.json's order"
            ),
        ));
    }
    let mut frame = Frame { index: file.index, images: Vec::new(), masks: Vec::new() };
    for (c, f) in rig.cameras.iter().zip(&file.cameras) {
        if c.name != f.name {
            return Err(IoError::new(
                &manifest,
                format!("camera {:?} stands where rig.json has {:?}; use rig.json's order", f.name, c.name),
            ));
        }
        let size = (c.width as usize, c.height as usize);
        let image_path = dir.join(&f.image);
        let image = match ending(&image_path).as_str() {
            "png" => read_png_grey(&image_path)?,
            _ => {
                let [y] = pick(&image_path, read_exr(&image_path)?, ["Y"])?;
                y
            }
        };
        check_image(&image_path, &image, size)?;
        let mask_path = dir.join(&f.mask);
        let mask = read_png_grey(&mask_path)?;
        check_image(&mask_path, &mask, size)?;
        let mask = mask.map(|&v| v >= 0.5);
        if !may_be_empty && !mask.data.contains(&true) {
            return Err(IoError::new(
                &mask_path,
                format!(
                    "the mask is empty: camera {} sees no hair; check the keying, or leave the camera out",
                    c.name
                ),
            ));
        }
        frame.images.push(image);
        frame.masks.push(mask);
    }
    frame.validate(&rig).map_err(|e| IoError::new(dir, format!("{e}; write the folder again")))?;
    Ok((rig, frame))
}

fn check_image(path: &Path, image: &Plane<f32>, (w, h): (usize, usize)) -> Result<()> {
    if image.size() != (w, h) {
        return Err(IoError::new(
            path,
            format!(
                "{}x{} pixels, but rig.json says {w}x{h}; resize neither: render again or correct the rig",
                image.width, image.height
            ),
        ));
    }
    if let Some(i) = image.data.iter().position(|v| !v.is_finite()) {
        return Err(IoError::new(path, format!("pixel ({}, {}) is not finite; render again", i % w, i / w)));
    }
    Ok(())
}

#[cfg(test)]
mod tests;

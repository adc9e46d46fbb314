//! A frame of colour cameras: all that a method for faces may see. Images are written and read one at a time.

use crate::atomic::{atomic_write, check_folder};
use crate::error::{IoError, Result};
use crate::png::{read_png_rgb, write_png_rgb16};
use crate::read::read_all;
use crate::rig_json::{check_rig, check_version, encode_rig, parse_rig};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use strandbench_types::{Plane, Rig};

const FORMAT: &str = "strandbench-colour-frame";
const VERSION: u32 = 1;
const MANIFEST: &str = "frame.json";
const NOTE: &str = "image: 16-bit RGB .png, linear light, 65535 at full scale; polarised: the camera looks through a \
     filter crossed with those of the lights; all in rig.json's order";

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
    polarised: bool,
}

impl FrameFile {
    fn parse(path: &Path, bytes: &[u8]) -> Result<FrameFile> {
        let file: FrameFile = serde_json::from_slice(bytes).map_err(|e| {
            IoError::new(path, format!("not a colour frame: {e}; correct the file or write it again"))
        })?;
        check_version(path, (&file.format, file.version), (FORMAT, VERSION))?;
        for f in &file.cameras {
            if f.image.is_empty() || f.image.contains(['/', '\\']) || f.image.starts_with('.') {
                let problem = format!("{:?} is not the name of a file in this folder", f.image);
                return Err(IoError::new(path, problem));
            }
        }
        Ok(file)
    }
}

/// Parses the `frame.json` of a colour frame and returns the names of its images; `path` is for messages only.
///
/// # Errors
/// Names the file, the line and the remedy.
pub fn parse_colour_json(path: &Path, bytes: &[u8]) -> Result<Vec<String>> {
    Ok(FrameFile::parse(path, bytes)?.cameras.into_iter().map(|f| f.image).collect())
}

/// Writes one camera's image, linear light with 1.0 at full scale, as `<camera>.png`; values outside 0..1 are clipped.
///
/// # Errors
/// If a value is not finite or the file cannot be written.
pub fn write_colour_image(dir: &Path, camera: &str, image: &Plane<[f32; 3]>) -> Result<()> {
    let path = dir.join(format!("{camera}.png"));
    if let Some(i) = image.data.iter().position(|c| c.iter().any(|v| !v.is_finite())) {
        let (x, y) = (i % image.width, i / image.width);
        return Err(IoError::new(&path, format!("not written: pixel ({x}, {y}) is not finite")));
    }
    write_png_rgb16(&path, &image.map(|c| c.map(|v| (v.clamp(0.0, 1.0) * 65_535.0).round() as u16)))
}

/// Writes `rig.json` (K, R and t as rows) and `frame.json` beside the images of [`write_colour_image`].
///
/// # Errors
/// If `polarised` has not one value a camera, a camera's name cannot name a file, an image is not there yet, or a file
/// cannot be written.
pub fn write_colour_manifest(dir: &Path, rig: &Rig, polarised: &[bool], index: u32) -> Result<()> {
    check_rig(dir, rig)?;
    let cameras = rig.cameras.len();
    if polarised.len() != cameras {
        let given = polarised.len();
        return Err(IoError::new(dir, format!("not written: {given} filters for {cameras} cameras")));
    }
    let named = rig.cameras.iter().zip(polarised);
    let file = FrameFile {
        format: FORMAT.into(),
        version: VERSION,
        note: NOTE.into(),
        index,
        cameras: named
            .map(|(c, &polarised)| Files {
                name: c.name.clone(),
                image: format!("{}.png", c.name),
                polarised,
            })
            .collect(),
    };
    if let Some(missing) = file.cameras.iter().map(|f| dir.join(&f.image)).find(|p| !p.is_file()) {
        return Err(IoError::new(&missing, "not written yet: write every camera's image first"));
    }
    atomic_write(&dir.join("rig.json"), |w| w.write_all(encode_rig(rig).as_bytes()))?;
    let text = serde_json::to_string_pretty(&file).expect("plain data") + "\n";
    atomic_write(&dir.join(MANIFEST), |w| w.write_all(text.as_bytes()))
}

/// A colour frame's folder whose images are read one by one.
#[derive(Clone, Debug, PartialEq)]
pub struct ColourFrame {
    /// Cameras as calibrated.
    pub rig: Rig,
    /// Whether a camera is cross-polarised, indexed `[camera]`.
    pub polarised: Vec<bool>,
    /// Time index.
    pub index: u32,
    images: Vec<PathBuf>,
}

impl ColourFrame {
    /// Reads `rig.json` and `frame.json`.
    ///
    /// # Errors
    /// Names the file that is missing, cannot be understood or contradicts the other, and the remedy.
    pub fn open(dir: &Path) -> Result<ColourFrame> {
        check_folder(dir)?;
        let rig_path = dir.join("rig.json");
        let rig = parse_rig(&rig_path, &read_all(&rig_path)?)?;
        let manifest = dir.join(MANIFEST);
        let file = FrameFile::parse(&manifest, &read_all(&manifest)?)?;
        let (listed, cameras) = (file.cameras.len(), rig.cameras.len());
        if listed != cameras {
            let problem = format!(
                "{listed} cameras are listed but rig.json has {cameras}; list them all, in rig.json's order"
            );
            return Err(IoError::new(&manifest, problem));
        }
        if let Some((c, f)) = rig.cameras.iter().zip(&file.cameras).find(|(c, f)| c.name != f.name) {
            let problem =
                format!("camera {:?} stands where rig.json has {:?}; use rig.json's order", f.name, c.name);
            return Err(IoError::new(&manifest, problem));
        }
        let polarised = file.cameras.iter().map(|f| f.polarised).collect();
        let images = file.cameras.iter().map(|f| dir.join(&f.image)).collect();
        Ok(ColourFrame { rig, polarised, index: file.index, images })
    }

    /// One camera's image, linear light, 0..1.
    ///
    /// # Errors
    /// If there is no such camera, the file cannot be read, is no RGB PNG, or has another size than the rig says.
    pub fn image(&self, camera: usize) -> Result<Plane<[f32; 3]>> {
        let (Some(path), Some(c)) = (self.images.get(camera), self.rig.cameras.get(camera)) else {
            let n = self.images.len();
            return Err(IoError::new(Path::new(MANIFEST), format!("there is no camera {camera} among {n}")));
        };
        let image = read_png_rgb(path)?;
        let want = (c.width as usize, c.height as usize);
        if image.size() != want {
            let ((w, h), (x, y)) = (image.size(), want);
            let problem = format!(
                "{w}x{h} pixels, but rig.json says {x}x{y}; resize neither: render again or correct the rig"
            );
            return Err(IoError::new(path, problem));
        }
        Ok(image)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rig_json::tests::rig;

    fn written() -> (tempfile::TempDir, Rig) {
        let dir = tempfile::tempdir().unwrap();
        let rig = rig(2, 12, 9);
        for (k, c) in rig.cameras.iter().enumerate() {
            let image =
                Plane::from_vec(12, 9, (0..108).map(|i| [i as f32 / 107.0, 0.25 * k as f32, 2.0]).collect());
            write_colour_image(dir.path(), &c.name, &image).unwrap();
        }
        write_colour_manifest(dir.path(), &rig, &[false, true], 7).unwrap();
        (dir, rig)
    }

    #[test]
    fn a_colour_frame_comes_back_camera_by_camera() {
        let (dir, rig) = written();
        let frame = ColourFrame::open(dir.path()).unwrap();
        assert_eq!((&frame.rig, frame.index, &frame.polarised[..]), (&rig, 7, &[false, true][..]));
        let image = frame.image(1).unwrap();
        for (i, c) in image.data.iter().enumerate() {
            let want = [i as f32 / 107.0, 0.25, 1.0];
            assert!(c.iter().zip(want).all(|(a, b)| (a - b).abs() <= 0.51 / 65_535.0), "{c:?} {want:?}");
        }
        assert!(frame.image(2).unwrap_err().to_string().contains("no camera 2 among 2"));
    }

    #[test]
    fn each_fault_names_its_file_and_the_remedy() {
        let fails = |file: &str, damage: &dyn Fn(&Path), wants: &[&str]| {
            let (dir, _) = written();
            damage(dir.path());
            let read = ColourFrame::open(dir.path()).and_then(|f| f.image(0));
            let text = read.unwrap_err().to_string();
            assert!(text.contains(file) && wants.iter().all(|w| text.contains(w)), "{text}");
        };
        let replace = |name: &'static str, from: &'static str, to: &'static str| {
            move |dir: &Path| {
                let text = std::fs::read_to_string(dir.join(name)).unwrap();
                assert!(text.contains(from), "{text}");
                std::fs::write(dir.join(name), text.replace(from, to)).unwrap();
            }
        };
        fails("rig.json", &|d| std::fs::remove_file(d.join("rig.json")).unwrap(), &[]);
        fails("frame.json", &|d| std::fs::remove_file(d.join("frame.json")).unwrap(), &[]);
        fails("cam0.png", &|d| std::fs::remove_file(d.join("cam0.png")).unwrap(), &[]);
        fails("frame.json", &replace("frame.json", "colour-frame", "frame"), &["strandbench-colour-frame"]);
        fails("frame.json", &replace("frame.json", "cam0.png", "../cam0.png"), &["name of a file"]);
        fails("frame.json", &replace("frame.json", "\"cam1\"", "\"cam9\""), &["cam9", "order"]);
        let small = |d: &Path| write_colour_image(d, "cam0", &Plane::filled(3, 2, [0.0; 3])).unwrap();
        fails("cam0.png", &small, &["3x2", "12x9"]);
        let grey = |d: &Path| crate::write_png_grey(&d.join("cam0.png"), &Plane::filled(12, 9, 3)).unwrap();
        fails("cam0.png", &grey, &["L8", "RGB"]);
        let cut = |d: &Path| {
            let bytes = std::fs::read(d.join("cam0.png")).unwrap();
            std::fs::write(d.join("cam0.png"), &bytes[..bytes.len() / 2]).unwrap();
        };
        fails("cam0.png", &cut, &["truncated"]);
    }

    #[test]
    fn what_is_not_whole_is_not_written() {
        let (dir, rig) = written();
        assert!(write_colour_manifest(dir.path(), &rig, &[true], 0).is_err());
        std::fs::remove_file(dir.path().join("cam1.png")).unwrap();
        let text = write_colour_manifest(dir.path(), &rig, &[true; 2], 0).unwrap_err().to_string();
        assert!(text.contains("cam1.png"), "{text}");
        let bad = Plane::filled(2, 2, [0.0, f32::NAN, 0.0]);
        assert!(write_colour_image(dir.path(), "x", &bad).unwrap_err().to_string().contains("(0, 0)"));
    }

    proptest::proptest! {
        #[test]
        fn any_bytes_are_a_manifest_or_an_error(bytes in proptest::collection::vec(0u8.., 0..300)) {
            let _ = parse_colour_json(Path::new("x"), &bytes);
            let _ = crate::parse_png_rgb(&bytes);
        }
    }
}

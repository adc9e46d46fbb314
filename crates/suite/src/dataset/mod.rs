//! A scene's renders as a folder that any program can use, its truth apart or withheld.
//!
//! ```text
//! README.md  dataset.json             what is what, for people and for programs
//! colmap/  opencv.json  transforms.json    the calibration, three times the same
//! images/  images_srgb/  images_exr/  masks/    a file a camera; of a moving scene a folder a frame
//! head.ply  scalp.ply                 of a moving scene head/ and scalp/, a file a frame
//! truth/                              only if asked for
//! ```

mod calibration;
mod readme;
mod source;
mod truth;

pub use calibration::{colmap_cameras, colmap_images, opencv_json, transforms_json};
pub(crate) use source::Source;

use crate::sequence::frame_name;
use crate::stage::{Progress, write_json};
use crate::{SuiteError, pictures};
use calibration::{Shot, write_colmap};
use serde::Serialize;
use std::path::{Path, PathBuf};
use strandbench_types::{Frame, Rig};

/// File that says to a program what a dataset folder holds.
pub const DATASET_FILE: &str = "dataset.json";
const FORMAT: &str = "strandbench-dataset";
const VERSION: u32 = 1;
/// Folders with a file for each camera, and the ending of their files.
const RASTERS: [(&str, &str); 4] =
    [("images", "png"), ("images_srgb", "png"), ("images_exr", "exr"), ("masks", "png")];

/// What a dataset holds beside images, masks and calibration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DatasetOptions {
    /// The bald head and its scalp: what a laboratory knows of its subject. No built-in method is given it.
    pub head: bool,
    /// The truth, in a folder of its own.
    pub truth: bool,
}

/// What was exported.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Dataset {
    /// The folder.
    pub folder: PathBuf,
    /// Names of the cameras, the reference first.
    pub cameras: Vec<String>,
    /// Indices of the frames; a scene that does not move has frame 0 alone.
    pub frames: Vec<u32>,
    /// Whether the head is in it.
    pub head: bool,
    /// Whether the truth is in it.
    pub truth: bool,
}

/// `dataset.json`.
#[derive(Serialize)]
struct DatasetFile {
    format: &'static str,
    version: u32,
    scene: Option<String>,
    unit: &'static str,
    reference: String,
    near_mm: f64,
    far_mm: f64,
    head_breadth_mm: Option<f32>,
    frame_rate_hz: f64,
    exposure_s: f64,
    moves: bool,
    cameras: Vec<String>,
    frames: Vec<FrameEntry>,
}

/// Folders and files of one frame, from the dataset's folder.
#[derive(Serialize)]
struct FrameEntry {
    index: u32,
    time_s: f64,
    images: String,
    images_srgb: String,
    images_exr: String,
    masks: String,
    head: Option<String>,
    scalp: Option<String>,
    /// Where the answer to this frame goes in the answer's folder; empty for the folder itself.
    answer: String,
}

/// Writes the renders in `render` (of one frame or of a sequence) into the new folder `out`: what a method may see,
/// with the rig as calibrated, and the truth only if asked for.
///
/// # Errors
/// If `render` is no render folder, `out` is there already, a file cannot be read or written, or the work is cancelled;
/// nothing is left behind then.
pub fn export_dataset(
    render: &Path,
    out: &Path,
    options: DatasetOptions,
    progress: &dyn Progress,
) -> Result<Dataset, SuiteError> {
    if out.exists() {
        return Err(SuiteError::file(out, "is there already; choose another folder"));
    }
    let source = Source::open(render)?;
    let made = strandbench_io::atomic_folder(out, |dir| fill(&source, options, dir, progress))?;
    Ok(Dataset { folder: out.to_owned(), ..made })
}

/// Fills an empty folder.
pub(crate) fn fill(
    source: &Source,
    options: DatasetOptions,
    dir: &Path,
    progress: &dyn Progress,
) -> Result<Dataset, SuiteError> {
    let frames = source.frames();
    progress.begin("frames exported", frames.len() as u64);
    let (mut entries, mut shots) = (Vec::new(), Vec::new());
    let mut first: Option<Rig> = None;
    let mut heads = false;
    for &index in &frames {
        progress.check()?;
        let (rig, frame) = source.read(index)?;
        let rig = match &first {
            Some(first) if *first != rig => {
                let problem = "its rig is not that of the first frame; a sequence has one rig";
                return Err(SuiteError::file(&source.frame_dir(index), problem));
            }
            Some(first) => first,
            None => first.insert(rig),
        };
        let time_s = f64::from(index) / rig.frame_rate_hz;
        let of = |kind: &str| {
            if source.moves() { format!("{kind}/{}", frame_name(index)) } else { kind.to_owned() }
        };
        write_rasters(dir, of, rig, &frame)?;
        shots.extend(rig.cameras.iter().map(|c| Shot {
            image: format!("{}/{}.png", of("images_srgb"), c.name),
            mask: format!("{}/{}.png", of("masks"), c.name),
            time_s: source.moves().then_some(time_s),
            camera: c.clone(),
        }));
        let mut entry = FrameEntry {
            index,
            time_s,
            images: of("images"),
            images_srgb: of("images_srgb"),
            images_exr: of("images_exr"),
            masks: of("masks"),
            head: None,
            scalp: None,
            answer: if source.moves() { frame_name(index) } else { String::new() },
        };
        if let Some(head) = options.head.then(|| source.head(index)).transpose()?.flatten() {
            heads = true;
            let scalp = strandbench_scenes::scalp_of(&head);
            for (kind, mesh, place) in
                [("head", Some(&head), &mut entry.head), ("scalp", scalp.as_ref(), &mut entry.scalp)]
            {
                let Some(mesh) = mesh else { continue };
                let name = format!("{}.ply", of(kind));
                make_parent(&dir.join(&name))?;
                strandbench_io::write_mesh(&dir.join(&name), mesh)?;
                *place = Some(name);
            }
        }
        if options.truth {
            truth::write(source, index, &dir.join(of("truth")))?;
        }
        entries.push(entry);
        progress.advance(1);
    }
    let rig = first.ok_or_else(|| SuiteError::file(dir, "there is no frame to export"))?;
    write_colmap(&dir.join("colmap"), &rig)?;
    write_text(&dir.join("opencv.json"), &opencv_json(&rig))?;
    write_text(&dir.join("transforms.json"), &transforms_json(&shots))?;
    let cameras: Vec<String> = rig.cameras.iter().map(|c| c.name.clone()).collect();
    let file = DatasetFile {
        format: FORMAT,
        version: VERSION,
        scene: source.scene(),
        unit: "mm",
        reference: cameras[0].clone(),
        near_mm: rig.near_mm,
        far_mm: rig.far_mm,
        head_breadth_mm: source.head_breadth_mm(),
        frame_rate_hz: rig.frame_rate_hz,
        exposure_s: rig.exposure_s,
        moves: source.moves(),
        cameras: cameras.clone(),
        frames: entries,
    };
    write_json(&dir.join(DATASET_FILE), &file)?;
    let made = Dataset { folder: dir.to_owned(), cameras, frames, head: heads, truth: options.truth };
    write_text(&dir.join("README.md"), &readme::text(&made, &rig, source))?;
    Ok(made)
}

/// Images and masks of one frame; `of` names the folder of a kind.
fn write_rasters(
    dir: &Path,
    of: impl Fn(&str) -> String,
    rig: &Rig,
    frame: &Frame,
) -> Result<(), SuiteError> {
    for (c, (image, mask)) in rig.cameras.iter().zip(frame.images.iter().zip(&frame.masks)) {
        let [png, srgb, exr, masks] =
            RASTERS.map(|(kind, ending)| dir.join(of(kind)).join(format!("{}.{ending}", c.name)));
        for path in [&png, &srgb, &exr, &masks] {
            make_parent(path)?;
        }
        let levels = image.map(|v| (v.clamp(0.0, 1.0) * 65_535.0).round() as u16);
        strandbench_io::write_png_grey16(&png, &levels)?;
        strandbench_io::write_png_grey(&srgb, &image.map(|&v| pictures::srgb(v)))?;
        strandbench_io::write_exr(&exr, &[("Y", image)])?;
        strandbench_io::write_png_grey(&masks, &mask.map(|&hair| if hair { 255 } else { 0 }))?;
    }
    Ok(())
}

fn make_parent(path: &Path) -> Result<(), SuiteError> {
    let parent = path.parent().unwrap_or(Path::new("."));
    std::fs::create_dir_all(parent).map_err(|e| SuiteError::file(parent, e))
}

fn write_text(path: &Path, text: &str) -> Result<(), SuiteError> {
    make_parent(path)?;
    std::fs::write(path, text).map_err(|e| SuiteError::file(path, e))
}

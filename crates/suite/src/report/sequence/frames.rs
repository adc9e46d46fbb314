//! The player's pictures, frame after frame, and the strands coloured by their error.

use super::data::Moving;
use super::draw;
use crate::SuiteError;
use crate::pictures::{self, sequential};
use crate::render::FRAME;
use crate::score::{ERRORS, read_error_map};
use crate::sequence::frame_name;
use crate::stage::Progress;
use std::io::Write as _;
use std::path::Path;
use strandbench_renderer::{RenderError, RenderScene, Settings};
use strandbench_scenes::{Pigment, Scene};
use strandbench_types::{Estimate, Plane, StopOnly, StrandSet, Truth};

/// Kinds of pictures in the player's order: part of the file name, and what it shows.
pub(super) const KINDS: [(&str, &str); 5] = [
    ("input", "What the method gets (reference camera)"),
    ("envelope", "Estimated envelope"),
    ("error", "Depth error, −10 (blue) to +10 mm (red)"),
    ("strands", "Estimated strands over the input, by distance to a true strand that runs alike"),
    ("synthesised", "Estimated strands, rendered with the scene's light"),
];
/// Strands drawn in a picture.
const DRAWN: usize = 6000;
/// Distance (mm) at the dark end of the strands' colours, and beyond which a strand has no match.
const REACH_MM: f64 = 5.0;
/// Angle within which a true strand counts, degrees.
const ANGLE_DEG: f64 = 20.0;
/// Strands behind the envelope by more are not drawn, mm.
const BEHIND_MM: f64 = 4.0;
/// Colour of what has no match.
const UNMATCHED: [u8; 3] = [214, 0, 170];
/// Rays through each pixel of the rendered strands.
const SAMPLES: u32 = 8;

/// Depth errors at the ends of their scale, mm.
const ERROR_LIMIT_MM: f32 = 10.0;

/// Which kinds there are, and for which frame strands were written as a coloured point set.
pub(super) struct Pictures {
    pub kinds: Vec<(&'static str, &'static str)>,
    pub coloured: Option<(u32, String)>,
}

/// Writes all pictures into `dir`, and `strands_by_error.ply` of the frame in the middle.
pub(super) fn write(data: &Moving, dir: &Path, progress: &dyn Progress) -> Result<Pictures, SuiteError> {
    std::fs::create_dir_all(dir).map_err(|e| SuiteError::file(dir, e))?;
    let frames = &data.sequence.file.frames;
    progress.begin("frames drawn", frames.len() as u64);
    let middle = frames[frames.len() / 2];
    let mut has_strands = false;
    let mut coloured = None;
    let mut gain = None;
    for &index in frames {
        progress.check()?;
        let (_, frame) = strandbench_io::read_frame_of_sequence(&data.sequence.frame_dir(index).join(FRAME))?;
        let gain = *gain.get_or_insert_with(|| {
            pictures::exposure(frame.images.iter().flat_map(|i| i.data.iter().copied()))
        });
        let estimate = data.estimate(index)?;
        let mut scene = data.sequence.scene(index)?.scene;
        let truth = data.sequence.truth_of(index, &mut scene)?;
        let input = pictures::monochrome(&frame.images[0], gain);
        let save =
            |kind: &str, picture: &Plane<[u8; 3]>| pictures::jpeg(&dir.join(name(index, kind)), picture);
        save("input", &input)?;
        save("envelope", &envelope(&truth, &estimate))?;
        save("error", &error(data, index, &truth)?)?;
        if let Some(strands) = &estimate.strands {
            has_strands = true;
            let (few, errors) = drawn(strands, estimate.strand_ids.as_deref(), &truth)?;
            let mut over = input.map(|c| c.map(|v| v / 2));
            let camera = &truth.rig.cameras[0];
            draw::strands(&mut over, camera, &few, estimate.depth.as_ref(), BEHIND_MM, |_, point| {
                colour(errors[point])
            });
            save("strands", &over)?;
            save("synthesised", &synthesised(data, scene, strands, progress)?)?;
            if index == middle {
                let path = dir.join("strands_by_error.ply");
                ply(&path, &few, &errors).map_err(|e| SuiteError::file(&path, e))?;
                coloured = Some((index, format!("{}/strands_by_error.ply", super::PICTURES)));
            }
        }
        progress.advance(1);
    }
    let kinds =
        KINDS.into_iter().filter(|k| has_strands || !["strands", "synthesised"].contains(&k.0)).collect();
    Ok(Pictures { kinds, coloured })
}

/// File name of a picture.
pub(super) fn name(index: u32, kind: &str) -> String {
    format!("{}_{kind}.jpg", frame_name(index))
}

/// Colour of a distance to the truth.
pub(super) fn colour(error_mm: f32) -> [u8; 3] {
    if error_mm.is_finite() { sequential(error_mm / REACH_MM as f32) } else { UNMATCHED }
}

fn envelope(truth: &Truth, estimate: &Estimate) -> Plane<[u8; 3]> {
    match &estimate.depth {
        Some(depth) => draw::shaded(&truth.rig.cameras[0], depth, pictures::PAPER),
        None => truth.views[0].mask.map(|&hair| if hair { pictures::ABSENT } else { pictures::PAPER }),
    }
}

fn error(data: &Moving, index: u32, truth: &Truth) -> Result<Plane<[u8; 3]>, SuiteError> {
    let folder = data.places.score.join(frame_name(index));
    if !folder.join(ERRORS).is_file() {
        return Ok(truth.views[0].mask.map(|_| pictures::PAPER));
    }
    Ok(pictures::signed_error(&read_error_map(&folder)?, ERROR_LIMIT_MM))
}

/// The strands that are drawn, and the distance to the truth at each of their points. Strands that keep their identity
/// are the same ones in every frame.
fn drawn(
    strands: &StrandSet,
    ids: Option<&[u64]>,
    truth: &Truth,
) -> Result<(StrandSet, Vec<f32>), SuiteError> {
    let step = strands.len().div_ceil(DRAWN).max(1) as u64;
    let mut few = StrandSet::new();
    for s in 0..strands.len() {
        let id = ids.map_or(s as u64, |ids| ids[s]);
        // Neighbours have neighbouring numbers: multiplied by an odd number the picks spread.
        if (id.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32).is_multiple_of(step) {
            few.push(strands.strand(s), strands.radii_mm[strands.offsets[s] as usize]);
        }
    }
    let errors = strandbench_score::strand_point_errors_mm(&truth.strands, &few, ANGLE_DEG, REACH_MM)
        .map_err(|e| SuiteError::Score { folder: "the estimate's strands".into(), problem: e.to_string() })?;
    Ok((few, errors))
}

/// The reference view of the scene with the estimate's strands in place of the true ones.
fn synthesised(
    data: &Moving,
    mut scene: Scene,
    strands: &StrandSet,
    progress: &dyn Progress,
) -> Result<Plane<[u8; 3]>, SuiteError> {
    let n = scene.pigments.len().max(1) as f32;
    let (e, p) =
        scene.pigments.iter().fold((0.0, 0.0), |(e, p), x| (e + x.eumelanin / n, p + x.pheomelanin / n));
    scene.pigments = vec![Pigment { eumelanin: e, pheomelanin: p }; strands.len()];
    scene.strands = strands.clone();
    let settings = Settings {
        samples_per_pixel: SAMPLES,
        max_samples_per_pixel: SAMPLES,
        depth: 1,
        ..data.render.settings.clone()
    };
    let render =
        RenderScene::new(&scene).and_then(|s| s.render(0, &settings, data.render.seed, &StopOnly(progress)));
    match render {
        Ok(render) => Ok(pictures::radiance(&render.radiance_rgb)),
        Err(RenderError::Cancelled(_)) => Err(SuiteError::Cancelled),
        Err(other) => Err(SuiteError::Render { scene: scene.name, problem: other.to_string() }),
    }
}

/// Points with colours and the edges between them, binary little-endian, as mesh viewers open it.
fn ply(path: &Path, set: &StrandSet, errors: &[f32]) -> std::io::Result<()> {
    let edges: usize = (0..set.len()).map(|s| set.strand(s).len().saturating_sub(1)).sum();
    let mut out = std::io::BufWriter::new(std::fs::File::create(path)?);
    write!(
        out,
        "ply\nformat binary_little_endian 1.0\ncomment mm; error_mm: distance to the nearest true strand within \
         {ANGLE_DEG} degrees, inf beyond {REACH_MM} mm\nelement vertex {}\nproperty float x\nproperty float y\n\
         property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nproperty float error_mm\n\
         element edge {edges}\nproperty int vertex1\nproperty int vertex2\nend_header\n",
        set.points.len()
    )?;
    for (p, &e) in set.points.iter().zip(errors) {
        for v in p.to_array() {
            out.write_all(&v.to_le_bytes())?;
        }
        out.write_all(&colour(e))?;
        out.write_all(&e.to_le_bytes())?;
    }
    for s in 0..set.len() {
        for i in set.offsets[s]..(set.offsets[s + 1]).saturating_sub(1) {
            out.write_all(&(i as i32).to_le_bytes())?;
            out.write_all(&(i as i32 + 1).to_le_bytes())?;
        }
    }
    out.flush()
}

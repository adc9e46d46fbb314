//! The truth of one camera's view of a face.

use crate::atomic::{atomic_folder, check_folder};
use crate::error::{IoError, Result};
use crate::exr::{pick, read_exr, write_exr_owned};
use crate::flow::{read_flow, write_flow};
use crate::png::{read_png_grey, write_png_grey};
use std::path::Path;
use strandbench_types::{
    DepthMap, FaceView, FirstHit, HitPlane, LABEL_HAIR, LABEL_NOTHING, LABEL_OTHER, LABEL_SKIN, Plane,
};

const SEEN: &str = "seen.exr";
const SKIN: &str = "skin.exr";
const FLOW: &str = "flow.exr";
const SKIN_FLOW: &str = "skin_flow.exr";
const LABELS: &str = "labels.png";

/// Channels of `seen.exr` and `skin.exr`.
const SEEN_CHANNELS: [&str; 4] = ["depth_mm", "strand", "segment", "along"];
const SKIN_CHANNELS: [&str; 5] = ["depth_mm", "surface", "triangle", "barycentric.u", "barycentric.v"];

/// Indices below this are exact in single precision.
const MAX_INDEX: u32 = 1 << 24;

const REMEDY: &str = "make the truth again";

/// Writes the truth of one camera's view as a folder of its own, whole or not at all, so that the view can be dropped
/// before the next is made:
///
/// * `seen.exr`: `depth_mm` of what is seen, and `strand`, `segment`, `along` where it is hair;
/// * `skin.exr`: the same without hair: `depth_mm`, `surface` (0 is skin), `triangle`, and the weights
///   `barycentric.u` and `.v` of the triangle's second and third corner;
/// * `flow.exr` and `skin_flow.exr`: flow to the reference frame of what is seen and of what would be seen without
///   hair, as [`write_flow`] has it;
/// * `labels.png`: 8 bits, 0 nothing, 1 skin, 2 another surface, 16 and more hair of kind 0 and more.
///
/// NaN stands where there is nothing.
///
/// # Errors
/// If planes contradict each other, an index is 2^24 or more, or a file cannot be written.
pub fn write_face_view(dir: &Path, view: &FaceView) -> Result<()> {
    view.validate().map_err(|e| IoError::new(dir, format!("not written: {e}; {REMEDY}")))?;
    let large = |hit: &FirstHit| match *hit {
        FirstHit::Nothing => false,
        FirstHit::Fibre { strand, segment, .. } => strand.max(segment) >= MAX_INDEX,
        FirstHit::Mesh { surface, triangle, .. } => surface.max(triangle) >= MAX_INDEX,
    };
    if let Some(hit) = view.seen.hits.data.iter().chain(&view.bare.hits.data).find(|h| large(h)) {
        let fault = format!("not written: {hit:?} has an index beyond 2^24; leave strands out");
        return Err(IoError::new(dir, fault));
    }
    atomic_folder(dir, |tmp| {
        let fibre = |f: fn(u32, u32, f32) -> f32| {
            view.seen.hits.map(|hit| match *hit {
                FirstHit::Fibre { strand, segment, along } => f(strand, segment, along),
                _ => f32::NAN,
            })
        };
        let planes = [
            view.seen.depth.raw().clone(),
            fibre(|strand, _, _| strand as f32),
            fibre(|_, segment, _| segment as f32),
            fibre(|_, _, along| along),
        ];
        write_exr_owned(&tmp.join(SEEN), SEEN_CHANNELS.into_iter().zip(planes).collect())?;
        let mesh = |f: fn(u32, u32, [f32; 2]) -> f32| {
            view.bare.hits.map(|hit| match *hit {
                FirstHit::Mesh { surface, triangle, uv } => f(surface, triangle, uv),
                _ => f32::NAN,
            })
        };
        let planes = [
            view.bare.depth.raw().clone(),
            mesh(|surface, _, _| surface as f32),
            mesh(|_, triangle, _| triangle as f32),
            mesh(|_, _, uv| uv[0]),
            mesh(|_, _, uv| uv[1]),
        ];
        write_exr_owned(&tmp.join(SKIN), SKIN_CHANNELS.into_iter().zip(planes).collect())?;
        write_flow(&tmp.join(FLOW), &view.flow)?;
        write_flow(&tmp.join(SKIN_FLOW), &view.bare_flow)?;
        write_png_grey(&tmp.join(LABELS), &view.labels)
    })
}

/// Reads the folder that [`write_face_view`] wrote, bit for bit.
///
/// # Errors
/// Names the missing or inconsistent file and the pixel.
pub fn read_face_view(dir: &Path) -> Result<FaceView> {
    check_folder(dir)?;
    let file = |name: &str| dir.join(name);
    let path = file(LABELS);
    let labels = read_png_grey(&path)?.map(|v| (v * 255.0).round() as u8);
    let sized = |path: &Path, size: (usize, usize)| {
        if size == labels.size() {
            return Ok(());
        }
        let fault = format!("{size:?} pixels, but {LABELS} has {:?}; {REMEDY}", labels.size());
        Err(IoError::new(path, fault))
    };
    let path = file(SKIN);
    let [depth, surface, triangle, u, v] = pick(&path, read_exr(&path)?, SKIN_CHANNELS)?;
    sized(&path, depth.size())?;
    let bare = hits(&path, depth, |i| mesh_hit(surface.data[i], triangle.data[i], [u.data[i], v.data[i]]))?;
    let path = file(SEEN);
    let [depth, strand, segment, along] = pick(&path, read_exr(&path)?, SEEN_CHANNELS)?;
    sized(&path, depth.size())?;
    let seen = hits(&path, depth, |i| match [strand.data[i], segment.data[i], along.data[i]] {
        s if s.iter().all(|v| v.is_nan()) => Some(bare.hits.data[i]),
        [strand, segment, along] => fibre_hit(strand, segment, along),
    })?;
    let path = file(LABELS);
    for (i, (&label, hit)) in labels.data.iter().zip(&seen.hits.data).enumerate() {
        let fits = match hit {
            FirstHit::Nothing => label == LABEL_NOTHING,
            FirstHit::Mesh { surface: 0, .. } => label == LABEL_SKIN,
            FirstHit::Mesh { .. } => label == LABEL_OTHER,
            FirstHit::Fibre { .. } => label >= LABEL_HAIR,
        };
        if !fits {
            let at = format!("pixel ({}, {})", i % labels.width, i / labels.width);
            return Err(IoError::new(&path, format!("{at}: label {label} for {hit:?}; {REMEDY}")));
        }
    }
    let flow = read_flow(&file(FLOW))?;
    sized(&file(FLOW), flow.state.size())?;
    let bare_flow = read_flow(&file(SKIN_FLOW))?;
    sized(&file(SKIN_FLOW), bare_flow.state.size())?;
    let view = FaceView { seen, bare, labels, flow, bare_flow };
    view.validate().map_err(|e| IoError::new(dir, format!("{e}; {REMEDY}")))?;
    Ok(view)
}

/// Hits by pixel, which have a depth where they are something and nowhere else.
fn hits(path: &Path, depth: Plane<f32>, of: impl Fn(usize) -> Option<FirstHit>) -> Result<HitPlane> {
    let (w, h) = depth.size();
    let found = (0..w * h).map(|i| {
        let z = depth.data[i];
        let at = || format!("pixel ({}, {})", i % w, i / w);
        let hit = of(i).ok_or_else(|| {
            IoError::new(path, format!("{}: indices or weights are none or incomplete; {REMEDY}", at()))
        })?;
        let fits = if hit == FirstHit::Nothing { z.is_nan() } else { z.is_finite() && z > 0.0 };
        if !fits {
            return Err(IoError::new(path, format!("{}: depth {z} mm of {hit:?}; {REMEDY}", at())));
        }
        Ok(hit)
    });
    let hits = Plane::from_vec(w, h, found.collect::<Result<_>>()?);
    Ok(HitPlane { hits, depth: DepthMap::from_raw(depth) })
}

fn index(v: f32) -> Option<u32> {
    (v >= 0.0 && v < MAX_INDEX as f32 && v.fract() == 0.0).then_some(v as u32)
}

fn fibre_hit(strand: f32, segment: f32, along: f32) -> Option<FirstHit> {
    let (strand, segment) = (index(strand)?, index(segment)?);
    (0.0..=1.0).contains(&along).then_some(FirstHit::Fibre { strand, segment, along })
}

fn mesh_hit(surface: f32, triangle: f32, uv: [f32; 2]) -> Option<FirstHit> {
    if [surface, triangle, uv[0], uv[1]].iter().all(|v| v.is_nan()) {
        return Some(FirstHit::Nothing);
    }
    let (surface, triangle) = (index(surface)?, index(triangle)?);
    let inside = uv.iter().all(|w| *w >= 0.0) && uv[0] + uv[1] <= 1.0 + 1e-6;
    inside.then_some(FirstHit::Mesh { surface, triangle, uv })
}

#[cfg(test)]
mod tests;

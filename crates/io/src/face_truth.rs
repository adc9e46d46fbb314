//! The truth of one frame of a face, apart from its views.

use crate::atomic::{atomic_write, check_folder, merge_folder};
use crate::error::{IoError, Result};
use crate::follicles::{encode_hair_roots, parse_hair_roots};
use crate::mesh::{parse_ply_mesh, write_mesh};
use crate::read::{read_all, read_exact_hair, write_strands};
use crate::rig_json::check_version;
use crate::truth_frame::{encode_seen_by, parse_seen_by};
use crate::visibility::{encode_visibility, parse_visibility};
use serde::{Deserialize, Serialize};
use std::path::Path;
use strandbench_types::{FaceTruth, LABEL_HAIR, SkinCover};

const SKIN: &str = "skin.ply";
const STRANDS: &str = "strands.hair";
const ROOTS: &str = "hairs.ply";
const VISIBILITY: &str = "visibility.bin";
const SKIN_SEEN_BY: &str = "skin_seen_by.bin";
const SKIN_BARE_SEEN_BY: &str = "skin_bare_seen_by.bin";
const SKIN_COVER: &str = "skin_cover.bin";
const ABOUT: &str = "face.json";
const FORMAT: &str = "strandbench-face-truth";
const VERSION: u32 = 1;
const REMEDY: &str = "make the truth again";
const COVERS: [SkinCover; 3] = [SkinCover::Bare, SkinCover::Margin, SkinCover::Under];

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct About {
    format: String,
    version: u32,
    #[serde(default)]
    note: String,
    kinds: Vec<Kind>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Kind {
    name: String,
    /// Label of its pixels in `labels.png`.
    label: u8,
}

/// Writes the truth of a frame: `skin.ply` (fixed topology), `strands.hair` (exact points and radii), `hairs.ply` (roots,
/// follicles, kinds), `visibility.bin`, what cameras see of the skin's vertices with hair (`skin_seen_by.bin`) and
/// without (`skin_bare_seen_by.bin`), `skin_cover.bin` (0 bare, 1 margin, 2 under hair; all three as runs of equal
/// values) and `face.json` (names and labels of the kinds). Other files of an existing folder stay.
///
/// # Errors
/// If the parts contradict each other or a file cannot be written.
pub fn write_face_truth(dir: &Path, truth: &FaceTruth) -> Result<()> {
    truth.validate().map_err(|e| IoError::new(dir, format!("not written: {e}; {REMEDY}")))?;
    let kinds = (LABEL_HAIR..).zip(&truth.kinds).map(|(label, name)| Kind { name: name.clone(), label });
    let about = About {
        format: FORMAT.into(),
        version: VERSION,
        note: "labels of pixels: 0 nothing, 1 skin, 2 another surface, and those of the kinds of hair".into(),
        kinds: kinds.collect(),
    };
    merge_folder(
        dir,
        |_| false,
        |tmp| {
            let write = |name: &str, bytes: &[u8]| atomic_write(&tmp.join(name), |w| w.write_all(bytes));
            write_mesh(&tmp.join(SKIN), &truth.skin)?;
            write_strands(&tmp.join(STRANDS), &truth.strands)?;
            write(ROOTS, &encode_hair_roots(&truth.roots))?;
            write(VISIBILITY, &encode_visibility(&truth.visibility))?;
            write(SKIN_SEEN_BY, &encode_seen_by(&truth.skin_seen_by))?;
            write(SKIN_BARE_SEEN_BY, &encode_seen_by(&truth.skin_bare_seen_by))?;
            let cover: Vec<u32> = truth.skin_cover.iter().map(|&c| c as u32).collect();
            write(SKIN_COVER, &encode_seen_by(&cover))?;
            let text = serde_json::to_string_pretty(&about).expect("plain data") + "\n";
            write(ABOUT, text.as_bytes())
        },
    )
}

/// Reads what [`write_face_truth`] wrote, bit for bit. `topology`, if given, is what the skin's triangles must be: those of
/// the sequence's first frame.
///
/// # Errors
/// Names the missing or inconsistent file.
pub fn read_face_truth(dir: &Path, topology: Option<&[[u32; 3]]>) -> Result<FaceTruth> {
    check_folder(dir)?;
    let file = |name: &str| Ok::<_, IoError>((dir.join(name), read_all(&dir.join(name))?));
    let (path, bytes) = file(ABOUT)?;
    let about: About = serde_json::from_slice(&bytes)
        .map_err(|e| IoError::new(&path, format!("not the truth of a face: {e}; {REMEDY}")))?;
    check_version(&path, (&about.format, about.version), (FORMAT, VERSION))?;
    for (k, kind) in about.kinds.iter().enumerate() {
        if usize::from(kind.label) != usize::from(LABEL_HAIR) + k {
            let fault = format!("kind {k} ({}) has label {}; {REMEDY}", kind.name, kind.label);
            return Err(IoError::new(&path, fault));
        }
    }
    let (path, bytes) = file(SKIN)?;
    let skin = parse_ply_mesh(&bytes).map_err(|e| e.in_file(&path))?;
    if topology.is_some_and(|t| t != skin.triangles) {
        let fault = format!("its triangles are not those of the sequence; {REMEDY}");
        return Err(IoError::new(&path, fault));
    }
    let (path, bytes) = file(ROOTS)?;
    let roots = parse_hair_roots(&bytes).map_err(|e| e.in_file(&path))?;
    let (path, bytes) = file(VISIBILITY)?;
    let visibility = parse_visibility(&bytes).map_err(|e| e.in_file(&path))?;
    let runs = |name: &str| {
        let (path, bytes) = file(name)?;
        let values = parse_seen_by(&bytes, skin.vertices.len()).map_err(|e| e.in_file(&path))?;
        Ok::<_, IoError>((path, values))
    };
    let (skin_seen_by, skin_bare_seen_by) = (runs(SKIN_SEEN_BY)?.1, runs(SKIN_BARE_SEEN_BY)?.1);
    let (path, covers) = runs(SKIN_COVER)?;
    let cover = |(v, c): (usize, &u32)| {
        COVERS
            .get(*c as usize)
            .copied()
            .ok_or_else(|| IoError::new(&path, format!("vertex {v} is {c}, none of 0 to 2; {REMEDY}")))
    };
    let skin_cover = covers.iter().enumerate().map(cover).collect::<Result<_>>()?;
    let truth = FaceTruth {
        strands: read_exact_hair(&dir.join(STRANDS))?,
        kinds: about.kinds.into_iter().map(|k| k.name).collect(),
        skin,
        roots,
        visibility,
        skin_seen_by,
        skin_bare_seen_by,
        skin_cover,
    };
    truth.validate().map_err(|e| IoError::new(dir, format!("{e}; {REMEDY}")))?;
    Ok(truth)
}

#[cfg(test)]
mod tests;

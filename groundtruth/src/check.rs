//! What the inputs must satisfy before any of them is indexed.

use crate::GroundTruthError;
use strandbench_types::{Camera, Rig, SampleHits, StrandSet, TriMesh};

/// Cameras that fit the bits of one visibility word.
pub const MAX_CAMERAS: usize = 32;

/// Strand samples (half a millimetre each) that truth is made for: 134 km of hair, three times that of a
/// full head of 150,000 strands of 300 mm.
pub const MAX_STRAND_SAMPLES: u64 = 1 << 28;

fn fault(text: String) -> Result<(), GroundTruthError> {
    Err(GroundTruthError::Inconsistent(text))
}

/// Checks rig and geometry.
pub(crate) fn scene(rig: &Rig, strands: &StrandSet, head: Option<&TriMesh>) -> Result<(), GroundTruthError> {
    rig.validate().map_err(GroundTruthError::Inconsistent)?;
    strands.validate()?;
    if strands.is_empty() {
        return fault("there are no strands: truth needs at least one".to_owned());
    }
    if let Some(Err(e)) = head.map(TriMesh::validate) {
        return fault(format!("head mesh: {e}"));
    }
    if rig.cameras.len() > MAX_CAMERAS {
        return fault(format!(
            "the rig has {} cameras; visibility is kept for at most {MAX_CAMERAS}",
            rig.cameras.len()
        ));
    }
    Ok(())
}

/// Checks that there is a buffer for each camera.
pub(crate) fn buffers(rig: &Rig, hits: &[SampleHits]) -> Result<(), GroundTruthError> {
    if hits.len() != rig.cameras.len() {
        return fault(format!(
            "the rig has {} cameras but there are {} identity buffers; give one for each camera",
            rig.cameras.len(),
            hits.len()
        ));
    }
    rig.cameras.iter().zip(hits).try_for_each(|(c, h)| buffer(c, h))
}

/// Checks a camera's buffer, but for the hits themselves.
pub(crate) fn buffer(camera: &Camera, hits: &SampleHits) -> Result<(), GroundTruthError> {
    match shape(hits, camera.width as usize, camera.height as usize) {
        Err(e) => fault(format!("identity buffer of camera {}: {e}", camera.name)),
        Ok(()) => Ok(()),
    }
}

fn shape(b: &SampleHits, width: usize, height: usize) -> Result<(), String> {
    if (b.width, b.height) != (width, height) {
        return Err(format!("it is {}x{} but the camera {width}x{height}", b.width, b.height));
    }
    let pixels = width * height;
    if b.rays.len() != pixels || b.offsets.len() != pixels + 1 {
        return Err(format!(
            "{pixels} pixels need as many ray counts and one offset more, not {} and {}",
            b.rays.len(),
            b.offsets.len()
        ));
    }
    if b.offsets[0] != 0 || b.offsets[pixels] as usize != b.hits.len() {
        return Err(format!(
            "offsets run from {} to {} but there are {} hits",
            b.offsets[0],
            b.offsets[pixels],
            b.hits.len()
        ));
    }
    for i in 0..pixels {
        let (x, y) = (i % width, i / width);
        let Some(n) = b.offsets[i + 1].checked_sub(b.offsets[i]) else {
            return Err(format!("offsets descend at pixel ({x}, {y})"));
        };
        if n > u32::from(b.rays[i]) {
            return Err(format!("pixel ({x}, {y}) has {n} hits of {} rays", b.rays[i]));
        }
    }
    Ok(())
}

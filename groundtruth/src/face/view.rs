//! All planes of one view.

use super::flow::{check_moments, flow_but};
use crate::GroundTruthError;
use strandbench_types::{
    Camera, FaceView, FirstHit, FlowState, HitPlane, LABEL_HAIR, LABEL_NOTHING, LABEL_OTHER, LABEL_SKIN,
    Moment, Monitor, Sight,
};

/// The frame that a view shows and the reference frame.
#[derive(Clone, Copy)]
pub struct Frames<'a> {
    /// What the view shows.
    pub now: Moment<'a>,
    /// Where flow goes.
    pub reference: Moment<'a>,
    /// Kind of hair, indexed `[strand]`; at most 239.
    pub kinds: &'a [u8],
    /// What hides what in the reference frame.
    pub sight: &'a dyn Sight,
    /// What hides what there without hair.
    pub bare_sight: &'a dyn Sight,
}

/// Labels, flow and occlusion of a camera's view, from what is seen and what would be seen without hair.
///
/// # Errors
/// If the moments differ in topology, hits are of another size than the camera, name what is not there or contradict each
/// other, a strand has no kind, or the work is stopped.
pub fn face_view(
    frames: &Frames,
    camera: &Camera,
    seen: HitPlane,
    bare: HitPlane,
    monitor: &dyn Monitor,
) -> Result<FaceView, GroundTruthError> {
    let fault = |text: String| GroundTruthError::Inconsistent(text);
    check_moments(&frames.now, &frames.reference)?;
    let (kinds, strands) = (frames.kinds.len(), frames.now.strands.len());
    if kinds != strands {
        return Err(fault(format!("{strands} strands have {kinds} kinds; each strand needs one")));
    }
    if let Some(i) = frames.kinds.iter().position(|&k| k > u8::MAX - LABEL_HAIR) {
        let (k, most) = (frames.kinds[i], u8::MAX - LABEL_HAIR);
        return Err(fault(format!("strand {i} is of kind {k}; labels have room for {most}")));
    }
    let moments = (&frames.now, &frames.reference);
    let flow = flow_but(camera, &seen, moments, frames.sight, monitor, |_| None)?;
    // What is not hair is the same with and without hair, and what nothing hides is not hidden by less.
    let known = |i: usize| match (seen.hits.data[i], flow.state.data[i]) {
        (FirstHit::Fibre { .. }, _) | (_, FlowState::Occluded) => None,
        (_, state) => Some((flow.flow_px.data[i], state)),
    };
    let bare_flow = flow_but(camera, &bare, moments, frames.bare_sight, monitor, known)?;
    let labels = seen.hits.map(|hit| match *hit {
        FirstHit::Nothing => LABEL_NOTHING,
        FirstHit::Mesh { surface: 0, .. } => LABEL_SKIN,
        FirstHit::Mesh { .. } => LABEL_OTHER,
        FirstHit::Fibre { strand, .. } => LABEL_HAIR + frames.kinds[strand as usize],
    });
    let view = FaceView { seen, bare, labels, flow, bare_flow };
    view.validate().map_err(|e| fault(format!("camera {}: {e}", camera.name)))?;
    Ok(view)
}

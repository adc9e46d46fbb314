//! Ground truth from geometry, never from pixels: depth, orientation, masks and visibility of every fibre.
//!
//! The only input besides the geometry is each camera's identity buffer: which fibre each sub-pixel ray met
//! first. Everything here is a reduction of those hits, so it can be checked by hand on a few rays. [`truth`] takes the
//! buffers of all cameras at once, [`Sightings`] one after the other. [`face`] has what faces with hair need besides:
//! flow, the skin under hair, follicles, a field of distances.

mod check;
pub mod face;
mod tensor;
mod view;
mod visibility;

use strandbench_types::{Cancelled, Rig, SampleHits, StrandError, StrandSet, TriMesh, Truth};

pub use check::{MAX_CAMERAS, MAX_STRAND_SAMPLES};
pub use visibility::Sightings;

/// Why no truth could be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum GroundTruthError {
    /// The identity buffers do not fit the rig or the strands.
    #[error("{0}")]
    Inconsistent(String),
    /// A strand is not usable.
    #[error("the scene's strands cannot be used: {0}")]
    Strands(#[from] StrandError),
    /// Stopped from outside.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// A hit contradicts the geometry that it claims to lie on.
    #[error(
        "camera {camera}, pixel ({x}, {y}): a hit on strand {strand}, segment {segment} {fault}; render the \
         identity buffers again from these strands and this rig"
    )]
    Hit {
        /// Camera index in the rig.
        camera: usize,
        /// Pixel column.
        x: usize,
        /// Pixel row.
        y: usize,
        /// Strand index that the hit names.
        strand: u32,
        /// Segment index that the hit names.
        segment: u32,
        /// What is wrong with it.
        fault: String,
    },
}

/// Truth of one frame from the strands and each camera's identity buffer (indexed `[camera]`).
///
/// With n rays through a pixel, the depth at which coverage reaches a share q is an order statistic: the
/// ceil(q n)-th smallest depth among the hits, or nothing if there are fewer hits. No interpolation takes
/// place, so every depth is the depth of some hit, and `mask` is true exactly where `depth_50` exists.
///
/// The tangent at a hit is the direction of its segment. In the image it is projected through the
/// derivative of the camera at the hit, and averaged over the pixel's hits as a line (doubled angle); in
/// space the mean is the principal axis of the hits' structure tensor, its sign arbitrary (the component of
/// largest magnitude is positive). Segments shorter than 1e-6 mm have no direction and are left out of it.
///
/// A strand sample is seen by a camera if its stretch covers at least 0.05 px there: the sum over the hits
/// on the stretch of one over the rays of the hit's pixel.
///
/// # Errors
/// If the buffers' number or size differs from the rig's, a hit names a strand or segment that is not there
/// or lies elsewhere than it, there are no strands, or there is more hair than memory is reserved for.
pub fn truth(
    rig: &Rig,
    strands: &StrandSet,
    head: Option<&TriMesh>,
    hits: &[SampleHits],
) -> Result<Truth, GroundTruthError> {
    check::scene(rig, strands, head)?;
    check::buffers(rig, hits)?;
    let mut sightings = Sightings::new(rig, strands)?;
    let views = hits.iter().enumerate().map(|(c, h)| sightings.add(c, h)).collect::<Result<_, _>>()?;
    Ok(Truth {
        rig: rig.clone(),
        views,
        strands: strands.clone(),
        visibility: sightings.finish(),
        head: head.cloned(),
    })
}

#[cfg(test)]
mod tests;

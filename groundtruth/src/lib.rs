//! Ground truth from geometry: depth, orientation, masks and visibility of every fibre.

use strandbench_types::{Rig, SampleHits, StrandSet, TriMesh, Truth};

/// Why no truth could be made.
#[derive(Debug, thiserror::Error)]
pub enum GroundTruthError {
    /// The identity buffers do not fit the rig or the strands.
    #[error("{0}")]
    Inconsistent(String),
}

/// Truth of one frame from the strands and each camera's identity buffer (indexed [camera]).
///
/// # Errors
/// If the buffers' number or size differs from the rig's, or a hit names a strand or segment that is not there.
pub fn truth(
    _rig: &Rig,
    _strands: &StrandSet,
    _head: Option<&TriMesh>,
    _hits: &[SampleHits],
) -> Result<Truth, GroundTruthError> {
    Err(GroundTruthError::Inconsistent("not built yet".into()))
}

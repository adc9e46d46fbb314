//! One depth for all hair: what a method has to beat that looks at no image.

use crate::account::Clock;
use crate::{BaselineError, Reconstruction};
use glam::{DMat3, DVec3};
use serde::{Deserialize, Serialize};
use strandbench_types::{DepthMap, Estimate, Frame, Monitor, Rig};

/// The constant depth has no number of its own.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ConstantDepth {}

/// Least of the eigenvalues of the optical axes' normal equations, a camera: below, the axes are as good as parallel
/// (0.6 degrees off each other).
const LEAST_CROSSING: f64 = 1e-4;

/// Depth of the point that is nearest to all optical axes, where the rig was aimed at, mm; the middle of the working
/// volume where the axes are parallel or cross outside of it. Nothing else is known without an image.
pub(crate) fn target_depth_mm(rig: &Rig) -> f64 {
    let middle = 0.5 * (rig.near_mm + rig.far_mm);
    let (mut matrix, mut rhs) = (DMat3::ZERO, DVec3::ZERO);
    for c in &rig.cameras {
        let d = c.ray_direction(c.principal_px).normalize();
        // Projection on the plane that the axis is normal to.
        let across = DMat3::IDENTITY - DMat3::from_cols(d * d.x, d * d.y, d * d.z);
        matrix += across;
        rhs += across * c.centre_mm();
    }
    // The determinant is at most the least eigenvalue times the square of the number of cameras.
    let n = rig.cameras.len() as f64;
    if matrix.determinant() < LEAST_CROSSING * n.powi(3) {
        return middle;
    }
    let z = rig.cameras[0].to_camera(matrix.inverse() * rhs).z;
    if z > rig.near_mm && z < rig.far_mm { z } else { middle }
}

pub(crate) fn reconstruct(
    rig: &Rig,
    frame: &Frame,
    monitor: &dyn Monitor,
) -> Result<Reconstruction, BaselineError> {
    let mut clock = Clock::new(monitor);
    let mask = &frame.masks[0];
    let z = target_depth_mm(rig);
    let depth = clock.stage("constant", || {
        Ok(DepthMap::from_raw(mask.map(|&hair| if hair { z as f32 } else { f32::NAN })))
    })?;
    clock.note(format!("depth {z:.1} mm"));
    let estimate = Estimate { depth: Some(depth), ..Estimate::default() };
    Ok(Reconstruction { estimate, account: clock.account() })
}

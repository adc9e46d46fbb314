//! Distance to the nearest hair on a grid.

use super::HairIndex;
use crate::GroundTruthError;
use glam::DVec3;
use rayon::prelude::*;
use strandbench_types::{HairField, Monitor};

/// Most voxels of a field: 1 GiB of distances and strands.
pub const MAX_VOXELS: usize = 1 << 27;

/// Distance from the centre of every voxel to the nearest axis, exact, in the box around the axes widened by `margin_mm`.
/// The grid's planes lie at multiples of `voxel_mm`, so that fields of different frames share their voxels.
///
/// # Errors
/// If voxel or margin is not positive (the margin may be 0), there would be more than [`MAX_VOXELS`], or the work is
/// stopped.
pub fn hair_field(
    index: &HairIndex,
    voxel_mm: f32,
    margin_mm: f32,
    monitor: &dyn Monitor,
) -> Result<HairField, GroundTruthError> {
    let fault = |text: String| Err(GroundTruthError::Inconsistent(text));
    if !(voxel_mm > 0.0 && voxel_mm.is_finite() && margin_mm >= 0.0 && margin_mm.is_finite()) {
        return fault(format!(
            "voxels of {voxel_mm} mm with a margin of {margin_mm} mm; give positive lengths"
        ));
    }
    let (low, high) = index.bounds();
    let (voxel, margin) = (f64::from(voxel_mm), f64::from(margin_mm));
    let first = ((low - margin) / voxel).floor();
    let last = ((high + margin) / voxel).ceil();
    let count = last - first + 1.0;
    let voxels = count.x * count.y * count.z;
    if voxels > MAX_VOXELS as f64 {
        return fault(format!(
            "voxels of {voxel_mm} mm make a field of {:.0} x {:.0} x {:.0}, more than {MAX_VOXELS} voxels; take larger \
             ones",
            count.x, count.y, count.z
        ));
    }
    let size = [count.x as usize, count.y as usize, count.z as usize];
    let [nx, ny, nz] = size;
    let origin_mm = (first * voxel).as_vec3();
    let mut distance_mm = vec![0.0f32; nx * ny * nz];
    let mut strand = vec![0u32; nx * ny * nz];
    monitor.begin("distance to hair", nx as u64);
    distance_mm.par_chunks_mut(ny * nz).zip(strand.par_chunks_mut(ny * nz)).enumerate().try_for_each(
        |(x, (distances, strands))| {
            monitor.check()?;
            for y in 0..ny {
                // The next centre is a voxel farther from what is nearest here, at most: exact, and a narrow search.
                let mut reach = f64::INFINITY;
                for z in 0..nz {
                    let p = origin_mm.as_dvec3() + DVec3::new(x as f64, y as f64, z as f64) * voxel;
                    let (d, s) = index.nearest_within(p, reach).expect("the last nearest is within reach");
                    distances[y * nz + z] = d as f32;
                    strands[y * nz + z] = s;
                    reach = (d + voxel) * (1.0 + 1e-9);
                }
            }
            monitor.advance(1);
            Ok::<(), GroundTruthError>(())
        },
    )?;
    Ok(HairField { origin_mm, voxel_mm, size, distance_mm, strand })
}

//! The scorer's own tests, on a small scene whose truth is written down rather than rendered.
use glam::Vec3;
use strandbench_types::{DepthMap, Plane, ViewTruth};

/// A view with this mask, flat hair at 500 mm and vertical fibres.
pub(crate) fn view_with_mask(w: usize, h: usize, hair: impl Fn(usize, usize) -> bool) -> ViewTruth {
    let pick = |yes: f32, no: f32| {
        let data = (0..w * h).map(|i| if hair(i % w, i / w) { yes } else { no }).collect();
        Plane::from_vec(w, h, data)
    };
    ViewTruth {
        depth_first: DepthMap::from_raw(pick(498.0, f32::NAN)),
        depth_05: DepthMap::from_raw(pick(499.0, f32::NAN)),
        depth_50: DepthMap::from_raw(pick(500.0, f32::NAN)),
        coverage: pick(1.0, 0.0),
        mask: pick(1.0, 0.0).map(|&c| c > 0.5),
        orientation_2d: pick(std::f32::consts::FRAC_PI_2, f32::NAN),
        orientation_agreement: pick(1.0, 0.0),
        orientation_3d: pick(1.0, 0.0).map(|&c| Vec3::Y * c),
    }
}

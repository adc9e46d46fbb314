//! Truth as pictures.

use strandbench_types::{
    DepthMap, FaceView, FirstHit, FlowMap, FlowState, LABEL_HAIR, LABEL_OTHER, LABEL_SKIN, Plane,
};

pub type Picture = Plane<[u8; 3]>;

fn hue(turn: f32, saturation: f32, value: f32) -> [u8; 3] {
    [5.0, 3.0, 1.0].map(|n: f32| {
        let k = (n + turn * 6.0).rem_euclid(6.0);
        ((value - value * saturation * k.min(4.0 - k).clamp(0.0, 1.0)) * 255.0) as u8
    })
}

/// Direction as colour (right is red), strength as saturation up to `most_px`.
pub fn flow(flow: &FlowMap, most_px: f32) -> Picture {
    flow.flow_px.map(|[u, v]| match u.is_nan() {
        true => [0; 3],
        false => hue(v.atan2(*u) / std::f32::consts::TAU, (u.hypot(*v) / most_px).min(1.0), 1.0),
    })
}

/// Seen green, hidden red, outside blue.
pub fn state(flow: &FlowMap) -> Picture {
    flow.state.map(|s| match s {
        FlowState::Absent => [0; 3],
        FlowState::Outside => [60, 90, 255],
        FlowState::Occluded => [230, 40, 40],
        FlowState::Seen => [40, 150, 70],
    })
}

/// Skin beige, eyes and teeth white, hair by kind.
pub fn labels(view: &FaceView) -> Picture {
    view.labels.map(|&l| match l {
        LABEL_SKIN => [200, 160, 130],
        LABEL_OTHER => [240; 3],
        l if l >= LABEL_HAIR => {
            [[90, 50, 20], [200, 40, 160], [20, 70, 200]][usize::from(l - LABEL_HAIR) % 3]
        }
        _ => [0; 3],
    })
}

/// Each strand and each triangle with a colour of its own.
pub fn identity(hits: &Plane<FirstHit>) -> Picture {
    let mix = |i: u32| (i.wrapping_mul(0x9E37_79B1) >> 8) as f32 / 16_777_216.0;
    hits.map(|h| match *h {
        FirstHit::Nothing => [0; 3],
        FirstHit::Fibre { strand, .. } => hue(mix(strand), 0.9, 1.0),
        FirstHit::Mesh { triangle, .. } => hue(mix(triangle), 0.25, 0.6),
    })
}

/// Near white, far black.
pub fn depth(map: &DepthMap) -> Picture {
    let known = || map.raw().data.iter().filter(|z| !z.is_nan());
    let (near, far) = known().fold((f32::MAX, f32::MIN), |(n, f), &z| (n.min(z), f.max(z)));
    map.raw().map(|&z| {
        [if z.is_nan() { 0 } else { (255.0 - 215.0 * (z - near) / (far - near).max(1e-3)) as u8 }; 3]
    })
}

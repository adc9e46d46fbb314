//! Where on the mean neutral face its parts are, mm. Both halves are alike.

use crate::groom::ramp;
use glam::{Vec2, Vec3};

/// The line between the lips, and half of the mouth's breadth.
const MOUTH_Y: f32 = -89.0;
const MOUTH_HALF: f32 = 26.0;
/// Height of the upper lip at its bows, and of the lower.
const UPPER: f32 = 11.2;
const LOWER: f32 = 12.3;
/// What lies behind this is not the face's front.
const BACK_Z: f32 = 40.0;

/// How much a place belongs to the lips (or to the mouth's inside), 0..1.
pub(in crate::face) fn lips(p: Vec3) -> f32 {
    let across = p.x.abs();
    if p.z < BACK_Z || across > MOUTH_HALF || !(-110.0..=-70.0).contains(&p.y) {
        return 0.0;
    }
    let t = across / MOUTH_HALF;
    let arch = (1.0 - t * t).max(0.0).sqrt();
    // The bows on both sides of the philtrum.
    let dip = 1.6 * bell(across / 3.5);
    let top = MOUTH_Y + UPPER * (1.0 - t).max(0.0).sqrt() * (1.0 + 0.25 * t) - dip;
    let bottom = MOUTH_Y - LOWER * arch * (1.0 - 0.25 * t);
    ramp(top - p.y, -0.4, 1.6) * ramp(p.y - bottom, -0.4, 1.8)
}

/// How much blood shows, 0..1: cheeks, nose, chin.
pub(super) fn flush(p: Vec3) -> f32 {
    if p.z < BACK_Z {
        return 0.0;
    }
    let at = Vec2::new(p.x.abs(), p.y);
    let spot = |x: f32, y: f32, wide: f32, high: f32| bell_2((at - Vec2::new(x, y)) / Vec2::new(wide, high));
    (0.9 * spot(40.0, -48.0, 17.0, 15.0) + spot(0.0, -56.0, 13.0, 9.0) + 0.5 * spot(0.0, -122.0, 14.0, 9.0))
        .min(1.0)
}

/// How many of the freckles that there may be are there, 0..1: most across nose and cheeks.
pub(super) fn freckled(p: Vec3) -> f32 {
    if p.z < BACK_Z {
        return 0.05;
    }
    let at = Vec2::new(p.x.abs(), p.y);
    let spot = bell_2((at - Vec2::new(24.0, -42.0)) / Vec2::new(26.0, 16.0));
    0.12 + 0.88 * spot
}

/// Thin, darker skin around the eyes, 0..1.
pub(super) fn orbit(p: Vec3) -> f32 {
    if p.z < BACK_Z {
        return 0.0;
    }
    let at = Vec2::new(p.x.abs(), p.y);
    bell_2((at - Vec2::new(31.0, -20.0)) / Vec2::new(15.0, 11.0))
}

/// 1 / (1 + r²)²: a bell without an exponential, 1/4 at r = 1.
fn bell(r: f32) -> f32 {
    let q = 1.0 + r * r;
    1.0 / (q * q)
}

fn bell_2(r: Vec2) -> f32 {
    let q = 1.0 + r.length_squared();
    1.0 / (q * q)
}

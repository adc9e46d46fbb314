//! Where hair of each kind grows on the mean neutral face, and which way. Both halves are alike.

use super::HairKind;
use crate::face::texture::lips;
use crate::groom::{ramp, space_noise};
use glam::Vec3;

/// Stream of what makes the regions' borders irregular.
const BORDER: u64 = 0xB02D;

/// Value at `x` of a line through points of ascending x; the ends go on level.
fn line(points: &[(f32, f32)], x: f32) -> f32 {
    let i = points.partition_point(|p| p.0 <= x);
    match (i.checked_sub(1).map(|k| points[k]), points.get(i)) {
        (None, Some(b)) => b.1,
        (Some(a), None) => a.1,
        (Some(a), Some(b)) => a.1 + (b.1 - a.1) * (x - a.0) / (b.0 - a.0),
        (None, None) => 0.0,
    }
}

/// How dense hair of a kind stands at a place of the mean face, 0..1.
pub(super) fn density(kind: HairKind, p: Vec3) -> f32 {
    let wobble = 1.6 * space_noise(BORDER, p / 5.0) + 0.8 * space_noise(BORDER ^ 1, p / 1.7);
    let (across, y) = (p.x.abs(), p.y + wobble);
    if p.z < 2.0 {
        return 0.0;
    }
    let mouth = {
        let (u, v) = (across / 30.0, (y + 90.5) / 16.5);
        ramp(u * u + v * v, 1.0, 0.25)
    };
    let front = ramp(p.z, 78.0, 8.0);
    match kind {
        HairKind::Beard => {
            // From the sideburn down the cheek to the corner of the mouth, over the jaw to the neck.
            const CHEEK: [(f32, f32); 6] =
                [(22.0, -2.0), (32.0, -14.0), (44.0, -50.0), (60.0, -66.0), (84.0, -76.0), (100.0, -84.0)];
            let top = line(&CHEEK, p.z);
            let neck = -160.0 + 40.0 * (across / 56.0) * (across / 56.0);
            let ear = line(&[(-112.0, 6.0), (-74.0, 24.0)], y);
            let edge = line(&[(30.0, 2.5), (90.0, 8.0)], p.z);
            ramp(top - y, 0.0, edge) * ramp(y - neck, 0.0, 12.0) * ramp(p.z - ear, 0.0, 4.0) * mouth
        }
        HairKind::Moustache => {
            let top = -65.5 - 0.015 * across * across;
            let bottom = line(&[(23.0, -84.0), (31.0, -101.0)], across);
            // Thinner in the philtrum.
            let middle = 0.45 + 0.55 * ramp(across, 1.0, 4.0);
            ramp(top - y, 0.0, 2.5)
                * ramp(37.0 - across, 0.0, 4.0)
                * ramp(y - bottom, 0.0, 2.0)
                * middle
                * front
                * (1.0 - ramp(lips(p), 0.0, 0.4))
        }
        HairKind::Goatee => {
            let chin = {
                let (u, v) = (across / 30.0, (y + 126.0) / 25.0);
                ramp(1.0 - (u * u + v * v), 0.0, 0.3)
            };
            let patch = ramp(7.0 - across, 0.0, 3.0) * ramp(y + 112.0, 0.0, 3.0) * ramp(-104.0 - y, 0.0, 1.5);
            let side = ramp(across, 28.0, 2.5)
                * ramp(37.0 - across, 0.0, 4.0)
                * ramp(y + 118.0, 0.0, 6.0)
                * ramp(-94.0 - y, 0.0, 4.0);
            let below = ramp(p.z, 62.0, 8.0);
            (chin * mouth).max(patch).max(side * mouth) * below * (1.0 - ramp(lips(p), 0.0, 0.4))
        }
        HairKind::Brow => {
            let middle = line(&BROW, across);
            let half = line(&[(11.0, 2.2), (18.0, 4.2), (36.0, 3.4), (52.0, 1.8), (58.0, 0.8)], across);
            let off = (y - middle).abs() / half;
            ramp(1.0 - off, 0.0, 0.5)
                * ramp(across, 10.0, 4.0)
                * ramp(58.0 - across, 0.0, 5.0)
                * front.max(ramp(p.z, 55.0, 8.0))
        }
        HairKind::Lash => 0.0,
    }
}

/// The middle of the brow: distance from the face's middle, height.
const BROW: [(f32, f32); 6] =
    [(10.0, -4.0), (18.0, -1.5), (30.0, 2.5), (40.0, 4.0), (48.0, 1.5), (58.0, -5.0)];

/// Which way hair of a kind grows there, not yet in the skin's plane.
pub(super) fn direction(kind: HairKind, p: Vec3, normal: Vec3) -> Vec3 {
    let (side, across) = (if p.x < 0.0 { -1.0 } else { 1.0 }, p.x.abs());
    match kind {
        HairKind::Beard | HairKind::Goatee => {
            // Below the jaw hair grows forward; on the cheeks downward and a little back.
            let under = ramp(-normal.y, 0.45, 0.4);
            let back = 0.25 * ramp(80.0 - p.z, 0.0, 50.0);
            Vec3::new(0.1 * side, -1.0, -back).lerp(Vec3::new(-0.1 * side, -0.4, 1.0), under)
        }
        HairKind::Moustache => {
            let out = ramp(across, 0.0, 14.0);
            Vec3::new(side * (0.25 + 1.0 * out), -1.0 + 0.25 * out, 0.0)
        }
        HairKind::Brow => {
            let (inner, outer) = (1.0 - ramp(across, 13.0, 9.0), ramp(across, 36.0, 14.0));
            Vec3::new(side * (1.0 - 0.75 * inner), 0.35 + 0.8 * inner - 0.75 * outer, -0.35 * outer)
        }
        HairKind::Lash => normal,
    }
}

/// How much more of the hair is grey there: the chin first.
pub(super) fn greying(p: Vec3) -> f32 {
    let (u, v) = (p.x.abs() / 26.0, (p.y + 122.0) / 26.0);
    0.6 + 1.2 * ramp(1.0 - (u * u + v * v), 0.0, 0.8)
}

//! Noise and dots in space, fast and with the same bits on every machine.
//!
//! A cell's random bits are one finaliser over its whole coordinates and the pattern's key: a look-up asks some seventy
//! cells, and a keyed stream for each would take three times as long. Coordinates wrap after 2^21 cells.

use crate::groom::quintic;
use glam::Vec3;
use strandbench_rng::mix;

/// Standard deviation of [`noise`]'s value over space: of uniform numbers in -1..1, times the mean square of the
/// weights in each of three dimensions, ∫ q² + (1 - q)² over quintic q = 0.783_55.
const DEVIATION: f32 = 0.400_44;

#[inline(always)]
fn bits(key: u64, cell: [i32; 3]) -> u64 {
    let [x, y, z] = cell.map(|c| u64::from(c as u32 & 0x1f_ffff));
    mix(key ^ (x | y << 21 | z << 42))
}

/// 0..1 from 16 bits of a cell.
#[inline(always)]
fn part(bits: u64, which: u32) -> f32 {
    (bits >> (16 * which) & 0xffff) as f32 * (1.0 / 65_536.0)
}

#[inline(always)]
fn whole(p: Vec3) -> [i32; 3] {
    [p.x as i32, p.y as i32, p.z as i32]
}

/// Smooth noise with cells of size 1, mean 0 and variance 1 over space, within ±2.5; and its gradient.
#[inline]
pub(super) fn noise(key: u64, p: Vec3) -> (f32, Vec3) {
    let low = p.floor();
    let f = p - low;
    let [x, y, z] = whole(low);
    let (u, v, w) = (quintic(f.x), quintic(f.y), quintic(f.z));
    let rise = |t: f32| 30.0 * t * t * (t * (t - 2.0) + 1.0);
    let (du, dv, dw) = (rise(f.x), rise(f.y), rise(f.z));
    let c: [f32; 8] = std::array::from_fn(|k| {
        let at = [x + (k & 1) as i32, y + (k >> 1 & 1) as i32, z + (k >> 2) as i32];
        part(bits(key, at), 0) * 2.0 - 1.0
    });
    let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
    let along: [f32; 4] = std::array::from_fn(|k| mix(c[2 * k], c[2 * k + 1], u));
    let slope: [f32; 4] = std::array::from_fn(|k| c[2 * k + 1] - c[2 * k]);
    let (near, far) = (mix(along[0], along[1], v), mix(along[2], along[3], v));
    let dx = mix(mix(slope[0], slope[1], v), mix(slope[2], slope[3], v), w) * du;
    let dy = mix(along[1] - along[0], along[3] - along[2], w) * dv;
    let dz = (far - near) * dw;
    (mix(near, far, w) / DEVIATION, Vec3::new(dx, dy, dz) / DEVIATION)
}

/// How deep a place is in a dot: 1 at its middle, 0 at its edge; the gradient; and bits of the dot.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Dot {
    pub depth: f32,
    pub gradient: Vec3,
    pub bits: u64,
}

/// The deepest of the balls around: each cell of size 1 holds, with probability `share`, one ball of radius
/// `small` to 1 times `radius` (at most 0.25), its middle in the cell's inner half, so that no ball leaves its cell.
#[inline]
pub(super) fn dots(key: u64, p: Vec3, share: f32, small: f32, radius: f32) -> Dot {
    let low = p.floor();
    let bits = bits(key, whole(low));
    if share <= 0.0 || part(bits, 3) >= share {
        return Dot::default();
    }
    let middle = Vec3::new(part(bits, 0), part(bits, 1), part(bits, 2)) * 0.5 + 0.25;
    let to = p - low - middle;
    // Other numbers of the same cell.
    let bits = mix(bits);
    let r = radius * (small + (1.0 - small) * part(bits, 0));
    let q = 1.0 - to.length_squared() / (r * r);
    if q <= 0.0 {
        return Dot::default();
    }
    Dot { depth: q * q, gradient: to * (-4.0 * q / (r * r)), bits }
}

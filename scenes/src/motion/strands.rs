//! From the guides to all strands.
//!
//! A segment of a strand turns as the guides that it follows turn at its arc length, and the strand is put together
//! from its turned segments: every length is kept by construction, strands that gather in a lock stay gathered,
//! and what lies beside a bending lock slides along it as fibres do. A last pass from root to tip keeps points
//! out of the skin, turning segments, never stretching them.

use super::body::{Body, HeadTurn, KNOWN_MM};
use super::guides::{FOLLOWED, Followed, Guide};
use super::turns::Turn;
use glam::Vec3;
use rayon::prelude::*;
use strandbench_types::StrandSet;

/// Distance from the skin that moved strands keep, mm, or what they kept when groomed if that is less.
const CLEARANCE_MM: f32 = 0.3;

/// How much faster than a step the distance to the skin can change in the bent neck.
const NECK_STRETCH: f32 = 1.6;

/// Guides' turns of one frame.
pub(super) struct Turned {
    /// All guides' turns ([`super::turns::unwound`]).
    pub turns: Vec<Turn>,
    /// Where each guide's begin; one more than there are guides.
    pub starts: Vec<u32>,
}

#[inline]
fn rotate(q: &Turn, v: Vec3) -> Vec3 {
    let u = Vec3::new(q[0], q[1], q[2]);
    let t = u.cross(v) * 2.0;
    v + t * q[3] + u.cross(t)
}

/// The strands of a frame: those of `rest` with other points.
pub(super) fn moved(
    rest: &StrandSet,
    followed: &[Followed],
    guides: &[Guide],
    turned: &Turned,
    body: &Body,
    head: &HeadTurn,
) -> StrandSet {
    let mut points = vec![Vec3::ZERO; rest.points.len()];
    let mut slices = Vec::with_capacity(rest.len());
    let mut left = points.as_mut_slice();
    for i in 0..rest.len() {
        let (own, others) = left.split_at_mut(rest.range(i).len());
        slices.push(own);
        left = others;
    }
    slices.into_par_iter().enumerate().with_min_len(64).for_each(|(i, out)| {
        strand(rest.strand(i), &followed[i], guides, turned, body, head, out);
    });
    StrandSet { points, offsets: rest.offsets.clone(), radii_mm: rest.radii_mm.clone() }
}

fn strand(
    rest: &[Vec3],
    followed: &Followed,
    guides: &[Guide],
    turned: &Turned,
    body: &Body,
    head: &HeadTurn,
    out: &mut [Vec3],
) {
    let mut leads: [(&[Turn], f32, f32); FOLLOWED] = [(&[], 0.0, 0.0); FOLLOWED];
    let mut n = 0;
    for (&g, &weight) in followed.guide.iter().zip(&followed.weight) {
        if weight > 0.0 {
            let (a, b) = (turned.starts[g as usize] as usize, turned.starts[g as usize + 1] as usize);
            leads[n] = (&turned.turns[a..b], 1.0 / guides[g as usize].step_mm, weight);
            n += 1;
        }
    }
    let mut p = body.carry_with_head(head, rest[0].as_dvec3()).as_vec3();
    out[0] = p;
    let mut s = 0.0f32;
    let mut free = 0.0f32;
    for j in 1..rest.len() {
        let segment = rest[j] - rest[j - 1];
        let length = segment.length();
        let turn = blended(&leads[..n], s + 0.5 * length);
        s += length;
        // What has not moved keeps its bits.
        let still = turn == [0.0, 0.0, 0.0, 1.0] && p == rest[j - 1];
        let mut next = if still { rest[j] } else { p + rotate(&turn, segment) };
        free -= length * NECK_STRETCH;
        if free < KNOWN_MM {
            (next, free) = clear(body, head, rest[j], p, next, length);
        }
        out[j] = next;
        p = next;
    }
}

/// The turn at an arc length: linear between the middles of segments and between guides, then of unit length.
#[inline]
fn blended(leads: &[(&[Turn], f32, f32)], s: f32) -> Turn {
    let mut sum = [0.0f32; 4];
    for (turns, per_mm, weight) in leads {
        let u = s * per_mm;
        let last = turns.len() - 1;
        let (i, t) = if u < 0.5 {
            (0, 2.0 * u)
        } else {
            let i = (u - 0.5) as usize;
            if i + 1 >= last { (last - 1, 1.0) } else { (i + 1, u - 0.5 - i as f32) }
        };
        let (a, b) = (&turns[i], &turns[i + 1]);
        let q: Turn = std::array::from_fn(|c| a[c] + (b[c] - a[c]) * t);
        let same = q.iter().zip(&sum).map(|(x, y)| x * y).sum::<f32>() >= 0.0;
        let w = if same { *weight } else { -*weight };
        for c in 0..4 {
            sum[c] += q[c] * w;
        }
    }
    let square: f32 = sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2] + sum[3] * sum[3];
    let scale = 1.0 / square.sqrt().max(1e-20);
    sum.map(|v| v * scale)
}

/// The point, or where the segment that ends there must turn to for it to be out of the skin; and a distance
/// within which there is no skin.
fn clear(body: &Body, head: &HeadTurn, rest: Vec3, from: Vec3, to: Vec3, length: f32) -> (Vec3, f32) {
    let (gap, error) = body.rough_gap(head, to);
    if gap >= KNOWN_MM || gap - error >= CLEARANCE_MM {
        return (to, gap);
    }
    // Where the field says what it said of the groomed point, the strand lies as it was groomed. Elsewhere the
    // mesh is asked.
    if (gap - body.rest_gap(rest).0).abs() < 0.01 {
        return (to, 0.0);
    }
    let exact = |p: Vec3| body.exact_gap(head, p);
    let (gap, _) = exact(to);
    if gap >= CLEARANCE_MM {
        return (to, 0.0);
    }
    let wanted = CLEARANCE_MM.min(body.exact_rest_gap(rest).0) - 1e-3;
    let (mut p, mut best) = (to, (gap, to));
    for _ in 0..5 {
        let (gap, normal) = exact(p);
        if gap > best.0 {
            best = (gap, p);
        }
        if gap >= wanted {
            return (p, 0.0);
        }
        let out = p + normal * (wanted + 2e-3 - gap);
        p = from + (out - from).normalize_or(normal) * length;
    }
    // Through an ear the way out that is nearest is no way out for the segment: around it, away from the head
    // first.
    let (_, away) = body.support(head, to);
    let ahead = (to - from) / length;
    let side = (away - ahead * away.dot(ahead)).normalize_or(ahead.any_orthonormal_vector());
    let across = ahead.cross(side);
    const HALF: f32 = std::f32::consts::FRAC_1_SQRT_2;
    for [forward, sideways] in [[0.9, 0.4], [0.6, 0.8], [0.1, 1.0], [-0.5, 0.8]] {
        for [u, v] in [
            [1.0, 0.0],
            [HALF, HALF],
            [HALF, -HALF],
            [0.0, 1.0],
            [0.0, -1.0],
            [-HALF, HALF],
            [-HALF, -HALF],
            [-1.0, 0.0],
        ] {
            let p = from + (ahead * forward + (side * u + across * v) * sideways).normalize() * length;
            let (gap, _) = exact(p);
            if gap > best.0 {
                best = (gap, p);
            }
            if gap >= wanted {
                return (p, 0.0);
            }
        }
    }
    (best.1, 0.0)
}

//! Rotations of a guide's segments from their groomed pose, eight bytes each: what a frame is kept as.

use glam::DQuat;

/// Steps from 0 to the largest possible of the three smaller components, 1/√2.
const STEPS: f64 = ((1u64 << 19) - 1) as f64;
const FIELD: u64 = (1 << 20) - 1;

/// A rotation as f32 quaternion (x, y, z, w), the form that strands are turned with.
pub(super) type Turn = [f32; 4];

/// The three smaller components in 20 bits each and which is the largest: an angle to 3e-6 rad; no rotation is
/// kept exactly.
pub(super) fn encode(q: DQuat) -> u64 {
    let v = q.to_array();
    let largest = (0..4).fold(3, |best, k| if v[k].abs() > v[best].abs() { k } else { best });
    let sign = if v[largest] < 0.0 { -1.0 } else { 1.0 };
    let mut code = largest as u64;
    for (_, x) in v.iter().enumerate().filter(|(k, _)| *k != largest) {
        let steps = (sign * x * std::f64::consts::SQRT_2 * STEPS).round().clamp(-STEPS, STEPS);
        code = code << 20 | (steps + STEPS) as u64;
    }
    code
}

/// The rotation of a code; codes that no rotation has (a sum of squares above one) are `None`.
pub(super) fn decode(code: u64) -> Option<DQuat> {
    let largest = (code >> 60) as usize;
    let field = |k: u32| {
        let steps = (code >> (20 * k) & FIELD) as f64;
        (steps <= 2.0 * STEPS).then(|| (steps - STEPS) / (STEPS * std::f64::consts::SQRT_2))
    };
    let small = [field(2)?, field(1)?, field(0)?];
    let square = 1.0 - small.iter().map(|x| x * x).sum::<f64>();
    // The largest component is at least a half, less the rounding of the others.
    if largest > 3 || square < 0.24 {
        return None;
    }
    let mut v = [0.0; 4];
    let mut rest = small.iter();
    for (k, x) in v.iter_mut().enumerate() {
        *x = if k == largest { square.sqrt() } else { *rest.next().expect("three others") };
    }
    Some(DQuat::from_array(v))
}

/// Turns of a guide for its strands: the root's, then one a segment, each of the sign nearest to the one before.
pub(super) fn unwound(root: DQuat, segments: impl Iterator<Item = DQuat>, out: &mut Vec<Turn>) {
    let mut last = if root.w < 0.0 { -root } else { root };
    out.push(last.to_array().map(|v| v as f32));
    for q in segments {
        last = if q.dot(last) < 0.0 { -q } else { q };
        out.push(last.to_array().map(|v| v as f32));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use strandbench_rng::Rng;

    #[test]
    fn rotations_come_back_and_none_is_exact() {
        let mut r = Rng::keyed(&[8]);
        for _ in 0..5000 {
            let v = [0; 4].map(|_| r.f64() * 2.0 - 1.0);
            let q = DQuat::from_array(v);
            if q.length() < 0.1 {
                continue;
            }
            let q = q.normalize();
            let back = decode(encode(q)).unwrap();
            // Half a step in each of three components, none larger than the fourth, moves that by up to three.
            let apart = (1.0 - q.dot(back).abs()).max(0.0).sqrt() * std::f64::consts::SQRT_2;
            assert!(apart < 12f64.sqrt() * 0.5 / (STEPS * std::f64::consts::SQRT_2), "{q} {back} {apart:e}");
            assert!((back.length() - 1.0).abs() < 1e-12);
        }
        for q in [DQuat::IDENTITY, -DQuat::IDENTITY] {
            assert_eq!(decode(encode(q)), Some(DQuat::IDENTITY));
        }
    }

    #[test]
    fn codes_of_no_rotation_are_refused() {
        assert_eq!(decode(u64::MAX), None);
        assert_eq!(decode(5 << 60), None);
        assert_eq!(decode(FIELD << 20), None);
        // Three components of 1/√2.
        let full = (2.0 * STEPS) as u64;
        assert_eq!(decode(full << 40 | full << 20 | full), None);
    }
}

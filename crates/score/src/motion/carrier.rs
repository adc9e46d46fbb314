//! The true motion at a point: the nearest visible true strand carries it, and the strands around turn it.

use crate::strands::samples::TrueStrands;
use glam::{DMat3, DMat4, DQuat, DVec3, DVec4, Vec3};

/// Strands whose segments tell how the surroundings turn.
const RING: usize = 8;

/// How far these may be, mm.
const RING_MM: f64 = 30.0;

/// How far the true strand that carries a point may be, mm.
pub(crate) const REACH_MM: f64 = 5.0;

/// Pull towards no turn at all, which decides where the surroundings leave a turn open (a single straight
/// strand): a share of their spread.
const STILL: f64 = 1e-6;

/// A material point of a true strand: the segment's first point, and the position on it (0 to 1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Material {
    pub point: u32,
    pub along: f64,
}

impl Material {
    /// Where it is, given the strands' points of a frame.
    pub fn at(self, points: &[Vec3]) -> DVec3 {
        let p = self.point as usize;
        points[p].as_dvec3().lerp(points[p + 1].as_dvec3(), self.along)
    }
}

/// What carries a point.
#[derive(Clone, Debug)]
pub(crate) struct Carrier {
    pub anchor: Material,
    /// First points of the segments around, the anchor's among them.
    ring: Vec<u32>,
    /// Where the anchor and the segments' ends were when the carrier was chosen.
    origin: DVec3,
    ends: Vec<DVec3>,
}

/// A place and an orientation.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pose {
    pub place: DVec3,
    pub turn: DMat3,
}

impl Carrier {
    /// The carrier of a point: its nearest true strand, if a camera sees it there and it is near.
    pub fn of(truth: &TrueStrands, p: DVec3, tangent: DVec3) -> Option<Carrier> {
        let hit = truth.full.nearest(p, tangent, REACH_MM, 0.0)?;
        if truth.cameras_at(hit.point, hit.along) == 0 {
            return None;
        }
        let anchor = Material { point: hit.point, along: hit.along };
        let points = &truth.truth.strands.points;
        let origin = anchor.at(points);
        let ring = truth.full.around(origin, RING_MM, RING, &truth.strand_of);
        let ends = ends(&ring, points);
        Some(Carrier { anchor, ring, origin, ends })
    }

    /// Where the carrier is in another frame, and how it has turned since it was chosen.
    pub fn pose(&self, points: &[Vec3]) -> Pose {
        Pose { place: self.anchor.at(points), turn: turn(&self.ends, &ends(&self.ring, points)) }
    }

    /// A point of another frame as the carrier sees it: its offset, in the orientation at the time of choice.
    pub fn local(&self, pose: &Pose, p: DVec3) -> DVec3 {
        pose.turn.transpose() * (p - pose.place)
    }

    /// The offset at the time of choice.
    pub fn offset(&self, p: DVec3) -> DVec3 {
        p - self.origin
    }

    /// Where the true motion brings a point.
    pub fn carried(&self, pose: &Pose, p: DVec3) -> DVec3 {
        pose.place + pose.turn * (p - self.origin)
    }
}

fn ends(ring: &[u32], points: &[Vec3]) -> Vec<DVec3> {
    ring.iter().flat_map(|&p| [points[p as usize].as_dvec3(), points[p as usize + 1].as_dvec3()]).collect()
}

/// The rotation that best brings `from` to `to`, up to a shift (Horn 1987: the eigenvector of the largest
/// eigenvalue of a symmetric 4 x 4 matrix).
fn turn(from: &[DVec3], to: &[DVec3]) -> DMat3 {
    let n = from.len().max(1) as f64;
    let (a, b) = (from.iter().sum::<DVec3>() / n, to.iter().sum::<DVec3>() / n);
    let mut m = DMat3::ZERO;
    let mut spread = 0.0;
    for (p, q) in from.iter().zip(to) {
        let (p, q) = (*p - a, *q - b);
        m += DMat3::from_cols(p * q.x, p * q.y, p * q.z);
        spread += p.length_squared();
    }
    if spread == 0.0 {
        return DMat3::IDENTITY;
    }
    m += DMat3::IDENTITY * (STILL * spread);
    // m.col(j)[i] = sum of p_i q_j.
    let s = |i: usize, j: usize| m.col(j)[i];
    let (xx, yy, zz) = (s(0, 0), s(1, 1), s(2, 2));
    let (x, y, z) = (s(1, 2) - s(2, 1), s(2, 0) - s(0, 2), s(0, 1) - s(1, 0));
    let (xy, xz, yz) = (s(0, 1) + s(1, 0), s(0, 2) + s(2, 0), s(1, 2) + s(2, 1));
    let mut k = DMat4::from_cols(
        DVec4::new(xx + yy + zz, x, y, z),
        DVec4::new(x, xx - yy - zz, xy, xz),
        DVec4::new(y, xy, yy - xx - zz, yz),
        DVec4::new(z, xz, yz, zz - xx - yy),
    );
    // Shifted so that all eigenvalues are positive; squaring then leaves the largest alone.
    let norm = k.to_cols_array().iter().map(|v| v * v).sum::<f64>().sqrt();
    for i in 0..4 {
        k.col_mut(i)[i] += norm;
    }
    for _ in 0..48 {
        let scale = k.to_cols_array().iter().fold(0.0, |a: f64, v| a.max(v.abs()));
        k *= 1.0 / scale;
        k = k * k;
    }
    let longest = (0..4)
        .map(|i| k.col(i))
        .fold(DVec4::ZERO, |a, b| if b.length_squared() > a.length_squared() { b } else { a });
    let q = longest.normalize();
    DMat3::from_quat(DQuat::from_xyzw(q.y, q.z, q.w, q.x))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(100))]
        #[test]
        fn a_turn_is_found(x in -1.0..1.0f64, y in -1.0..1.0f64, z in -1.0..1.0f64, angle in -3.0..3.0f64) {
            prop_assume!(DVec3::new(x, y, z).length() > 0.1);
            let r = DMat3::from_axis_angle(DVec3::new(x, y, z).normalize(), angle);
            let from: Vec<DVec3> = (0..9).map(|i| {
                let i = f64::from(i);
                DVec3::new((i * 1.7).sin(), (i * 2.9).cos() * 3.0, (i * 0.6).sin() * 2.0)
            }).collect();
            let to: Vec<DVec3> = from.iter().map(|p| r * *p + DVec3::new(5.0, -2.0, 9.0)).collect();
            let got = turn(&from, &to);
            let off = (got - r).to_cols_array().iter().fold(0.0, |m: f64, v| m.max(v.abs()));
            // The pull towards no turn moves the answer by its own share, times the cotangent of half the angle left.
            prop_assert!(off < 1e-4, "{off}");
        }
    }

    #[test]
    fn one_straight_strand_turns_as_little_as_it_can() {
        let from = [DVec3::ZERO, DVec3::X];
        assert!((turn(&from, &from) - DMat3::IDENTITY).to_cols_array().iter().all(|v| v.abs() < 1e-9));
        let got = turn(&from, &[DVec3::ZERO, DVec3::Y]);
        assert!(
            (got * DVec3::X - DVec3::Y).length() < 1e-5 && (got * DVec3::Z - DVec3::Z).length() < 1e-5,
            "{got}"
        );
        assert_eq!(turn(&[DVec3::ONE; 2], &[DVec3::ONE; 2]), DMat3::IDENTITY);
    }
}

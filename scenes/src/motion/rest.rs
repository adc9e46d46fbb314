//! The shape that hair would have without weight, so that it hangs as it was groomed.
//!
//! A groomed fibre is at rest under gravity. What holds it: the head and the hair beneath it push outward on the
//! segments that lie on a pile of hair, and bending moments carry the rest. The pushes are those, all non-negative,
//! that leave the least moments; the rest shape of each joint is then the groomed shape less what the moment
//! bends. The groomed pose so is an equilibrium to rounding, without a time in which the hair settles.

use super::rod::{Clamp, Rod};
use glam::{DQuat, DVec3};

/// Largest angle between the groomed and the rest shape of a joint, rad. Where a fibre as stiff as hair would
/// need more, it is made stiffer: such a fibre is held by those around it.
const MAX_PRELOAD: f64 = 0.5;

/// Largest sum of those angles from the root on, rad, as vectors: a fibre that its weight straightens turns to and fro.
/// Where it is more, the fibre is made stiffer along its whole length. A cantilever under its weight tips over to
/// one side (lateral-torsional buckling) at w L³ = 12.85 √(EI GJ), which makes the sum 1.8.
const MAX_TOTAL_PRELOAD: f64 = 1.8;

/// Standard gravity, mm/s².
pub(super) const GRAVITY: f64 = 9810.0;

/// A guide in its groomed pose.
pub(super) struct Pose<'a> {
    /// Ends of the segments, root first, mm.
    pub nodes: &'a [DVec3],
    /// Length of fibre that a segment stands for, mm.
    pub mass: f64,
    /// Bending stiffness over mass per length, mm⁴/s².
    pub bend: f64,
    /// Twisting stiffness over mass per length, mm⁴/s².
    pub twist: f64,
    /// Indexed by segment: outward direction of the pile that it lies on, times 0..1 by how much it does.
    pub pile: &'a [DVec3],
}

/// The rod, at rest as posed; the pile's pushes (mm/s²), indexed by segment; and how many times stiffer than hair
/// it had to be made.
pub(super) fn rod(pose: &Pose<'_>, clamp: &Clamp, gravity: DVec3) -> (Rod, Vec<f64>, f64) {
    let n = pose.nodes.len() - 1;
    let span: Vec<DVec3> = pose.nodes.windows(2).map(|w| w[1] - w[0]).collect();
    let length_mm: Vec<f64> = span.iter().map(|s| s.length()).collect();
    let x: Vec<DVec3> = pose.nodes.windows(2).map(|w| (w[0] + w[1]) * 0.5).collect();
    let mut q: Vec<DQuat> = Vec::with_capacity(n);
    for (k, s) in span.iter().enumerate() {
        let tangent = *s / length_mm[k];
        let before = q.last().copied().unwrap_or(clamp.rotation);
        // The least rotation of the frame before it.
        q.push((arc(before * DVec3::Z, tangent) * before).normalize());
    }
    let pushes = pile_pushes(pose, &x, gravity);
    let mut moment = vec![DVec3::ZERO; n];
    let (mut force, mut about) = (DVec3::ZERO, DVec3::ZERO);
    for k in (0..n).rev() {
        // Moments about the joint are those about the origin less joint × force.
        let f = (gravity + pose.pile[k] * pushes[k]) * pose.mass;
        force += f;
        about += x[k].cross(f);
        moment[k] = about - pose.nodes[k].cross(force);
    }
    let reach = |j: usize| {
        if j == 0 { 0.5 * length_mm[0] } else { 0.5 * (length_mm[j - 1] + length_mm[j]) }
    };
    let mut sum = DVec3::ZERO;
    let mut total = 0.0f64;
    for j in 0..n {
        sum += moment[j] * (reach(j) / pose.bend.min(pose.twist));
        total = total.max(sum.length());
    }
    let stiffer = (total / MAX_TOTAL_PRELOAD).max(1.0);
    let (mut rest, mut stiffness) = (Vec::with_capacity(n), Vec::with_capacity(n));
    for j in 0..n {
        let mut k = [pose.bend, pose.twist].map(|k| k * stiffer / reach(j));
        // The torque of a joint turned by an angle is k sin(angle).
        let weakest = k[0].min(k[1]) * libm::sin(MAX_PRELOAD);
        if moment[j].length() > weakest {
            k = k.map(|k| k * moment[j].length() / weakest);
        }
        let rested = unloaded(q[j], moment[j], k);
        let inner = if j == 0 { clamp.rotation } else { q[j - 1] };
        rest.push((inner.conjugate() * rested).normalize());
        stiffness.push(k);
    }
    let zero = vec![DVec3::ZERO; n];
    let rod = Rod { length_mm, mass: vec![pose.mass; n], rest, stiffness, x, q, v: zero.clone(), w: zero };
    (rod, pushes, stiffer)
}

/// Least rotation from one unit vector to another.
fn arc(from: DVec3, to: DVec3) -> DQuat {
    let w = 1.0 + from.dot(to);
    if w < 1e-9 {
        let c = from.any_orthonormal_vector();
        return DQuat::from_xyzw(c.x, c.y, c.z, 0.0);
    }
    let c = from.cross(to);
    DQuat::from_xyzw(c.x, c.y, c.z, w).normalize()
}

/// Orientation from which the load's moment bends a joint of stiffness `k` to `q`: the deviation e (quaternion
/// with vector v, scalar w) solves (w + [v]×) K 2v = moment, with K in the frame of the orientation sought.
fn unloaded(q: DQuat, moment: DVec3, k: [f64; 2]) -> DQuat {
    let mut v = DVec3::ZERO;
    let mut rested = q;
    for _ in 0..60 {
        let w = (1.0 - v.length_squared()).max(0.0).sqrt();
        let t = rested * DVec3::Z;
        // (w + [v]×)^-1 of a quaternion of length one is (w² + v vᵀ - w [v]×) / w.
        let m = (moment * (w * w) + v * v.dot(moment) - v.cross(moment) * w) / w;
        v = (m / k[0] + t * (t.dot(m) * (1.0 / k[1] - 1.0 / k[0]))) * 0.5;
        let w = (1.0 - v.length_squared()).max(0.0).sqrt();
        rested = (DQuat::from_xyzw(-v.x, -v.y, -v.z, w) * q).normalize();
    }
    rested
}

/// Pushes of the pile, mm/s² of acceleration, non-negative and at most three times gravity, that make the sum of
/// squared moments over all joints least: projected coordinate descent on the normal equations.
fn pile_pushes(pose: &Pose<'_>, x: &[DVec3], gravity: DVec3) -> Vec<f64> {
    let n = x.len();
    let active: Vec<usize> = (0..n).filter(|&k| pose.pile[k].length_squared() > 1e-4).collect();
    let mut pushes = vec![0.0; n];
    if active.is_empty() {
        return pushes;
    }
    // Moment of a unit push k about joint j <= k, and of gravity on everything beyond j.
    let column = |k: usize, j: usize| (x[k] - pose.nodes[j]).cross(pose.pile[k]);
    let mut residual = vec![DVec3::ZERO; n];
    let (mut about, mut count) = (DVec3::ZERO, 0.0);
    for j in (0..n).rev() {
        about += x[j];
        count += 1.0;
        residual[j] = (about - pose.nodes[j] * count).cross(gravity);
    }
    let square: Vec<f64> =
        active.iter().map(|&k| (0..=k).map(|j| column(k, j).length_squared()).sum::<f64>()).collect();
    // Keeps pushes that hardly matter from growing.
    let floor = 1e-3 * square.iter().fold(0.0f64, |a, &b| a.max(b));
    for _ in 0..40 {
        for (&k, &square) in active.iter().zip(&square) {
            let slope: f64 = (0..=k).map(|j| column(k, j).dot(residual[j])).sum::<f64>() + floor * pushes[k];
            let next = (pushes[k] - slope / (square + floor)).clamp(0.0, 3.0 * GRAVITY);
            let change = next - pushes[k];
            pushes[k] = next;
            for (j, r) in residual.iter_mut().enumerate().take(k + 1) {
                *r += column(k, j) * change;
            }
        }
    }
    pushes
}

//! An inextensible rod that bends and twists: a chain of rigid segments.
//!
//! The chain is a position-based Cosserat rod (Kugelstadt and Schömer 2016; Deul et al. 2018, "Direct
//! position-based solver for stiff rods"): each segment has a position and an orientation, each joint holds the
//! segments' ends together (no stretch, no shear) and resists the rotation that takes its outer segment away from
//! where the inner one would have it at rest (bending and twist, compliant: XPBD, Macklin et al. 2016). A step
//! predicts, then does one Newton iteration for all joints of the chain at once, a block-tridiagonal solve, so
//! that nothing depends on how many sweeps were made; many small steps take the place of iterations.
//!
//! Mass, stiffness and forces are per mass per length, so that a segment of length l has mass l and a fibre of
//! bending stiffness EI and mass μ per length has stiffness EI / μ, in mm⁴/s².

use super::block::{Block, Chain};
use glam::{DQuat, DVec3};

/// Inertia about a segment's own axis relative to that across it. A fibre's true one is a hundred thousand
/// times smaller; its twist then relaxes within microseconds, which no step resolves. This one relaxes within a
/// few steps.
const AXIAL_INERTIA: f64 = 0.02;

/// A joint's rotation away from rest, as twice the vector part of its quaternion: the angle for small angles.
fn deviation(inner_rest: DQuat, outer: DQuat) -> (DVec3, f64) {
    let e = outer * inner_rest.conjugate();
    if e.w < 0.0 { (-e.xyz(), -e.w) } else { (e.xyz(), e.w) }
}

/// [v]×, so that `cross(v) * u = v × u`.
#[inline]
fn cross(v: DVec3) -> [[f64; 3]; 3] {
    [[0.0, -v.z, v.y], [v.z, 0.0, -v.x], [-v.y, v.x, 0.0]]
}

#[inline]
fn times(a: &[[f64; 3]; 3], b: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
    std::array::from_fn(|i| {
        std::array::from_fn(|j| a[i][0] * b[0][j] + a[i][1] * b[1][j] + a[i][2] * b[2][j])
    })
}

#[inline]
fn transposed(a: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
    std::array::from_fn(|i| std::array::from_fn(|j| a[j][i]))
}

/// Where and how the rod's root is held, world.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clamp {
    pub anchor: DVec3,
    pub rotation: DQuat,
}

/// A rod and its state.
#[derive(Clone, Debug)]
pub(super) struct Rod {
    /// Segment lengths, mm.
    pub length_mm: Vec<f64>,
    /// Masses, mm of fibre.
    pub mass: Vec<f64>,
    /// Orientation of each segment at rest relative to the one before it, the first relative to the clamp.
    pub rest: Vec<DQuat>,
    /// Bending and twisting stiffness of each joint over mass per length, mm³/s².
    pub stiffness: Vec<[f64; 2]>,
    /// Middles of the segments, mm.
    pub x: Vec<DVec3>,
    /// Orientations: +z runs along the segment.
    pub q: Vec<DQuat>,
    /// Velocities, mm/s.
    pub v: Vec<DVec3>,
    /// Angular velocities, rad/s, world axes.
    pub w: Vec<DVec3>,
}

/// What a step works with besides the rod.
#[derive(Default)]
pub(super) struct Scratch {
    chain: Chain,
    x0: Vec<DVec3>,
    q0: Vec<DQuat>,
    before: Vec<DVec3>,
    turn: Vec<Deviation>,
    pub acceleration: Vec<DVec3>,
}

#[derive(Clone, Copy)]
struct Deviation {
    vector: DVec3,
    scalar: f64,
    /// Tangent of the outer segment as the inner one would have it.
    tangent: DVec3,
}

impl Rod {
    pub fn len(&self) -> usize {
        self.x.len()
    }

    pub fn tangent(&self, k: usize) -> DVec3 {
        self.q[k] * DVec3::Z
    }

    fn inertia(&self, k: usize) -> f64 {
        self.mass[k] * self.length_mm[k] * self.length_mm[k] / 12.0
    }

    /// Orientation that segment `j` has at rest given the one before it.
    pub fn rested(&self, j: usize, clamp: &Clamp) -> DQuat {
        let inner = if j == 0 { clamp.rotation } else { self.q[j - 1] };
        inner * self.rest[j]
    }

    /// Advances by `dt` seconds under the accelerations (mm/s²) in `scratch`, with the clamp going from
    /// `clamps[0]` to `clamps[1]`; `damping_s` is the Kelvin-Voigt time constant. `contact` may then move
    /// segments ([`Rod::push`]); velocities follow from what all of it did.
    pub fn step(
        &mut self,
        dt: f64,
        clamps: [Clamp; 2],
        damping_s: f64,
        s: &mut Scratch,
        contact: impl FnOnce(&mut Rod, &[DVec3], &[DQuat]),
    ) {
        let n = self.len();
        s.x0.clone_from(&self.x);
        s.q0.clone_from(&self.q);
        // Deviations at the step's start, in the frame that turns with the inner segment.
        s.before.clear();
        for j in 0..n {
            let rested = self.rested(j, &clamps[0]);
            s.before.push(rested.conjugate() * (2.0 * deviation(rested, self.q[j]).0));
        }
        for k in 0..n {
            self.v[k] += s.acceleration[k] * dt;
            self.x[k] += self.v[k] * dt;
            // Euler's equations of a symmetric top.
            let t = self.tangent(k);
            let w = self.w[k];
            self.w[k] = w + w.cross(t) * ((1.0 - AXIAL_INERTIA) * t.dot(w) * dt);
            self.q[k] = turned(self.q[k], self.w[k] * dt);
        }
        self.join(dt, &clamps[1], damping_s, s);
        contact(self, &s.x0, &s.q0);
        for k in 0..n {
            self.v[k] = (self.x[k] - s.x0[k]) / dt;
            let d = self.q[k] * s.q0[k].conjugate();
            self.w[k] = d.xyz() * (if d.w < 0.0 { -2.0 } else { 2.0 } / dt);
        }
    }

    /// One Newton iteration on all joints.
    fn join(&mut self, dt: f64, clamp: &Clamp, damping_s: f64, s: &mut Scratch) {
        let n = self.len();
        s.chain.resize(n);
        s.turn.clear();
        let fade = damping_s / dt / (1.0 + damping_s / dt);
        for j in 0..n {
            let rested = self.rested(j, clamp);
            let (vector, scalar) = deviation(rested, self.q[j]);
            s.turn.push(Deviation { vector, scalar, tangent: rested * DVec3::Z });
            let outer = self.tangent(j) * (-0.5 * self.length_mm[j]);
            let (anchor, inner) = if j == 0 {
                (clamp.anchor, DVec3::ZERO)
            } else {
                let r = self.tangent(j - 1) * (0.5 * self.length_mm[j - 1]);
                (self.x[j - 1] + r, r)
            };
            let gap = self.x[j] + outer - anchor;
            let bend = 2.0 * vector - (rested * s.before[j]) * fade;
            s.chain.rhs[j] = [-gap.x, -gap.y, -gap.z, -bend.x, -bend.y, -bend.z];
            let soft = self.stiffness[j].map(|k| 1.0 / (k * dt * (dt + damping_s)));
            s.chain.diagonal[j] = self.diagonal(j, outer, inner, &s.turn[j], soft);
        }
        for j in 0..n.saturating_sub(1) {
            s.chain.upper[j] = self.coupling(j, [&s.turn[j], &s.turn[j + 1]]);
        }
        s.chain.solve();
        for k in 0..n {
            let half = self.tangent(k) * (0.5 * self.length_mm[k]);
            let part = |j: usize| {
                let r = s.chain.rhs[j];
                (DVec3::new(r[0], r[1], r[2]), DVec3::new(r[3], r[4], r[5]))
            };
            let (mut push, turn) = part(k);
            let d = &s.turn[k];
            let mut moment = turn * d.scalar + d.vector.cross(turn) - half.cross(push);
            if k + 1 < n {
                let (p, turn) = part(k + 1);
                let d = &s.turn[k + 1];
                moment -= turn * d.scalar + d.vector.cross(turn) + half.cross(p);
                push -= p;
            }
            self.x[k] += push / self.mass[k];
            let w = self.angular(k, moment);
            self.q[k] = turned(self.q[k], w);
        }
    }

    /// Inverse inertia of segment `k` times a vector.
    fn angular(&self, k: usize, moment: DVec3) -> DVec3 {
        let t = self.tangent(k);
        let across = 1.0 / self.inertia(k);
        moment * across + t * (t.dot(moment) * across * (1.0 / AXIAL_INERTIA - 1.0))
    }

    /// J W Jᵀ + compliance of one joint, lower triangle. Rows 0..3 hold the ends together, rows 3..6 bend and
    /// twist. `outer` and `inner` lead from the segments' middles to the joint.
    fn diagonal(&self, j: usize, outer: DVec3, inner: DVec3, turn: &Deviation, soft: [f64; 2]) -> Block {
        let mut d = [[0.0; 6]; 6];
        let mut arm = DVec3::ZERO;
        let mut bend = [[0.0; 3]; 3];
        let jacobian = turn.jacobian();
        let bodies = [(Some(j), outer), (j.checked_sub(1), inner)];
        for (k, r) in bodies.into_iter().filter_map(|(k, r)| k.map(|k| (k, r))) {
            let i = 1.0 / self.inertia(k);
            let shift = 1.0 / self.mass[k] + i * r.length_squared();
            add(&mut bend, i, self.tangent(k), i * (1.0 / AXIAL_INERTIA - 1.0));
            arm += r * i;
            let v = r.to_array();
            for a in 0..3 {
                for b in 0..=a {
                    d[a][b] -= v[a] * v[b] * i;
                }
                d[a][a] += shift;
            }
        }
        let low = times(&jacobian, &cross(arm));
        let mut turned = times(&times(&jacobian, &bend), &transposed(&jacobian));
        add(&mut turned, soft[0], turn.tangent, soft[1] - soft[0]);
        for a in 0..3 {
            for b in 0..3 {
                d[3 + a][b] = low[a][b];
                d[3 + a][3 + b] = turned[a][b];
            }
        }
        d
    }

    /// J W Jᵀ between joints j and j + 1, which share segment j.
    fn coupling(&self, j: usize, turns: [&Deviation; 2]) -> Block {
        let i = 1.0 / self.inertia(j);
        let t = self.tangent(j);
        let half = t * (0.5 * self.length_mm[j]);
        let (from, to) = (turns[0].jacobian(), transposed(&turns[1].jacobian()));
        let mut shift = [[0.0; 3]; 3];
        add(&mut shift, i * half.length_squared() - 1.0 / self.mass[j], half, -i);
        let mut inverse = [[0.0; 3]; 3];
        add(&mut inverse, i, t, i * (1.0 / AXIAL_INERTIA - 1.0));
        let lever = cross(half * i);
        let (up, low) = (times(&lever, &to), times(&from, &lever));
        let turn = times(&times(&from, &inverse), &to);
        std::array::from_fn(|a| {
            std::array::from_fn(|b| match (a < 3, b < 3) {
                (true, true) => shift[a][b],
                (true, false) => -up[a][b - 3],
                (false, true) => -low[a - 3][b],
                (false, false) => -turn[a - 3][b - 3],
            })
        })
    }

    /// Moves the outer end of segment `k` by about `by` (mm), as a push there would: the segment also turns.
    pub fn push_end(&mut self, k: usize, by: DVec3) {
        let depth = by.length();
        if depth == 0.0 {
            return;
        }
        let n = by / depth;
        let arm = self.tangent(k) * (0.5 * self.length_mm[k]);
        let lever = self.angular(k, arm.cross(n));
        let inverse_mass = 1.0 / self.mass[k];
        let scale = depth / (inverse_mass + arm.cross(n).dot(lever));
        self.x[k] += n * (scale * inverse_mass);
        self.q[k] = turned(self.q[k], lever * scale);
    }

    /// Outer end of segment `k` as its own position has it, mm.
    pub fn end(&self, k: usize) -> DVec3 {
        self.x[k] + self.tangent(k) * (0.5 * self.length_mm[k])
    }
}

impl Deviation {
    /// Of the deviation's vector by the outer segment's rotation; the inner one's is its negative, so that
    /// torques are equal and opposite.
    fn jacobian(&self) -> [[f64; 3]; 3] {
        let (v, w) = (self.vector, self.scalar);
        [[w, v.z, -v.y], [-v.z, w, v.x], [v.y, -v.x, w]]
    }
}

/// m += isotropic I + along t tᵀ.
#[inline]
fn add(m: &mut [[f64; 3]; 3], isotropic: f64, t: DVec3, along: f64) {
    let v = t.to_array();
    for a in 0..3 {
        for b in 0..3 {
            m[a][b] += v[a] * v[b] * along;
        }
        m[a][a] += isotropic;
    }
}

/// The orientation after a small rotation.
fn turned(q: DQuat, by: DVec3) -> DQuat {
    let d = DQuat::from_xyzw(0.5 * by.x, 0.5 * by.y, 0.5 * by.z, 0.0) * q;
    DQuat::from_xyzw(q.x + d.x, q.y + d.y, q.z + d.z, q.w + d.w).normalize()
}

#[cfg(test)]
mod tests;

//! Intersection of rays with fibre segments (round cones) and triangles.

use glam::Vec3;

/// A round cone, the convex hull of two spheres, stored by its middle so that f32 suffices far from the
/// world's origin.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C, align(32))]
pub struct RoundCone {
    /// Middle of the axis, mm.
    pub middle: Vec3,
    /// Radius at the middle, mm.
    pub radius: f32,
    /// Half of the axis from start to end, mm; zero for a sphere.
    pub half: Vec3,
    /// Half of (end radius - start radius), mm.
    pub half_delta: f32,
}

/// Where a ray enters a round cone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConeHit {
    /// Distance along the ray, mm.
    pub t: f32,
    /// Position along the axis of the sphere that touches the hit, 0 at the start, 1 at the end.
    pub along: f32,
}

impl RoundCone {
    /// The hull of a sphere (`p0`, `r0`) and a sphere (`p1`, `r1`); where one holds the other (also for a
    /// segment without length), the larger sphere alone.
    pub fn new(p0: Vec3, r0: f32, p1: Vec3, r1: f32) -> RoundCone {
        let half = (p1 - p0) * 0.5;
        let half_delta = (r1 - r0) * 0.5;
        if half.length_squared() <= half_delta * half_delta * 1.000_1 || half.length_squared() < 1e-20 {
            let (middle, radius) = if r0 >= r1 { (p0, r0) } else { (p1, r1) };
            return RoundCone { middle, radius, half: Vec3::ZERO, half_delta: 0.0 };
        }
        RoundCone { middle: p0 + half, radius: (r0 + r1) * 0.5, half, half_delta }
    }

    /// Lowest and highest corner of the box around it, mm.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        let (a, b) = (self.middle - self.half, self.middle + self.half);
        let (ra, rb) = (self.radius - self.half_delta, self.radius + self.half_delta);
        ((a - ra).min(b - rb), (a + ra).max(b + rb))
    }

    /// The first entry of the ray `origin + t * direction` (unit direction) with `t > tmin`; rays that start
    /// inside see no entry.
    ///
    /// With y the position relative to the middle, split into y_a along the unit axis and y⊥ across it, and
    /// σ = (r0 - r1) / length, the lateral surface is (1 - σ²) |y⊥|² = (r_m - σ y_a)². The ray's origin is first
    /// moved to its point nearest the middle, and the discriminant is written with the triple product
    /// (o × axis)·d instead of a difference of squares, so that nothing large cancels.
    #[inline(always)]
    pub fn intersect(&self, origin: Vec3, direction: Vec3, tmin: f32) -> Option<ConeHit> {
        let w = origin - self.middle;
        let shift = -w.dot(direction);
        let o = w + direction * shift;
        let r_max = self.radius + self.half_delta.abs();
        let n = self.half.cross(direction);
        let x = o.dot(n);
        // The ray's line stays farther from the axis' line than the thickest sphere reaches.
        if x * x > r_max * r_max * n.length_squared() {
            return None;
        }
        let h2 = self.half.length_squared();
        let reach = h2.sqrt() + r_max;
        if o.length_squared() > reach * reach {
            return None;
        }
        self.intersect_near(o, direction, shift, tmin, h2)
    }

    #[inline(always)]
    fn intersect_near(&self, o: Vec3, d: Vec3, shift: f32, tmin: f32, h2: f32) -> Option<ConeHit> {
        if h2 == 0.0 {
            return sphere_entry(o, d, self.radius)
                .map(|t| ConeHit { t: t + shift, along: 0.5 })
                .filter(|h| h.t > tmin);
        }
        let h = h2.sqrt();
        let a = self.half / h;
        let sigma = -self.half_delta / h;
        let c2 = 1.0 - sigma * sigma;
        let z = o.dot(a);
        let dz = d.dot(a);
        let o_perp = o - a * z;
        let d_perp = d - a * dz;
        let radius_z = self.radius - sigma * z;
        let qa = c2 * d_perp.length_squared() - sigma * sigma * dz * dz;
        let qb = c2 * o_perp.dot(d_perp) + sigma * radius_z * dz;
        let qc = c2 * o_perp.length_squared() - radius_z * radius_z;
        let x = o.dot(a.cross(d));
        let spread = (d_perp * radius_z + o_perp * (sigma * dz)).length_squared();
        let disc = c2 * (spread - c2 * x * x);
        if disc < 0.0 {
            return None;
        }
        let root = disc.sqrt();
        // The root at which the ray goes inwards; the form without cancellation.
        let t = if qb <= 0.0 { qc / (root - qb) } else { -(qb + root) / qa };
        let along_axis = (z + t * dz - sigma * self.radius) / c2;
        let hit = if along_axis.abs() <= h {
            ConeHit { t: t + shift, along: 0.5 + 0.5 * along_axis / h }
        } else {
            let start = sphere_entry(o + self.half, d, self.radius - self.half_delta);
            let end = sphere_entry(o - self.half, d, self.radius + self.half_delta);
            match (start, end) {
                (Some(s), Some(e)) if s <= e => ConeHit { t: s + shift, along: 0.0 },
                (Some(s), None) => ConeHit { t: s + shift, along: 0.0 },
                (_, Some(e)) => ConeHit { t: e + shift, along: 1.0 },
                (None, None) => return None,
            }
        };
        (hit.t > tmin).then_some(hit)
    }
}

/// Entry distance of a ray into a sphere at the origin.
#[inline(always)]
fn sphere_entry(o: Vec3, d: Vec3, radius: f32) -> Option<f32> {
    let b = o.dot(d);
    let nearest = o - d * b;
    let disc = radius * radius - nearest.length_squared();
    (disc >= 0.0).then(|| -b - disc.sqrt())
}

/// A triangle by a corner and two edges.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct Triangle {
    /// First corner, mm.
    pub a: Vec3,
    /// Second corner minus first, mm.
    pub ab: Vec3,
    /// Third corner minus first, mm.
    pub ac: Vec3,
}

/// Where a ray meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TriangleHit {
    /// Distance along the ray, mm.
    pub t: f32,
    /// Barycentric weight of the second corner.
    pub u: f32,
    /// Barycentric weight of the third corner.
    pub v: f32,
}

/// Widening of the bounds on barycentric weights.
pub(crate) const EDGE: f32 = 1e-6;

impl Triangle {
    /// Lowest and highest corner of the box around it, mm.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        let (b, c) = (self.a + self.ab, self.a + self.ac);
        (self.a.min(b).min(c), self.a.max(b).max(c))
    }

    /// The crossing with `t > tmin`, from either side. The bounds on the barycentric weights are wider by
    /// 1e-6, so that rays do not slip between neighbours.
    #[inline(always)]
    pub fn intersect(&self, origin: Vec3, direction: Vec3, tmin: f32) -> Option<TriangleHit> {
        let p = direction.cross(self.ac);
        let det = self.ab.dot(p);
        if det == 0.0 {
            return None;
        }
        let inv = 1.0 / det;
        let s = origin - self.a;
        let u = s.dot(p) * inv;
        if !(-EDGE..=1.0 + EDGE).contains(&u) {
            return None;
        }
        let q = s.cross(self.ab);
        let v = direction.dot(q) * inv;
        if v < -EDGE || u + v > 1.0 + EDGE {
            return None;
        }
        let t = self.ac.dot(q) * inv;
        (t > tmin && t.is_finite()).then_some(TriangleHit { t, u, v })
    }
}

//! Random fibres and triangles, and hits without a tree; each test uses a part of it.
#![allow(dead_code)]

use glam::Vec3;
use strandbench_renderer::accel::Hit;
use strandbench_renderer::cone::{RoundCone, Triangle};
use strandbench_rng::Rng;
use strandbench_types::{StrandSet, TriMesh};

/// A random unit vector.
pub fn direction(rng: &mut Rng) -> Vec3 {
    loop {
        let v = Vec3::new(rng.range(-1.0, 1.0), rng.range(-1.0, 1.0), rng.range(-1.0, 1.0));
        if (0.01..1.0).contains(&v.length_squared()) {
            return v.normalize();
        }
    }
}

/// A random point of a cube of half side `size`.
pub fn point(rng: &mut Rng, size: f32) -> Vec3 {
    Vec3::new(rng.range(-size, size), rng.range(-size, size), rng.range(-size, size))
}

/// Random strands of a few segments, some with repeated points, within a cube of half side `size`.
pub fn strands(rng: &mut Rng, n: usize, size: f32, radius: f32) -> StrandSet {
    let mut set = StrandSet::new();
    for _ in 0..n {
        let mut p = point(rng, size);
        let (mut points, mut radii) = (vec![p], vec![radius * rng.range(0.3, 1.0)]);
        for _ in 0..3 {
            if rng.f32() > 0.1 {
                p += direction(rng) * rng.range(0.0, 0.2 * size);
            }
            points.push(p);
            radii.push(radius * rng.range(0.3, 1.0));
        }
        set.push_tapered(&points, &radii);
    }
    set
}

/// Random triangles.
pub fn mesh(rng: &mut Rng, n: u32, size: f32) -> TriMesh {
    let mut m = TriMesh::default();
    for i in 0..n {
        let a = point(rng, size);
        m.vertices.extend([a, a + point(rng, 0.2 * size), a + point(rng, 0.2 * size)]);
        m.triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
    }
    m
}

/// The first hit, of all there is asked one by one.
pub fn brute(strands: &StrandSet, mesh: &TriMesh, o: Vec3, d: Vec3) -> Option<Hit> {
    let mut best: Option<Hit> = None;
    let mut t = f32::INFINITY;
    for s in 0..strands.len() {
        let r = strands.range(s);
        for i in r.start..r.end - 1 {
            let (p, w) = (&strands.points, &strands.radii_mm);
            if let Some(h) = RoundCone::new(p[i], w[i], p[i + 1], w[i + 1]).intersect(o, d, 0.0)
                && h.t < t
            {
                t = h.t;
                best = Some(Hit::Fibre { t, strand: s as u32, point: i as u32, along: h.along });
            }
        }
    }
    for (i, k) in mesh.triangles.iter().enumerate() {
        let [a, b, c] = k.map(|v| mesh.vertices[v as usize]);
        if let Some(h) = (Triangle { a, ab: b - a, ac: c - a }).intersect(o, d, 0.0)
            && h.t < t
        {
            t = h.t;
            best = Some(Hit::Mesh { t, surface: 0, triangle: i as u32, uv: [h.u, h.v] });
        }
    }
    best
}

/// Distance of a hit, infinite for none.
pub fn distance(h: Option<Hit>) -> f32 {
    match h {
        Some(Hit::Fibre { t, .. } | Hit::Mesh { t, .. }) => t,
        None => f32::INFINITY,
    }
}

//! Closest point on a triangle mesh, signed by angle-weighted pseudo-normals (Bærentzen and Aanæs 2005).

use glam::Vec3;
use std::collections::HashMap;

/// The closest point of a surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Closest {
    /// Signed distance of the query, mm; negative inside.
    pub distance: f32,
    /// Unit outward direction: the distance's gradient, or the surface's normal on the surface.
    pub normal: Vec3,
    /// Triangle that holds the point.
    pub triangle: u32,
}

struct Node {
    low: Vec3,
    high: Vec3,
    /// First triangle of a leaf, or index of the first of two neighbouring children.
    first: u32,
    /// Triangles of a leaf; 0 for an inner node.
    count: u32,
}

pub(crate) struct MeshBvh {
    nodes: Vec<Node>,
    order: Vec<u32>,
    corners: Vec<[Vec3; 3]>,
    /// Pseudo-normals, indexed [triangle]: three corners, the edges from each corner to the next, the face.
    normals: Vec<[Vec3; 7]>,
}

const LEAF: usize = 4;

impl MeshBvh {
    pub fn new(vertices: &[Vec3], triangles: &[[u32; 3]]) -> MeshBvh {
        let corners: Vec<[Vec3; 3]> = triangles.iter().map(|t| t.map(|i| vertices[i as usize])).collect();
        let face: Vec<Vec3> =
            corners.iter().map(|[a, b, c]| (*b - *a).cross(*c - *a).normalize_or_zero()).collect();
        let mut at_vertex = vec![Vec3::ZERO; vertices.len()];
        let mut at_edge: HashMap<(u32, u32), Vec3> = HashMap::new();
        let edge_key = |t: &[u32; 3], k: usize| {
            let (a, b) = (t[k], t[(k + 1) % 3]);
            (a.min(b), a.max(b))
        };
        for (i, t) in triangles.iter().enumerate() {
            for k in 0..3 {
                let p = corners[i];
                let u = (p[(k + 1) % 3] - p[k]).normalize_or_zero();
                let v = (p[(k + 2) % 3] - p[k]).normalize_or_zero();
                at_vertex[t[k] as usize] += face[i] * libm::acosf(u.dot(v).clamp(-1.0, 1.0));
                *at_edge.entry(edge_key(t, k)).or_default() += face[i];
            }
        }
        let normals = triangles
            .iter()
            .enumerate()
            .map(|(i, t)| {
                std::array::from_fn(|k| match k {
                    0..3 => at_vertex[t[k] as usize].normalize_or_zero(),
                    3..6 => at_edge[&edge_key(t, k - 3)].normalize_or_zero(),
                    _ => face[i],
                })
            })
            .collect();
        let mut out =
            MeshBvh { nodes: Vec::new(), order: (0..triangles.len() as u32).collect(), corners, normals };
        out.nodes.push(Node { low: Vec3::ZERO, high: Vec3::ZERO, first: 0, count: triangles.len() as u32 });
        out.split(0);
        out
    }

    fn split(&mut self, node: usize) {
        let (first, count) = (self.nodes[node].first as usize, self.nodes[node].count as usize);
        let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let (mut clow, mut chigh) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for &i in &self.order[first..first + count] {
            let t = &self.corners[i as usize];
            for p in t {
                (low, high) = (low.min(*p), high.max(*p));
            }
            let c = t[0] + t[1] + t[2];
            (clow, chigh) = (clow.min(c), chigh.max(c));
        }
        (self.nodes[node].low, self.nodes[node].high) = (low, high);
        if count <= LEAF {
            return;
        }
        let extent = chigh - clow;
        let axis = if extent.x >= extent.y && extent.x >= extent.z {
            0
        } else if extent.y >= extent.z {
            1
        } else {
            2
        };
        let corners = &self.corners;
        let key = |i: u32| {
            let t = &corners[i as usize];
            t[0][axis] + t[1][axis] + t[2][axis]
        };
        self.order[first..first + count].sort_unstable_by(|&a, &b| key(a).total_cmp(&key(b)).then(a.cmp(&b)));
        let child = self.nodes.len();
        let half = count / 2;
        for (f, c) in [(first, half), (first + half, count - half)] {
            self.nodes.push(Node { low: Vec3::ZERO, high: Vec3::ZERO, first: f as u32, count: c as u32 });
        }
        (self.nodes[node].first, self.nodes[node].count) = (child as u32, 0);
        self.split(child);
        self.split(child + 1);
    }

    /// The closest point of the surface; `hint` is a triangle near it, which only saves time.
    pub fn closest(&self, p: Vec3, hint: Option<u32>) -> Closest {
        let mut best = (f32::INFINITY, u32::MAX, Vec3::ZERO, 6usize);
        let look = |i: u32, best: &mut (f32, u32, Vec3, usize)| {
            let (q, feature) = closest_on_triangle(p, &self.corners[i as usize]);
            let d = p.distance_squared(q);
            // The lower triangle wins a tie, so that the hint cannot change the answer.
            if d < best.0 || (d == best.0 && i < best.1) {
                *best = (d, i, q, feature);
            }
        };
        if let Some(i) = hint {
            look(i, &mut best);
        }
        let mut stack = [0u32; 64];
        let mut top = 1;
        let gap = |n: &Node| (n.low - p).max(p - n.high).max(Vec3::ZERO).length_squared();
        while top > 0 {
            top -= 1;
            let node = &self.nodes[stack[top] as usize];
            if gap(node) > best.0 {
                continue;
            }
            if node.count > 0 {
                for &i in &self.order[node.first as usize..(node.first + node.count) as usize] {
                    look(i, &mut best);
                }
                continue;
            }
            let (a, b) = (node.first, node.first + 1);
            let (da, db) = (gap(&self.nodes[a as usize]), gap(&self.nodes[b as usize]));
            let (near, far) = if da <= db { (a, b) } else { (b, a) };
            stack[top] = far;
            stack[top + 1] = near;
            top += 2;
        }
        let (d2, triangle, point, feature) = best;
        let normal = self.normals[triangle as usize][feature];
        let d = d2.sqrt();
        let away = p - point;
        let outside = away.dot(normal) >= 0.0;
        let distance = if outside { d } else { -d };
        // Off the surface the gradient is the direction from it; on it, that direction is noise.
        let normal = if d > 0.02 { away * (1.0 / distance) } else { normal };
        Closest { distance, normal, triangle }
    }
}

/// The closest point, and what holds it: corner 0..3, edge 3..6 or the face, 6.
fn closest_on_triangle(p: Vec3, [a, b, c]: &[Vec3; 3]) -> (Vec3, usize) {
    // Regions of barycentric coordinates (Ericson, Real-Time Collision Detection, 5.1.5).
    let (ab, ac, ap) = (*b - *a, *c - *a, p - *a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return (*a, 0);
    }
    let bp = p - *b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return (*b, 1);
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return (*a + ab * (d1 / (d1 - d3)), 3);
    }
    let cp = p - *c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return (*c, 2);
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return (*a + ac * (d2 / (d2 - d6)), 5);
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        return (*b + (*c - *b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6))), 4);
    }
    let scale = 1.0 / (va + vb + vc);
    (*a + ab * (vb * scale) + ac * (vc * scale), 6)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn octahedron() -> (Vec<Vec3>, Vec<[u32; 3]>) {
        let v = [Vec3::X, -Vec3::X, Vec3::Y, -Vec3::Y, Vec3::Z, -Vec3::Z];
        let t = vec![[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
        (v.iter().map(|p| *p * 10.0).collect(), t)
    }

    proptest! {
        #[test]
        fn sign_and_distance_of_an_octahedron(x in -20.0..20.0f32, y in -20.0..20.0f32, z in -20.0..20.0f32) {
            let (v, t) = octahedron();
            let p = Vec3::new(x, y, z);
            let got = MeshBvh::new(&v, &t).closest(p, Some(3));
            let plane = (p.abs().element_sum() - 10.0) / 3f32.sqrt();
            prop_assert_eq!(got.distance < 0.0, plane < 0.0, "{:?}", got);
            // Inside, the nearest plane is the distance; outside, a lower bound of it. Brute force settles it.
            let brute = (0..8u32)
                .map(|i| closest_on_triangle(p, &t[i as usize].map(|k| v[k as usize])).0.distance(p))
                .fold(f32::INFINITY, f32::min);
            prop_assert!((got.distance.abs() - brute).abs() < 1e-5);
            prop_assert!(got.distance.abs() + 1e-4 >= plane.abs());
        }
    }
}

//! Values on the nodes of a regular grid, and the surface on which they take one value.

use glam::DVec3;
use rayon::prelude::*;
use std::collections::HashMap;
use strandbench_types::TriMesh;

/// Most nodes of a lattice: its values then take 200 MB.
pub(crate) const MOST_NODES: u64 = 25_000_000;

/// Nodes at equal distances.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Lattice {
    /// Position of the first node, mm.
    pub origin: DVec3,
    /// Distance between nodes, mm.
    pub cell_mm: f64,
    /// Nodes along x, y and z.
    pub size: [usize; 3],
}

/// The six tetrahedra of a cube along its diagonal (Freudenthal): corners by their bits, x lowest.
const TETRAHEDRA: [[usize; 4]; 6] =
    [[0, 1, 3, 7], [0, 1, 5, 7], [0, 2, 3, 7], [0, 2, 6, 7], [0, 4, 5, 7], [0, 4, 6, 7]];

impl Lattice {
    pub fn count(&self) -> usize {
        self.size[0] * self.size[1] * self.size[2]
    }

    pub fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.size[1] + y) * self.size[0] + x
    }

    /// Position of a node by its index, mm.
    pub fn node(&self, i: usize) -> DVec3 {
        let [nx, ny, _] = self.size;
        self.origin + DVec3::new((i % nx) as f64, (i / nx % ny) as f64, (i / (nx * ny)) as f64) * self.cell_mm
    }

    /// Corner `k` (its bits are steps along x, y, z) of the cell whose first node is given.
    pub fn corner(&self, node: usize, k: usize) -> usize {
        node + (k & 1) + (k >> 1 & 1) * self.size[0] + (k >> 2) * self.size[0] * self.size[1]
    }

    /// First node of the cell that holds a point, and the trilinear weights of its corners; points outside count as
    /// the nearest inside.
    pub fn around(&self, at: DVec3) -> (usize, [f64; 8]) {
        let p = (at - self.origin) / self.cell_mm;
        let mut cell = [0; 3];
        let mut share = [0.0; 3];
        for a in 0..3 {
            let c = p[a].clamp(0.0, (self.size[a] - 1) as f64);
            cell[a] = (c as usize).min(self.size[a] - 2);
            share[a] = c - cell[a] as f64;
        }
        let weights = std::array::from_fn(|k| {
            (0..3).map(|a| if k >> a & 1 == 1 { share[a] } else { 1.0 - share[a] }).product()
        });
        (self.index(cell), weights)
    }

    /// Weighted sum over a cell's corners.
    pub fn blend(&self, values: &[f64], node: usize, weights: &[f64; 8]) -> f64 {
        (0..8).map(|k| weights[k] * values[self.corner(node, k)]).sum()
    }

    /// The lattice with every 2^`halvings`-th node.
    pub fn coarser(&self, halvings: usize) -> Lattice {
        Lattice {
            origin: self.origin,
            cell_mm: self.cell_mm * (1u64 << halvings) as f64,
            size: self.size.map(|n| ((n - 1) >> halvings) + 1),
        }
    }

    /// Adds to `fine`, on this lattice, the trilinear interpolation of values on the next coarser one.
    pub fn prolong_add(&self, coarse: &[f64], fine: &mut [f64]) {
        let [nx, ny, _] = self.size;
        let c = self.coarser(1);
        fine.par_chunks_mut(nx * ny).enumerate().for_each(|(z, plane)| {
            for (i, v) in plane.iter_mut().enumerate() {
                let (x, y) = (i % nx, i / nx);
                let ends = |n: usize| [n / 2, n.div_ceil(2)];
                let mut sum = 0.0;
                for cz in ends(z) {
                    for cy in ends(y) {
                        let row = (cz * c.size[1] + cy) * c.size[0];
                        sum += coarse[row + x / 2] + coarse[row + x.div_ceil(2)];
                    }
                }
                *v += 0.125 * sum;
            }
        });
    }

    /// The transpose of [`Lattice::prolong_add`].
    pub fn restrict(&self, fine: &[f64]) -> Vec<f64> {
        let c = self.coarser(1);
        let [cx, cy, _] = c.size;
        let mut out = vec![0.0; c.count()];
        out.par_chunks_mut(cx * cy).enumerate().for_each(|(z, plane)| {
            for (i, v) in plane.iter_mut().enumerate() {
                let at = [i % cx, i / cx, z];
                for k in 0..27usize {
                    let d = [k % 3, k / 3 % 3, k / 9];
                    let mut weight = 1.0;
                    let mut node = [0; 3];
                    let inside = (0..3).all(|a| {
                        weight *= if d[a] == 1 { 1.0 } else { 0.5 };
                        let n = (2 * at[a] + d[a]).checked_sub(1);
                        node[a] = n.unwrap_or(0);
                        n.is_some_and(|n| n < self.size[a])
                    });
                    if inside {
                        *v += weight * fine[self.index(node)];
                    }
                }
            }
        });
        out
    }

    /// The surface on which the values are `iso`, wound so that larger values lie outside: linear in each of the six
    /// tetrahedra of a cell, which know no ambiguous case.
    pub fn surface(&self, values: &[f64], iso: f64) -> TriMesh {
        let [nx, ny, nz] = self.size;
        let slabs: Vec<Vec<[(usize, usize); 3]>> = (0..nz - 1)
            .into_par_iter()
            .map(|z| {
                let mut found = Vec::new();
                for y in 0..ny - 1 {
                    for x in 0..nx - 1 {
                        let node = self.index([x, y, z]);
                        let corners: [usize; 8] = std::array::from_fn(|k| self.corner(node, k));
                        let inside = corners.map(|c| values[c] < iso);
                        if inside.iter().all(|i| *i == inside[0]) {
                            continue;
                        }
                        for t in TETRAHEDRA {
                            self.cut(t.map(|k| (corners[k], inside[k])), &mut found);
                        }
                    }
                }
                found
            })
            .collect();
        let mut mesh = TriMesh::default();
        let mut known: HashMap<(usize, usize), u32> = HashMap::new();
        for t in slabs.into_iter().flatten() {
            let triangle = t.map(|(a, b)| {
                *known.entry((a.min(b), a.max(b))).or_insert_with(|| {
                    let (a, b) = (a.min(b), a.max(b));
                    let share = (iso - values[a]) / (values[b] - values[a]);
                    mesh.vertices.push(self.node(a).lerp(self.node(b), share.clamp(0.0, 1.0)).as_vec3());
                    mesh.vertices.len() as u32 - 1
                })
            });
            mesh.triangles.push(triangle);
        }
        mesh
    }

    /// Triangles, as the edges of nodes that they cut, of one tetrahedron.
    fn cut(&self, nodes: [(usize, bool); 4], found: &mut Vec<[(usize, usize); 3]>) {
        let side = |wanted: bool| -> Vec<usize> {
            nodes.iter().filter(|(_, i)| *i == wanted).map(|(n, _)| *n).collect()
        };
        let (inner, outer) = (side(true), side(false));
        let mut push = |t: [(usize, usize); 3]| {
            let middle = |(a, b): (usize, usize)| 0.5 * (self.node(a) + self.node(b));
            let [a, b, c] = t.map(middle);
            let outwards = self.node(outer[0]) - self.node(inner[0]);
            let right = (b - a).cross(c - a).dot(outwards) >= 0.0;
            found.push(if right { t } else { [t[0], t[2], t[1]] });
        };
        match (&inner[..], &outer[..]) {
            ([a], [p, q, r]) | ([p, q, r], [a]) => push([(*a, *p), (*a, *q), (*a, *r)]),
            ([a, b], [p, q]) => {
                push([(*a, *p), (*a, *q), (*b, *q)]);
                push([(*a, *p), (*b, *q), (*b, *p)]);
            }
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn interpolation_is_exact_for_linear_functions_and_restriction_is_its_transpose() {
        let l = Lattice { origin: DVec3::new(1.0, 2.0, 3.0), cell_mm: 0.5, size: [9, 5, 13] };
        let c = l.coarser(1);
        let f = |p: DVec3| 2.0 * p.x - 3.0 * p.y + 0.5 * p.z + 1.0;
        let coarse: Vec<f64> = (0..c.count()).map(|i| f(c.node(i))).collect();
        let mut fine = vec![0.0; l.count()];
        l.prolong_add(&coarse, &mut fine);
        for (i, v) in fine.iter().enumerate() {
            assert!((v - f(l.node(i))).abs() < 1e-12);
        }
        let w: Vec<f64> = (0..l.count()).map(|i| (i as f64).sin()).collect();
        let back = l.restrict(&w);
        let one: f64 = fine.iter().zip(&w).map(|(a, b)| a * b).sum();
        let other: f64 = coarse.iter().zip(&back).map(|(a, b)| a * b).sum();
        assert!((one - other).abs() < 1e-9 * one.abs().max(1.0), "{one} {other}");
        let (node, weights) = l.around(DVec3::new(2.1, 3.3, 4.7));
        assert!((l.blend(&fine, node, &weights) - f(DVec3::new(2.1, 3.3, 4.7))).abs() < 1e-12);
    }

    #[test]
    fn a_sphere_is_closed_wound_outwards_and_in_its_place() {
        let n = 33;
        let l = Lattice { origin: DVec3::splat(-16.0), cell_mm: 1.0, size: [n; 3] };
        let values: Vec<f64> = (0..l.count()).map(|i| l.node(i).length()).collect();
        let mesh = l.surface(&values, 11.3);
        mesh.validate().unwrap();
        // The distance is linear along an edge of length e up to e² / 8r, e being at most √3.
        for v in &mesh.vertices {
            assert!((f64::from(v.length()) - 11.3).abs() < 3.0 / (8.0 * 10.0), "{v}");
        }
        let mut edges: HashMap<(u32, u32), i32> = HashMap::new();
        let mut volume = 0.0;
        for t in &mesh.triangles {
            let [a, b, c] = t.map(|i| mesh.vertices[i as usize]);
            volume += a.dot(b.cross(c)) / 6.0;
            for k in 0..3 {
                let (p, q) = (t[k], t[(k + 1) % 3]);
                *edges.entry((p.min(q), p.max(q))).or_default() += if p < q { 1 } else { -1 };
            }
        }
        assert!(edges.values().all(|&n| n == 0), "every edge is run through in both directions");
        let want = 4.0 / 3.0 * std::f32::consts::PI * 11.3f32.powi(3);
        assert!((volume / want - 1.0).abs() < 0.01, "{volume} for {want}");
        assert!(mesh.vertices.iter().all(|v| *v != Vec3::ZERO));
    }
}

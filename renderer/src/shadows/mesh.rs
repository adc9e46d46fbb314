//! Points over meshes: a lattice in each triangle, its corners and edges shared with the triangles beside it.

use glam::Vec3;
use std::collections::HashMap;
use strandbench_types::TriMesh;

/// Numbers of the points over all meshes.
#[derive(Debug, Default)]
pub(super) struct Meshes {
    /// Number of the first point.
    pub first: u32,
    /// Indexed [surface][triangle].
    pub triangles: Vec<Vec<Lattice>>,
    /// A triangle that each point is of.
    pub owners: Vec<Owner>,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Owner {
    pub surface: u32,
    pub triangle: u32,
    /// Steps from the first corner towards the second and the third.
    pub at: [u8; 2],
}

/// Points of a triangle whose edges have so many parts.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lattice {
    pub parts: u8,
    /// Whether each edge's points are counted from its end.
    turned: [bool; 3],
    corners: [u32; 3],
    /// First point within the edge from the first corner to the second, from the first to the third, from the second to the
    /// third.
    edges: [u32; 3],
    inside: u32,
}

const EDGES: [[usize; 2]; 3] = [[0, 1], [0, 2], [1, 2]];

impl Lattice {
    /// The point so many steps from the first corner towards the second and the third.
    #[inline]
    pub fn point(&self, column: u32, row: u32) -> u32 {
        let parts = u32::from(self.parts);
        let on_edge = |edge: usize, step: u32| {
            self.edges[edge] + if self.turned[edge] { parts - step } else { step } - 1
        };
        match (column, row) {
            (0, 0) => self.corners[0],
            (c, 0) if c == parts => self.corners[1],
            (0, r) if r == parts => self.corners[2],
            (c, 0) => on_edge(0, c),
            (0, r) => on_edge(1, r),
            (c, r) if c + r == parts => on_edge(2, r),
            (c, r) => self.inside + (r - 1) * (parts - 1) - r * (r - 1) / 2 + c - 1,
        }
    }
}

impl Meshes {
    /// Adds the next surface; `parts` is given the side of a square of twice a triangle's area, and its middle. Points are
    /// as many in long triangles as in others, and farther apart along them than across.
    pub fn add(&mut self, mesh: &TriMesh, parts: impl Fn(f32, Vec3) -> u8) {
        const NONE: u32 = u32::MAX;
        let surface = self.triangles.len() as u32;
        let mut corners = vec![NONE; mesh.vertices.len()];
        // By both ends and the number of parts.
        let mut edges: HashMap<(u32, u32, u8), u32> = HashMap::new();
        let mut made = Vec::with_capacity(mesh.triangles.len());
        for (triangle, t) in mesh.triangles.iter().enumerate() {
            let [a, b, c] = t.map(|k| mesh.vertices[k as usize]);
            let n = parts((b - a).cross(c - a).length().sqrt(), (a + b + c) / 3.0);
            let (first, owners) = (self.first, &mut self.owners);
            let mut own = |column: u8, row: u8| {
                owners.push(Owner { surface, triangle: triangle as u32, at: [column, row] });
                first + owners.len() as u32 - 1
            };
            let mut of = Lattice { parts: n, turned: [false; 3], corners: [0; 3], edges: [0; 3], inside: 0 };
            for (k, at) in [[0, 0], [n, 0], [0, n]].into_iter().enumerate() {
                let corner = &mut corners[t[k] as usize];
                if *corner == NONE {
                    *corner = own(at[0], at[1]);
                }
                of.corners[k] = *corner;
            }
            for (k, [from, to]) in EDGES.map(|e| e.map(|c| t[c])).into_iter().enumerate() {
                of.turned[k] = from > to;
                of.edges[k] = *edges.entry((from.min(to), from.max(to), n)).or_insert_with(|| {
                    let step = |s: u8| if of.turned[k] { n - s } else { s };
                    let points = (1..n).map(|s| match k {
                        0 => own(step(s), 0),
                        1 => own(0, step(s)),
                        _ => own(n - step(s), step(s)),
                    });
                    points.reduce(|first, _| first).unwrap_or(0)
                });
            }
            of.inside = first + owners.len() as u32;
            for row in 1..n {
                for column in 1..n - row {
                    owners.push(Owner { surface, triangle: triangle as u32, at: [column, row] });
                }
            }
            made.push(of);
        }
        self.triangles.push(made);
    }
}

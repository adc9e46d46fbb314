//! Points around a vertex.

use strandbench_types::TriMesh;

/// Triangles around each vertex: running areas and triangle, ranges by vertex.
pub(super) struct Patches {
    starts: Vec<u32>,
    of: Vec<(f32, u32)>,
}

impl Patches {
    pub fn new(mesh: &TriMesh) -> Patches {
        let mut starts = vec![0u32; mesh.vertices.len() + 1];
        mesh.triangles.iter().flatten().for_each(|&v| starts[v as usize + 1] += 1);
        for i in 1..starts.len() {
            starts[i] += starts[i - 1];
        }
        let mut next = starts.clone();
        let mut of = vec![(0.0, 0); mesh.triangles.len() * 3];
        for (i, t) in mesh.triangles.iter().enumerate() {
            let [a, b, c] = t.map(|k| mesh.vertices[k as usize]);
            let area = (b - a).cross(c - a).length();
            for &v in t {
                of[next[v as usize] as usize] = (area, i as u32);
                next[v as usize] += 1;
            }
        }
        for w in starts.windows(2) {
            let mut sum = 0.0;
            for (area, _) in &mut of[w[0] as usize..w[1] as usize] {
                sum += *area;
                *area = sum;
            }
        }
        Patches { starts, of }
    }

    /// A triangle around the vertex in proportion to area; `None` if there is none with an area.
    pub fn draw(&self, vertex: usize, u: f32) -> Option<usize> {
        let around = &self.of[self.starts[vertex] as usize..self.starts[vertex + 1] as usize];
        let total = around.last()?.0;
        let i = around.partition_point(|a| a.0 <= u * total).min(around.len() - 1);
        (total > 0.0).then_some(around[i].1 as usize)
    }
}

/// Weight of the corner whose hat function is the density over a triangle: of density 6 b (1 - b), from its inverse.
pub(super) fn hat(u: f32) -> f32 {
    0.5 - libm::sinf(libm::asinf((1.0 - 2.0 * u).clamp(-1.0, 1.0)) / 3.0)
}

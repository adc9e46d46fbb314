//! Triangle meshes.

use glam::Vec3;

/// Triangles over shared vertices, mm, world, wound counter-clockwise seen from outside.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct TriMesh {
    /// Vertex positions, mm.
    pub vertices: Vec<Vec3>,
    /// Vertex indices, three a triangle.
    pub triangles: Vec<[u32; 3]>,
}

impl TriMesh {
    /// Unit vertex normals, area-weighted; zero for a vertex of no triangle.
    pub fn vertex_normals(&self) -> Vec<Vec3> {
        let mut n = vec![Vec3::ZERO; self.vertices.len()];
        for t in &self.triangles {
            let [a, b, c] = t.map(|i| self.vertices[i as usize]);
            let area = (b - a).cross(c - a);
            for &i in t {
                n[i as usize] += area;
            }
        }
        n.iter().map(|v| v.normalize_or_zero()).collect()
    }

    /// Lowest and highest corner, mm; `None` without vertices.
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        let first = *self.vertices.first()?;
        Some(self.vertices.iter().fold((first, first), |(lo, hi), &v| (lo.min(v), hi.max(v))))
    }

    /// Says what is wrong with the mesh, if anything is: an index out of range or a vertex not finite.
    pub fn validate(&self) -> Result<(), String> {
        if let Some(i) = self.vertices.iter().position(|v| !v.is_finite()) {
            return Err(format!("vertex {i} is not finite"));
        }
        let n = self.vertices.len();
        if let Some(i) = self.triangles.iter().position(|t| t.iter().any(|&k| k as usize >= n)) {
            return Err(format!("triangle {i} names a vertex beyond the {n} there are"));
        }
        Ok(())
    }
}

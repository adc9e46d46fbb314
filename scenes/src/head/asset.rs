//! The embedded head: decoding, and one step of Catmull-Clark subdivision.

use crate::subdivision::{Refinement, triangles};
use glam::Vec3;

/// Made by `assets/derive_head.py` from the MakeHuman base mesh (CC0).
static HEAD_BIN: &[u8] = include_bytes!("../../assets/head.bin");

/// A mesh of quads with a weight per vertex.
#[derive(Clone, Debug, Default)]
pub(crate) struct QuadMesh {
    pub vertices: Vec<Vec3>,
    /// 1 on the outer ear, 0 elsewhere, indexed [vertex].
    pub ear: Vec<f32>,
    pub quads: Vec<[u32; 4]>,
}

struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl Reader<'_> {
    fn take<const N: usize>(&mut self) -> [u8; N] {
        let out = self.bytes[self.at..self.at + N].try_into().expect("N bytes");
        self.at += N;
        out
    }
    fn u16(&mut self) -> u16 {
        u16::from_le_bytes(self.take())
    }
    fn u32(&mut self) -> u32 {
        u32::from_le_bytes(self.take())
    }
    fn vec3(&mut self) -> Vec3 {
        Vec3::from_array(std::array::from_fn(|_| f32::from_le_bytes(self.take())))
    }
}

/// Skin and eyes of the embedded head, mm at its own size.
pub(crate) fn load() -> (QuadMesh, QuadMesh) {
    let mut r = Reader { bytes: HEAD_BIN, at: 0 };
    assert_eq!(&r.take::<8>(), b"SBHEAD1\0", "head.bin is not a head");
    let (vertices, skin, eyes) = (r.u32(), r.u32(), r.u32());
    let (low, high) = (r.vec3(), r.vec3());
    let points: Vec<Vec3> = (0..vertices)
        .map(|_| {
            let q = Vec3::from_array(std::array::from_fn(|_| f32::from(r.u16()) / 65535.0));
            low + q * (high - low)
        })
        .collect();
    let ear: Vec<f32> = (0..vertices).map(|_| f32::from(r.take::<1>()[0]) / 255.0).collect();
    let mut quads =
        |n: u32| -> Vec<[u32; 4]> { (0..n).map(|_| std::array::from_fn(|_| u32::from(r.u16()))).collect() };
    let (skin, eyes) = (quads(skin), quads(eyes));
    assert_eq!(r.at, HEAD_BIN.len(), "head.bin has a tail");
    (compact(&points, &ear, &skin), compact(&points, &ear, &eyes))
}

fn compact(points: &[Vec3], ear: &[f32], quads: &[[u32; 4]]) -> QuadMesh {
    let mut index = vec![u32::MAX; points.len()];
    let mut out = QuadMesh::default();
    for q in quads {
        out.quads.push(q.map(|i| {
            let slot = &mut index[i as usize];
            if *slot == u32::MAX {
                *slot = out.vertices.len() as u32;
                out.vertices.push(points[i as usize]);
                out.ear.push(ear[i as usize]);
            }
            *slot
        }));
    }
    out
}

impl QuadMesh {
    /// One step of Catmull and Clark.
    pub fn subdivided(&self) -> QuadMesh {
        let step = Refinement::new(&self.quads, self.vertices.len());
        QuadMesh { vertices: step.smooth(&self.vertices), ear: step.linear(&self.ear), quads: step.quads }
    }

    /// Each quad as two triangles.
    pub fn triangles(&self) -> Vec<[u32; 3]> {
        triangles(&self.quads)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_subdivided_cube_has_the_known_corner_and_stays_closed() {
        let v =
            |i: u32| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2 & 1) as f32) * 2.0 - Vec3::ONE;
        let cube = QuadMesh {
            vertices: (0..8).map(v).collect(),
            ear: vec![0.0; 8],
            quads: vec![[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]],
        };
        let s = cube.subdivided();
        assert_eq!((s.vertices.len(), s.quads.len()), (26, 24));
        // n = 3: (F + 2R + 0) / 3 with F = 1/3 and R = 2/3 of the corner: 5/9.
        assert!((s.vertices[7] - Vec3::splat(5.0 / 9.0)).length() < 1e-6, "{}", s.vertices[7]);
        let volume: f32 = s
            .triangles()
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|i| s.vertices[i as usize]);
                a.dot(b.cross(c)) / 6.0
            })
            .sum();
        assert!(volume > 0.0 && volume < 8.0, "wound outward, shrunk: {volume}");
    }

    #[test]
    fn the_head_is_the_size_of_a_head_and_wound_outward() {
        let (skin, eyes) = load();
        assert!(skin.quads.len() > 4000 && eyes.quads.len() > 100);
        let n_ear = skin.ear.iter().filter(|&&e| e > 0.5).count();
        assert!((100..900).contains(&n_ear), "{n_ear} vertices of ears");
        for mesh in [&skin, &eyes] {
            let s = mesh.subdivided();
            let centre = s.vertices.iter().sum::<Vec3>() / s.vertices.len() as f32;
            let volume: f32 = s
                .triangles()
                .iter()
                .map(|t| {
                    let [a, b, c] = t.map(|i| s.vertices[i as usize] - centre);
                    a.dot(b.cross(c)) / 6.0
                })
                .sum();
            assert!(volume > 0.0, "inside out: {volume} mm³");
        }
    }
}

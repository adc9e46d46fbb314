//! A sampled signed distance field: exact at the nodes, trilinear between them.

use super::bvh::MeshBvh;
use glam::Vec3;
use rayon::prelude::*;

pub(crate) struct Sdf {
    low: Vec3,
    cell_mm: f32,
    size: [usize; 3],
    /// Distance and unit gradient, x fastest.
    nodes: Vec<(f32, Vec3)>,
}

impl Sdf {
    /// Samples the mesh over a box.
    pub fn new(bvh: &MeshBvh, low: Vec3, high: Vec3, cell_mm: f32) -> Sdf {
        let size = ((high - low) / cell_mm).ceil().to_array().map(|n| n as usize + 1);
        let [nx, ny, nz] = size;
        let mut nodes = vec![(0.0, Vec3::ZERO); nx * ny * nz];
        nodes.par_chunks_mut(nx).enumerate().for_each(|(row, out)| {
            let (y, z) = (row % ny, row / ny);
            let mut hint = None;
            for (x, node) in out.iter_mut().enumerate() {
                let p = low + Vec3::new(x as f32, y as f32, z as f32) * cell_mm;
                let c = bvh.closest(p, hint);
                hint = Some(c.triangle);
                *node = (c.distance, c.normal);
            }
        });
        Sdf { low, cell_mm, size, nodes }
    }

    /// The field averaged over a cube of `2 reach + 1` nodes a side, with its own gradient: what thick hair
    /// feels of the head, without ears and nose.
    pub fn blurred(&self, reach: usize) -> Sdf {
        let [nx, ny, nz] = self.size;
        let strides = [1, nx, nx * ny];
        let mut d: Vec<f32> = self.nodes.iter().map(|n| n.0).collect();
        for axis in 0..3 {
            let source = d;
            let (len, stride) = (self.size[axis], strides[axis]);
            d = (0..source.len())
                .into_par_iter()
                .map(|i| {
                    let at = i / stride % len;
                    let (a, b) = (at.saturating_sub(reach), (at + reach).min(len - 1));
                    let sum: f32 = (a..=b).map(|k| source[i + k * stride - at * stride]).sum();
                    sum / (b - a + 1) as f32
                })
                .collect();
        }
        let nodes = (0..nx * ny * nz)
            .into_par_iter()
            .map(|i| {
                let slope = |axis: usize| {
                    let (len, stride) = (self.size[axis], strides[axis]);
                    let at = i / stride % len;
                    let (a, b) = (at.saturating_sub(1), (at + 1).min(len - 1));
                    (d[i + b * stride - at * stride] - d[i + a * stride - at * stride]) / (b - a) as f32
                };
                (d[i], Vec3::new(slope(0), slope(1), slope(2)).normalize_or(Vec3::Y))
            })
            .collect();
        Sdf { low: self.low, cell_mm: self.cell_mm, size: self.size, nodes }
    }

    /// Distance (mm, negative inside) and unit outward direction; beyond the box, a lower bound of it.
    pub fn sample(&self, p: Vec3) -> (f32, Vec3) {
        let g = (p - self.low) / self.cell_mm;
        let top = Vec3::new((self.size[0] - 1) as f32, (self.size[1] - 1) as f32, (self.size[2] - 1) as f32);
        let inside = g.clamp(Vec3::ZERO, top);
        let i = inside.min(top - Vec3::ONE).floor();
        let f = inside - i;
        let base = i.x as usize + self.size[0] * (i.y as usize + self.size[1] * i.z as usize);
        let (sy, sz) = (self.size[0], self.size[0] * self.size[1]);
        let mut d = 0.0;
        let mut n = Vec3::ZERO;
        for (offset, w) in [
            (0, (1.0 - f.x) * (1.0 - f.y) * (1.0 - f.z)),
            (1, f.x * (1.0 - f.y) * (1.0 - f.z)),
            (sy, (1.0 - f.x) * f.y * (1.0 - f.z)),
            (sy + 1, f.x * f.y * (1.0 - f.z)),
            (sz, (1.0 - f.x) * (1.0 - f.y) * f.z),
            (sz + 1, f.x * (1.0 - f.y) * f.z),
            (sz + sy, (1.0 - f.x) * f.y * f.z),
            (sz + sy + 1, f.x * f.y * f.z),
        ] {
            let (nd, nn) = self.nodes[base + offset];
            d += nd * w;
            n += nn * w;
        }
        let beyond = (g - inside) * self.cell_mm;
        if beyond == Vec3::ZERO {
            (d, n.normalize_or(Vec3::Y))
        } else {
            (d + beyond.length(), (n * d.max(0.0) + beyond).normalize_or(Vec3::Y))
        }
    }
}

//! A frame's envelope with what the temporal half of the method asks of it.

use crate::ReconError;
use crate::envelope::{Envelope, orientation_3d, triangulate};
use crate::tensor::{Tensor, outer};
use glam::{DVec2, DVec3, Vec3};
use strandbench_solve::deform::{DeformError, Surface};
use strandbench_types::{Camera, DepthMap, OrientationField, Plane};

/// An envelope, vertex by vertex.
#[derive(Clone, Debug)]
pub struct FrameSurface {
    /// Time index.
    pub frame: u32,
    /// Depth in the reference camera.
    pub depth: DepthMap,
    /// The mesh, and which vertex is which pixel's (`u32::MAX` for none).
    pub envelope: Envelope,
    /// Row-major pixel of each vertex.
    pub pixels: Vec<u32>,
    /// Unit normal of each vertex, towards the camera.
    pub normals: Vec<Vec3>,
}

impl FrameSurface {
    /// The envelope of a depth map.
    ///
    /// # Errors
    /// If it has no triangle.
    pub fn new(
        camera: &Camera,
        frame: u32,
        depth: DepthMap,
        cut_mm: f32,
    ) -> Result<FrameSurface, ReconError> {
        let envelope = triangulate(camera, &depth, cut_mm);
        if envelope.mesh.triangles.is_empty() {
            return Err(ReconError::NoSurface { frame, pixels: depth.answered() });
        }
        let mut pixels = vec![0u32; envelope.mesh.vertices.len()];
        for (pixel, &v) in envelope.vertex.data.iter().enumerate() {
            if v != u32::MAX {
                pixels[v as usize] = pixel as u32;
            }
        }
        let normals = envelope.mesh.vertex_normals();
        Ok(FrameSurface { frame, depth, envelope, pixels, normals })
    }

    /// Number of vertices.
    pub fn len(&self) -> usize {
        self.pixels.len()
    }

    /// Whether there are none; never so once made.
    pub fn is_empty(&self) -> bool {
        self.pixels.is_empty()
    }

    /// Centre of a vertex's pixel.
    pub fn centre_px(&self, vertex: usize) -> DVec2 {
        let (i, w) = (self.pixels[vertex] as usize, self.depth.size().0);
        DVec2::new((i % w) as f64 + 0.5, (i / w) as f64 + 0.5)
    }

    /// The vertex of the pixel at a position, if it has one.
    pub fn vertex_at(&self, pixel: DVec2) -> Option<usize> {
        let (w, h) = self.depth.size();
        let inside = pixel.x >= 0.0 && pixel.y >= 0.0 && pixel.x < w as f64 && pixel.y < h as f64;
        let v = if inside { *self.envelope.vertex.at(pixel.x as usize, pixel.y as usize) } else { u32::MAX };
        (v != u32::MAX).then_some(v as usize)
    }

    /// Depth at a position between pixel centres, mm: bilinear where the four pixels around are answered and within
    /// `step_mm` of each other, else that of the pixel itself; `None` where that is not answered.
    pub fn depth_at(&self, pixel: DVec2, step_mm: f32) -> Option<f64> {
        let (w, h) = self.depth.size();
        if !(pixel.x >= 0.0 && pixel.y >= 0.0 && pixel.x < w as f64 && pixel.y < h as f64) {
            return None;
        }
        let own = self.depth.get(pixel.x as usize, pixel.y as usize)?;
        let (fx, fy) = (pixel.x - 0.5, pixel.y - 0.5);
        if fx < 0.0 || fy < 0.0 || fx >= (w - 1) as f64 || fy >= (h - 1) as f64 {
            return Some(f64::from(own));
        }
        let (x, y) = (fx as usize, fy as usize);
        let four = [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)].map(|(x, y)| self.depth.get(x, y));
        let [Some(a), Some(b), Some(c), Some(d)] = four else { return Some(f64::from(own)) };
        if a.max(b).max(c).max(d) - a.min(b).min(c).min(d) > step_mm {
            return Some(f64::from(own));
        }
        let (u, v) = (fx - x as f64, fy - y as f64);
        let [a, b, c, d] = [a, b, c, d].map(f64::from);
        Some((a * (1.0 - u) + b * u) * (1.0 - v) + (c * (1.0 - u) + d * u) * v)
    }

    /// The mesh as a target of registrations.
    ///
    /// # Errors
    /// If a number is not finite.
    pub fn target(&self) -> Result<Surface, DeformError> {
        let points: Vec<DVec3> = self.envelope.mesh.vertices.iter().map(|v| v.as_dvec3()).collect();
        let normals = self.normals.iter().map(|n| n.as_dvec3()).collect();
        Surface::new(points, normals, self.envelope.mesh.triangles.clone())
    }

    /// T = ℓ ℓᵀ at each vertex: ℓ = n_l × n_p of unit length times the strength |O| of the pixel's 2-D line (5.1);
    /// zero where there is no line.
    pub fn tensors(&self, camera: &Camera, field: &OrientationField) -> Vec<Tensor> {
        let lines = orientation_3d(camera, field, &self.envelope);
        self.pixels
            .iter()
            .map(|&i| {
                let strength = field.line(i as usize).map_or(0.0, |l| l.1);
                outer(lines.data[i as usize] * strength)
            })
            .collect()
    }

    /// A value a vertex as a raster, `none` elsewhere.
    pub fn raster<T: Clone>(&self, values: &[T], none: T) -> Plane<T> {
        let (w, h) = self.depth.size();
        let mut plane = Plane::filled(w, h, none);
        for (&i, v) in self.pixels.iter().zip(values) {
            plane.data[i as usize] = v.clone();
        }
        plane
    }
}

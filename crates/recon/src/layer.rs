//! The hair layer as voxels: between the tracked template and its inner offset, around the envelope, and inside the
//! visual hull (5.2, 5.3).

use crate::surface::FrameSurface;
use crate::{ReconError, StrandParameters};
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use strandbench_solve::deform::Surface;
use strandbench_types::{Silhouette, in_hull};

/// No voxel.
pub const NO_VOXEL: u32 = u32::MAX;

/// Most voxels of a box around the hair: its index then takes half a gigabyte.
const VOXEL_LIMIT: u64 = 1 << 27;

/// A box of voxels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VoxelBox {
    /// Lowest corner, mm.
    pub origin: Vec3,
    /// Edge of a voxel, mm.
    pub voxel_mm: f32,
    /// Voxels along x, y and z.
    pub size: [usize; 3],
}

impl VoxelBox {
    /// The box from `low` to `high` (mm), rounded up to whole voxels.
    ///
    /// # Errors
    /// If there are too many.
    pub fn new(frame: u32, low: Vec3, high: Vec3, voxel_mm: f32) -> Result<VoxelBox, ReconError> {
        let counts = ((high - low) / voxel_mm).ceil().max(Vec3::ONE);
        let voxels = f64::from(counts.x) * f64::from(counts.y) * f64::from(counts.z);
        if !(voxels <= VOXEL_LIMIT as f64 && counts.max_element() <= f32::from(u16::MAX)) {
            return Err(ReconError::TooManyVoxels {
                frame,
                voxels: voxels as u64,
                voxel_mm,
                limit: VOXEL_LIMIT,
            });
        }
        Ok(VoxelBox { origin: low, voxel_mm, size: counts.to_array().map(|c| c as usize) })
    }

    /// Number of voxels.
    pub fn count(&self) -> usize {
        self.size[0] * self.size[1] * self.size[2]
    }

    /// Row-major index of a voxel, x fastest.
    pub fn index(&self, v: [usize; 3]) -> usize {
        (v[2] * self.size[1] + v[1]) * self.size[0] + v[0]
    }

    /// Centre of a voxel, mm.
    pub fn centre(&self, v: [usize; 3]) -> Vec3 {
        self.origin + (Vec3::from_array(v.map(|c| c as f32)) + 0.5) * self.voxel_mm
    }

    /// The voxel that holds a point, if the box does.
    pub fn holding(&self, at: Vec3) -> Option<[usize; 3]> {
        let v = ((at - self.origin) / self.voxel_mm).floor().to_array();
        let inside = v.iter().zip(self.size).all(|(&c, n)| c >= 0.0 && c < n as f32);
        inside.then(|| v.map(|c| c as usize))
    }

    /// The eight voxels whose centres surround a point, with trilinear weights; `None` for those outside the box.
    pub fn around(&self, at: Vec3) -> [(Option<usize>, f32); 8] {
        let p = (at - self.origin) / self.voxel_mm - 0.5;
        let base = p.floor();
        let share = p - base;
        std::array::from_fn(|k| {
            let high = [k & 1, k >> 1 & 1, k >> 2];
            let mut w = 1.0;
            let mut v = [0usize; 3];
            let mut inside = true;
            for a in 0..3 {
                w *= if high[a] == 1 { share[a] } else { 1.0 - share[a] };
                let c = base[a] + high[a] as f32;
                inside &= c >= 0.0 && c < self.size[a] as f32;
                v[a] = c as usize;
            }
            (inside.then(|| self.index(v)), w)
        })
    }
}

/// Signed distances to a surface with borders, mm, negative inside (against the normals), on a box of voxels.
#[derive(Clone, Debug)]
pub struct SignedDistance {
    /// The box.
    pub grid: VoxelBox,
    /// Distance at each voxel's centre; NaN farther away than asked for, and where the nearest point of the surface
    /// lies on its border: there is no inside beyond an edge.
    pub distance_mm: Vec<f32>,
}

/// Voxels along the edge of a block that is skipped whole if the surface is far away.
const BLOCK: usize = 8;

impl SignedDistance {
    /// Distances up to `inside_mm` below a surface and `outside_mm` above it.
    ///
    /// # Errors
    /// If the box has too many voxels.
    pub fn new(
        frame: u32,
        surface: &Surface,
        inside_mm: f32,
        outside_mm: f32,
        voxel_mm: f32,
    ) -> Result<SignedDistance, ReconError> {
        let reach = inside_mm.max(outside_mm) + 2.0 * voxel_mm;
        let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for p in surface.points() {
            low = low.min(p.as_vec3());
            high = high.max(p.as_vec3());
        }
        let grid = VoxelBox::new(frame, low - reach, high + reach, voxel_mm)?;
        let mut distance_mm = vec![f32::NAN; grid.count()];
        let slab = grid.size[0] * grid.size[1] * BLOCK;
        let half_diagonal = voxel_mm * BLOCK as f32 * 0.5 * 3f32.sqrt();
        distance_mm.par_chunks_mut(slab).enumerate().for_each(|(bz, out)| {
            let planes = out.len() / (grid.size[0] * grid.size[1]);
            for by in 0..grid.size[1].div_ceil(BLOCK) {
                for bx in 0..grid.size[0].div_ceil(BLOCK) {
                    let corner = [bx * BLOCK, by * BLOCK, bz * BLOCK];
                    let middle = grid.centre(corner) + (BLOCK as f32 - 1.0) * 0.5 * voxel_mm;
                    if surface.nearest(middle.as_dvec3(), f64::from(reach + half_diagonal)).is_none() {
                        continue;
                    }
                    for z in 0..planes {
                        for y in corner[1]..(corner[1] + BLOCK).min(grid.size[1]) {
                            for x in corner[0]..(corner[0] + BLOCK).min(grid.size[0]) {
                                let at = grid.centre([x, y, corner[2] + z]).as_dvec3();
                                if let Some(d) = signed(surface, at, reach) {
                                    out[(z * grid.size[1] + y) * grid.size[0] + x] = d;
                                }
                            }
                        }
                    }
                }
            }
        });
        Ok(SignedDistance { grid, distance_mm })
    }

    /// Distance at a point, mm, trilinear between voxels; `None` where one of them has none.
    pub fn at(&self, p: Vec3) -> Option<f32> {
        let mut sum = 0.0;
        for (voxel, w) in self.grid.around(p) {
            sum += w * self.distance_mm[voxel?];
        }
        (!sum.is_nan()).then_some(sum)
    }
}

fn signed(surface: &Surface, at: DVec3, reach: f32) -> Option<f32> {
    let near = surface.nearest(at, f64::from(reach))?;
    if surface.border()[near.vertex] {
        return None;
    }
    let offset = at - near.point;
    let d = offset.length() as f32;
    Some(if offset.dot(near.normal) < 0.0 { -d } else { d })
}

/// The active voxels of a frame.
#[derive(Clone, Debug)]
pub struct Layer {
    /// The box that holds them.
    pub grid: VoxelBox,
    /// Edge of a voxel, mm.
    pub voxel_mm: f32,
    /// Coordinates of the active voxels, sorted by z, y, x.
    pub voxels: Vec<[u16; 3]>,
    /// Active voxel at each place of the box, `NO_VOXEL` for none.
    index: Vec<u32>,
}

impl Layer {
    /// Voxels at most `layer_mm` below the template and at most one voxel above it, and those within one voxel of the
    /// envelope, which may stand out of the smoother template; of all these, the ones inside the visual hull.
    ///
    /// # Errors
    /// If the box has too many voxels.
    pub fn new(
        surface: &FrameSurface,
        template: &SignedDistance,
        silhouettes: &[Silhouette<'_>],
        p: &StrandParameters,
    ) -> Result<Layer, ReconError> {
        let h = p.voxel_mm;
        let (low, high) = surface.envelope.mesh.bounds().unwrap_or_default();
        let edge = template.grid.voxel_mm * Vec3::from_array(template.grid.size.map(|n| n as f32));
        let low = low.min(template.grid.origin) - 2.0 * h;
        let high = high.max(template.grid.origin + edge) + 2.0 * h;
        let grid = VoxelBox::new(surface.frame, low, high, h)?;
        let mut touched = vec![false; grid.count()];
        for v in &surface.envelope.mesh.vertices {
            let Some(c) = grid.holding(*v) else { continue };
            let span = |a: usize| c[a].saturating_sub(1)..(c[a] + 2).min(grid.size[a]);
            for z in span(2) {
                for y in span(1) {
                    for x in span(0) {
                        touched[grid.index([x, y, z])] = true;
                    }
                }
            }
        }
        let plane = grid.size[0] * grid.size[1];
        let rows: Vec<Vec<[u16; 3]>> = (0..grid.size[2])
            .into_par_iter()
            .map(|z| {
                let mut active = Vec::new();
                for i in 0..plane {
                    let v = [i % grid.size[0], i / grid.size[0], z];
                    let at = grid.centre(v);
                    let between = || template.at(at).is_some_and(|d| d >= -p.layer_mm && d <= h);
                    if (touched[z * plane + i] || between()) && in_hull(silhouettes, at.as_dvec3()) {
                        active.push(v.map(|c| c as u16));
                    }
                }
                active
            })
            .collect();
        let voxels = rows.concat();
        Ok(Layer::from_voxels(grid, voxels))
    }

    /// A layer of given voxels, sorted by z, y, x.
    pub fn from_voxels(grid: VoxelBox, voxels: Vec<[u16; 3]>) -> Layer {
        let mut index = vec![NO_VOXEL; grid.count()];
        for (i, v) in voxels.iter().enumerate() {
            index[grid.index(v.map(usize::from))] = i as u32;
        }
        Layer { grid, voxel_mm: grid.voxel_mm, voxels, index }
    }

    /// Whether a point (mm) lies in an active voxel.
    pub fn contains(&self, at: Vec3) -> bool {
        self.grid.holding(at).is_some_and(|v| self.index[self.grid.index(v)] != NO_VOXEL)
    }

    /// The eight voxels around a point with trilinear weights; inactive ones are `NO_VOXEL`.
    pub fn around(&self, at: Vec3) -> [(u32, f32); 8] {
        self.grid.around(at).map(|(i, w)| (i.map_or(NO_VOXEL, |i| self.index[i]), w))
    }
}

//! From one camera's hits to the truth of its view.

use crate::GroundTruthError;
use crate::tensor::Tensor;
use crate::visibility::Arcs;
use glam::{DVec2, Vec3};
use rayon::prelude::*;
use std::f64::consts::PI;
use strandbench_types::{Camera, DepthMap, Plane, Rig, SampleHit, SampleHits, StrandSet, ViewTruth};

/// Segments shorter than this have no direction, mm (METRICS ground rule 3).
const MIN_SEGMENT_MM: f64 = 1e-6;

/// How far (px) beyond its pixel a hit may project, over the fibre's own width: a reconstruction filter may
/// spread its rays a little beyond the pixel.
const PIXEL_SLACK: f64 = 1.5;

#[derive(Clone, Copy)]
struct PixelTruth {
    first: f32,
    at_05: f32,
    at_50: f32,
    coverage: f32,
    angle: f32,
    agreement: f32,
    axis: Vec3,
}

const BARE: PixelTruth = PixelTruth {
    first: f32::NAN,
    at_05: f32::NAN,
    at_50: f32::NAN,
    coverage: 0.0,
    angle: f32::NAN,
    agreement: 0.0,
    axis: Vec3::ZERO,
};

/// The truth of view `camera`, and one visibility key for each hit.
pub(crate) fn reduce(
    rig: &Rig,
    camera: usize,
    strands: &StrandSet,
    arcs: &Arcs,
    buffer: &SampleHits,
) -> Result<(ViewTruth, Vec<u64>), GroundTruthError> {
    let (width, height) = (buffer.width, buffer.height);
    let mut touched = vec![0u64; buffer.hits.len()];
    let mut rows = Vec::with_capacity(height);
    let mut rest = touched.as_mut_slice();
    for y in 0..height {
        let n = (buffer.offsets[(y + 1) * width] - buffer.offsets[y * width]) as usize;
        let (row, after) = rest.split_at_mut(n);
        rows.push((y, row));
        rest = after;
    }
    let geometry = Geometry { camera: &rig.cameras[camera], index: camera, strands, arcs };
    // Results are looked at in row order, so that the error reported does not depend on scheduling.
    let rows: Vec<Result<Vec<PixelTruth>, GroundTruthError>> =
        rows.into_par_iter().map(|(y, keys)| geometry.row(buffer, y, keys)).collect();
    let mut pixels = Vec::with_capacity(width * height);
    for row in rows {
        pixels.extend(row?);
    }
    let plane = |f: fn(&PixelTruth) -> f32| Plane { width, height, data: pixels.iter().map(f).collect() };
    let view = ViewTruth {
        depth_first: DepthMap::from_raw(plane(|p| p.first)),
        depth_05: DepthMap::from_raw(plane(|p| p.at_05)),
        depth_50: DepthMap::from_raw(plane(|p| p.at_50)),
        coverage: plane(|p| p.coverage),
        mask: Plane { width, height, data: pixels.iter().map(|p| !p.at_50.is_nan()).collect() },
        orientation_2d: plane(|p| p.angle),
        orientation_agreement: plane(|p| p.agreement),
        orientation_3d: Plane { width, height, data: pixels.iter().map(|p| p.axis).collect() },
    };
    Ok((view, touched))
}

struct Geometry<'a> {
    camera: &'a Camera,
    index: usize,
    strands: &'a StrandSet,
    arcs: &'a Arcs,
}

impl Geometry<'_> {
    fn row(
        &self,
        buffer: &SampleHits,
        y: usize,
        mut keys: &mut [u64],
    ) -> Result<Vec<PixelTruth>, GroundTruthError> {
        let mut depths = Vec::new();
        (0..buffer.width)
            .map(|x| {
                let i = y * buffer.width + x;
                let hits = buffer.pixel(i);
                let (own, after) = std::mem::take(&mut keys).split_at_mut(hits.len());
                keys = after;
                self.pixel((x, y), hits, buffer.rays[i], own, &mut depths)
            })
            .collect()
    }

    fn pixel(
        &self,
        (x, y): (usize, usize),
        hits: &[SampleHit],
        rays: u16,
        keys: &mut [u64],
        depths: &mut Vec<f32>,
    ) -> Result<PixelTruth, GroundTruthError> {
        if hits.is_empty() {
            return Ok(BARE);
        }
        let mut doubled = DVec2::ZERO;
        let mut tensor = Tensor::default();
        let mut directed = 0u32;
        for (hit, key) in hits.iter().zip(keys) {
            let fault = |fault: String| GroundTruthError::Hit {
                camera: self.index,
                x,
                y,
                strand: hit.strand,
                segment: hit.segment,
                fault,
            };
            let (strand, segment) = (hit.strand as usize, hit.segment as usize);
            if strand >= self.strands.len() {
                return Err(fault(format!("names none of the {} strands", self.strands.len())));
            }
            let points = self.strands.range(strand);
            if segment + 1 >= points.len() {
                return Err(fault(format!("names none of its {} segments", points.len() - 1)));
            }
            if !(0.0..=1.0).contains(&hit.along) {
                return Err(fault(format!("lies at {} along the segment, outside 0..1", hit.along)));
            }
            let k = points.start + segment;
            let a = self.strands.points[k].as_dvec3();
            let b = self.strands.points[k + 1].as_dvec3();
            let c = self.camera.to_camera(a.lerp(b, f64::from(hit.along)));
            let radius = f64::from(self.strands.radii_mm[k].max(self.strands.radii_mm[k + 1]));
            self.agrees(hit, (x, y), c, radius).map_err(fault)?;

            let arc = &self.arcs.arc_mm[k..k + 2];
            *key = self.arcs.key(strand, arc[0] + f64::from(hit.along) * (arc[1] - arc[0]), rays);

            let length = (b - a).length();
            if length < MIN_SEGMENT_MM {
                continue;
            }
            directed += 1;
            let t = (b - a) / length;
            tensor.add(t);
            // Derivative of the pixel position along t, up to the factor 1/z².
            let d = self.camera.camera_from_world * t;
            let v = self.camera.focal_px * DVec2::new(d.x * c.z - c.x * d.z, d.y * c.z - c.y * d.z);
            let vv = v.length_squared();
            if vv > 0.0 {
                doubled += DVec2::new(v.x * v.x - v.y * v.y, 2.0 * v.x * v.y) / vv;
            }
        }
        depths.clear();
        depths.extend(hits.iter().map(|h| h.depth_mm));
        depths.sort_unstable_by(f32::total_cmp);
        let order = |k: usize| depths.get(k.max(1) - 1).copied().unwrap_or(f32::NAN);
        let n = usize::from(rays);
        let agreement = doubled.length() / f64::from(directed.max(1));
        Ok(PixelTruth {
            first: depths[0],
            at_05: order(n.div_ceil(20)),
            at_50: order(n.div_ceil(2)),
            coverage: hits.len() as f32 / f32::from(rays),
            angle: line_angle(doubled),
            agreement: agreement as f32,
            axis: tensor.principal_axis().as_vec3(),
        })
    }

    /// Whether a hit lies where its segment lies: `c` is the point on the axis in camera coordinates.
    fn agrees(
        &self,
        hit: &SampleHit,
        (x, y): (usize, usize),
        c: glam::DVec3,
        radius: f64,
    ) -> Result<(), String> {
        let depth = f64::from(hit.depth_mm);
        if !(depth.is_finite() && depth > 0.0) {
            return Err(format!("has depth {depth} mm"));
        }
        let off = (depth - c.z).abs();
        if c.z <= 0.0 || off > 2.0 * radius + 0.02 + 1e-5 * c.z {
            return Err(format!("has depth {depth} mm where the segment's axis is at {:.3} mm", c.z));
        }
        let p = self.camera.focal_px * DVec2::new(c.x, c.y) / c.z + self.camera.principal_px;
        let beyond = (p - DVec2::new(x as f64 + 0.5, y as f64 + 0.5)).abs().max_element() - 0.5;
        if beyond > PIXEL_SLACK + 2.0 * radius * self.camera.focal_px.max_element() / c.z {
            return Err(format!("projects to ({:.2}, {:.2})", p.x, p.y));
        }
        Ok(())
    }
}

/// Angle in [0, π) of a line whose doubled angle has this direction; NaN if there is none.
fn line_angle(doubled: DVec2) -> f32 {
    if doubled == DVec2::ZERO {
        return f32::NAN;
    }
    let half = 0.5 * doubled.y.atan2(doubled.x);
    let angle = if half < 0.0 { half + PI } else { half } as f32;
    // Rounding to f32 can reach π itself, which is the line at 0.
    if angle >= PI as f32 { 0.0 } else { angle }
}

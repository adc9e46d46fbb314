//! The visual hull of masks: points that every camera whose image reaches them shows as hair.

use crate::{Camera, Plane, Rig};
use glam::{DVec2, DVec3};

/// Depths tried along a ray, at least and at most; between them, one per pixel that the ray's image moves
/// in the camera where it moves farthest.
const STEPS: (usize, usize) = (64, 1024);

/// A camera and its hair mask.
#[derive(Clone, Copy, Debug)]
pub struct Silhouette<'a> {
    /// The camera.
    pub camera: &'a Camera,
    /// True where its image shows hair.
    pub mask: &'a Plane<bool>,
}

/// Whether a point (mm) lies inside the visual hull: inside the mask of every camera whose image reaches it.
pub fn in_hull(silhouettes: &[Silhouette<'_>], at: DVec3) -> bool {
    silhouettes.iter().all(|s| match s.camera.project(at) {
        Some((q, _)) if s.camera.contains(q) => *s.mask.at(q.x as usize, q.y as usize),
        _ => true,
    })
}

/// Where a ray of the reference camera lies in the hull.
#[derive(Clone, Debug, PartialEq)]
pub struct HullSpan {
    /// Nearest depth inside, mm, to 1/256 of a step.
    pub front_mm: f64,
    /// Depths inside among those tried, mm, ascending; at least one.
    pub inside_mm: Vec<f64>,
    /// Distance between the depths tried, mm.
    pub step_mm: f64,
}

/// The hull along rays of the reference camera, in the working volume.
#[derive(Clone, Debug)]
pub struct HullRays<'a> {
    reference: &'a Camera,
    others: Vec<Other<'a>>,
    near_mm: f64,
    steps: usize,
    step_mm: f64,
}

/// A point X = centre + z direction of the reference ray in another camera: homogeneous and linear in z.
#[derive(Clone, Debug)]
struct Other<'a> {
    camera: &'a Camera,
    mask: &'a Plane<bool>,
    centre: DVec3,
}

impl Other<'_> {
    /// Whether this camera allows hair at depth `z` of the ray whose direction in its frame is `d`. What
    /// lies outside its image or behind it, it cannot deny.
    fn allows(&self, d: DVec3, z: f64) -> bool {
        let c = self.centre + d * z;
        if c.z <= 0.0 {
            return true;
        }
        let u = self.camera.focal_px.x * c.x / c.z + self.camera.principal_px.x;
        let v = self.camera.focal_px.y * c.y / c.z + self.camera.principal_px.y;
        let (w, h) = (self.mask.width, self.mask.height);
        if !(u >= 0.0 && v >= 0.0 && u < w as f64 && v < h as f64) {
            return true;
        }
        self.mask.data[v as usize * w + u as usize]
    }
}

impl<'a> HullRays<'a> {
    /// The hull of `masks`, indexed `[camera]`; the reference camera's own is not asked.
    ///
    /// # Panics
    /// If the rig has no camera.
    pub fn new(rig: &'a Rig, masks: &[&'a Plane<bool>]) -> HullRays<'a> {
        let reference = &rig.cameras[0];
        let centre = reference.centre_mm();
        let others: Vec<Other> = rig
            .cameras
            .iter()
            .zip(masks)
            .skip(1)
            .map(|(camera, &mask)| Other { camera, mask, centre: camera.to_camera(centre) })
            .collect();
        let axis = reference.ray_direction(reference.principal_px);
        let travel = |o: &Other| {
            let at = |z: f64| o.camera.project(centre + axis * z).map(|(p, _)| p);
            at(rig.near_mm).zip(at(rig.far_mm)).map_or(f64::INFINITY, |(a, b)| a.distance(b))
        };
        let steps = others.iter().map(travel).fold(0.0, f64::max).ceil();
        let steps = (steps as usize).clamp(STEPS.0, STEPS.1);
        let step_mm = (rig.far_mm - rig.near_mm) / steps as f64;
        HullRays { reference, others, near_mm: rig.near_mm, steps, step_mm }
    }

    /// The ray through `pixel`; `None` where no depth of the working volume is inside.
    pub fn along(&self, pixel: DVec2) -> Option<HullSpan> {
        let direction = self.reference.ray_direction(pixel);
        let rays: Vec<(&Other, DVec3)> =
            self.others.iter().map(|o| (o, o.camera.camera_from_world * direction)).collect();
        let inside = |z: f64| rays.iter().all(|(o, d)| o.allows(*d, z));
        let depth = |j: usize| self.near_mm + (j as f64 + 0.5) * self.step_mm;
        let members: Vec<usize> = (0..self.steps).filter(|&j| inside(depth(j))).collect();
        let first = *members.first()?;
        let (mut out, mut front) = (depth(first) - self.step_mm, depth(first));
        if first == 0 {
            (out, front) = (self.near_mm, if inside(self.near_mm) { self.near_mm } else { front });
        }
        for _ in 0..8 {
            let z = 0.5 * (out + front);
            if inside(z) { front = z } else { out = z }
        }
        let inside_mm = members.into_iter().map(depth).collect();
        Some(HullSpan { front_mm: front, inside_mm, step_mm: self.step_mm })
    }
}

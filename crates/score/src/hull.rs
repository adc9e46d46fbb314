//! The visual hull of the true masks along the reference camera's rays: all that silhouettes tell.

use crate::depth::pixel_centre;
use crate::regions::Regions;
use glam::DVec3;
use rayon::prelude::*;
use strandbench_rng::Rng;
use strandbench_types::{Camera, Plane, Truth};

/// Depths tried along a ray, at least and at most; between them, one per pixel that the ray's image moves
/// in the camera where it moves farthest.
const STEPS: (usize, usize) = (64, 1024);

/// Key of the nulls' random numbers beside the seed.
pub(crate) const NULL_KEY: u64 = 0x6e75_6c6c;

/// Where the ray of a hair pixel lies in the hull; depths in mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct HullRay {
    /// Nearest depth inside, to 1/256 of a step.
    pub front: f64,
    /// Middle one of the depths inside.
    pub middle: f64,
    /// A uniformly random depth inside.
    pub random: f64,
}

/// Per hair pixel, in the order of [`Regions::hair`]; `None` where no depth of the working volume is inside.
pub(crate) type Hull = Vec<Option<HullRay>>;

/// A point X = centre + z direction of the reference ray in another camera: homogeneous and linear in z.
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

pub(crate) fn hull(truth: &Truth, regions: &Regions, seed: u64) -> Hull {
    let rig = &truth.rig;
    let reference = &rig.cameras[0];
    let centre = reference.centre_mm();
    let others: Vec<Other> = rig
        .cameras
        .iter()
        .zip(&truth.views)
        .skip(1)
        .map(|(camera, view)| Other { camera, mask: &view.mask, centre: camera.to_camera(centre) })
        .collect();
    let axis = reference.ray_direction(reference.principal_px);
    let travel = |o: &Other| {
        let at = |z: f64| o.camera.project(centre + axis * z).map(|(p, _)| p);
        at(rig.near_mm).zip(at(rig.far_mm)).map_or(f64::INFINITY, |(a, b)| a.distance(b))
    };
    let steps = others.iter().map(travel).fold(0.0, f64::max).ceil();
    let steps = (steps as usize).clamp(STEPS.0, STEPS.1);
    let dz = (rig.far_mm - rig.near_mm) / steps as f64;
    let depth = |j: usize| rig.near_mm + (j as f64 + 0.5) * dz;

    let of_pixel = |&i: &u32| {
        let direction = reference.ray_direction(pixel_centre(i, reference.width));
        let rays: Vec<(&Other, DVec3)> =
            others.iter().map(|o| (o, o.camera.camera_from_world * direction)).collect();
        let inside = |z: f64| rays.iter().all(|(o, d)| o.allows(*d, z));
        let members: Vec<usize> = (0..steps).filter(|&j| inside(depth(j))).collect();
        let first = *members.first()?;
        let (mut out, mut front) = (depth(first) - dz, depth(first));
        if first == 0 {
            (out, front) = (rig.near_mm, if inside(rig.near_mm) { rig.near_mm } else { front });
        }
        for _ in 0..8 {
            let z = 0.5 * (out + front);
            if inside(z) { front = z } else { out = z }
        }
        let mut rng = Rng::keyed(&[seed, NULL_KEY, 0, u64::from(i)]);
        let j = members[rng.below(members.len() as u64) as usize];
        let random = depth(j) + (rng.f64() - 0.5) * dz;
        Some(HullRay { front, middle: depth(members[(members.len() - 1) / 2]), random })
    };
    regions.hair.par_iter().map(of_pixel).collect()
}

//! The visual hull of the true masks along the reference camera's rays: all that silhouettes tell.

use crate::depth::pixel_centre;
use glam::DVec3;
use rayon::prelude::*;
use strandbench_rng::Rng;
use strandbench_types::{Camera, Plane, Rig};

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

/// The hull of `masks` (indexed [camera]) along the rays of the reference camera's pixels `hair`.
pub(crate) fn hull(rig: &Rig, masks: &[&Plane<bool>], hair: &[u32], seed: u64) -> Hull {
    let reference = &rig.cameras[0];
    let centre = reference.centre_mm();
    let others: Vec<Other> = rig
        .cameras
        .iter()
        .zip(masks)
        .skip(1)
        .map(|(camera, mask)| Other { camera, mask, centre: camera.to_camera(centre) })
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
    hair.par_iter().map(of_pixel).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const BASELINE: f64 = 100.0;
    const FOCAL: f64 = 200.0;

    /// Two parallel cameras a baseline apart; the second sees hair in columns `from..to` alone.
    fn pair(near_mm: f64, from: usize, to: usize) -> (Rig, [Plane<bool>; 2]) {
        let camera = |name: &str, x: f64| {
            Camera::look_at(name, (101, 3), FOCAL, DVec3::new(x, 0.0, 0.0), DVec3::new(x, 0.0, 1.0), DVec3::Y)
        };
        let rig = Rig {
            cameras: vec![camera("a", 0.0), camera("b", -BASELINE)],
            near_mm,
            far_mm: 900.0,
            frame_rate_hz: 1.0,
            exposure_s: 1.0,
        };
        let second = (0..303).map(|i| (from..to).contains(&(i % 101))).collect();
        (rig, [Plane::filled(101, 3, true), Plane::from_vec(101, 3, second)])
    }

    fn of_centre(near_mm: f64, from: usize, to: usize) -> Vec<Option<HullRay>> {
        let (rig, masks) = pair(near_mm, from, to);
        // The centre ray, many times over with other random numbers.
        (0..200).flat_map(|seed| hull(&rig, &[&masks[0], &masks[1]], &[101 + 50], seed)).collect()
    }

    #[test]
    fn depths_inside_are_where_epipolar_geometry_puts_them() {
        // The centre ray at depth z has column 50.5 + f b / z in the second camera: 75 to 95 is z from 449.4 to 816.3.
        let depth = |column: f64| FOCAL * BASELINE / (column - 50.5);
        let (near, far) = (depth(95.0), depth(75.0));
        let step = 500.0 / 64.0;
        let rays: Vec<HullRay> = of_centre(400.0, 75, 95).into_iter().map(Option::unwrap).collect();
        for r in &rays {
            assert!((r.front - near).abs() <= step / 128.0, "{} for {near}", r.front);
            assert!((r.middle - 0.5 * (near + far)).abs() <= step, "{}", r.middle);
            assert!(r.random > near - step && r.random < far + step, "{}", r.random);
        }
        let mean = rays.iter().map(|r| r.random).sum::<f64>() / 200.0;
        let error = (far - near) / (12.0f64 * 200.0).sqrt();
        assert!((mean - 0.5 * (near + far)).abs() < 4.0 * error, "{mean}");
    }

    #[test]
    fn a_camera_denies_only_what_it_sees() {
        assert!(of_centre(400.0, 0, 40).iter().all(Option::is_none));
        // Nearer than 396 mm the ray has left the second image (column 101).
        let free = of_centre(300.0, 0, 0)[0].unwrap();
        assert_eq!(free.front, 300.0);
        assert!(free.middle < 396.1 && free.random < 401.0);
        let (rig, masks) = pair(300.0, 0, 101);
        let alone = Rig { cameras: rig.cameras[..1].to_vec(), ..rig };
        let ray = hull(&alone, &[&masks[0]], &[0], 1)[0].unwrap();
        assert_eq!(ray.front, 300.0);
        assert!((ray.middle - 600.0).abs() < 10.0);
    }
}

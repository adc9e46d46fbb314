//! The visual hull of the true masks along the reference camera's rays: all that silhouettes tell.

use crate::depth::pixel_centre;
use rayon::prelude::*;
use strandbench_rng::Rng;
use strandbench_types::{HullRays, Plane, Rig};

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

/// The hull of `masks` (indexed [camera]) along the rays of the reference camera's pixels `hair`.
pub(crate) fn hull(rig: &Rig, masks: &[&Plane<bool>], hair: &[u32], seed: u64) -> Hull {
    let rays = HullRays::new(rig, masks);
    let of_pixel = |&i: &u32| {
        let span = rays.along(pixel_centre(i, rig.cameras[0].width))?;
        let inside = &span.inside_mm;
        let mut rng = Rng::keyed(&[seed, NULL_KEY, 0, u64::from(i)]);
        let drawn = inside[rng.below(inside.len() as u64) as usize];
        let random = drawn + (rng.f64() - 0.5) * span.step_mm;
        Some(HullRay { front: span.front_mm, middle: inside[(inside.len() - 1) / 2], random })
    };
    hair.par_iter().map(of_pixel).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use strandbench_types::Camera;

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

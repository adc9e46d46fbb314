//! Pictures of one frame: a shaded envelope, and strands over an image.

use glam::{DVec2, DVec3, Vec3};
use strandbench_types::{Camera, DepthMap, Plane, StrandSet};

/// A depth map as a surface lit from the camera's upper left; pixels without depth are `background`.
pub(super) fn shaded(camera: &Camera, depth: &DepthMap, background: [u8; 3]) -> Plane<[u8; 3]> {
    let (w, h) = depth.size();
    let mut picture = Plane::filled(w, h, background);
    let at = |x: usize, y: usize| -> Option<DVec3> {
        let z = depth.get(x, y)?;
        let p = camera.unproject(DVec2::new(x as f64 + 0.5, y as f64 + 0.5), f64::from(z));
        Some(camera.camera_from_world * p)
    };
    let light = DVec3::new(-0.45, -0.6, -0.66).normalize();
    for y in 0..h {
        for x in 0..w {
            let Some(here) = at(x, y) else { continue };
            // The nearer neighbour of each pair: a step at a silhouette is no slope.
            let slope = |a: Option<DVec3>, b: Option<DVec3>| -> Option<DVec3> {
                let (a, b) = (a.map(|a| here - a), b.map(|b| b - here));
                match (a, b) {
                    (Some(a), Some(b)) => Some(if a.z.abs() < b.z.abs() { a } else { b }),
                    (a, b) => a.or(b),
                }
            };
            let before = |v: usize| v.checked_sub(1);
            let u = slope(before(x).and_then(|x| at(x, y)), (x + 1 < w).then(|| at(x + 1, y)).flatten());
            let v = slope(before(y).and_then(|y| at(x, y)), (y + 1 < h).then(|| at(x, y + 1)).flatten());
            let normal = u.zip(v).map_or(DVec3::NEG_Z, |(u, v)| v.cross(u).normalize_or(DVec3::NEG_Z));
            let lit = 0.18 + 0.82 * normal.dot(light).max(0.0);
            *picture.at_mut(x, y) = [0.93, 0.90, 0.84].map(|c| (c * lit.powf(0.8) * 255.0).round() as u8);
        }
    }
    picture
}

/// A polyline's point in the image: place (px) and depth (mm).
type Placed = Option<(DVec2, f64)>;

/// Draws strands over a picture, far ones first, those in front of or within `behind_mm` of the envelope alone. `colour`
/// gives the colour at a point (strand, index in the set's points).
pub(super) fn strands(
    picture: &mut Plane<[u8; 3]>,
    camera: &Camera,
    set: &StrandSet,
    envelope: Option<&DepthMap>,
    behind_mm: f64,
    colour: impl Fn(usize, usize) -> [u8; 3],
) {
    let place = |p: Vec3| -> Placed { camera.project(p.as_dvec3()) };
    let mut order: Vec<(f64, usize)> = (0..set.len())
        .filter_map(|s| {
            let depths: Vec<f64> = set.strand(s).iter().filter_map(|&p| place(p).map(|q| q.1)).collect();
            (!depths.is_empty()).then(|| (depths.iter().sum::<f64>() / depths.len() as f64, s))
        })
        .collect();
    order.sort_by(|a, b| b.0.total_cmp(&a.0));
    let seen = |q: DVec2, z: f64| -> bool {
        let Some(map) = envelope else { return true };
        let (w, h) = map.size();
        if q.x < 0.0 || q.y < 0.0 || q.x >= w as f64 || q.y >= h as f64 {
            return false;
        }
        map.get(q.x as usize, q.y as usize).is_none_or(|d| z < f64::from(d) + behind_mm)
    };
    for (_, s) in order {
        let first = set.offsets[s] as usize;
        let placed: Vec<Placed> = set.strand(s).iter().map(|&p| place(p)).collect();
        for (i, pair) in placed.windows(2).enumerate() {
            let (Some((a, za)), Some((b, zb))) = (pair[0], pair[1]) else { continue };
            if seen(a, za) && seen(b, zb) {
                line(picture, a, b, colour(s, first + i));
            }
        }
    }
}

/// A line one pixel wide whose pixels are mixed in by their coverage.
fn line(picture: &mut Plane<[u8; 3]>, a: DVec2, b: DVec2, colour: [u8; 3]) {
    let (w, h) = (picture.width as f64, picture.height as f64);
    let steps = ((b - a).abs().max_element() * 2.0).ceil();
    // A line that leaves the image by far is a point behind the camera's plane gone astray.
    if !steps.is_finite() || steps > 4.0 * (w + h) {
        return;
    }
    let steps = steps.max(1.0) as usize;
    for k in 0..steps {
        let p = a.lerp(b, (k as f64 + 0.5) / steps as f64) - DVec2::splat(0.5);
        let low = p.floor();
        let f = p - low;
        for (dx, wx) in [(0.0, 1.0 - f.x), (1.0, f.x)] {
            for (dy, wy) in [(0.0, 1.0 - f.y), (1.0, f.y)] {
                let (x, y) = (low.x + dx, low.y + dy);
                if x >= 0.0 && y >= 0.0 && x < w && y < h {
                    // Two steps a pixel: each pixel on the line is met about twice.
                    let share = 0.5 * wx * wy;
                    let pixel = picture.at_mut(x as usize, y as usize);
                    for c in 0..3 {
                        let mixed = f64::from(pixel[c]) * (1.0 - share) + f64::from(colour[c]) * share;
                        pixel[c] = mixed.round() as u8;
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DMat3;

    fn camera() -> Camera {
        Camera {
            name: "c".into(),
            width: 40,
            height: 30,
            focal_px: DVec2::splat(40.0),
            principal_px: DVec2::new(20.0, 15.0),
            camera_from_world: DMat3::IDENTITY,
            translation_mm: DVec3::ZERO,
        }
    }

    #[test]
    fn a_surface_that_faces_the_light_is_brighter() {
        let c = camera();
        let plane = |slope: f64| {
            let mut map = DepthMap::empty(40, 30);
            for y in 0..30 {
                for x in 0..40 {
                    map.set(x, y, Some((100.0 + slope * (x as f64 - 20.0)) as f32));
                }
            }
            f64::from(shaded(&c, &map, [0; 3]).at(20, 15)[0])
        };
        // Depth that grows to the right turns the surface to the right, away from the light on the left... of the camera.
        assert!(plane(-1.0) > plane(0.0) + 5.0 || plane(1.0) > plane(0.0) + 5.0);
        assert!((plane(1.0) - plane(-1.0)).abs() > 20.0);
        assert_eq!(shaded(&c, &DepthMap::empty(40, 30), [7, 8, 9]).at(3, 3), &[7, 8, 9]);
    }

    #[test]
    fn strands_behind_the_envelope_and_outside_the_image_are_not_drawn() {
        let c = camera();
        let mut map = DepthMap::empty(40, 30);
        (0..40).for_each(|x| (0..30).for_each(|y| map.set(x, y, Some(100.0))));
        let mut set = StrandSet::new();
        set.push(&[Vec3::new(-20.0, 0.0, 90.0), Vec3::new(20.0, 0.0, 90.0)], 0.05);
        set.push(&[Vec3::new(-20.0, 10.0, 150.0), Vec3::new(20.0, 10.0, 150.0)], 0.05);
        set.push(&[Vec3::new(0.0, 0.0, -5.0), Vec3::new(1e9, 0.0, 90.0)], 0.05);
        let mut picture = Plane::filled(40, 30, [0u8; 3]);
        strands(&mut picture, &c, &set, Some(&map), 10.0, |_, _| [255, 0, 0]);
        let lit = |y: usize| (0..40).filter(|&x| picture.at(x, y)[0] > 60).count();
        assert!(lit(14) + lit(15) >= 30, "the near strand crosses the middle");
        assert_eq!(lit(17) + lit(18), 0, "the far one is hidden");
        strands(&mut picture, &c, &set, None, 10.0, |_, _| [255, 0, 0]);
        assert!((16..20).map(|y| (0..40).filter(|&x| picture.at(x, y)[0] > 60).count()).sum::<usize>() >= 10);
    }
}

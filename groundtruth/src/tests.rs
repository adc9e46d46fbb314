mod refusals;
mod visibility;

use super::*;
use glam::{DVec2, DVec3, Vec3};
use proptest::prelude::*;
use strandbench_rng::Rng;
use strandbench_types::{Camera, SampleHit, VISIBILITY_STEP_MM, Visibility};

/// A camera at the origin that looks along +z with +y down: camera and world coordinates agree.
fn camera(name: &str, width: u32, height: u32) -> Camera {
    Camera::look_at(name, (width, height), 100.0, DVec3::ZERO, DVec3::Z, DVec3::Y)
}

fn rig(cameras: Vec<Camera>) -> Rig {
    Rig { cameras, near_mm: 10.0, far_mm: 1000.0, frame_rate_hz: 100.0, exposure_s: 0.001 }
}

/// A buffer with `rays` rays in each pixel, from hits listed as (pixel index, hit).
fn buffer(width: usize, height: usize, rays: u16, listed: &[(usize, SampleHit)]) -> SampleHits {
    let mut offsets = vec![0];
    let mut hits = Vec::new();
    for i in 0..width * height {
        hits.extend(listed.iter().filter(|(pixel, _)| *pixel == i).map(|(_, hit)| *hit));
        offsets.push(hits.len() as u32);
    }
    SampleHits { width, height, rays: vec![rays; width * height], offsets, hits }
}

fn hit(strand: u32, along: f32, depth_mm: f32) -> SampleHit {
    SampleHit { strand, segment: 0, along, depth_mm }
}

/// Horizontal strands of 2 mm through the optical axis, the i-th at depth 100 + i mm.
fn ladder(n: usize) -> StrandSet {
    let mut s = StrandSet::new();
    for i in 0..n {
        let z = 100.0 + i as f32;
        s.push(&[Vec3::new(-1.0, 0.0, z), Vec3::new(1.0, 0.0, z)], 0.04);
    }
    s
}

fn one_pixel(rays: u16, depths: &[usize]) -> (Option<f32>, Option<f32>, Option<f32>, f32, bool) {
    let listed: Vec<_> = depths.iter().map(|&i| (0, hit(i as u32, 0.5, 100.0 + i as f32))).collect();
    let t = truth(&rig(vec![camera("a", 1, 1)]), &ladder(64), None, &[buffer(1, 1, rays, &listed)]).unwrap();
    let v = &t.views[0];
    (v.depth_first.get(0, 0), v.depth_05.get(0, 0), v.depth_50.get(0, 0), v.coverage.data[0], v.mask.data[0])
}

#[test]
fn depths_are_order_statistics_of_all_rays() {
    // Of 20 rays, 5 % is the first hit and 50 % the tenth, whatever the order in which hits come.
    let all: Vec<usize> = (0..20).rev().collect();
    assert_eq!(one_pixel(20, &all), (Some(100.0), Some(100.0), Some(109.0), 1.0, true));
    // Of 21 rays, the second and the eleventh.
    assert_eq!(one_pixel(21, &all), (Some(100.0), Some(101.0), Some(110.0), 20.0 / 21.0, true));
    // Exactly one half is enough, one hit fewer is not.
    assert_eq!(one_pixel(20, &all[10..]), (Some(100.0), Some(100.0), Some(109.0), 0.5, true));
    assert_eq!(one_pixel(20, &all[11..]), (Some(100.0), Some(100.0), None, 0.45, false));
    // One hit of 64 rays is less than 5 %.
    assert_eq!(one_pixel(64, &[3]), (Some(103.0), None, None, 1.0 / 64.0, false));
    assert_eq!(one_pixel(20, &[]), (None, None, None, 0.0, false));
}

/// The view's line angle (degrees) and agreement for one hit at the middle of each segment (a, b) in turn.
fn angle_of(segments: &[(DVec3, DVec3)]) -> (f64, f64, Vec3) {
    let mut strands = StrandSet::new();
    let mut listed = Vec::new();
    let c = camera("a", 40, 40);
    let mut pixel = None;
    for (i, &(a, b)) in segments.iter().enumerate() {
        strands.push(&[a.as_vec3(), b.as_vec3()], 0.04);
        let (p, z) = c.project((a + b) * 0.5).unwrap();
        let index = p.y as usize * 40 + p.x as usize;
        assert_eq!(*pixel.get_or_insert(index), index, "test segments meet in one pixel");
        listed.push((index, hit(i as u32, 0.5, z as f32)));
    }
    let t = truth(&rig(vec![c]), &strands, None, &[buffer(40, 40, 8, &listed)]).unwrap();
    let i = pixel.unwrap();
    let v = &t.views[0];
    (
        f64::from(v.orientation_2d.data[i]).to_degrees(),
        f64::from(v.orientation_agreement.data[i]),
        v.orientation_3d.data[i],
    )
}

proptest! {
    #[test]
    fn projected_tangent_is_the_derivative_of_the_projection(
        x in -15.0..15.0f64, y in -15.0..15.0f64, z in 80.0..200.0f64,
        dx in -1.0..1.0f64, dy in -1.0..1.0f64, dz in -1.0..1.0f64,
    ) {
        let d = DVec3::new(dx, dy, dz);
        prop_assume!(d.truncate().length() > 0.1);
        let m = DVec3::new(x * z / 100.0, y * z / 100.0, z);
        // Round to the precision that strands are kept in, then take the secant of the projection.
        let (a, b) = ((m - d).as_vec3().as_dvec3(), (m + d).as_vec3().as_dvec3());
        let (m, d) = ((a + b) * 0.5, (b - a) * 1e-5);
        let c = camera("a", 40, 40);
        let secant: DVec2 = c.project(m + d).unwrap().0 - c.project(m - d).unwrap().0;
        prop_assume!(secant.length() > 1e-7);
        let (deg, agreement, axis) = angle_of(&[(a, b)]);
        prop_assert!((0.0..180.0).contains(&deg));
        let off = (deg - secant.y.atan2(secant.x).to_degrees()).rem_euclid(180.0);
        prop_assert!(off.min(180.0 - off) < 1e-3, "{deg} against secant {secant}");
        prop_assert!((agreement - 1.0).abs() < 1e-6);
        prop_assert!(axis.as_dvec3().cross(d.normalize()).length() < 1e-6);
    }
}

#[test]
fn orientation_is_a_mean_of_lines() {
    let at = |deg: f64| {
        let (s, c) = deg.to_radians().sin_cos();
        (DVec3::new(-c, -s, 100.0), DVec3::new(c, s, 100.0))
    };
    // 30 degrees from +x towards +y, which is down.
    let (deg, agreement, _) = angle_of(&[at(30.0)]);
    assert!((deg - 30.0).abs() < 1e-4 && (agreement - 1.0).abs() < 1e-6);
    // A reversed segment is the same line; 10 and 170 degrees average to the horizontal, not to 90.
    let (deg, agreement, _) = angle_of(&[at(30.0), at(210.0)]);
    assert!((deg - 30.0).abs() < 1e-4 && (agreement - 1.0).abs() < 1e-6);
    let (deg, agreement, axis) = angle_of(&[at(10.0), at(170.0)]);
    assert!(deg.min(180.0 - deg) < 1e-4, "{deg}");
    assert!((agreement - 20f64.to_radians().cos()).abs() < 1e-6, "{agreement}");
    assert!((axis - Vec3::X).length() < 1e-6);
    // Crossed lines agree on nothing.
    assert!(angle_of(&[at(20.0), at(110.0)]).1 < 1e-6);
}

/// Rays against capsules by brute force: strands of random slope, four rays a pixel.
fn traced(seed: u64) -> (Rig, StrandSet, Vec<SampleHits>) {
    let (w, h) = (24, 16);
    let second = Camera::look_at(
        "b",
        (w, h),
        100.0,
        DVec3::new(15.0, 0.0, 0.0),
        DVec3::new(0.0, 0.0, 100.0),
        DVec3::Y,
    );
    let rig = rig(vec![camera("a", w, h), second]);
    let mut strands = StrandSet::new();
    for i in 0..60 {
        let mut r = Rng::keyed(&[seed, i]);
        let root = Vec3::new(r.range(-12.0, 12.0), -9.0, r.range(95.0, 105.0));
        let mid = root + Vec3::new(r.range(-3.0, 3.0), 9.0, r.range(-3.0, 3.0));
        let tip = mid + Vec3::new(r.range(-3.0, 3.0), 9.0, r.range(-3.0, 3.0));
        strands.push(&[root, mid, tip], 0.2);
    }
    let hits = rig.cameras.iter().map(|c| trace(c, &strands)).collect();
    (rig, strands, hits)
}

fn trace(camera: &Camera, strands: &StrandSet) -> SampleHits {
    let (w, h) = (camera.width as usize, camera.height as usize);
    let mut listed = Vec::new();
    for i in 0..w * h {
        for sub in 0..4 {
            let p = DVec2::new(
                (i % w) as f64 + 0.25 + 0.5 * f64::from(sub % 2),
                (i / w) as f64 + 0.25 + 0.5 * f64::from(sub / 2),
            );
            let (o, d) = (camera.centre_mm(), camera.ray_direction(p));
            let mut first: Option<SampleHit> = None;
            for s in 0..strands.len() {
                for (k, w) in strands.strand(s).windows(2).enumerate() {
                    let (a, b) = (w[0].as_dvec3(), w[1].as_dvec3());
                    let (u, v) = (b - a, a - o);
                    let (uu, ud, dd) = (u.dot(u), u.dot(d), d.dot(d));
                    let along = ((ud * v.dot(d) - dd * u.dot(v)) / (uu * dd - ud * ud)).clamp(0.0, 1.0);
                    let z = (a + u * along - o).dot(d) / dd;
                    let hit = SampleHit {
                        strand: s as u32,
                        segment: k as u32,
                        along: along as f32,
                        depth_mm: z as f32,
                    };
                    let near = (o + d * z - a - u * along).length() < 0.2;
                    if near && first.is_none_or(|f| hit.depth_mm < f.depth_mm) {
                        first = Some(hit);
                    }
                }
            }
            listed.extend(first.map(|hit| (i, hit)));
        }
    }
    buffer(w, h, 4, &listed)
}

#[test]
fn threads_and_the_order_of_hits_change_no_bit_of_depth_or_visibility() {
    let (rig, strands, hits) = traced(5);
    let run = |threads: usize, hits: &[SampleHits]| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| truth(&rig, &strands, None, hits).unwrap())
    };
    // NaN is where there is no hair, so planes of angles are compared by their printed form.
    let text = |t: &Truth| format!("{:?}", (&t.views, &t.visibility));
    let one = run(1, &hits);
    assert_eq!(text(&one), text(&run(3, &hits)));
    let mut shuffled = hits.clone();
    for b in &mut shuffled {
        for i in 0..b.rays.len() {
            b.hits[b.offsets[i] as usize..b.offsets[i + 1] as usize].reverse();
        }
    }
    let other = run(2, &shuffled);
    assert_eq!(one.visibility, other.visibility);
    for (a, b) in one.views.iter().zip(&other.views) {
        assert_eq!((&a.depth_first, &a.depth_05, &a.depth_50), (&b.depth_first, &b.depth_05, &b.depth_50));
    }
    let seen = |bits: u32| one.visibility.seen_by.iter().filter(|&&s| s & bits == bits).count();
    assert!(seen(1) > 300 && seen(3) > 100 && seen(3) < seen(1), "{} {}", seen(1), seen(3));
}

#[test]
fn first_depth_is_not_behind_the_others_and_the_mask_is_where_half_is_covered() {
    let (rig, strands, hits) = traced(6);
    let t = truth(&rig, &strands, None, &hits).unwrap();
    for (v, b) in t.views.iter().zip(&hits) {
        let mut hair = 0;
        for i in 0..b.rays.len() {
            assert_eq!(v.mask.data[i], 2 * b.pixel(i).len() >= 4);
            assert_eq!(v.mask.data[i], v.depth_50.get_index(i).is_some());
            if let (Some(first), Some(half)) = (v.depth_first.get_index(i), v.depth_50.get_index(i)) {
                let at_05 = v.depth_05.get_index(i).unwrap();
                assert!(first <= at_05 && at_05 <= half);
                hair += 1;
            }
            assert_eq!(v.orientation_2d.data[i].is_nan(), b.pixel(i).is_empty());
            assert_eq!(v.orientation_3d.data[i] == Vec3::ZERO, b.pixel(i).is_empty());
        }
        assert!(hair > 50);
    }
}

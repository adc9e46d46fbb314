use super::*;
use crate::rig_json::tests::rig;
use glam::Vec3;
use std::fs;
use strandbench_rng::Rng;
use strandbench_types::{Plane, StrandSet, TriMesh, Visibility};

/// A truth of random content: `n` strands of up to 60 points, cameras of `w` x `h`.
fn random(seed: u64, cameras: usize, (w, h): (u32, u32), n: usize) -> Truth {
    let mut r = Rng::keyed(&[seed]);
    let mut plane = |holes: bool| {
        let data = (0..w * h).map(|_| if holes && r.f32() < 0.4 { f32::NAN } else { 1.0 + 1000.0 * r.f32() });
        Plane::from_vec(w as usize, h as usize, data.collect())
    };
    let views = (0..cameras)
        .map(|_| {
            let coverage = plane(false);
            ViewTruth {
                depth_first: DepthMap::from_raw(plane(true)),
                depth_05: DepthMap::from_raw(plane(true)),
                depth_50: DepthMap::from_raw(plane(true)),
                mask: coverage.map(|&c| c > 500.0),
                orientation_2d: plane(true),
                orientation_agreement: plane(true),
                orientation_3d: join(&[plane(false), plane(false), plane(false)]),
                coverage,
            }
        })
        .collect();
    let mut strands = StrandSet::new();
    let mut visibility = Visibility { offsets: vec![0], seen_by: vec![] };
    for _ in 0..n {
        let points: Vec<Vec3> =
            (0..2 + r.below(59)).map(|_| Vec3::new(r.range(-99.0, 99.0), r.f32(), -r.f32())).collect();
        let radii: Vec<f32> = points.iter().map(|_| r.range(0.02, 0.06)).collect();
        strands.push_tapered(&points, &radii);
        visibility.seen_by.extend((0..r.below(40)).map(|_| r.below(1 << cameras) as u32));
        visibility.offsets.push(visibility.seen_by.len() as u32);
    }
    let head = TriMesh { vertices: vec![Vec3::X, Vec3::Y, Vec3::ZERO], triangles: vec![[0, 1, 2]] };
    Truth { rig: rig(cameras, w, h), views, strands, visibility, head: Some(head) }
}

/// Equality that takes NaN for what it is: every float by its bits.
fn assert_same(a: &Truth, b: &Truth) {
    assert_eq!((&a.rig, &a.strands, &a.visibility, &a.head), (&b.rig, &b.strands, &b.visibility, &b.head));
    assert_eq!(a.views.len(), b.views.len());
    let bits = |p: &Plane<f32>| p.map(|v| v.to_bits());
    for (a, b) in a.views.iter().zip(&b.views) {
        assert_eq!((&a.depth_first, &a.depth_05, &a.depth_50), (&b.depth_first, &b.depth_05, &b.depth_50));
        assert_eq!((&a.mask, &a.orientation_3d), (&b.mask, &b.orientation_3d));
        assert_eq!(bits(&a.coverage), bits(&b.coverage));
        assert_eq!(bits(&a.orientation_2d), bits(&b.orientation_2d));
        assert_eq!(bits(&a.orientation_agreement), bits(&b.orientation_agreement));
    }
}

#[test]
fn truth_comes_back_bit_for_bit() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("t");
    for (seed, cameras) in [(1, 1), (2, 4), (3, 12), (4, 20)] {
        let mut t = random(seed, cameras, (21, 13), 30);
        if seed == 2 {
            t.head = None;
        }
        write_truth(&out, &t).unwrap();
        assert_same(&read_truth(&out).unwrap(), &t);
        assert_eq!(out.join(HEAD).exists(), t.head.is_some());
        let views = fs::read_dir(&out)
            .unwrap()
            .filter(|e| e.as_ref().unwrap().file_name().to_str().unwrap().ends_with(SUFFIX));
        assert_eq!(views.count(), cameras, "files of an older truth must go");
    }
    let none =
        Truth { strands: StrandSet::new(), visibility: Visibility::default(), ..random(5, 2, (4, 4), 0) };
    write_truth(&out, &none).unwrap();
    assert_same(&read_truth(&out).unwrap(), &none);
}

#[test]
fn channels_hold_what_their_names_say() {
    let dir = tempfile::tempdir().unwrap();
    let t = random(10, 1, (9, 7), 2);
    write_truth(dir.path(), &t).unwrap();
    let channels = read_exr(&dir.path().join("cam0_truth.exr")).unwrap();
    let bits = |p: &Plane<f32>| p.map(|v| v.to_bits());
    let get = |name: &str| bits(&channels.iter().find(|c| c.0 == name).unwrap().1);
    let v = &t.views[0];
    assert_eq!(get("depth_first_mm"), bits(v.depth_first.raw()));
    assert_eq!(get("depth_05_mm"), bits(v.depth_05.raw()));
    assert_eq!(get("depth_50_mm"), bits(v.depth_50.raw()));
    assert_eq!(get("coverage"), bits(&v.coverage));
    assert_eq!(get("mask"), v.mask.map(|&m| if m { 1.0f32.to_bits() } else { 0 }));
    assert_eq!(get("orientation_2d_rad"), bits(&v.orientation_2d));
    assert_eq!(get("orientation_agreement"), bits(&v.orientation_agreement));
    assert_eq!(get("orientation_3d.X"), v.orientation_3d.map(|o| o.x.to_bits()));
    assert_eq!(get("orientation_3d.Y"), v.orientation_3d.map(|o| o.y.to_bits()));
    assert_eq!(get("orientation_3d.Z"), v.orientation_3d.map(|o| o.z.to_bits()));
}

#[test]
fn frame_and_truth_can_share_a_folder() {
    let dir = tempfile::tempdir().unwrap();
    let t = random(6, 2, (9, 7), 3);
    let frame = strandbench_types::Frame {
        index: 0,
        images: vec![Plane::filled(9, 7, 0.5); 2],
        masks: vec![Plane::filled(9, 7, true); 2],
    };
    crate::write_truth(dir.path(), &t).unwrap();
    crate::write_frame(dir.path(), &t.rig, &frame).unwrap();
    crate::write_truth(dir.path(), &t).unwrap();
    assert_same(&read_truth(dir.path()).unwrap(), &t);
    assert_eq!(crate::read_frame(dir.path()).unwrap(), (t.rig, frame));
}

#[test]
fn each_fault_names_its_file() {
    let fails = |damage: &dyn Fn(&Path), file: &str, problem: &str| {
        let dir = tempfile::tempdir().unwrap();
        let out = dir.path().join("t");
        write_truth(&out, &random(7, 2, (9, 7), 4)).unwrap();
        damage(&out);
        let e = read_truth(&out).unwrap_err();
        assert!(e.path.ends_with(file) && e.problem.contains(problem), "{file}, {problem}: {e}");
    };
    for file in [RIG, STRANDS, VISIBILITY, "cam1_truth.exr"] {
        fails(&|d| fs::remove_file(d.join(file)).unwrap(), file, "check the path");
        fails(&|d| fs::write(d.join(file), b"rubbish, and more of it").unwrap(), file, "");
    }
    let (w, h) = (8, 7);
    let small = Plane::filled(w, h, 0.0);
    let channels: Vec<_> = CHANNELS.iter().map(|&c| (c, &small)).collect();
    fails(&|d| write_exr(&d.join("cam0_truth.exr"), &channels).unwrap(), "cam0_truth.exr", "8x7 pixels");
    let half = Plane::filled(9, 7, 0.5);
    let channels: Vec<_> = CHANNELS.iter().map(|&c| (c, &half)).collect();
    fails(&|d| write_exr(&d.join("cam0_truth.exr"), &channels).unwrap(), "cam0_truth.exr", "not 0 or 1");
    let three = random(8, 2, (9, 7), 3);
    fails(&|d| write_strands(&d.join(STRANDS), &three.strands).unwrap(), "t", "visibility of 4 strands");
    let beyond = encode_visibility(&Visibility { offsets: vec![0, 0, 0, 0, 1], seen_by: vec![4] });
    fails(&|d| fs::write(d.join(VISIBILITY), &beyond).unwrap(), "t", "beyond the 2");
}

#[test]
fn inconsistent_truth_is_not_written() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("t");
    let fails = |damage: &dyn Fn(&mut Truth), problem: &str| {
        let mut t = random(9, 2, (9, 7), 4);
        damage(&mut t);
        let e = write_truth(&out, &t).unwrap_err();
        assert!(e.problem.contains(problem) && !out.exists(), "{problem}: {e}");
    };
    fails(&|t| t.views.truncate(1), "1 views of 2 cameras");
    fails(&|t| t.views[1].orientation_agreement = Plane::filled(7, 9, 0.0), "a raster");
    fails(&|t| t.visibility.offsets[1] = u32::MAX, "do not divide");
    fails(&|t| t.strands.points[0].x = f32::NAN, "strand 0, point 0");
    fails(&|t| t.rig.far_mm = 0.0, "working volume");
}

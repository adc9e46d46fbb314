use super::*;
use crate::{write_exr, write_mesh, write_png_grey, write_png_grey16, write_strands};
use glam::{DVec2, DVec3};
use proptest::prelude::*;
use std::fs;
use strandbench_rng::Rng;
use strandbench_types::{Plane, TriMesh};

const W: usize = 24;
const H: usize = 18;

fn camera() -> Camera {
    let (eye, target) = (DVec3::new(120.0, 40.0, 800.0), DVec3::new(0.0, 10.0, 0.0));
    Camera::look_at("center", (W as u32, H as u32), 40.0, eye, target, DVec3::NEG_Y)
}

fn ray(camera: &Camera, x: usize, y: usize) -> DVec3 {
    let p = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
    ((p - camera.principal_px) / camera.focal_px).extend(1.0)
}

fn world(camera: &Camera, p: DVec3) -> Vec3 {
    (camera.camera_from_world.transpose() * (p - camera.translation_mm)).as_vec3()
}

/// Two triangles that fill far more than the image, in camera coordinates z = a + b x.
fn sheet(camera: &Camera, a: f64, b: f64) -> TriMesh {
    let s = 2000.0;
    let corners = [(-s, -s), (s, -s), (s, s), (-s, s)].map(|(x, y)| DVec3::new(x, y, a + b * x));
    TriMesh { vertices: corners.map(|c| world(camera, c)).to_vec(), triangles: vec![[0, 1, 2], [0, 2, 3]] }
}

fn both(one: TriMesh, other: TriMesh) -> TriMesh {
    let n = one.vertices.len() as u32;
    let moved = other.triangles.iter().map(|t| t.map(|i| i + n));
    TriMesh {
        triangles: one.triangles.iter().copied().chain(moved).collect(),
        vertices: [one.vertices, other.vertices].concat(),
    }
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().unwrap()
}

fn read(dir: &tempfile::TempDir) -> Estimate {
    read_any_estimate(dir.path(), &camera()).unwrap()
}

fn refused(dir: &tempfile::TempDir, words: &[&str]) {
    let e = read_any_estimate(dir.path(), &camera()).unwrap_err().to_string();
    for word in words {
        assert!(e.contains(word), "{word} is not in: {e}");
    }
}

fn ramp() -> Plane<f32> {
    let mut p = Plane::from_vec(W, H, (0..W * H).map(|i| 700.0 + i as f32 * 0.25).collect());
    (p.data[3], p.data[4], p.data[5]) = (0.0, f32::NAN, -1.0);
    p
}

fn npy(header: &str, body: &[u8]) -> Vec<u8> {
    let mut b = b"\x93NUMPY\x01\x00".to_vec();
    b.extend((header.len() as u16).to_le_bytes());
    b.extend(header.as_bytes());
    b.extend(body);
    b
}

#[test]
fn the_first_sheet_on_the_ray_through_the_pixels_centre_is_the_depth() {
    let c = camera();
    let (near, far) = (sheet(&c, 700.0, 0.9), sheet(&c, 760.0, -0.4));
    let dir = folder();
    write_mesh(&dir.path().join("mesh.ply"), &both(far, near)).unwrap();
    let depth = read(&dir).depth.unwrap();
    assert_eq!(depth.answered(), W * H);
    for (x, y) in (0..H).flat_map(|y| (0..W).map(move |x| (x, y))) {
        let r = ray(&c, x, y);
        // z = a + b x and x = r.x z.
        let want = [(700.0, 0.9), (760.0, -0.4)].map(|(a, b)| a / (1.0 - b * r.x));
        // Vertices are 32-bit numbers of up to 2700 mm: half a step of 1.2e-4 mm, times the sheet's slant.
        let (got, want) = (f64::from(depth.get(x, y).unwrap()), want[0].min(want[1]));
        assert!((got - want).abs() < 1e-3, "({x}, {y}): {got} for {want}");
    }
}

#[test]
fn a_surface_behind_the_camera_is_not_seen_and_one_through_it_is() {
    let c = camera();
    let triangle =
        |p: [DVec3; 3]| TriMesh { vertices: p.map(|p| world(&c, p)).to_vec(), triangles: vec![[0, 1, 2]] };
    let behind =
        triangle([DVec3::new(-9e3, -9e3, -50.0), DVec3::new(9e3, -9e3, -50.0), DVec3::new(0.0, 9e3, -50.0)]);
    assert_eq!(DepthMap::of_mesh(&c, &behind).unwrap().answered(), 0);
    // The plane y = 100 from behind the camera to far away, seen in the rows below the centre.
    let floor = triangle([
        DVec3::new(-9e3, 100.0, -500.0),
        DVec3::new(9e3, 100.0, -500.0),
        DVec3::new(0.0, 100.0, 9e4),
    ]);
    let depth = DepthMap::of_mesh(&c, &floor).unwrap();
    for y in 0..H {
        let down = ray(&c, W / 2, y).y;
        let want = (down > 0.0).then(|| 100.0 / down);
        match (depth.get(W / 2, y), want) {
            (Some(got), Some(want)) => {
                assert!((f64::from(got) / want - 1.0).abs() < 1e-4, "{got} for {want}")
            }
            (got, want) => assert_eq!(got.is_some(), want.is_some(), "row {y}"),
        }
    }
}

#[test]
fn a_mesh_that_covers_the_image_too_often_is_refused_before_it_is_drawn() {
    let eye = DVec3::new(0.0, 0.0, 800.0);
    let c = Camera::look_at("center", (4000, 4000), 4000.0, eye, DVec3::ZERO, DVec3::NEG_Y);
    let one = sheet(&c, 700.0, 0.0);
    let many = TriMesh { triangles: one.triangles.repeat(150), ..one };
    let fault = DepthMap::of_mesh(&c, &many).map(|_| ()).unwrap_err();
    assert!(fault.contains("300 times over"), "{fault}");
}

#[test]
fn points_are_discs_and_the_nearest_counts() {
    let c = camera();
    let at = |x: f64, y: f64, z: f64| (((DVec2::new(x, y) - c.principal_px) / c.focal_px).extend(1.0)) * z;
    // Beside the centre of (7, 5); on the corner of four pixels around (12, 9), twice; behind the camera.
    let points = [at(7.6, 5.4, 800.0), at(12.0, 9.0, 900.0), at(12.0, 9.0, 850.0), at(3.5, 3.5, -800.0)];
    let cloud = TriMesh { vertices: points.map(|p| world(&c, p)).to_vec(), triangles: vec![] };
    let dir = folder();
    write_mesh(&dir.path().join("points.ply"), &cloud).unwrap();
    let depth = read(&dir).depth.unwrap();
    let mut seen: Vec<(usize, usize, i64)> = Vec::new();
    for (x, y) in (0..H).flat_map(|y| (0..W).map(move |x| (x, y))) {
        seen.extend(depth.get(x, y).map(|z| (x, y, z.round() as i64)));
    }
    let beside = [(7, 4), (7, 5), (8, 5)].map(|(x, y)| (x, y, 800));
    let corner = [(11, 8), (12, 8), (11, 9), (12, 9)].map(|(x, y)| (x, y, 850));
    assert_eq!(seen, [&beside[..], &corner].concat());
    fs::write(dir.path().join("units.json"), r#"{"point_radius_px": 0.6}"#).unwrap();
    assert_eq!(read(&dir).depth.unwrap().answered(), 1);
    fs::write(dir.path().join("units.json"), r#"{"point_radius_px": 1e9}"#).unwrap();
    refused(&dir, &["units.json", "point_radius_px", "0.5 to 32"]);
}

#[test]
fn depth_maps_of_every_format_are_the_same_depth() {
    let want = DepthMap::from_raw(ramp());
    assert_eq!(want.answered(), W * H - 3);
    let of = |name: &str, bytes: Vec<u8>| {
        let dir = folder();
        fs::write(dir.path().join(name), bytes).unwrap();
        read(&dir).depth.unwrap()
    };
    let rows: Vec<f32> = ramp().data;
    let columns: Vec<f32> = (0..W * H).map(|i| rows[(i % H) * W + i / H]).collect();
    let le: Vec<u8> = rows.iter().flat_map(|v| v.to_le_bytes()).collect();
    let be64: Vec<u8> = columns.iter().flat_map(|v| f64::from(*v).to_be_bytes()).collect();
    let shape = format!("'shape': ({H}, {W}), }}\n");
    assert_eq!(
        of("depth.npy", npy(&format!("{{'descr': '<f4', 'fortran_order': False, {shape}"), &le)),
        want
    );
    assert_eq!(
        of("depth.npy", npy(&format!("{{'descr': '>f8', 'fortran_order': True, {shape}"), &be64)),
        want
    );
    let up: Vec<f32> = rows.chunks(W).rev().flatten().copied().collect();
    for (scale, body) in [
        ("-1.0", up.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>()),
        ("1", up.iter().flat_map(|v| v.to_be_bytes()).collect()),
    ] {
        assert_eq!(of("depth.pfm", [format!("Pf\n{W} {H}\n{scale}\n").into_bytes(), body].concat()), want);
    }
    let dir = folder();
    write_exr(&dir.path().join("depth.exr"), &[("Z", &ramp())]).unwrap();
    assert_eq!(read(&dir).depth.unwrap(), want);
    // Quarters of a millimetre are levels of a PNG.
    let levels = ramp().map(|v| if *v > 0.0 { (v * 4.0) as u16 } else { 0 });
    let dir = folder();
    write_png_grey16(&dir.path().join("depth.png"), &levels).unwrap();
    refused(&dir, &["depth.png", "depth_png_mm_per_unit", "units.json"]);
    fs::write(dir.path().join("units.json"), r#"{"depth_png_mm_per_unit": 0.25}"#).unwrap();
    assert_eq!(read(&dir).depth.unwrap(), want);
    write_png_grey(&dir.path().join("depth.png"), &Plane::filled(W, H, 9)).unwrap();
    refused(&dir, &["depth.png", "8 bits"]);
}

#[test]
fn units_and_frame_are_what_the_folder_states() {
    let c = camera();
    let mut strands = StrandSet::new();
    let camera_points = [DVec3::new(1.0, 2.0, 700.0), DVec3::new(1.5, 2.0, 720.0)];
    strands.push(&camera_points.map(|p| (p / 1000.0).as_vec3()), 0.05 / 1000.0);
    let dir = folder();
    for name in ["strands.ply", "strands.obj"] {
        let dir = folder();
        write_strands(&dir.path().join(name), &strands).unwrap();
        let text = r#"{"mm_per_unit": 1000.0, "frame": "reference-camera"}"#;
        fs::write(dir.path().join("units.json"), text).unwrap();
        let got = read(&dir).strands.unwrap();
        for (got, want) in got.points.iter().zip(camera_points) {
            // Metres of 32 bits: half a step of 6e-8 m at 0.7 m.
            assert!(got.distance(world(&c, want)) < 2e-4, "{name}: {got}");
        }
    }
    let metres = sheet(&c, 0.7, 0.0);
    let metres = TriMesh {
        vertices: metres.vertices.iter().map(|v| c.to_camera(v.as_dvec3()).as_vec3()).collect(),
        ..metres
    };
    write_mesh(&dir.path().join("mesh.obj"), &metres).unwrap();
    fs::write(dir.path().join("units.json"), r#"{"mm_per_unit": 1000, "frame": "reference-camera"}"#)
        .unwrap();
    let depth = read(&dir).depth.unwrap();
    assert!((depth.get(5, 5).unwrap() - 700.0).abs() < 0.1, "{:?}", depth.get(5, 5));
    for (text, words) in [
        (r#"{"mm_per_unit": 0}"#, ["units.json", "mm_per_unit is 0"]),
        (r#"{"mm": 1}"#, ["units.json", "unknown field `mm`"]),
        (r#"{"frame": "camera"}"#, ["units.json", "reference-camera"]),
        ("{", ["units.json", "cannot be understood"]),
    ] {
        fs::write(dir.path().join("units.json"), text).unwrap();
        refused(&dir, &words);
    }
}

#[test]
fn strands_of_every_format_lie_where_the_file_has_them() {
    let mut strands = StrandSet::new();
    for s in 0..20u64 {
        let mut r = Rng::keyed(&[7, s]);
        let points: Vec<Vec3> = (0..3 + s)
            .map(|i| Vec3::new(r.f64() as f32 * 90.0, i as f32 * 30.0, r.f64() as f32 * 90.0))
            .collect();
        strands.push(&points, 0.05);
    }
    for ending in ["hair", "data", "ply", "obj"] {
        let dir = folder();
        write_strands(&dir.path().join(format!("strands.{ending}")), &strands).unwrap();
        let got = read(&dir).strands.unwrap();
        assert_eq!(
            (&got.points, &got.offsets),
            (&strands.points, &strands.offsets),
            "{ending}: no resampling"
        );
    }
    let tfx = {
        let n = 4u32;
        let mut b = 4.0f32.to_le_bytes().to_vec();
        for v in [2, n, 160, 0, 0, 0, 0, 0, 0] {
            b.extend(u32::to_le_bytes(v));
        }
        b.resize(160, 0);
        (0..2 * n).for_each(|i| (0..4).for_each(|k| b.extend(((i * (k + 1)) as f32).to_le_bytes())));
        b
    };
    let dir = folder();
    fs::write(dir.path().join("strands.tfx"), tfx).unwrap();
    assert_eq!(read(&dir).strands.unwrap().len(), 2);
}

#[test]
fn whatever_is_wrong_names_file_and_remedy() {
    let dir = folder();
    refused(&dir, &["is empty", "depth.npy", "strands.obj"]);
    fs::write(dir.path().join("depth.tiff"), "x").unwrap();
    refused(&dir, &["has only depth.tiff", "depth.png"]);
    let file = |name: &str, bytes: &[u8], words: &[&str]| {
        let dir = folder();
        fs::write(dir.path().join(name), bytes).unwrap();
        refused(&dir, &[&[name], words].concat());
    };
    for name in DEPTHS.iter().chain(&MESHES).chain(&[POINTS]).chain(&STRANDS).filter(|n| !n.ends_with(".png"))
    {
        file(name, b"", &["empty"]);
        file(name, b"\x00\xff nothing that anybody wrote", &[]);
    }
    let good = |shape: &str| format!("{{'descr': '<f4', 'fortran_order': False, 'shape': {shape}, }}");
    file("depth.npy", &npy(&good("(2, 3)"), &[0; 24]), &["3x2 pixels", "center has 24x18"]);
    file("depth.npy", &npy(&good("(18, 24, 1)"), &[0; 4 * W * H]), &["(18, 24, 1) is not (height, width)"]);
    file("depth.npy", &npy(&good("(18, 24)"), &[0; 4 * W * H - 1]), &["1727 bytes", "(18, 24)"]);
    file("depth.npy", &npy(&good("(99999, 99999)"), &[0; 8]), &["(99999, 99999)"]);
    file("depth.npy", &npy("{'descr': '|O', 'fortran_order': False, 'shape': (2, 3)}", b""), &["'|O'"]);
    file("depth.pfm", b"PF\n2 2\n-1\n", &["three colours"]);
    file("depth.pfm", b"Pf\n2 2\n0\n0000000000000000", &["scale is zero"]);
    file("depth.pfm", b"Pf\n2 2\n-1\n000", &["3 bytes"]);
    file("mesh.obj", b"v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", &["line 1", "not finite"]);
    file("mesh.obj", b"v 0 0 0\n", &["no faces"]);
    file("points.ply", b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\nnan 0 0\n", &["point 0", "not finite"]);
    file("strands.obj", b"v 0 0 0\nv 0 0 inf\nl 1 2\n", &["line 2", "not finite"]);
    file("strands.obj", b"v 0 0 0\nv 0 0 2e8\nl 1 2\n", &["200 km", "mm_per_unit"]);
    file("strands.obj", b"v 0 0 0\nl 1\n", &["none of the 1 strands has a length"]);

    let dir = folder();
    fs::write(dir.path().join("depth.npy"), "").unwrap();
    fs::write(dir.path().join("points.ply"), "").unwrap();
    refused(&dir, &["depth.npy and points.ply both answer for the depth"]);
    let dir = folder();
    write_mesh(&dir.path().join("points.ply"), &sheet(&camera(), 700.0, 0.0)).unwrap();
    refused(&dir, &["points.ply", "has faces", "mesh.ply"]);
}

#[test]
fn more_strands_than_a_head_has_are_refused() {
    let mut text = b"v 0 0 0\nv 0 1 0\n".to_vec();
    text.extend(b"l 1 2\n".repeat(MAX_ANSWER_STRANDS + 1));
    let dir = folder();
    fs::write(dir.path().join("strands.obj"), text).unwrap();
    refused(&dir, &["strands.obj", "1000001 strands, more than 1000000"]);
}

#[test]
fn the_programs_own_folder_keeps_its_meaning() {
    let dir = folder();
    let own = Estimate { envelope: Some(sheet(&camera(), 700.0, 0.0)), ..Estimate::default() };
    crate::write_estimate(dir.path(), &own).unwrap();
    assert_eq!(read(&dir), own, "an envelope is no depth");
    fs::remove_file(dir.path().join("estimate.json")).unwrap();
    assert_eq!(read(&dir), own, "with the manifest or without");
    let depth = Estimate { depth: Some(DepthMap::empty(7, 5)), ..Estimate::default() };
    let dir = folder();
    crate::write_estimate(dir.path(), &depth).unwrap();
    refused(&dir, &["depth.exr", "7x5", "24x18"]);
}

proptest! {
    #[test]
    fn any_bytes_are_an_answer(noise in proptest::collection::vec(proptest::num::u8::ANY, 0..200), cut in 0usize..200) {
        let good = npy("{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }", &[0; 24]);
        for start in [&good[..cut.min(good.len())], b"Pf\n2 2\n-1\n", b"Pf ", b"\x93NUMPY\x02\x00"] {
            let bytes = [start, &noise[..]].concat();
            let _ = (parse_npy(&bytes), parse_pfm(&bytes));
        }
    }
}

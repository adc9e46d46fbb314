use super::*;
use glam::Vec3;

fn quad(faces: &str, count: usize) -> Vec<u8> {
    format!(
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
         element face {count}\nproperty list uchar int vertex_index\nend_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n{faces}"
    )
    .into_bytes()
}

#[test]
fn polygons_are_fanned_and_bad_faces_named() {
    let m = parse_ply_mesh(&quad("4 0 1 2 3\n3 3 2 1\n", 2)).unwrap();
    assert_eq!(m.triangles, [[0, 1, 2], [0, 2, 3], [3, 2, 1]]);
    let e = |f: &str| parse_ply_mesh(&quad(f, 1)).unwrap_err().to_string();
    assert!(e("2 0 1\n").contains("face 0: 2 corners"));
    assert!(e("3 0 1 4\n").contains("vertex 4"));
    assert!(e("3 0 1 -1\n").contains("vertex -1"));
}

#[test]
fn both_formats_round_trip_bit_for_bit_and_the_winding_stays() {
    let dir = tempfile::tempdir().unwrap();
    let mesh = TriMesh {
        vertices: vec![
            Vec3::new(0.1, -1e-30, 3e20),
            Vec3::X,
            Vec3::new(1.0 / 3.0, -0.0, 16_777_217.0),
            Vec3::Z,
        ],
        triangles: vec![[0, 1, 2], [3, 2, 1]],
    };
    for name in ["m.ply", "m.obj", "m.OBJ"] {
        let path = dir.path().join(name);
        write_mesh(&path, &mesh).unwrap();
        let back = read_mesh(&path).unwrap();
        assert_eq!(back, mesh);
        assert_eq!(back.vertices[2].y.to_bits(), (-0.0f32).to_bits());
    }
    let names = std::fs::read_dir(dir.path()).unwrap().count();
    assert_eq!(names, 3, "no temporary file may stay");
}

#[test]
fn what_is_no_mesh_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let path = |n: &str| dir.path().join(n);
    std::fs::write(path("cloud.ply"), quad("", 0)).unwrap();
    assert!(read_mesh(&path("cloud.ply")).unwrap_err().problem.contains("no faces"));
    std::fs::write(path("empty.obj"), "").unwrap();
    assert!(read_mesh(&path("empty.obj")).unwrap_err().problem.contains("is empty"));
    std::fs::write(path("a.stl"), "solid").unwrap();
    assert!(read_mesh(&path("a.stl")).unwrap_err().problem.contains(".ply or .obj"));
    let e = read_mesh(&path("none.ply")).unwrap_err();
    assert!(e.path.ends_with("none.ply") && e.problem.contains("check the path"), "{e}");
    let bad = TriMesh { vertices: vec![Vec3::NAN], triangles: vec![] };
    assert!(write_mesh(&path("nan.ply"), &bad).is_err() && !path("nan.ply").exists());
    let good = TriMesh { vertices: vec![Vec3::X], triangles: vec![[0, 0, 0]] };
    assert!(write_mesh(&path("m.stl"), &good).unwrap_err().problem.contains("stl"));
}

#[test]
fn real_meshes_have_their_known_sizes() {
    let Some(root) = std::env::var_os("STRANDBENCH_DATA") else {
        println!("ignored, no data: set STRANDBENCH_DATA");
        return;
    };
    for (file, vertices, faces) in [
        ("hair/cem_yuksel/woman_head.ply", 43_662, 78_520),
        ("face/ict_facekit/FaceXModel/generic_neutral_mesh.obj", 26_719, 52_220),
        ("face/makehuman_cc0/base.obj", 19_158, 36_972),
    ] {
        let m = read_mesh(&Path::new(&root).join(file)).unwrap();
        assert_eq!((m.vertices.len(), m.triangles.len()), (vertices, faces), "{file}");
    }
    // The head faces +x with z up: its foremost point in the world is the nose, below the eyes, on the midline.
    let head = read_mesh(&Path::new(&root).join("hair/cem_yuksel/woman_head.ply")).unwrap();
    let options = crate::ImportOptions::preset("yuksel-woman").unwrap();
    let world = crate::transform_mesh(&head, &options).unwrap();
    let nose = world.vertices.iter().copied().reduce(|a, b| if b.z > a.z { b } else { a }).unwrap();
    let (lo, hi) = world.bounds().unwrap();
    assert!(nose.x.abs() < 3.0, "{nose}");
    assert!(nose.y > 0.5 * (lo.y + hi.y) && nose.y < 0.7 * hi.y, "{nose} in {lo} {hi}");
}

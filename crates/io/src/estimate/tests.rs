use super::*;
use std::fs;
use strandbench_types::{StrandSet, TriMesh};

fn sample() -> Estimate {
    let mut depth = DepthMap::empty(8, 6);
    depth.set(3, 2, Some(901.25));
    depth.set(7, 5, Some(f32::MIN_POSITIVE));
    let field = |k: f32| Plane::from_vec(8, 6, (0..48).map(|i| i as f32 * k).collect());
    let mut strands = StrandSet::new();
    strands.push(&[Vec3::ZERO, Vec3::new(0.1, 0.2, 0.3)], 0.04);
    Estimate {
        depth: Some(depth),
        envelope: Some(TriMesh { vertices: vec![Vec3::X, Vec3::Y, Vec3::Z], triangles: vec![[0, 1, 2]] }),
        orientation: Some(OrientationField { re: field(0.1), im: field(-0.3) }),
        orientation_3d: Some(Plane::from_vec(
            8,
            6,
            (0..48).map(|i| Vec3::new(i as f32, 0.0, -1.0)).collect(),
        )),
        strands: Some(strands),
        strand_ids: Some(vec![u64::MAX - 1]),
    }
}

#[test]
fn each_subset_of_parts_comes_back_with_nothing_left_of_the_last() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("e");
    let mut seen = std::collections::HashSet::new();
    for subset in (0..64u32).rev().filter(|s| s >> 5 == 0 || s >> 4 & 1 == 1) {
        let mut e = sample();
        let keep = |i: u32| subset >> i & 1 == 1;
        if !keep(0) {
            e.depth = None;
        }
        if !keep(1) {
            e.envelope = None;
        }
        if !keep(2) {
            e.orientation = None;
        }
        if !keep(3) {
            e.orientation_3d = None;
        }
        if !keep(4) {
            e.strands = None;
        }
        if !keep(5) {
            e.strand_ids = None;
        }
        write_estimate(&out, &e).unwrap();
        assert_eq!(read_estimate(&out).unwrap(), e, "subset {subset}");
        seen.insert(fs::read_dir(&out).unwrap().count());
    }
    assert_eq!(seen.len(), 7, "1 to 7 files");
}

#[test]
fn channels_hold_what_their_names_say() {
    let dir = tempfile::tempdir().unwrap();
    let e = sample();
    write_estimate(dir.path(), &e).unwrap();
    let get = |file: &str, name: &str| {
        let channels = read_exr(&dir.path().join(file)).unwrap();
        channels.into_iter().find(|c| c.0 == name).unwrap().1
    };
    let (o, d) = (e.orientation.unwrap(), e.orientation_3d.unwrap());
    assert_eq!((get(ORIENTATION, "re"), get(ORIENTATION, "im")), (o.re, o.im));
    assert_eq!(get(ORIENTATION_3D, "X"), d.map(|v| v.x));
    assert_eq!(get(ORIENTATION_3D, "Z"), d.map(|v| v.z));
}

#[test]
fn an_empty_strand_set_and_an_empty_mesh_are_answers_too() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("e");
    let e = Estimate {
        strands: Some(StrandSet::new()),
        envelope: Some(TriMesh::default()),
        ..Estimate::default()
    };
    write_estimate(&out, &e).unwrap();
    assert_eq!(read_estimate(&out).unwrap(), e);
}

#[test]
fn an_outsiders_folder_needs_no_manifest() {
    let dir = tempfile::tempdir().unwrap();
    assert!(read_estimate(dir.path()).unwrap_err().problem.contains("holds no estimate"));
    let raw = Plane::from_vec(2, 1, vec![0.0, 850.0]);
    write_exr(&dir.path().join("depth.exr"), &[("Z", &raw)]).unwrap();
    let e = read_estimate(dir.path()).unwrap();
    let depth = e.depth.unwrap();
    assert_eq!((depth.get(0, 0), depth.get(1, 0)), (None, Some(850.0)));
    assert!(e.strands.is_none());
}

#[test]
fn each_fault_names_its_file() {
    let fails = |damage: &dyn Fn(&Path), file: &str, problem: &str| {
        let dir = tempfile::tempdir().unwrap();
        let out = dir.path().join("e");
        write_estimate(&out, &sample()).unwrap();
        damage(&out);
        let e = read_estimate(&out).unwrap_err();
        assert!(e.path.ends_with(file) && e.problem.contains(problem), "{file}, {problem}: {e}");
    };
    for part in PARTS {
        fails(&|d| fs::remove_file(d.join(part)).unwrap(), MANIFEST, "is listed but not there");
        fails(&|d| fs::write(d.join(part), b"rubbish").unwrap(), part, "");
        fails(
            &|d| {
                let b = fs::read(d.join(part)).unwrap();
                fs::write(d.join(part), &b[..b.len() - 1]).unwrap();
            },
            part,
            "truncated",
        );
    }
    let edit = |from: &'static str, to: &'static str| {
        move |d: &Path| {
            let text = fs::read_to_string(d.join(MANIFEST)).unwrap();
            assert!(text.contains(from));
            fs::write(d.join(MANIFEST), text.replacen(from, to, 1)).unwrap();
        }
    };
    fails(&edit("\"depth.exr\",", ""), MANIFEST, "is there but not listed");
    fails(&edit("depth.exr", "deep.exr"), MANIFEST, "\"deep.exr\" is not one of");
    fails(&edit("holds", "has"), MANIFEST, "unknown field");
    let nan = Plane::filled(2, 2, f32::NAN);
    fails(
        &|d| write_exr(&d.join(ORIENTATION), &[("re", &nan), ("im", &nan)]).unwrap(),
        ORIENTATION,
        "pixel (0, 0) is not finite",
    );
    fails(
        &|d| {
            let path = d.join(STRANDS);
            let mut b = fs::read(&path).unwrap();
            // The first coordinate: after 128 bytes of header and one strand's u16.
            b[130..134].copy_from_slice(&f32::NAN.to_le_bytes());
            fs::write(path, b).unwrap();
        },
        STRANDS,
        "strand 0, point 0",
    );
    let rewrite =
        |ids: Vec<u64>| move |d: &Path| fs::write(d.join(STRAND_IDS), encode_strand_ids(&ids)).unwrap();
    fails(&rewrite(vec![1, 2]), STRAND_IDS, "2 strand identities for 1 strands");
    let dir = tempfile::tempdir().unwrap();
    let e = write_estimate(&dir.path().join("e"), &Estimate { strands: None, ..sample() }).unwrap_err();
    assert!(e.path.ends_with(STRAND_IDS) && e.problem.contains("no strands"), "{e}");
    let mut bad = sample();
    bad.strands.as_mut().unwrap().points[1].y = f32::NAN;
    let e = write_estimate(&dir.path().join("e"), &bad).unwrap_err();
    assert!(e.problem.contains("strand 0, point 1"), "{e}");
    assert!(!dir.path().join("e").exists());
}

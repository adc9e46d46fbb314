use super::*;
use glam::Vec3;
use proptest::prelude::*;
use std::fs;
use strandbench_types::{HairRoot, StrandSet, TriMesh, Visibility};

const FILES: [&str; 8] =
    [SKIN, STRANDS, ROOTS, VISIBILITY, SKIN_SEEN_BY, SKIN_BARE_SEEN_BY, SKIN_COVER, ABOUT];

fn truth() -> FaceTruth {
    let mut strands = StrandSet::new();
    strands.push(&[Vec3::ZERO, Vec3::Z, Vec3::new(0.1, 0.0, 2.2)], 0.04);
    strands.push(&[Vec3::X, Vec3::new(1.0, 0.3, 0.7)], 0.05);
    let root = |i: usize, kind| HairRoot {
        position_mm: Vec3::X * i as f32,
        triangle: i as u32,
        barycentric: [0.2, 0.3, 0.5],
        length_mm: 2.2 + i as f32,
        kind,
        density_per_cm2: 30.5,
    };
    FaceTruth {
        skin: TriMesh {
            vertices: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::ONE * 0.1],
            triangles: vec![[0, 1, 2], [2, 1, 3]],
        },
        strands,
        roots: vec![root(0, 1), root(1, 0)],
        kinds: vec!["beard".into(), "brows".into()],
        visibility: Visibility { offsets: vec![0, 4, 5], seen_by: vec![1, 3, 0, 0x2000, 1] },
        skin_seen_by: vec![0, 1, 1, 0x3fff],
        skin_bare_seen_by: vec![5, 1, 1, 0x3fff],
        skin_cover: vec![SkinCover::Under, SkinCover::Margin, SkinCover::Bare, SkinCover::Bare],
    }
}

fn written() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    write_face_truth(dir.path(), &truth()).unwrap();
    dir
}

#[test]
fn a_frame_comes_back_bit_for_bit() {
    let dir = written();
    let topology = truth().skin.triangles;
    assert_eq!(read_face_truth(dir.path(), Some(&topology)).unwrap(), truth());
    let e = read_face_truth(dir.path(), Some(&topology[..1])).unwrap_err();
    assert!(e.path.ends_with(SKIN) && e.problem.contains("not those of the sequence"), "{e}");
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), FILES.len());
    let about = fs::read_to_string(dir.path().join(ABOUT)).unwrap();
    assert!(about.contains("\"name\": \"brows\",\n      \"label\": 17"), "{about}");
}

#[test]
fn what_contradicts_is_not_written() {
    let said = |change: fn(&mut FaceTruth)| {
        let (dir, mut t) = (tempfile::tempdir().unwrap(), truth());
        change(&mut t);
        let e = write_face_truth(dir.path(), &t).unwrap_err().problem;
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 0);
        e
    };
    for (got, want) in [
        (said(|t| t.roots[1].triangle = 2), "root 1 stands in triangle 2 of 2"),
        (said(|t| t.roots[0].kind = 2), "root 0 is of kind 2 of 2"),
        (said(|t| t.roots[0].barycentric[0] = f32::NAN), "root 0 has weights"),
        (said(|t| t.roots[0].barycentric = [0.5; 3]), "do not sum to 1"),
        (said(|t| t.roots[0].length_mm = -1.0), "negative or not finite"),
        (said(|t| t.roots[0].position_mm.y = f32::NAN), "negative or not finite"),
        (said(|t| t.roots.truncate(1)), "2 strands have 1 roots"),
        (said(|t| t.skin_cover.truncate(3)), "skin_cover has 3 entries for 4"),
        (said(|t| t.skin.vertices[0].x = f32::NAN), "skin: vertex 0"),
        (said(|t| t.kinds = vec![String::new(); 241]), "241 kinds"),
    ] {
        assert!(got.contains(want), "{got:?} does not say {want:?}");
    }
}

#[test]
fn each_file_is_needed_whole_and_named() {
    for name in FILES {
        let dir = written();
        let path = dir.path().join(name);
        let good = fs::read(&path).unwrap();
        for n in (0..good.len()).filter(|n| n % 7 == 0 || n + 40 > good.len()) {
            fs::write(&path, &good[..n]).unwrap();
            let whole = name == ABOUT && n + 1 == good.len();
            assert!(
                whole || read_face_truth(dir.path(), None).is_err(),
                "{name}: {n} of {} bytes",
                good.len()
            );
        }
        fs::remove_file(&path).unwrap();
        let e = read_face_truth(dir.path(), None).unwrap_err();
        assert!(e.path.ends_with(name), "{e}");
    }
    let said = |name: &str, from: &str, to: &str| {
        let dir = written();
        let path = dir.path().join(name);
        let text = fs::read_to_string(&path).unwrap();
        assert!(text.contains(from));
        fs::write(&path, text.replace(from, to)).unwrap();
        read_face_truth(dir.path(), None).unwrap_err().problem
    };
    assert!(said(ABOUT, "\"version\": 1", "\"version\": 7").contains("version 7"));
    assert!(said(ABOUT, "\"label\": 17", "\"label\": 18").contains("kind 1 (brows) has label 18"));
    assert!(said(ABOUT, "\"note\"", "\"hint\"").contains("hint"));
    let dir = written();
    fs::write(dir.path().join(SKIN_COVER), encode_seen_by(&[0, 1, 3, 0])).unwrap();
    let e = read_face_truth(dir.path(), None).unwrap_err();
    assert!(e.path.ends_with(SKIN_COVER) && e.problem.contains("vertex 2 is 3"), "{e}");
}

proptest! {
    #[test]
    fn damage_never_panics(
        which in 0usize..FILES.len(),
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
    ) {
        let dir = written();
        let path = dir.path().join(FILES[which]);
        let mut b = fs::read(&path).unwrap();
        for (at, v) in changes {
            let i = at.index(b.len());
            b[i] = v;
        }
        fs::write(&path, b).unwrap();
        if let Ok(t) = read_face_truth(dir.path(), None) {
            prop_assert_eq!(t.validate(), Ok(()));
        }
    }
}

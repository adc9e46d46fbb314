use super::*;
use crate::exr::write_exr;
use proptest::prelude::*;
use std::fs;
use strandbench_types::{FlowMap, FlowState};

/// Nothing, skin, an eye, and hair of kind 2 over skin.
pub(crate) fn view() -> FaceView {
    let mesh = |surface, triangle, uv| FirstHit::Mesh { surface, triangle, uv };
    let bare = vec![
        FirstHit::Nothing,
        mesh(0, 160_000, [0.25, 0.75]),
        mesh(1, 3, [0.0, 1e-30]),
        mesh(0, 7, [0.1, 0.2]),
    ];
    let mut seen = bare.clone();
    seen[3] = FirstHit::Fibre { strand: (1 << 24) - 1, segment: 5, along: 0.7 };
    let plane = |hits, last: f32| HitPlane {
        hits: Plane::from_vec(2, 2, hits),
        depth: DepthMap::from_raw(Plane::from_vec(2, 2, vec![f32::NAN, 800.1, 700.2, last])),
    };
    let flow = |last| FlowMap {
        flow_px: Plane::from_vec(2, 2, vec![[f32::NAN; 2], [1.0, 2.0], [900.0, 0.0], [0.3, 0.4]]),
        state: Plane::from_vec(2, 2, vec![FlowState::Absent, FlowState::Seen, FlowState::Outside, last]),
    };
    FaceView {
        seen: plane(seen, 799.0),
        bare: plane(bare, 802.0),
        labels: Plane::from_vec(2, 2, vec![LABEL_NOTHING, LABEL_SKIN, LABEL_OTHER, LABEL_HAIR + 2]),
        flow: flow(FlowState::Occluded),
        bare_flow: flow(FlowState::Seen),
    }
}

fn written() -> (tempfile::TempDir, std::path::PathBuf) {
    let dir = tempfile::tempdir().unwrap();
    let view_dir = dir.path().join("cam");
    write_face_view(&view_dir, &view()).unwrap();
    (dir, view_dir)
}

#[test]
fn a_view_comes_back_bit_for_bit() {
    let (dir, path) = written();
    assert_eq!(read_face_view(&path).unwrap(), view());
    let mut names: Vec<_> =
        fs::read_dir(&path).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    assert_eq!(names, [FLOW, LABELS, SEEN, SKIN, SKIN_FLOW]);
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1, "nothing is left beside");
}

#[test]
fn what_cannot_be_read_back_is_not_written() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("cam");
    let said = |change: fn(&mut FaceView)| {
        let mut v = view();
        change(&mut v);
        write_face_view(&path, &v).unwrap_err().problem
    };
    for (got, want) in [
        (said(|v| v.seen.hits.data[3] = FirstHit::Fibre { strand: 1 << 24, segment: 0, along: 0.0 }), "2^24"),
        (said(|v| v.seen.hits.data[1] = FirstHit::Nothing), "pixel (1, 0) shows something else without hair"),
        (said(|v| v.bare.hits.data[3] = v.seen.hits.data[3]), "pixel (1, 1) shows hair without hair"),
        (said(|v| v.flow.state = Plane::filled(1, 1, FlowState::Seen)), "state of flow is (1, 1) px"),
    ] {
        assert!(got.contains(want), "{got:?} does not say {want:?}");
    }
    assert!(!path.exists());
}

#[test]
fn each_file_that_contradicts_is_named_with_its_pixel() {
    let said = |file: &str, channel: &str, value: f32| {
        let (_dir, path) = written();
        let file = path.join(file);
        let mut channels = read_exr(&file).unwrap();
        channels.iter_mut().find(|c| c.0 == channel).unwrap().1.data[3] = value;
        let list: Vec<_> = channels.iter().map(|(n, p)| (n.as_str(), p)).collect();
        write_exr(&file, &list).unwrap();
        let e = read_face_view(&path).unwrap_err();
        assert!(e.path == file && e.problem.contains("pixel (1, 1)"), "{e}");
    };
    for bad in [f32::NAN, -1.0, 0.5, 16_777_216.0, f32::INFINITY] {
        said(SEEN, "strand", bad);
        said(SEEN, "segment", bad);
        said(SKIN, "triangle", bad);
    }
    said(SEEN, "along", 1.1);
    said(SEEN, "depth_mm", f32::NAN);
    said(SEEN, "depth_mm", -3.0);
    said(SKIN, "barycentric.u", 0.9);
    said(SKIN, "barycentric.v", -0.1);
    said(SKIN, "depth_mm", f32::INFINITY);
    said(FLOW, "valid", 0.0);
    let (_dir, path) = written();
    let mut labels = view().labels;
    labels.data[3] = LABEL_SKIN;
    write_png_grey(&path.join(LABELS), &labels).unwrap();
    let e = read_face_view(&path).unwrap_err();
    assert!(e.path.ends_with(LABELS) && e.problem.contains("pixel (1, 1): label 1 for Fibre"), "{e}");
    write_png_grey(&path.join(LABELS), &Plane::filled(4, 1, 0)).unwrap();
    assert!(read_face_view(&path).unwrap_err().problem.contains("(2, 2) pixels, but labels.png has (4, 1)"));
    for name in [FLOW, LABELS, SEEN, SKIN, SKIN_FLOW] {
        let (_dir, path) = written();
        fs::remove_file(path.join(name)).unwrap();
        let e = read_face_view(&path).unwrap_err();
        assert!(e.path.ends_with(name), "{e}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]
    #[test]
    fn damage_never_panics(
        which in 0usize..5,
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
    ) {
        let (_dir, path) = written();
        let file = path.join([FLOW, LABELS, SEEN, SKIN, SKIN_FLOW][which]);
        let mut b = fs::read(&file).unwrap();
        for (at, v) in changes {
            let i = at.index(b.len());
            b[i] = v;
        }
        fs::write(&file, b).unwrap();
        if let Ok(v) = read_face_view(&path) {
            prop_assert_eq!(v.validate(), Ok(()));
        }
    }
}

//! USD layers, opened by Pixar's own library.

use glam::Vec3;
use serde_json::{Value, json};
use std::path::Path;
use std::process::{Command, Stdio};
use strandbench_io::usd::{At, Content, MAX_FRAMES, frame_path, write_index, write_mesh, write_strands};
use strandbench_rng::Rng;
use strandbench_types::{StrandSet, TriMesh};

const RATE_HZ: f64 = 100.0;

fn python() -> Option<String> {
    let python = std::env::var("STRANDBENCH_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let there = Command::new(&python).args(["-c", "import pxr"]).stderr(Stdio::null()).status();
    if there.is_ok_and(|s| s.success()) {
        return Some(python);
    }
    println!("ignored, no usd-core: install it for python3 or set STRANDBENCH_PYTHON");
    None
}

fn opened(python: &str, prim: &str, path: &Path, times: &[f64]) -> Value {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/usd_reader.py");
    let times = times.iter().map(f64::to_string);
    let output = Command::new(python).arg(script).arg(prim).arg(path).args(times).output().unwrap();
    let complaints = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success() && complaints.is_empty(), "{complaints}");
    serde_json::from_slice(&output.stdout).expect("the reader prints JSON")
}

/// Strands of a frame: their number, points, radii and identities all change from frame to frame.
fn strands(frame: u32) -> (StrandSet, Vec<u64>) {
    let mut set = StrandSet::new();
    for s in 0..40 + 7 * u64::from(frame) {
        let mut r = Rng::keyed(&[u64::from(frame), s]);
        let n = 2 + r.below(30) as usize;
        let mut number = |_| (r.f64() * 600.0 - 300.0) as f32;
        let points: Vec<Vec3> =
            (0..n).map(|i| Vec3::from_array(std::array::from_fn(|_| number(i)))).collect();
        let radii: Vec<f32> = (0..n).map(|_| (0.02 + 0.03 * r.f64()) as f32).collect();
        set.push_tapered(&points, &radii);
    }
    // Numbers that a careless decimal would not bring back.
    set.push_tapered(
        &[Vec3::new(-0.0, f32::MIN_POSITIVE, 1.0 / 3.0), Vec3::new(1e-30, -16_777_217.0, 3.0e30)],
        &[1e-20, f32::from_bits(1)],
    );
    let ids = (0..set.len() as u64).map(|s| u64::MAX - (s * 31 + u64::from(frame))).collect();
    (set, ids)
}

fn bits(points: &[Vec3]) -> Value {
    json!(points.iter().map(|p| p.to_array().map(f32::to_bits)).collect::<Vec<_>>())
}

fn expect_strands(got: &Value, set: &StrandSet, ids: Option<&[u64]>) {
    let a = &got["attributes"];
    assert_eq!(a["type"], "linear");
    assert_eq!(a["curveVertexCounts"], json!(set.iter().map(<[Vec3]>::len).collect::<Vec<_>>()));
    assert_eq!(a["points"], bits(&set.points));
    let widths: Vec<u32> = set.radii_mm.iter().map(|r| (2.0 * r).to_bits()).collect();
    assert_eq!(a["widths"], json!(widths));
    assert_eq!(a["primvars:strandId"], json!(ids));
    assert_eq!(a["extent"], got["computed_extent"], "USD computes the same box");
}

#[test]
fn a_sequence_of_strands_is_what_another_reader_finds() {
    let Some(python) = python() else { return };
    let dir = tempfile::tempdir().unwrap();
    let index = dir.path().join("strands.usda");
    std::fs::create_dir(dir.path().join("strands")).unwrap();
    for frame in 3..9 {
        let (mut set, ids) = strands(frame);
        // An absent answer is a frame without strands.
        if frame == 7 {
            set = StrandSet::new();
        }
        let at = At { frame, rate_hz: RATE_HZ };
        write_strands(&frame_path(&index, frame), &set, Some(&ids[..set.len()]), Some(at)).unwrap();
    }
    write_index(&index, Content::Strands { ids: true }, 3, 8, RATE_HZ).unwrap();

    let got = opened(&python, "/Strands", &index, &[4.0, 4.5, 5.0]);
    assert_eq!(got["default"], "/Strands");
    assert_eq!((&got["type"], &got["up"]), (&json!("BasisCurves"), &json!("Y")));
    assert_eq!((&got["metres"], &got["rate"]), (&json!(0.001), &json!(RATE_HZ)));
    assert_eq!((&got["from"], &got["to"]), (&json!(3.0), &json!(8.0)));
    assert_eq!(got["interpolation"]["strandId"], "uniform");
    assert_eq!(got["widths"], "vertex");
    // A held frame's end counts as a sample as well, just before the next one.
    let samples = got["samples"].as_array().unwrap().iter().map(|t| t.as_f64().unwrap());
    let starts: Vec<f64> = samples.filter(|t| t.fract() == 0.0).collect();
    assert_eq!(starts, [3.0, 4.0, 5.0, 6.0, 7.0, 8.0]);
    // The index, the session's own, and the two frames that were asked for.
    assert_eq!(got["layers"], 4, "no other frame is loaded");
    for (k, frame) in [4, 4, 5].into_iter().enumerate() {
        let (set, ids) = strands(frame);
        expect_strands(&got["values"][k], &set, Some(&ids));
    }
    let empty = opened(&python, "/Strands", &index, &[7.0]);
    assert_eq!(empty["values"][0]["attributes"]["points"], json!([]));

    // A frame alone, and strands without time or identity.
    let (set, ids) = strands(8);
    let alone = opened(&python, "/Strands", &frame_path(&index, 8), &[8.0]);
    assert_eq!((&alone["from"], &alone["to"]), (&json!(8.0), &json!(8.0)));
    expect_strands(&alone["values"][0], &set, Some(&ids));
    let still = dir.path().join("still.usda");
    strandbench_io::write_strands(&still, &set).unwrap();
    expect_strands(&opened(&python, "/Strands", &still, &[])["values"][0], &set, None);
}

#[test]
fn a_sequence_of_meshes_is_what_another_reader_finds() {
    let Some(python) = python() else { return };
    let dir = tempfile::tempdir().unwrap();
    let index = dir.path().join("envelope.usda");
    std::fs::create_dir(dir.path().join("envelope")).unwrap();
    let mesh = |frame: u32| {
        let (set, _) = strands(frame);
        let triangles = (2..set.points.len() as u32).map(|i| [i, i / 2, i - 2]).collect();
        TriMesh { vertices: set.points, triangles }
    };
    for frame in 0..2 {
        let at = At { frame, rate_hz: 29.97 };
        write_mesh(&frame_path(&index, frame), &mesh(frame), Some(at)).unwrap();
    }
    write_index(&index, Content::Mesh, 0, 1, 29.97).unwrap();
    let got = opened(&python, "/Envelope", &index, &[0.0, 1.0]);
    assert_eq!((&got["type"], &got["rate"]), (&json!("Mesh"), &json!(29.97)));
    let same = |got: &Value, frame: u32| {
        let (a, want) = (&got["attributes"], mesh(frame));
        assert_eq!(a["points"], bits(&want.vertices));
        assert_eq!(a["faceVertexIndices"], json!(want.triangles.concat()));
        assert_eq!(a["faceVertexCounts"], json!(vec![3; want.triangles.len()]));
        assert_eq!(a["subdivisionScheme"], "none");
        assert_eq!(a["extent"], got["computed_extent"]);
    };
    same(&got["values"][0], 0);
    same(&got["values"][1], 1);
    let still = dir.path().join("still.usda");
    strandbench_io::write_mesh(&still, &mesh(5)).unwrap();
    same(&opened(&python, "/Envelope", &still, &[])["values"][0], 5);
}

#[test]
fn what_no_layer_can_hold_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let index = dir.path().join("s.usda");
    std::fs::create_dir(dir.path().join("s")).unwrap();
    let (set, ids) = strands(0);
    let refused = |r: Result<(), strandbench_io::IoError>, want: &str| {
        let e = r.unwrap_err().to_string();
        assert!(e.contains(want), "{e}");
    };
    let at = |frame, rate_hz| Some(At { frame, rate_hz });
    let one = frame_path(&index, 0);
    refused(write_strands(&one, &set, Some(&ids[1..]), None), "40 identities for 41 strands");
    refused(write_strands(&one, &set, None, at(MAX_FRAMES, 30.0)), "not below 1000000");
    refused(write_strands(&one, &set, None, at(0, f64::NAN)), "NaN frames a second");
    refused(write_mesh(&one, &TriMesh { vertices: vec![Vec3::NAN], triangles: vec![] }, None), "vertex 0");
    let mut nan = set.clone();
    nan.points[3].y = f32::NAN;
    refused(write_strands(&one, &nan, None, None), "not finite");
    assert!(!one.exists(), "nothing is left of what was refused");
    write_strands(&one, &set, None, at(0, RATE_HZ)).unwrap();
    let strands = Content::Strands { ids: false };
    refused(
        write_index(&index, strands, 0, 1, RATE_HZ),
        "s.000001.usda: this frame of the sequence is not there",
    );
    refused(write_index(&index, strands, 1, 0, RATE_HZ), "frames 1 to 0 are none");
    refused(write_index(&index, strands, 0, 0, 0.0), "0 frames a second");
    for name in ["s@.usda", "s#.usda", "s\".usda", "s.usd", ".usda"] {
        refused(write_index(&dir.path().join(name), strands, 0, 0, RATE_HZ), "cannot stand in the layer");
    }
    write_index(&index, strands, 0, 0, RATE_HZ).unwrap();
    assert!(std::fs::metadata(&index).unwrap().len() < 1000, "frames are named, not copied");
}

//! Faces: what a render leaves behind, the same bits from any number of threads, going on after a stop, bad input.

use crate::support::{copy, differences, fails, files, folder, json, ok, strandbench, text};
use glam::DVec2;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use strandbench_io::{ColourFrame, read_face_truth, read_face_view, read_hair_field};
use strandbench_types::{FirstHit, FlowState, LABEL_HAIR};

/// A talking face with few hairs, 60 x 80 pixels.
const FACE: &str = r#"description = "a small face for tests"
stresses = "the harness, not a method"

[face]
identity = 4
male = 1.0
performance = "dialogue"

[rig]
width_px = 60
height_px = 80
"#;

const SETTINGS: [&str; 3] =
    ["render.samples_per_pixel=2", "render.max_samples_per_pixel=2", "render.depth=2"];
const LABEL: &str = "face+samples_per_pixel=2+max_samples_per_pixel=2+depth=2";

fn render<'a>(more: &[&'a str]) -> Vec<&'a str> {
    let mut args = vec!["render", "--scene", "face.toml", "--out", "out"];
    SETTINGS.iter().for_each(|s| args.extend(["--set", s]));
    args.extend(more);
    args
}

/// A folder with frames 0 and 40 of the face; shared, so look and do not touch.
fn finished() -> &'static Path {
    static DONE: OnceLock<PathBuf> = OnceLock::new();
    DONE.get_or_init(|| {
        let dir = folder("face");
        std::fs::write(dir.join("face.toml"), FACE).unwrap();
        ok(&dir, &render(&["--frames", "0..1"]));
        ok(&dir, &render(&["--frames", "40..41"]));
        dir
    })
}

fn out(dir: &Path) -> PathBuf {
    dir.join("out").join(LABEL).join("render")
}

#[test]
fn a_face_leaves_images_for_a_method_truth_for_a_scorer_and_a_page_for_people() {
    let render = out(finished());
    let frame = ColourFrame::open(&render.join("000040/frame")).unwrap();
    assert_eq!((frame.rig.cameras.len(), frame.index), (14, 40));
    assert_eq!(frame.polarised.iter().filter(|p| **p).count(), 4);
    for c in 0..14 {
        let image = frame.image(c).unwrap();
        let mean = image.data.iter().flatten().sum::<f32>() / (3 * image.data.len()) as f32;
        assert!((0.05..0.8).contains(&mean), "camera {c}: a lit face before a dark wall, mean {mean}");
    }
    // A method is given nothing but images and calibration.
    let mut names: Vec<_> =
        std::fs::read_dir(render.join("000040/frame")).unwrap().map(|e| e.unwrap().file_name()).collect();
    names.sort();
    assert_eq!(names.len(), 16, "{names:?}");

    let truth = read_face_truth(&render.join("000040/truth"), None).unwrap();
    let first = read_face_truth(&render.join("000000/truth"), Some(&truth.skin.triangles)).unwrap();
    assert!(truth.strands.len() > 100 && truth.strands.offsets == first.strands.offsets);
    assert!(truth.skin.vertices != first.skin.vertices, "the face has moved");
    let field = read_hair_field(&render.join("000040/truth")).unwrap();
    assert!(field.distance_mm.iter().any(|d| *d < 1.0));
    let page = std::fs::read_to_string(render.join("report/report.html")).unwrap();
    for picture in page.split("src=\"../").skip(1).filter_map(|p| p.split('"').next()) {
        assert!(render.join(picture).is_file(), "the page shows {picture}, which is not there");
    }
    assert!(render.join("subject/skin.obj").is_file());
    let model = std::fs::read_to_string(render.join("subject/model/model.json")).unwrap();
    assert!(model.contains("\"left_out\": 4"), "{model}");
}

#[test]
fn the_written_truth_is_consistent_with_the_written_geometry() {
    let render = out(finished());
    let (now, then) = ("000040/truth", "000000/truth");
    let [truth, first] = [now, then].map(|t| read_face_truth(&render.join(t), None).unwrap());
    let rig = strandbench_io::parse_rig(
        Path::new("rig.json"),
        &std::fs::read(render.join(now).join("rig.json")).unwrap(),
    );
    let rig = rig.unwrap();
    let mut seen = 0;
    for c in &rig.cameras {
        let view = read_face_view(&render.join(now).join(&c.name)).unwrap();
        for (i, hit) in view.bare.hits.data.iter().enumerate() {
            // Skin under everything: the file's place on the file's mesh, in the file's image.
            let FirstHit::Mesh { surface: 0, triangle, uv } = *hit else { continue };
            let place = |mesh: &strandbench_types::TriMesh| {
                let [a, b, c] =
                    mesh.triangles[triangle as usize].map(|v| mesh.vertices[v as usize].as_dvec3());
                a + (b - a) * f64::from(uv[0]) + (c - a) * f64::from(uv[1])
            };
            let pixel = DVec2::new((i % 60) as f64 + 0.5, (i / 60) as f64 + 0.5);
            let (at, depth) = c.project(place(&truth.skin)).unwrap();
            assert!(at.distance(pixel) < 0.01, "{} pixel {i}: {at}", c.name);
            assert!((depth - f64::from(view.bare.depth.get_index(i).unwrap())).abs() < 1e-3);
            if view.bare_flow.state.data[i] != FlowState::Absent {
                let (there, _) = c.project(place(&first.skin)).unwrap();
                let [u, v] = view.bare_flow.flow_px.data[i].map(f64::from);
                assert!(there.distance(pixel + DVec2::new(u, v)) < 0.01, "{} pixel {i}", c.name);
                seen += 1;
            }
        }
        for (label, hit) in view.labels.data.iter().zip(&view.seen.hits.data) {
            assert_eq!(*label >= LABEL_HAIR, matches!(hit, FirstHit::Fibre { .. }));
        }
    }
    assert!(seen > 10_000, "{seen} pixels of skin");
}

#[test]
fn one_thread_gives_the_same_bits_and_a_second_run_repeats_nothing() {
    let dir = folder("face-threads");
    std::fs::write(dir.join("face.toml"), FACE).unwrap();
    let all = json(&dir, &render(&["--frames", "40..41", "--threads", "1"]));
    assert_eq!(all[0]["reused"], false);
    let of = |dir: &Path| files(&out(dir).join("000040"));
    let found = differences(&of(finished()), &of(&dir));
    let found: Vec<_> =
        found.iter().filter(|f| !f.ends_with("stage.json") && !f.ends_with("render.json")).collect();
    assert!(found.is_empty(), "{found:?}");
    let again = json(&dir, &render(&["--frames", "40..41"]));
    assert_eq!(again[0]["reused"], true);
}

#[test]
fn what_is_no_face_is_an_error_that_names_it() {
    let dir = folder("face-bad");
    copy(finished(), &dir);
    let wrong = |from: &str, to: &str, wants: &[&str]| {
        std::fs::write(dir.join("face.toml"), FACE.replace(from, to)).unwrap();
        let said = fails(&dir, &render(&[]));
        assert!(wants.iter().all(|w| said.contains(w)), "{said}");
    };
    wrong("male = 1.0", "male = 3.0", &["face.toml, line 6", "face.male", "between 0 and 1"]);
    wrong("male", "mail", &["face.toml, line 6", "mail"]);
    wrong("[rig]", "[rig]\npixel_mm = 0", &["rig.pixel_mm: 0 is not"]);
    std::fs::write(dir.join("face.toml"), FACE).unwrap();
    let said = fails(&dir, &render(&["--frames", "149..152"]));
    assert!(said.contains("149..152") && said.contains("0..150"), "{said}");
    let run = strandbench(&dir, &["run", "--scene", "face.toml"]);
    assert!(
        !run.status.success() && text(&run.stderr).contains("strandbench render"),
        "{}",
        text(&run.stderr)
    );
    std::fs::remove_file(out(&dir).join("000040/stage.json")).unwrap();
    let said = fails(&dir, &["report", &out(&dir).display().to_string()]);
    assert!(said.contains("000040"), "{said}");
}

use super::*;
use crate::rig_json::tests::rig;
use std::fs;

fn sample() -> (Rig, Frame) {
    let rig = rig(2, 40, 30);
    let image =
        |c: usize| Plane::from_vec(40, 30, (0..1200).map(|i| (i * (c + 1)) as f32 / 999.0 - 0.1).collect());
    let mask = |c: usize| Plane::from_vec(40, 30, (0..1200).map(|i| i % (c + 2) == 0).collect());
    let frame = Frame { index: 17, images: vec![image(0), image(1)], masks: vec![mask(0), mask(1)] };
    (rig, frame)
}

fn written() -> (tempfile::TempDir, std::path::PathBuf) {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("frame");
    let (rig, frame) = sample();
    write_frame(&out, &rig, &frame).unwrap();
    (dir, out)
}

#[test]
fn a_frame_comes_back_and_its_files_are_those_documented() {
    let (_keep, out) = written();
    assert_eq!(read_frame(&out).unwrap(), sample());
    let mut names: Vec<_> = fs::read_dir(&out).unwrap().map(|e| e.unwrap().file_name()).collect();
    names.sort();
    assert_eq!(
        names,
        [
            "cam0.exr",
            "cam0.png",
            "cam0_mask.png",
            "cam1.exr",
            "cam1.png",
            "cam1_mask.png",
            "frame.json",
            "rig.json"
        ]
    );
    let preview = read_png_grey(&out.join("cam0.png")).unwrap();
    for (p, v) in preview.data.iter().zip(&sample().1.images[0].data) {
        assert!((p - v.clamp(0.0, 1.0)).abs() <= 0.5 / 65_535.0 + 1e-7, "{p} {v}");
    }
}

#[test]
fn an_outsiders_folder_of_8_bit_pngs_is_read() {
    let (_keep, out) = written();
    let grey = Plane::from_vec(40, 30, (0..1200).map(|i| (i % 256) as u8).collect());
    write_png_grey(&out.join("shot.png"), &grey).unwrap();
    let text = fs::read_to_string(out.join("frame.json")).unwrap();
    fs::write(out.join("frame.json"), text.replace("\"cam1.exr\"", "\"shot.png\"")).unwrap();
    assert_eq!(read_frame(&out).unwrap().1.images[1], grey.map(|&v| f32::from(v) / 255.0));
}

#[test]
fn each_fault_names_its_file() {
    let fails = |damage: &dyn Fn(&Path), file: &str, problem: &str| {
        let (_keep, out) = written();
        damage(&out);
        let e = read_frame(&out).unwrap_err();
        assert!(e.path.ends_with(file) && e.problem.contains(problem), "{file}, {problem}: {e}");
    };
    for file in ["rig.json", "frame.json", "cam1.exr", "cam0_mask.png"] {
        fails(&|d| fs::remove_file(d.join(file)).unwrap(), file, "check the path");
        fails(&|d| fs::write(d.join(file), b"").unwrap(), file, "is empty");
        fails(&|d| fs::write(d.join(file), b"what?").unwrap(), file, "not a");
    }
    let other = Plane::filled(41, 30, 1u8);
    fails(&|d| write_png_grey(&d.join("cam1_mask.png"), &other).unwrap(), "cam1_mask.png", "41x30");
    let none = Plane::filled(40, 30, 0u8);
    fails(
        &|d| write_png_grey(&d.join("cam1_mask.png"), &none).unwrap(),
        "cam1_mask.png",
        "the mask is empty",
    );
    let big = Plane::filled(40, 31, 0.5f32);
    fails(&|d| write_exr(&d.join("cam0.exr"), &[("Y", &big)]).unwrap(), "cam0.exr", "40x31");
    let nan = Plane::filled(40, 30, f32::NAN);
    fails(&|d| write_exr(&d.join("cam0.exr"), &[("Y", &nan)]).unwrap(), "cam0.exr", "not finite");
    fails(&|d| write_exr(&d.join("cam0.exr"), &[("R", &big)]).unwrap(), "cam0.exr", "channel Y is missing");
    let edit = |from: &'static str, to: &'static str| {
        move |d: &Path| {
            let text = fs::read_to_string(d.join("frame.json")).unwrap();
            assert!(text.contains(from));
            fs::write(d.join("frame.json"), text.replacen(from, to, 1)).unwrap();
        }
    };
    fails(&edit("\"name\": \"cam0\"", "\"name\": \"cam1\""), "frame.json", "rig.json has \"cam0\"");
    fails(&edit("\"cam0.exr\"", "\"../cam0.exr\""), "frame.json", "not the name of a file");
    for name in ["../cam0.exr", "sub/cam0.exr", "sub\\\\cam0.exr", "/cam0.exr", ".cam0.exr", ""] {
        let outside = move |d: &Path| {
            let text = fs::read_to_string(d.join("frame.json")).unwrap();
            fs::write(d.join("frame.json"), text.replacen("cam0.exr", name, 1)).unwrap();
        };
        fails(&outside, "frame.json", "not the name of a file");
    }
    fails(&edit("\"index\"", "\"time\""), "frame.json", "unknown field");
    fails(&edit("\"version\": 1", "\"version\": 7"), "frame.json", "version 7");
    fails(&|d| fs::write(d.join(".incomplete"), b"").unwrap(), "frame", "half-written");
    let (_keep, out) = written();
    let text = fs::read_to_string(out.join("rig.json")).unwrap();
    let one = encode_rig(&rig(1, 40, 30));
    assert_ne!(one, text);
    fs::write(out.join("rig.json"), one).unwrap();
    assert!(read_frame(&out).unwrap_err().problem.contains("2 cameras are listed but rig.json has 1"));
}

#[test]
fn a_frame_that_disagrees_with_its_rig_is_not_written_and_nothing_is_overwritten() {
    let (_keep, out) = written();
    let before = fs::read(out.join("cam0.exr")).unwrap();
    let (rig, mut frame) = sample();
    frame.images[1] = Plane::filled(3, 3, 0.0);
    assert!(write_frame(&out, &rig, &frame).unwrap_err().problem.contains("3x3"));
    let (mut rig, frame) = sample();
    rig.cameras[1].name = "a/b".into();
    assert!(write_frame(&out, &rig, &frame).unwrap_err().problem.contains("cannot name a file"));
    rig.cameras[1].name = "b".into();
    rig.exposure_s = f64::NAN;
    assert!(write_frame(&out, &rig, &frame).unwrap_err().problem.contains("not finite"));
    assert_eq!(fs::read(out.join("cam0.exr")).unwrap(), before);
    assert_eq!(read_frame(&out).unwrap(), sample());
}

#[test]
fn writing_again_drops_files_of_cameras_that_are_gone_and_keeps_strangers() {
    let (_keep, out) = written();
    fs::write(out.join("note.txt"), b"mine").unwrap();
    let (mut rig, mut frame) = sample();
    rig.cameras.truncate(1);
    frame.images.truncate(1);
    frame.masks.truncate(1);
    write_frame(&out, &rig, &frame).unwrap();
    assert!(!out.join("cam1.exr").exists() && out.join("note.txt").exists());
    assert_eq!(read_frame(&out).unwrap(), (rig, frame));
}

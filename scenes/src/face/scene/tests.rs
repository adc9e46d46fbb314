use super::*;
use glam::DVec3;
use strandbench_types::Camera;

const SMALL: &str =
    "stresses = \"nothing\"\n\n[face]\nidentity = 3\nperformance = \"dialogue\"\n\n[rig]\nframe = \"hair\"\n";

#[test]
fn every_face_of_the_catalogue_is_one_and_survives_being_written() {
    for entry in catalog() {
        assert!(FaceScene::is(entry.toml), "{}", entry.name);
        let path = format!("{}.toml", entry.name);
        let scene = FaceScene::parse(entry.toml, Path::new(&path)).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(scene.name, entry.name);
        assert!(scene.frames() > 100, "{}: {} frames", entry.name, scene.frames());
        assert_eq!(FaceScene::parse(&scene.to_toml(), Path::new("x.toml")).unwrap(), scene);
    }
    assert!(!FaceScene::is("stresses = \"\"") && !FaceScene::is("[face"));
}

#[test]
fn a_sensor_that_states_one_value_keeps_the_others_of_faces() {
    let text = format!("{SMALL}\n[sensor]\nbits = 10\n");
    let scene = FaceScene::parse(&text, Path::new("f.toml")).unwrap();
    let whole = FaceScene::parse(SMALL, Path::new("f.toml")).unwrap();
    assert_eq!(scene.sensor, Sensor { bits: 10, ..whole.sensor });
    let typo = format!("{SMALL}\n[sensor]\nbit = 10\n");
    let got = FaceScene::parse(&typo, Path::new("f.toml")).unwrap_err().to_string();
    assert!(got.contains("bit") && got.contains("f.toml"), "{got}");
}

#[test]
fn faults_are_named_with_file_line_key_and_remedy() {
    for (from, to, wants) in [
        ("identity = 3", "identity = 3\nmale = 2.0", "a/b.toml, line 5: face.male: 2 is not between 0 and 1"),
        ("\n\n[rig]", "\n[face.expressions]\njawOpen = 1.5\n[rig]", "line 7: face.expressions.jawOpen"),
        ("\n\n[rig]", "\n[face.expressions]\njawOpn = 0.5\n[rig]", "jawOpn"),
        ("\"dialogue\"", "\"singing\"", "line 5"),
        ("frame = \"hair\"", "frame = \"whole\"", "line 8"),
        ("frame = \"hair\"", "frame = \"hair\"\npair_deg = nan", "line 9: rig.pair_deg: NaN is not"),
        ("frame = \"hair\"", "frame = \"hair\"\nexposure_samples = 0", "rig.exposure_samples: 0 is not"),
        ("frame = \"hair\"", "frame = \"hair\"\nexposure_samples = 4", "rig.exposure_samples: 4 is even"),
        ("frame = \"hair\"", "frame = \"hair\"\nwidth_px = 70000", "rig.width_px: 70000 is not"),
        ("frame = \"hair\"", "frame = \"hair\"\n[lights]\nedges_mm = [0, 300]", "lights.edges_mm: 0 is not"),
        ("frame = \"hair\"", "frame = \"hair\"\n[skin_texture]\npores = 2.0", "skin_texture.pores: 2 is not"),
        ("frame = \"hair\"", "frame = \"hair\"\n[sensor]\nbits = 99", "sensor.bits: 99 is not"),
    ] {
        let text = SMALL.replace(from, to);
        assert_ne!(text, SMALL);
        let got = FaceScene::parse(&text, Path::new("a/b.toml")).unwrap_err().to_string();
        assert!(got.contains(wants), "{got:?} lacks {wants:?}");
    }
}

#[test]
fn fourteen_cameras_stand_where_their_names_say_and_see_the_target() {
    let spec = FaceRigSpec::default();
    let (rig, polarised) = spec.rig();
    rig.validate().unwrap();
    assert_eq!((rig.cameras.len(), polarised.iter().filter(|p| **p).count()), (14, 4));
    let target = spec.target_mm();
    let eye = |name: &str| rig.cameras.iter().find(|c| c.name == name).unwrap().centre_mm() - target;
    for (c, crossed) in rig.cameras.iter().zip(&polarised) {
        let (at, depth) = c.project(target).unwrap();
        assert!((at - c.principal_px).length() < 1e-6 && (depth - 900.0).abs() < 1e-6, "{}", c.name);
        assert_eq!(*crossed, c.name.ends_with("-x"), "{}", c.name);
        let (above, _) = c.project(target + DVec3::Y * 10.0).unwrap();
        assert!(above.y < at.y, "{} is upright", c.name);
        assert!(c.centre_mm().z > target.z + 300.0, "{}: the frontal hemisphere", c.name);
    }
    for group in ["front-up", "front-below", "left", "right"] {
        let [a, x, b] = ["a", "x", "b"].map(|end| eye(&format!("{group}-{end}")));
        assert!((a.angle_between(b).to_degrees() - 13.0).abs() < 1e-9, "{group}");
        assert!((x.angle_between((a + b) / 2.0)).abs() < 1e-6, "{group}: the polarised camera is central");
    }
    assert!(eye("front-up-a").y > 300.0 && eye("front-below-a").y < -300.0);
    assert!(
        eye("front-up-a").x < -90.0 && eye("front-up-b").x > 90.0,
        "side by side, the subject's right first"
    );
    assert!(eye("left-x").x > 600.0 && eye("right-x").x < -600.0);
    assert!(eye("left-b").y > eye("left-a").y + 150.0, "one above the other");
    let hair = eye("hair-left");
    let from = |name: &str| hair.angle_between(eye(name)).to_degrees();
    assert!(from("front-below-x") < 35.0 && from("left-x") < 35.0, "between the triplets");
}

#[test]
fn a_size_keeps_the_field_and_the_settings_are_what_they_say() {
    let width_mm = |spec: &FaceRigSpec| {
        let (rig, _) = spec.rig();
        let c: &Camera = &rig.cameras[0];
        f64::from(c.width) * spec.distance_mm / c.focal_px.x
    };
    let of = |frame, width_px| FaceRigSpec { frame, width_px, ..FaceRigSpec::default() };
    let full = width_mm(&of(Frame::Full, None));
    assert!((full - 199.68).abs() < 1e-6, "{full}");
    for spec in [of(Frame::Scaled, None), of(Frame::Full, Some(300)), of(Frame::Scaled, Some(64))] {
        assert!((width_mm(&spec) - full).abs() < 1e-6);
    }
    let pixels = |frame| {
        let (w, h) = of(frame, None).size_px();
        f64::from(w * h) * 1e-6
    };
    assert!((pixels(Frame::Full) - 12.58).abs() < 0.01 && (pixels(Frame::Scaled) - 3.15).abs() < 0.01);
    assert!(
        (0.1 / of(Frame::Hair, None).pixel_mm() - 3.0).abs() < 0.05,
        "a hair of 0.1 mm is three pixels wide"
    );
}

#[test]
fn sixteen_banks_face_the_target_and_light_it_evenly() {
    let spec = LedSpec::default();
    let target = FaceRigSpec::default().target_mm();
    let lights = spec.lights(target);
    assert_eq!(lights.len(), 16);
    for l in &lights {
        let out = l.half_u_mm.cross(l.half_v_mm).normalize();
        assert!(out.dot((target.as_vec3() - l.centre_mm).normalize()) > 0.9999);
        assert!(l.centre_mm.z > target.z as f32, "the frontal hemisphere");
    }
    // A small card's irradiance from each bank's middle, for cards that face where the face's sides do.
    let card = |facing: glam::Vec3| -> f32 {
        lights
            .iter()
            .map(|l| {
                let to = (l.centre_mm - target.as_vec3()).normalize();
                to.dot(facing).max(0.0) * l.radiance_rgb[0]
            })
            .sum()
    };
    let front = card(glam::Vec3::Z);
    for (x, y) in [(0.7, 0.0), (-0.7, 0.0), (0.0, 0.5), (0.0, -0.5)] {
        let share = card(glam::Vec3::new(x, y, 1.0).normalize()) / front;
        assert!((0.75..1.15).contains(&share), "uniform light: {share} of the front's towards ({x}, {y})");
    }
}

/// The skin's share of a moment.
fn skin(m: &FaceMoment) -> &strandbench_types::TriMesh {
    &m.scene.surfaces[0].mesh
}

#[test]
fn moments_keep_their_topology_and_the_same_seed_gives_the_same_bits() {
    let spec = FaceScene::parse(catalog()[1].toml, Path::new("f.toml")).unwrap();
    let stage = FaceStage::new(&spec, 1, None).unwrap();
    let (first, later) = (stage.moment(0.0).unwrap(), stage.moment(1.2).unwrap());
    assert!(skin(&first).triangles == skin(&later).triangles);
    assert_eq!(first.scene.strands.offsets, later.scene.strands.offsets);
    assert!(skin(&first).vertices != skin(&later).vertices);
    assert_eq!(first.scene.strands.len(), stage.hair.kinds.len());
    assert_eq!(first.follicles.len(), stage.hair.kinds.len());
    assert_eq!(first.scene.surfaces.len(), 4);
    first.scene.strands.validate().unwrap();
    let again = FaceStage::new(&spec, 1, None).unwrap().moment(1.2).unwrap();
    assert!(again.scene.strands == later.scene.strands && skin(&again) == skin(&later));
    assert_eq!(again.scene.calibrated_rig, later.scene.calibrated_rig);
    let other = FaceStage::new(&spec, 2, None).unwrap();
    let moved = other.moment(1.2).unwrap();
    assert!(skin(&moved) == skin(&later), "the person is the scene's");
    assert_ne!(moved.scene.calibrated_rig, later.scene.calibrated_rig);
    assert!(other.hair.strands != stage.hair.strands, "the seed is the hair's");
}

use super::*;
use proptest::prelude::*;

pub(crate) fn rig(n: usize, width: u32, height: u32) -> Rig {
    let camera = |i: usize| {
        let eye = DVec3::new(100.0 * i as f64 / 3.0, 7.0, 900.0);
        Camera::look_at(
            &format!("cam{i}"),
            (width, height),
            1200.1,
            eye,
            DVec3::new(0.1, 0.2, 0.3),
            DVec3::NEG_Y,
        )
    };
    Rig {
        cameras: (0..n).map(camera).collect(),
        near_mm: 700.3,
        far_mm: 1100.7,
        frame_rate_hz: 100.0,
        exposure_s: 0.001,
    }
}

fn parse(text: &str) -> Result<Rig> {
    parse_rig(Path::new("rig.json"), text.as_bytes())
}

#[test]
fn rows_are_spelled_as_people_write_them() {
    let r = rig(2, 64, 48);
    let text = encode_rig(&r);
    let v: serde_json::Value = serde_json::from_str(&text).unwrap();
    let c = &v["cameras"][1];
    let number = |v: &serde_json::Value| v.as_f64().unwrap();
    assert_eq!((number(&c["K"][0][2]), number(&c["K"][1][2])), (32.0, 24.0));
    let world = DVec3::new(10.0, -20.0, 30.0);
    let row = |i: usize| {
        let r = &c["R"][i];
        number(&r[0]) * world.x + number(&r[1]) * world.y + number(&r[2]) * world.z + number(&c["t_mm"][i])
    };
    let by_hand = DVec3::new(row(0), row(1), row(2));
    assert!((by_hand - r.cameras[1].to_camera(world)).length() < 1e-9);
    assert_eq!(parse(&text).unwrap(), r);
}

#[test]
fn each_fault_is_named() {
    let good = encode_rig(&rig(2, 64, 48));
    let e = |from: &str, to: &str| {
        assert!(good.contains(from), "{from}");
        parse(&good.replacen(from, to, 1)).unwrap_err().problem
    };
    assert!(e("\"near_mm\"", "\"nearest\"").contains("unknown field"));
    assert!(e("\"version\": 1", "\"version\": 2").contains("version 2, but this program reads"));
    assert!(e("strandbench-rig", "colmap").contains("\"colmap\""));
    assert!(e("700.3", "1e9").contains("working volume"));
    assert!(e("700.3", "1e999").contains("not a rig"));
    assert!(e("\"width\": 64", "\"width\": 0").contains("outside"));
    assert!(e("\"width\": 64", "\"width\": 4294967296").contains("not a rig"));
    assert!(e("1200.1,\n          0.0", "1200.1,\n          0.5").contains("skew"));
    assert!(e("cam1", "../etc/passwd").contains("cannot name a file"));
    assert!(e("cam1", "cam0").contains("used twice"));
    assert!(e("cam1", "CAM0").contains("overwrite"));
    assert!(e("cam1", "cam0_mask").contains("overwrite"));
    assert!(parse("").is_err() && parse("[]").is_err());
    assert!(parse(&good[..good.len() - 3]).is_err());
}

proptest! {
    #[test]
    fn any_numbers_come_back_bit_for_bit(
        f in prop::array::uniform2(1e-3f64..1e7), p in prop::array::uniform2(-1e9f64..1e9),
        t in prop::array::uniform3(any::<f64>()), hz in any::<f64>(), eye in prop::array::uniform3(1.0f64..1e4)
    ) {
        prop_assume!(hz.is_finite() && t.iter().all(|v| v.is_finite()));
        let mut r = rig(1, 64, 48);
        r.frame_rate_hz = hz;
        let c = &mut r.cameras[0];
        *c = Camera::look_at("a", (64, 48), 1.0, DVec3::from_array(eye), DVec3::ZERO, DVec3::NEG_Y);
        (c.focal_px, c.principal_px) = (DVec2::from_array(f), DVec2::from_array(p));
        c.translation_mm = DVec3::from_array(t);
        let back = parse(&encode_rig(&r)).unwrap();
        prop_assert_eq!(&back, &r);
        prop_assert_eq!(encode_rig(&back), encode_rig(&r));
    }
}

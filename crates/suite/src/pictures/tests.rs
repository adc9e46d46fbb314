use super::*;

#[test]
fn base64_of_the_rfc() {
    for (bytes, text) in [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foobar", "Zm9vYmFy")] {
        assert_eq!(base64(bytes.as_bytes()), text);
    }
    assert_eq!(base64(&[255, 239, 190]), "/+++");
}

#[test]
fn scales_run_the_right_way_and_lines_have_no_direction() {
    let light = |c: [u8; 3]| c.iter().map(|&v| i32::from(v)).sum::<i32>();
    for i in 0..20 {
        let t = i as f32 / 20.0;
        assert!(light(sequential(t)) > light(sequential(t + 0.05)), "darker with depth at {t}");
    }
    let (blue, red) = (diverging(-1.0), diverging(1.0));
    assert!(blue[2] > blue[0] + 60 && red[0] > red[2] + 60, "{blue:?} {red:?}");
    assert!(diverging(0.0).iter().all(|&v| v > 235));
    let near_pi = line_colour(std::f32::consts::PI - 1e-4, 1.0);
    let zero = line_colour(0.0, 1.0);
    assert!(zero.iter().zip(near_pi).all(|(a, b)| a.abs_diff(b) <= 1));
    let quarter = line_colour(std::f32::consts::FRAC_PI_2, 1.0);
    assert!(zero.iter().zip(quarter).any(|(a, b)| a.abs_diff(b) > 60));
}

#[test]
fn exposure_brightens_the_lit_part_and_ignores_the_dark_background() {
    let values = (0..1000).map(|i| if i < 900 { 0.0 } else { 0.05 });
    assert!((exposure(values) - 16.0).abs() < 1e-3);
    assert_eq!(exposure([0.0, f32::NAN].into_iter()), 1.0);
}

#[test]
fn absent_is_not_an_error_of_zero() {
    let e = Plane::from_vec(4, 1, vec![f32::NAN, f32::INFINITY, 0.0, 50.0]);
    let p = signed_error(&e, 10.0);
    assert_eq!((p.data[0], p.data[1], p.data[3]), (PAPER, ABSENT, diverging(1.0)));
    assert_ne!(p.data[2], PAPER);
    let mut map = DepthMap::empty(2, 1);
    map.set(0, 0, Some(900.0));
    let p = depth(&map, &Plane::filled(2, 1, true), (800.0, 1000.0));
    assert_eq!(p.data, [sequential(0.5), ABSENT]);
}

#[test]
fn a_frame_leaves_its_block_and_the_rest_alone() {
    let mut p = Plane::filled(12, 10, [9; 3]);
    frame_block(&mut p, (4, 3), 3);
    let dark = p.data.iter().filter(|c| **c == [0; 3]).count();
    let light = p.data.iter().filter(|c| **c == [255; 3]).count();
    assert_eq!((dark, light), (16, 24), "5 x 5 and 7 x 7 pixels less their insides");
    assert_eq!((p.at(4, 3), p.at(6, 5), p.at(3, 3), p.at(2, 1)), (&[9; 3], &[9; 3], &[0; 3], &[255; 3]));
    frame_block(&mut p, (0, 0), 32);
}

#[test]
fn a_data_uri_is_a_png_that_reads_back() {
    let picture = orientation_wheel(9);
    let uri = data_uri(&picture);
    assert!(uri.starts_with("data:image/png;base64,iVBORw0KGgo"));
}

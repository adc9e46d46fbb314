//! The pattern's contrast, gradients, counts and limits.

use super::noise::{dots, noise};
use super::*;
use strandbench_rng::Rng;

fn skin(texture: SkinTexture) -> SkinDetail {
    SkinDetail::skin(texture, Vec::new(), Vec::new())
}

/// A patch of the forehead, where neither lips nor freckles are many.
fn patch(x: f32, y: f32) -> Vec3 {
    Vec3::new(x - 7.3, 20.0 + y, 111.0 - 0.1 * x - 0.2 * y)
}

#[test]
fn noise_has_unit_variance_and_its_gradient_is_that_of_differences() {
    let mut rng = Rng::keyed(&[1]);
    let n = 40_000;
    let (mut sum, mut squares) = (0.0f64, 0.0f64);
    for k in 0..n {
        let p = Vec3::new(rng.range(-300.0, 300.0), rng.range(-300.0, 300.0), rng.range(-300.0, 300.0));
        let (v, g) = noise(7, p);
        sum += f64::from(v);
        squares += f64::from(v * v);
        if k % 100 == 0 {
            // Central differences over 2h: truncation of the order h² times third derivatives (60 / 0.4), and
            // rounding of a place of 300 to 3e-5, over h.
            let h = 0.01;
            for (axis, want) in [(Vec3::X, g.x), (Vec3::Y, g.y), (Vec3::Z, g.z)] {
                let got = (noise(7, p + axis * h).0 - noise(7, p - axis * h).0) / (2.0 * h);
                assert!((got - want).abs() < 0.06, "{p}: {got} {want}");
            }
        }
    }
    let (mean, square) = (sum / f64::from(n), squares / f64::from(n));
    // The square of a number within ±2.5 has a variance below 2.
    assert!(mean.abs() < 5.0 / f64::from(n).sqrt(), "mean {mean}");
    assert!((square - 1.0).abs() < 5.0 * (2.0 / f64::from(n)).sqrt(), "variance {square}");
}

#[test]
fn as_many_dots_are_cut_as_asked_for_and_their_gradient_is_right() {
    // On a plane a ball of radius r in every cell is cut with probability 2 r: count discs by their area instead,
    // which a ball cut at random shows: π r³ 4/3 a ball, the volume fraction.
    let mut rng = Rng::keyed(&[2]);
    let (share, small, radius) = (0.6f32, 0.5f32, 0.25f32);
    let n = 200_000;
    let mut inside = 0u32;
    for _ in 0..n {
        let p = Vec3::new(rng.range(-90.0, 90.0), rng.range(-90.0, 90.0), rng.range(-90.0, 90.0));
        let d = dots(3, p, share, small, radius);
        inside += u32::from(d.depth > 0.0);
        if d.depth > 0.1 {
            let h = 1e-3;
            let at = |p: Vec3| dots(3, p, share, small, radius).depth;
            let got = (at(p + Vec3::Y * h) - at(p - Vec3::Y * h)) / (2.0 * h);
            // Depth has slopes up to 8 and curvatures near 64 / cell²; places round to 4e-6.
            assert!((got - d.gradient.y).abs() < 0.1, "{p}: {got} {}", d.gradient.y);
        }
    }
    // Mean of r³ over r from r/2 to r: (1 - 1/16) / (4 · 1/2) r³.
    let volume = 4.0 / 3.0 * std::f64::consts::PI * 0.25f64.powi(3) * (15.0 / 32.0);
    let want = f64::from(share) * volume;
    let got = f64::from(inside) / f64::from(n);
    assert!((got - want).abs() < 5.0 * (want / f64::from(n)).sqrt(), "{got}, {want}");
}

/// Standard deviation of the green albedo over its mean in windows of 1.5 mm.
fn contrast(d: &SkinDetail, stubble: f32) -> f64 {
    let mut rng = Rng::keyed(&[4]);
    let mut total = 0.0;
    for _ in 0..60 {
        let (x0, y0) = (rng.range(-20.0, 20.0), rng.range(0.0, 20.0));
        let (mut sum, mut squares) = (0.0f64, 0.0f64);
        for k in 0..400 {
            let (x, y) = (0.075 * (k % 20) as f32, 0.075 * (k / 20) as f32);
            let v = f64::from(d.look(patch(x0 + x, y0 + y), stubble).albedo_rgb[1]);
            sum += v;
            squares += v * v;
        }
        let mean = sum / 400.0;
        total += (squares / 400.0 - mean * mean).max(0.0).sqrt() / mean / 60.0;
    }
    total
}

#[test]
fn contrast_within_a_window_of_stereo_is_that_of_skin() {
    let plain = contrast(&skin(SkinTexture::default()), 0.0);
    println!("contrast in windows of 1.5 mm: {:.2} %", 100.0 * plain);
    assert!((0.03..0.08).contains(&plain), "{plain}");
    let stubbly = contrast(&skin(SkinTexture::default()), 0.8);
    println!("with stubble of 0.8: {:.2} %", 100.0 * stubbly);
    assert!(stubbly > 1.3 * plain, "{stubbly} {plain}");
    let none = SkinTexture {
        mottling: 0.0,
        grain: 0.0,
        pores: 0.0,
        freckles_per_cm2: 0.0,
        moles_per_dm2: 0.0,
        ..SkinTexture::default()
    };
    // What regions change over 1.5 mm alone.
    let smooth = contrast(&skin(none), 0.0);
    assert!(smooth < 2e-3, "{smooth}");
}

#[test]
fn looks_stay_within_their_limits_and_follow_the_seed() {
    let extreme = SkinTexture {
        tone_rgb: [0.95; 3],
        mottling: 0.3,
        grain: 0.2,
        pores: 0.9,
        freckles_per_cm2: 9.0,
        moles_per_dm2: 50.0,
        relief_mm: 0.3,
        pore_mm: 0.3,
        ..SkinTexture::default()
    };
    let mut rng = Rng::keyed(&[5]);
    let other = skin(SkinTexture { seed: 1, ..SkinTexture::default() });
    let usual = skin(SkinTexture::default());
    let extreme = skin(extreme);
    extreme.texture.check().unwrap();
    let mut differ = 0;
    for _ in 0..20_000 {
        let p = Vec3::new(rng.range(-90.0, 90.0), rng.range(-140.0, 90.0), rng.range(-100.0, 130.0));
        for d in [&extreme, &usual] {
            let l = d.look(p, rng.f32());
            assert!(l.albedo_rgb.iter().all(|a| (0.0..=0.95).contains(a)), "{p}: {l:?}");
            assert!((0.0..=1.0).contains(&l.coat) && (0.0..=1.0).contains(&l.roughness), "{p}: {l:?}");
            assert!(l.slope.is_finite(), "{p}: {l:?}");
        }
        assert_eq!(usual.look(p, 0.3), usual.look(p, 0.3));
        differ += u32::from(usual.look(p, 0.0) != other.look(p, 0.0));
    }
    assert!(differ > 19_990, "{differ}");
}

#[test]
fn what_is_out_of_range_is_named() {
    let bad = |t: SkinTexture, key: &str| {
        let e = t.check().unwrap_err().to_string();
        assert!(e.contains(key), "{e}");
    };
    bad(SkinTexture { grain: f32::NAN, ..SkinTexture::default() }, "grain");
    bad(SkinTexture { pore_mm: 0.0, ..SkinTexture::default() }, "pore_mm");
    bad(SkinTexture { tone_rgb: [0.5, -0.1, 0.5], ..SkinTexture::default() }, "tone_rgb");
    bad(SkinTexture { moles_per_dm2: 1e9, ..SkinTexture::default() }, "moles_per_dm2");
    let d = SkinDetail::skin(SkinTexture::default(), vec![Vec3::ZERO; 3], vec![0.0; 3]);
    d.check(3).unwrap();
    assert!(d.check(4).unwrap_err().to_string().contains("rest"));
    let nan = SkinDetail { rest: vec![Vec3::ZERO, Vec3::new(0.0, f32::NAN, 0.0), Vec3::ZERO], ..d.clone() };
    assert!(nan.check(3).unwrap_err().to_string().contains("rest"));
    let hairy = SkinDetail { stubble: vec![0.0, 2.0, 0.0], ..d };
    assert!(hairy.check(3).unwrap_err().to_string().contains("stubble"));
}

#[test]
fn eyes_have_a_dark_pupil_in_the_middle_and_a_pale_sclera() {
    let ball = |x: f32| {
        let about = move |v: Vec3| Vec3::new(x, -15.0, 85.0) + v * 16.0;
        [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z].map(about)
    };
    let d = SkinDetail::eyes(SkinTexture::default(), [ball(32.0), ball(-32.0)].concat());
    let Tissue::Eyes([left, right]) = d.tissue else { panic!("eyes") };
    assert!((left - Vec3::new(32.0, -15.0, 85.0)).length() < 1e-4);
    let mean = |p: Vec3| d.look(p, 0.0).albedo_rgb.iter().sum::<f32>() / 3.0;
    for middle in [left, right] {
        let (pupil, iris, white) = (
            mean(middle + Vec3::new(1.0, 0.5, 16.0)),
            mean(middle + Vec3::new(5.0, 2.5, 14.8)),
            mean(middle + Vec3::new(12.0, 0.0, 10.0)),
        );
        assert!(pupil < 0.01 && iris > 4.0 * pupil && white > 2.0 * iris, "{pupil} {iris} {white}");
    }
}

#[test]
fn height_and_slope_belong_together() {
    // Along a closed loop a gradient's integral vanishes; one that is turned wrongly, or scaled on one axis, has curl.
    let d = skin(SkinTexture::default());
    let (n, side) = (400, 0.35f32);
    let mut rng = Rng::keyed(&[6]);
    let (mut loops, mut legs) = (0.0f64, 0.0f64);
    for _ in 0..40 {
        let p = patch(rng.range(-20.0, 20.0), rng.range(0.0, 20.0));
        let corners = [p, p + Vec3::X * side, p + Vec3::new(side, side, 0.0), p + Vec3::Y * side];
        let leg = |a: Vec3, b: Vec3| -> f64 {
            let at = |k: i32| a.lerp(b, (k as f32 + 0.5) / n as f32);
            (0..n).map(|k| f64::from(d.look(at(k), 0.0).slope.dot(b - a))).sum::<f64>() / f64::from(n)
        };
        let of: Vec<f64> = (0..4).map(|k| leg(corners[k], corners[(k + 1) % 4])).collect();
        loops += of.iter().sum::<f64>().abs();
        legs += of.iter().map(|l| l.abs()).sum::<f64>();
    }
    // Midpoints of 0.9 µm steps; slopes have no jumps: the rule's error is of second
    // order, (step / 0.1 mm)² of a leg, and rounding of places to 8e-6 mm adds 1e-3 of a step.
    assert!(loops < 2e-3 * legs, "{loops} {legs}");
}

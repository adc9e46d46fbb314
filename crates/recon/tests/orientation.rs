//! Eq. 1 on drawn lines.

use std::f32::consts::PI;
use strandbench_recon::kernel::FilterBank;
use strandbench_recon::orientation::{field, respond, unit_response};
use strandbench_recon::pyramid::pyramid;
use strandbench_types::{OrientationField, Plane};

/// A Gaussian ridge (or valley) through the middle of a square image; direction from +x towards +y (down).
fn line(angle: f32, sigma_px: f32, height: f32) -> Plane<f32> {
    let n = 41;
    let (sin, cos) = angle.sin_cos();
    let value = |i: usize| {
        // 4x4 samples a pixel: an ideal sensor.
        let mut sum = 0.0;
        for s in 0..16 {
            let x = (i % n) as f32 + (s % 4) as f32 * 0.25 + 0.125 - 20.4;
            let y = (i / n) as f32 + (s / 4) as f32 * 0.25 + 0.125 - 20.7;
            let across = y * cos - x * sin;
            sum += (-across * across / (2.0 * sigma_px * sigma_px)).exp() / 16.0;
        }
        0.5 + height * sum
    };
    Plane::from_vec(n, n, (0..n * n).map(value).collect())
}

fn field_of(image: &Plane<f32>, mask: &Plane<bool>, angles: usize) -> OrientationField {
    let bank = FilterBank::new(angles, 1.0, 2.0);
    let response = respond(&pyramid(image, mask, 1)[0], &bank);
    let unit = unit_response(&response, 0.95).unwrap_or(1.0);
    field(&response, unit, 0.5)
}

/// Largest axial error in degrees over line angles and positions near the line.
fn worst_error_deg(sigma_px: f32, angles: usize) -> f32 {
    let mask = Plane::filled(41, 41, true);
    let mut worst = 0.0f32;
    for k in 0..45 {
        let angle = k as f32 * PI / 45.0 + 0.003;
        let f = field_of(&line(angle, sigma_px, 0.4), &mask, angles);
        // Pixels within about a pixel of the line, in the middle of the image.
        for t in -6..=6 {
            let (x, y) = (20.4 + t as f32 * angle.cos(), 20.7 + t as f32 * angle.sin());
            let (got, strength) = f.line(y as usize * 41 + x as usize).expect("a bright line answers");
            assert!(strength > 0.5, "{strength} at angle {angle}");
            let d = (got - angle).rem_euclid(PI);
            worst = worst.max(d.min(PI - d).to_degrees());
        }
    }
    worst
}

#[test]
fn drawn_lines_of_all_angles_and_widths_are_read_within_a_degree() {
    for sigma_px in [0.4, 0.8, 1.5] {
        let e = worst_error_deg(sigma_px, 32);
        assert!(e < 1.0, "{e} degrees at line width {sigma_px}");
    }
    // What the number of filters is chosen by: 8, 16, 32 and 64 of them err by 1.90, 1.08, 0.95 and 0.96 degrees.
    assert!(worst_error_deg(0.4, 8) > 1.5 * worst_error_deg(0.4, 32));
}

#[test]
fn down_right_is_a_quarter_turn_of_the_image_axes() {
    let mask = Plane::filled(41, 41, true);
    for (angle, want) in
        [(0.0, 0.0), (PI / 4.0, PI / 4.0), (PI / 2.0, PI / 2.0), (3.0 * PI / 4.0, 3.0 * PI / 4.0)]
    {
        let (got, _) = field_of(&line(angle, 0.8, 0.4), &mask, 32).line(20 * 41 + 20).unwrap();
        let d = (got - want).rem_euclid(PI);
        assert!(d.min(PI - d) < 0.02, "{got} for {want}");
    }
    // Drawn pixel by pixel: (k, k) runs right and down.
    let mut image = Plane::filled(41, 41, 0.0f32);
    for k in 0..41 {
        *image.at_mut(k, k) = 1.0;
    }
    let (got, _) = field_of(&image, &mask, 32).line(20 * 41 + 20).unwrap();
    assert!((got - PI / 4.0).abs() < 1e-3, "{got}");
}

#[test]
fn dark_lines_and_flat_images_give_zero() {
    let mask = Plane::filled(41, 41, true);
    let dark = field_of(&line(1.0, 0.8, -0.4), &mask, 32);
    for t in -8..=8 {
        let (x, y) = (20.4 + t as f32 * 1f32.cos(), 20.7 + t as f32 * 1f32.sin());
        assert_eq!(dark.line(y as usize * 41 + x as usize), None, "a dark line answered at step {t}");
    }
    let bank = FilterBank::new(32, 1.0, 2.0);
    let flat = respond(&pyramid(&Plane::filled(41, 41, 0.7), &mask, 1)[0], &bank);
    let largest = flat.value.data.iter().fold(0.0f32, |m, v| m.max(v.abs()));
    assert!(largest < 1e-6, "a flat image of 0.7 answers {largest}");
}

#[test]
fn silhouettes_are_no_edges_and_background_has_no_field() {
    let mask = Plane::from_vec(
        64,
        48,
        (0..64 * 48usize).map(|i| (i % 64).abs_diff(30) + (i / 64).abs_diff(20) < 15).collect(),
    );
    let image = mask.map(|&m| if m { 0.6 } else { 0.0 });
    let bank = FilterBank::new(32, 1.0, 2.0);
    for level in pyramid(&image, &mask, 3) {
        let r = respond(&level, &bank);
        let largest = r.value.data.iter().fold(0.0f32, |m, v| m.max(v.abs()));
        assert!(largest < 1e-5, "flat hair before black answers {largest}");
    }
    let streaks =
        Plane::from_vec(64, 48, (0..64 * 48).map(|i| ((i % 64) as f32 * 0.9).sin() + 1.0).collect());
    let f = field_of(&streaks, &mask, 32);
    let outside = (0..64 * 48).filter(|&i| !mask.data[i]).all(|i| f.line(i).is_none());
    let inside = (0..64 * 48).filter(|&i| mask.data[i] && f.line(i).is_some()).count();
    assert!(outside && inside > 100, "{inside} answers inside");
}

#[test]
fn gamma_and_unit_scale_the_strength_alone() {
    let image = line(0.7, 0.8, 0.4);
    let response =
        respond(&pyramid(&image, &Plane::filled(41, 41, true), 1)[0], &FilterBank::new(32, 1.0, 2.0));
    let i = 20 * 41 + 20;
    for gamma in [0.5f32, 1.0, 0.8] {
        for unit in [0.01f32, 0.3] {
            let (angle, strength) = field(&response, unit, gamma).line(i).unwrap();
            assert!((angle - response.angle.data[i]).abs() < 1e-5);
            let want = (response.value.data[i] / unit).powf(gamma);
            assert!((strength / want - 1.0).abs() < 1e-5, "{strength} for {want}");
        }
    }
}

#[test]
fn the_answer_to_a_point_is_the_filter() {
    let (n, s, t) = (33usize, 1.2f64, 2.3f64);
    let bank = FilterBank::new(12, s as f32, t as f32);
    let r = bank.radius() as isize;
    assert_eq!(r, 7, "three of the wider sigma, rounded up");
    let gauss = |v: f64, s: f64| (-v * v / (2.0 * s * s)).exp() / (s * (2.0 * std::f64::consts::PI).sqrt());
    let mut image = vec![0.0f32; n * n];
    image[16 * n + 16] = 1.0;
    let mut scratch = bank.scratch();
    for a in 0..12 {
        let (sin, cos) = (std::f64::consts::PI * a as f64 / 12.0).sin_cos();
        let kernel = |x: isize, y: isize| {
            let (x, y) = (x as f64, y as f64);
            let (across, along) = (y * cos - x * sin, x * cos + y * sin);
            (gauss(across, s) - gauss(across, t)) * gauss(along, t)
        };
        let blob = |x: isize, y: isize| gauss(x as f64, t) * gauss(y as f64, t);
        let all: Vec<(isize, isize)> = (-r..=r).flat_map(|y| (-r..=r).map(move |x| (x, y))).collect();
        let sum = |f: &dyn Fn(isize, isize) -> f64| all.iter().map(|&(x, y)| f(x, y)).sum::<f64>();
        let excess = sum(&kernel) / sum(&blob);
        for &(x, y) in &all {
            bank.responses(&image, n, (16 - x) as usize, (16 - y) as usize, &mut scratch);
            let (got, want) = (f64::from(scratch.responses[a]), kernel(x, y) - excess * blob(x, y));
            assert!((got - want).abs() < 1e-6, "angle {a}, tap ({x}, {y}): {got} for {want}");
        }
        assert!((excess * blob(0, 0)).abs() < 0.01 * kernel(0, 0), "what is taken away is small: {excess}");
    }
}

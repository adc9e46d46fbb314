use super::*;
use std::f64::consts::PI;
use strandbench_rng::Rng;
use strandbench_scenes::Environment;
use strandbench_types::Plane;

/// A map with a bright spot, a black stripe and rows of different radiance, turned.
fn map(width: usize, height: usize) -> Environment {
    let texel = |i: usize| {
        let (x, y) = (i % width, i / width);
        let level = if x == 1 { 0.0 } else { 0.2 + (y as f32 * 0.7).sin().abs() };
        let spot = if (x, y) == (width / 2, height / 3) { 40.0 } else { 0.0 };
        [level + spot, 0.5 * level, 2.0 * level]
    };
    Environment {
        radiance_rgb: Plane::from_vec(width, height, (0..width * height).map(texel).collect()),
        azimuth_deg: 25.0,
    }
}

fn sphere(rng: &mut Rng) -> Vec3 {
    let (y, phi) = (rng.range(-1.0, 1.0), rng.range(0.0, TAU));
    let flat = (1.0 - y * y).sqrt();
    Vec3::new(flat * phi.cos(), y, flat * phi.sin())
}

#[test]
fn the_density_integrates_to_one_and_a_constant_is_uniform() {
    let sky = Sky::new(&map(16, 8)).unwrap().unwrap();
    // Texels have constant density: one direction inside each, times its solid angle.
    let mut total = 0.0;
    for (row, share) in (0..8).map(|r| (r, solid_share(r, 8))) {
        for column in 0..16 {
            total += f64::from(sky.pdf(row * 16 + column)) * 4.0 * PI * share / 16.0;
        }
    }
    assert!((total - 1.0).abs() < 1e-6, "{total}");
    // The same through directions, as a renderer asks: the mean of the density over the sphere is 1/4π.
    let mut rng = Rng::keyed(&[1]);
    let n = 200_000;
    let (mut sum, mut squares) = (0.0f64, 0.0f64);
    for _ in 0..n {
        let p = f64::from(sky.radiance_pdf(sphere(&mut rng)).1) * 4.0 * PI;
        sum += p;
        squares += p * p;
    }
    let (mean, n) = (sum / f64::from(n), f64::from(n));
    assert!((mean - 1.0).abs() < 4.0 * ((squares / n - mean * mean) / n).sqrt(), "{mean}");

    let constant = Sky::new(&Environment::constant([2.0, 1.0, 0.0])).unwrap().unwrap();
    let s = constant.sample([0.3, 0.9]);
    assert!(
        (f64::from(s.pdf) * 4.0 * PI - 1.0).abs() < 1e-6
            && (s.weight_rgb[0] / s.weight_rgb[1] - 2.0).abs() < 1e-6
    );
    assert_eq!(constant.radiance_pdf(Vec3::X).0, [2.0, 1.0, 0.0]);
}

#[test]
fn samples_follow_their_density_and_look_up_what_they_carry() {
    let (width, height) = (16usize, 8usize);
    let sky = Sky::new(&map(width, height)).unwrap().unwrap();
    let mut rng = Rng::keyed(&[2]);
    let draws = 400_000u32;
    // Cells of half a texel each way, found from the direction alone.
    let (rows, columns) = (2 * height, 2 * width);
    let mut counts = vec![0.0f64; rows * columns];
    let mut missed = 0;
    for _ in 0..draws {
        let s = sky.sample([rng.f32(), rng.f32()]);
        let (radiance, pdf) = sky.radiance_pdf(s.direction);
        let same = (0..3).all(|c| (radiance[c] - s.weight_rgb[c] * s.pdf).abs() <= 1e-5 * radiance[c]);
        missed += u32::from(!same || pdf != s.pdf);
        let v = f64::from(s.direction.y).clamp(-1.0, 1.0).acos() / PI;
        let u = (f64::from(s.direction.x).atan2(-f64::from(s.direction.z)).to_degrees() + 25.0) / 360.0;
        let (i, j) = ((v * rows as f64) as usize, (u.rem_euclid(1.0) * columns as f64) as usize);
        counts[i.min(rows - 1) * columns + j.min(columns - 1)] += 1.0;
    }
    // Only a direction within rounding of a texel's edge may look up its neighbour.
    assert!(missed < draws / 10_000, "{missed} samples look up something else than they carry");
    let (mut chi, mut free) = (0.0, -1.0);
    for (k, n) in counts.iter().enumerate() {
        let (i, j) = (k / columns, k % columns);
        let share = 0.5 * ((PI * i as f64 / rows as f64).cos() - (PI * (i + 1) as f64 / rows as f64).cos());
        let pdf = f64::from(sky.pdf((i / 2) * width + j / 2));
        let expected = pdf * 4.0 * PI * share / columns as f64 * f64::from(draws);
        if expected == 0.0 {
            assert_eq!(*n, 0.0, "black texels are never drawn");
            continue;
        }
        assert!(expected > 20.0);
        chi += (n - expected).powi(2) / expected;
        free += 1.0;
    }
    assert!(chi < free + 5.0 * (2.0f64 * free).sqrt(), "χ² {chi:.0} with {free} degrees of freedom");
}

#[test]
fn directions_are_where_the_map_says() {
    // Four columns from -z over +x and +z to -x, two rows: above and below.
    let texels: Vec<[f32; 3]> = (0..8).map(|i| [1.0 + i as f32; 3]).collect();
    let map = |azimuth_deg| Environment { radiance_rgb: Plane::from_vec(4, 2, texels.clone()), azimuth_deg };
    let sky = Sky::new(&map(0.0)).unwrap().unwrap();
    let at = |sky: &Sky, x: f32, y: f32, z: f32| sky.radiance_pdf(Vec3::new(x, y, z).normalize()).0[0];
    assert_eq!(at(&sky, 1.0, 0.5, -1.0), 1.0);
    assert_eq!(at(&sky, 1.0, 0.5, 1.0), 2.0);
    assert_eq!(at(&sky, -1.0, 0.5, 1.0), 3.0);
    assert_eq!(at(&sky, -1.0, 0.5, -1.0), 4.0);
    assert_eq!(at(&sky, 1.0, -0.5, 1.0), 6.0);
    // Turned by 90 degrees, what was around +z (between columns 1 and 2) is around +x.
    let turned = Sky::new(&map(90.0)).unwrap().unwrap();
    let mut seen = [at(&turned, 1.0, 0.5, 0.1), at(&turned, 1.0, 0.5, -0.1)];
    seen.sort_by(f32::total_cmp);
    assert_eq!(seen, [2.0, 3.0]);
}

#[test]
fn black_skies_are_none_and_bad_ones_are_named() {
    assert!(Sky::new(&Environment::constant([0.0; 3])).unwrap().is_none());
    for bad in [f32::NAN, -1.0, f32::INFINITY] {
        let e = Sky::new(&Environment::constant([1.0, bad, 1.0])).unwrap_err();
        assert!(e.contains("texel (0, 0)"), "{e}");
    }
    let empty = Environment { radiance_rgb: Plane::from_vec(0, 0, Vec::new()), azimuth_deg: 0.0 };
    assert!(Sky::new(&empty).unwrap_err().contains("0x0"));
}

use super::*;
use std::f64::consts::PI as PI64;
use strandbench_rng::Rng;

fn skin(coat_reflectance: f32, coat_roughness: f32) -> Skin {
    Skin::new(&SkinOptics { coat_reflectance, coat_roughness, scatter_mm: 0.0 }).unwrap()
}

fn tilted(deg: f32) -> Vec3 {
    Vec3::new(deg.to_radians().sin(), 0.0, deg.to_radians().cos())
}

#[test]
fn white_skin_gives_back_less_than_it_gets_and_is_symmetric() {
    let n = Vec3::Z;
    let skin = skin(0.028, 0.35);
    for deg in [0.0f32, 30.0, 60.0, 80.0] {
        let wo = tilted(deg);
        let (steps_c, steps_p) = (400, 400);
        let mut energy = 0.0f64;
        for i in 0..steps_c {
            let c = (i as f32 + 0.5) / steps_c as f32;
            let s = (1.0 - c * c).sqrt();
            for j in 0..steps_p {
                let phi = 2.0 * PI * (j as f32 + 0.5) / steps_p as f32;
                let wi = Vec3::new(s * phi.cos(), s * phi.sin(), c);
                let f = skin.scatter(n, wi, wo, [1.0; 3])[0];
                let back = skin.scatter(n, wo, wi, [1.0; 3])[0];
                assert!((f - back).abs() <= 1e-5 * f.max(1e-3), "{f} {back}");
                energy += f64::from(f * c) * 2.0 * PI64 / f64::from(steps_c * steps_p);
            }
        }
        assert!(energy < 1.0 && energy > 0.6, "{deg}°: {energy}");
        // What sampling finds, in the mean, is the same energy.
        let toward = skin.toward(n, n, wo, [1.0; 3]);
        let mut rng = Rng::keyed(&[9, deg as u64]);
        let draws = 400_000;
        let (mut sum, mut squares) = (0.0f64, 0.0f64);
        for _ in 0..draws {
            let drawn = toward.sample([rng.f32(), rng.f32(), rng.f32()]);
            let w = drawn.map_or(0.0, |d| f64::from(d.1[0]));
            sum += w;
            squares += w * w;
        }
        let mean = sum / f64::from(draws);
        let error = ((squares / f64::from(draws) - mean * mean) / f64::from(draws)).sqrt();
        // The quadrature itself is good to a few 1e-5.
        assert!((mean - energy).abs() < 4.0 * error + 1e-4, "{deg}°: {mean} ± {error}, {energy}");
    }
    assert_eq!(skin.scatter(n, -n, n, [1.0; 3]), [0.0; 3]);
}

#[test]
fn without_a_coat_skin_is_lamberts_law() {
    let matte = skin(0.0, 0.35);
    let (n, wo) = (Vec3::Z, tilted(70.0));
    let toward = matte.toward(n, n, wo, [0.8, 0.4, 0.2]);
    let mut rng = Rng::keyed(&[3]);
    for _ in 0..1000 {
        let (d, w, pdf) = toward.sample([rng.f32(), rng.f32(), rng.f32()]).unwrap();
        assert!((w[0] - 0.8).abs() < 1e-5 && (w[1] - 0.4).abs() < 1e-5, "{w:?}");
        assert!((pdf - d.z / PI).abs() < 1e-5 && (toward.eval(d)[2] - 0.2 * d.z / PI).abs() < 1e-6);
    }
}

/// Samples counted in cells of equal solid angle against the density integrated over each.
fn chi2(toward: &SkinToward, key: u64) -> (f64, usize) {
    let (rows, columns, draws) = (24usize, 48usize, 400_000u32);
    let mut counts = vec![0.0f64; rows * columns + 1];
    let mut rng = Rng::keyed(&[key, 0x5C1]);
    for _ in 0..draws {
        match toward.sample([rng.f32(), rng.f32(), rng.f32()]) {
            None => counts[rows * columns] += 1.0,
            Some((d, _, pdf)) => {
                assert!((pdf / toward.pdf(d) - 1.0).abs() < 1e-4);
                let row = ((d.z * rows as f32) as usize).min(rows - 1);
                let phi = d.y.atan2(d.x) / TAU + 0.5;
                counts[row * columns + ((phi * columns as f32) as usize).min(columns - 1)] += 1.0;
            }
        }
    }
    let fine = 12;
    let mut expected = vec![0.0f64; rows * columns + 1];
    for (k, e) in expected.iter_mut().enumerate().take(rows * columns) {
        for a in 0..fine * fine {
            let sub = |n: usize| (n as f32 + 0.5) / fine as f32;
            let z = ((k / columns) as f32 + sub(a % fine)) / rows as f32;
            let phi = TAU * (((k % columns) as f32 + sub(a / fine)) / columns as f32 - 0.5);
            let flat = (1.0 - z * z).sqrt();
            let d = Vec3::new(flat * phi.cos(), flat * phi.sin(), z);
            *e += f64::from(toward.pdf(d)) * 2.0 * PI64 / (rows * columns * fine * fine) as f64;
        }
        *e *= f64::from(draws);
    }
    // What falls below the horizon is a sample of nothing.
    expected[rows * columns] = f64::from(draws) - expected.iter().sum::<f64>();
    // Cells of few expected samples are pooled.
    let (mut sum, mut cells, mut pool) = (0.0, 0, (0.0, 0.0));
    for (n, e) in counts.iter().zip(&expected) {
        pool = (pool.0 + n, pool.1 + e);
        if pool.1 >= 20.0 {
            sum += (pool.0 - pool.1).powi(2) / pool.1;
            cells += 1;
            pool = (0.0, 0.0);
        }
    }
    (sum, cells - 1)
}

#[test]
fn samples_follow_their_density() {
    for (k, (f0, roughness, albedo, deg)) in
        [(0.028, 0.35, 0.3, 20.0), (0.028, 0.35, 0.0, 65.0), (0.2, 0.6, 0.1, 75.0), (0.0, 0.3, 0.5, 40.0)]
            .into_iter()
            .enumerate()
    {
        let toward = skin(f0, roughness).toward(Vec3::Z, Vec3::Z, tilted(deg), [albedo; 3]);
        let (chi, free) = chi2(&toward, k as u64);
        let free = free as f64;
        // Five deviations of the distribution, which is normal for this many cells.
        assert!(chi < free + 5.0 * (2.0 * free).sqrt(), "case {k}: χ² {chi:.0} with {free} cells");
    }
}

#[test]
fn impossible_optics_are_refused() {
    for (f0, roughness, part) in
        [(f32::NAN, 0.3, "reflectance"), (0.9, 0.3, "reflectance"), (0.03, 0.0, "rough")]
    {
        let e = Skin::new(&SkinOptics { coat_reflectance: f0, coat_roughness: roughness, scatter_mm: 0.0 })
            .unwrap_err();
        assert!(e.contains(part), "{e}");
    }
}

//! The samplers against their densities.

use super::*;
use std::sync::LazyLock;

const BINS: (usize, usize) = (72, 72);
const SUB: u32 = 5;

/// z-score of the chi² of `n` samples against the density (Wilson and Hilferty's cube root).
fn chi_squared(
    s: &Setup,
    n: u32,
    key: u64,
    pdf: impl Fn(Vec3) -> f32,
    sample: impl Fn([f32; 4]) -> Option<Scattered>,
) -> f64 {
    let (dt, dp) = (180.0 / BINS.0 as f64, 360.0 / BINS.1 as f64);
    let mut counts = vec![0u32; BINS.0 * BINS.1 + 1];
    let mut rng = Rng::keyed(&[5, key]);
    for _ in 0..n {
        let bin = match sample(std::array::from_fn(|_| rng.f32())) {
            Some(x) => {
                let (theta, phi) = angles(s, x.to_light);
                let i = (((theta + 90.0) / dt) as usize).min(BINS.0 - 1);
                i * BINS.1 + (((phi + 180.0) / dp) as usize).min(BINS.1 - 1)
            }
            None => BINS.0 * BINS.1,
        };
        counts[bin] += 1;
    }
    let mut expected = vec![0.0f64; counts.len()];
    let (ht, hp) = (dt / f64::from(SUB), dp / f64::from(SUB));
    for i in 0..BINS.0 {
        for k in 0..SUB {
            let theta = -90.0 + dt * i as f64 + ht * (f64::from(k) + 0.5);
            let w = theta.to_radians().cos() * ht.to_radians() * hp.to_radians() * f64::from(n);
            for j in 0..BINS.1 {
                let sum: f64 = (0..SUB)
                    .map(|l| {
                        let phi = -180.0 + dp * j as f64 + hp * (f64::from(l) + 0.5);
                        f64::from(pdf(s.direction(theta, phi)))
                    })
                    .sum();
                expected[i * BINS.1 + j] += w * sum;
            }
        }
    }
    // What the density lacks of one is drawn as nothing.
    let inside: f64 = expected.iter().sum();
    *expected.last_mut().unwrap() = (f64::from(n) - inside).max(0.0);
    let mut order: Vec<usize> = (0..counts.len()).collect();
    order.sort_by(|&a, &b| expected[a].total_cmp(&expected[b]));
    let (mut chi2, mut dof, mut e, mut c) = (0.0, -1.0, 0.0, 0.0);
    for b in order {
        e += expected[b];
        c += f64::from(counts[b]);
        // Pooled to a count whose square is near normal.
        if e >= 25.0 {
            chi2 += (c - e) * (c - e) / e;
            dof += 1.0;
            (e, c) = (0.0, 0.0);
        }
    }
    assert!(dof > 5.0, "the lobe fills {dof} bins");
    let a = 2.0 / (9.0 * dof);
    ((chi2 / dof).cbrt() - (1.0 - a)) / a.sqrt()
}

fn lobe<'a>(model: &'a FibreModel, s: &Setup, p: usize) -> Option<Toward<'a>> {
    match s.toward(model) {
        Toward::Marschner(t) => t.drawing_from(p).map(Toward::Marschner),
        Toward::Chiang(t) => t.drawing_from(p).map(Toward::Chiang),
    }
}

/// Fibres of all kinds, tabulated once.
fn cases() -> &'static [(&'static str, FibreModel)] {
    static CASES: LazyLock<Vec<(&'static str, FibreModel)>> = LazyLock::new(|| {
        optics().into_iter().map(|(name, o)| (name, FibreModel::new(&o).unwrap())).collect()
    });
    &CASES
}

fn optics() -> Vec<(&'static str, FibreOptics)> {
    let oval = FibreOptics { eccentricity: 0.85, ..marschner() };
    vec![
        ("marschner", FibreOptics { rest: true, ..marschner() }),
        ("cubic", FibreOptics { roots: OpticsRoots::Cubic, ..marschner() }),
        ("oval", oval),
        ("wide", FibreOptics { width_r_deg: 30.0, shift_r_deg: 5.0, rest: true, ..marschner() }),
        ("chiang", chiang(0.3, 0.3, -2.0)),
        ("rough", chiang(0.9, 0.8, 10.0)),
        ("smooth", chiang(0.15, 0.2, -5.0)),
    ]
}

#[test]
fn every_lobe_is_drawn_as_its_density_says() {
    for (k, (name, model)) in cases().iter().enumerate() {
        // 80° cuts the lobes at the poles.
        for (theta_deg, h) in [(15.0, 0.4), (-80.0, -0.95)] {
            let s = Setup::new(theta_deg, h, [0.2, 0.5, 1.0]);
            for p in 0..4 {
                let Some(t) = lobe(model, &s, p) else {
                    assert!(p == 3 && matches!(*name, "cubic" | "oval"), "{name}: lobe {p} is empty");
                    continue;
                };
                let z = chi_squared(&s, 150_000, (k * 8 + p) as u64, |d| t.pdf(d), |u| t.sample(u));
                println!("{name} θ_r {theta_deg} lobe {p}: z {z:.2}");
                // One false alarm in 3 million per test.
                assert!(z < 5.0, "{name}, θ_r {theta_deg}°, lobe {p}: χ² is {z} standard deviations high");
            }
        }
    }
}

#[test]
fn mixtures_are_drawn_as_their_density_says() {
    for (k, (name, model)) in cases().iter().enumerate() {
        for (theta_deg, h, sigma) in [(0.0, 0.0, 0.0), (-40.0, 0.8, 0.3), (75.0, -0.99, 3.0)] {
            let s = Setup::new(theta_deg, h, [sigma, 2.0 * sigma, 3.0 * sigma]);
            let t = s.toward(model);
            let z = chi_squared(&s, 300_000, 100 + k as u64, |d| t.pdf(d), |u| t.sample(u));
            println!("{name} θ_r {theta_deg}: z {z:.2}");
            assert!(z < 5.0, "{name}, θ_r {theta_deg}°: χ² is {z} standard deviations high");
        }
    }
}

#[test]
fn density_integrates_to_one() {
    for (name, model) in cases() {
        for (theta_deg, h) in [(0.0, 0.0), (-50.0, 1.0), (85.0, -0.7), (89.5, 0.2)] {
            let s = Setup::new(theta_deg, h, [0.3; 3]);
            let t = s.toward(model);
            let got = integrate_open(&s, (480, 240), |d| f64::from(t.pdf(d)));
            println!("{name} θ_r {theta_deg}: {:.2e}", got - 1.0);
            // Midpoints of 0.4° and 1.5° on tables of 0.7° and 0.94° with kinks at each node: 5e-4.
            assert!((got - 1.0).abs() < 1e-3, "{name}, θ_r {theta_deg}°: {got}");
        }
    }
}

#[test]
fn a_sample_carries_the_value_and_density_of_its_direction() {
    for (k, (name, model)) in cases().iter().enumerate() {
        let mut rng = Rng::keyed(&[6, k as u64]);
        for i in 0..20_000 {
            let s = Setup::new([10.0, -60.0, 85.0][i % 3], rng.range(-1.0, 1.0), [0.1, 0.4, 2.0]);
            let t = s.toward(model);
            let Some(x) = t.sample(std::array::from_fn(|_| rng.f32())) else { continue };
            assert!((x.to_light.length() - 1.0).abs() < 1e-5);
            let (value, pdf) = t.eval_pdf(x.to_light);
            assert_eq!((value, pdf), (t.eval(x.to_light), t.pdf(x.to_light)));
            // The angles are found again to 7e-7 (the arcsine's error) and 1e-7 / cos θ_i (the direction's). The
            // steepest slopes per radian are 80 (TT at 5 standard deviations) and 120 (a cell of a table in
            // which N falls to a third). The density has 1 / cos θ_i.
            let cos = angles(&s, x.to_light).0.to_radians().cos() as f32;
            let slack = 200.0 * (7e-7 + 2e-7 / cos) + 1e-7 / (cos * cos);
            assert!((pdf - x.pdf).abs() <= slack * pdf.max(x.pdf), "{name}: {pdf}, {x:?}, cos {cos}");
            for c in 0..3 {
                let got = x.weight_rgb[c] * x.pdf;
                assert!((got - value[c]).abs() <= slack * value[c].max(1e-6), "{name}: {value:?}, {x:?}");
            }
        }
    }
}

/// Draws at random cameras, offsets and colours; the greatest weight, and the greatest share of its bound.
fn hammer(model: &FibreModel, n: u32, key: u64) -> (f32, f32) {
    let mut rng = Rng::keyed(&[7, key]);
    let mut greatest = (0.0f32, 0.0f32);
    for i in 0..n {
        let mut number = |extremes: &[f32], low: f32, high: f32| {
            let k = rng.below(4 * extremes.len() as u64) as usize;
            if k < extremes.len() { extremes[k] } else { rng.range(low, high) }
        };
        let sin = number(&[-1.0, 1.0, 0.0, 0.999_999_9, -0.999], -1.0, 1.0);
        let h = number(&[-1.0, 1.0, 0.999_999_94], -1.0, 1.0);
        let sigma = number(&[0.0, 1e-6, 30.0, 1e6], 0.0, 3.0);
        let u = std::array::from_fn(|_| number(&[0.0, 0.999_999_94, 0.5], 0.0, 1.0));
        let cos = ((1.0 - sin) * (1.0 + sin)).sqrt();
        let point = FibrePoint {
            tangent: Vec3::Z,
            normal: Vec3::new(((1.0 - h) * (1.0 + h)).sqrt(), h, 0.0),
            absorption_rgb: [sigma, 0.5 * sigma, 0.0],
            major: Vec3::Y,
        };
        let t = model.toward(&point, Vec3::new(cos, 0.0, sin));
        let Some(x) = t.sample(u) else { continue };
        let weight = x.weight_rgb.iter().copied().fold(0.0, f32::max);
        let fine = |v: f32| v.is_finite() && v >= 0.0;
        assert!(
            x.weight_rgb.iter().all(|&v| fine(v)) && fine(x.pdf) && x.pdf > 0.0 && x.to_light.is_finite(),
            "draw {i}: sin θ_r {sin}, h {h}, σ {sigma}, u {u:?}: {x:?}"
        );
        let (value, pdf) = t.eval_pdf(x.to_light);
        assert!(value.iter().all(|&v| fine(v)) && fine(pdf), "draw {i}: {value:?} {pdf}");
        let bound = match &t {
            // Shares are the means of three channels of A_p, which sum to 1 at most: no channel exceeds 3.
            Toward::Chiang(_) => 3.0,
            Toward::Marschner(t) => t.weight_bound(),
        };
        greatest = (greatest.0.max(weight), greatest.1.max(weight / bound));
    }
    greatest
}

#[test]
fn a_million_draws_are_finite_and_their_weights_bounded() {
    let narrow = FibreModel::new(&FibreOptics { width_r_deg: 0.5, ..marschner() }).unwrap();
    let polished = FibreModel::new(&chiang(0.01, 0.01, -3.0)).unwrap();
    let more = [("narrow", narrow), ("polished", polished)];
    for (k, (name, model)) in cases().iter().chain(&more).enumerate() {
        let (weight, share) = hammer(model, 120_000, k as u64);
        println!("{name}: greatest weight {weight}, {share} of its bound");
        // The bound's maxima are taken on a grid; rounding.
        assert!(share <= 1.05, "{name}: greatest weight {weight}, {share} of its bound");
    }
}

#[test]
#[ignore = "a hundred million draws: minutes"]
fn a_hundred_million_draws_are_finite() {
    let n = 100_000_000 / cases().len() as u32 + 1;
    for (k, (name, model)) in cases().iter().enumerate() {
        println!("{name}: greatest weight and share of its bound {:?}", hammer(model, n, 1000 + k as u64));
    }
}

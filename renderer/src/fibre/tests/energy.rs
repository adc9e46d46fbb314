//! White furnace, energy of the samplers, reciprocity.

use super::*;

#[test]
fn chiang_returns_all_light_in_a_white_furnace() {
    // Each M_p and N_p integrates to one and the A_p sum to one, so nothing may be lost at any tilt or offset.
    for (beta_m, beta_n) in [(0.06, 0.06), (0.3, 0.3), (1.0, 1.0)] {
        for tilt in [0.0, 2.0, 5.0, 10.0, -5.0] {
            let model = FibreModel::new(&chiang(beta_m, beta_n, tilt)).unwrap();
            for (theta_deg, h) in [(0.0, 0.0), (30.0, 1.0), (-30.0, -0.999), (70.0, 0.5), (-85.0, -1.0)] {
                let s = Setup::new(theta_deg, h, [0.0; 3]);
                let t = s.toward(&model);
                let got = integrate(&s, (720, 400), |d| f64::from(t.eval(d)[1]));
                // Relative rounding of narrow lobes.
                assert!(
                    (got - 1.0).abs() < 3e-5,
                    "β_m {beta_m}, tilt {tilt}°, θ_r {theta_deg}°, h {h}: {got}"
                );
            }
        }
    }
}

#[test]
fn mean_weight_is_the_energy_returned() {
    let cases = [
        FibreOptics { rest: true, ..marschner() },
        FibreOptics { eccentricity: 0.85, ..marschner() },
        FibreOptics { width_r_deg: 2.0, ..marschner() },
        chiang(0.3, 0.3, -2.0),
        chiang(0.7, 0.2, 5.0),
    ];
    for (k, optics) in cases.into_iter().enumerate() {
        let model = FibreModel::new(&optics).unwrap();
        for (theta_deg, h, sigma) in [(5.0, 0.3, 0.0), (-55.0, -0.9, 0.5), (84.0, 0.0, 2.0)] {
            let s = Setup::new(theta_deg, h, [sigma, 0.3 * sigma, 2.0 * sigma]);
            let t = s.toward(&model);
            let want = integrate(&s, (720, 300), |d| f64::from(t.eval(d)[0]));
            let n = 200_000;
            let mut rng = Rng::keyed(&[8, k as u64]);
            let (mut sum, mut squares) = (0.0f64, 0.0f64);
            for _ in 0..n {
                let w =
                    t.sample(std::array::from_fn(|_| rng.f32())).map_or(0.0, |x| f64::from(x.weight_rgb[0]));
                sum += w;
                squares += w * w;
            }
            let mean = sum / f64::from(n);
            let deviation = ((squares / f64::from(n) - mean * mean).max(0.0) / f64::from(n)).sqrt();
            println!("case {k} θ_r {theta_deg}: {mean} ± {deviation}, {want}");
            // 5e-4 for the quadrature (tables with kinks) beside 5 standard errors.
            assert!(
                (mean - want).abs() < 5.0 * deviation + 5e-4 * want,
                "case {k}, θ_r {theta_deg}°: {mean} ± {deviation}, by quadrature {want}"
            );
        }
    }
}

#[test]
fn marschner_with_the_rest_returns_all_light_where_there_is_no_caustic() {
    // Past 50° TRT has none to replace. Lobes this narrow see cos²θ_i / cos²θ_d within 3 (2 β tan θ_r)² of 1.
    let width = 0.25f32;
    let optics = FibreOptics { rest: true, shift_r_deg: 0.0, width_r_deg: width, ..marschner() };
    for (rest, lost) in [(true, [0.0, 0.0, 0.0]), (false, [0.0272, 0.0781, 0.1406])] {
        let model = FibreModel::new(&FibreOptics { rest, ..optics }).unwrap();
        for (theta_deg, lost) in [60.0f32, -75.0, 85.0].into_iter().zip(lost) {
            let s = Setup::new(theta_deg, 0.0, [0.0; 3]);
            let t = s.toward(&model);
            let mut rng = Rng::keyed(&[9]);
            let n = 40_000;
            let weights: Vec<f64> = (0..n)
                .filter_map(|_| t.sample(std::array::from_fn(|_| rng.f32())))
                .map(|x| f64::from(x.weight_rgb[1]))
                .collect();
            let mean = weights.iter().sum::<f64>() / f64::from(n);
            let squares = weights.iter().map(|w| w * w).sum::<f64>() / f64::from(n);
            let error = ((squares - mean * mean) / f64::from(n)).sqrt();
            let spread = 3.0 * f64::from(2.0 * width.to_radians() * theta_deg.to_radians().tan()).powi(2);
            // 3e-4: the table of θ_d, 0.7° apart.
            assert!(
                (mean - (1.0 - lost)).abs() < 5.0 * error + spread + 3e-4,
                "rest {rest}, θ_r {theta_deg}°: {mean} ± {error}, without {lost}"
            );
        }
    }
}

#[test]
fn marschner_is_reciprocal_at_every_shift_and_chiang_is_not() {
    // S depends on θ_h, |θ_d|, |φ| and φ_i + φ_r, none of which changes when light and camera do: the far-field
    // form is reciprocal with shifted lobes too. Chiang's A_p and its tilt belong to the camera alone.
    let asymmetry = |optics: &FibreOptics| {
        let model = FibreModel::new(optics).unwrap();
        let s = Setup::new(0.0, 0.3, [0.2, 0.5, 1.0]);
        let mut worst = 0.0f64;
        for (a, b) in
            [((10.0, 0.0), (-40.0, 100.0)), ((-60.0, 30.0), (45.0, -20.0)), ((5.0, 0.0), (0.0, 180.0))]
        {
            let (wa, wb) = (s.direction(a.0, a.1), s.direction(b.0, b.1));
            let ab = f64::from(model.toward(&s.point, wa).eval(wb)[0]) / b.0.to_radians().cos();
            let ba = f64::from(model.toward(&s.point, wb).eval(wa)[0]) / a.0.to_radians().cos();
            worst = worst.max((ab - ba).abs() / ab.max(ba));
        }
        worst
    };
    for optics in [
        marschner(),
        FibreOptics { shift_r_deg: 0.0, ..marschner() },
        FibreOptics { shift_r_deg: 10.0, rest: true, eccentricity: 0.85, ..marschner() },
    ] {
        // Float error of angles of 1e-6 times lobes' slopes of 30 per radian, and cosines.
        let worst = asymmetry(&optics);
        assert!(worst < 1e-4, "{worst}");
    }
    assert!(asymmetry(&chiang(0.3, 0.3, -5.0)) > 0.05);
}

#[test]
fn interface_and_angles_give_the_same_marschner() {
    let optics = FibreOptics { eccentricity: 0.9, rest: true, ..marschner() };
    let model = FibreModel::new(&optics).unwrap();
    let fibre = marschner::Fibre::new(&optics, marschner::Roots::Exact).unwrap();
    let sigma = [0.1, 0.4, 0.9];
    for (theta_r, theta_i, phi) in [(10.0, -30.0, 20.0), (-50.0, 60.0, -170.0), (0.0, 5.0, 95.0)] {
        let s = Setup::new(theta_r, 0.2, sigma);
        let got = s.toward(&model).eval(s.direction(theta_i, phi));
        // The camera has azimuth 0 and the major axis that of (0.6, 0.8).
        let major = 0.8f64.atan2(0.6);
        let angles = marschner::Angles {
            sin_i: theta_i.to_radians().sin() as f32,
            sin_r: theta_r.to_radians().sin(),
            cos_phi: phi.to_radians().cos() as f32,
            cos_2phi_h: (phi.to_radians() - 2.0 * major).cos() as f32,
        };
        let want = fibre.scatter(&angles, sigma).map(|v| v * theta_i.to_radians().cos() as f32);
        for c in 0..3 {
            assert!((got[c] - want[c]).abs() < 1e-4 * want[c], "θ_r {theta_r}°: {got:?}, {want:?}");
        }
    }
}

//! Tests of the model's parts.

use super::*;
use strandbench_scenes::OpticsModel;

#[test]
fn width_of_r_gives_the_roughness_of_the_same_width() {
    // MITSUBA's own figure: β_R = 7.5° is β_m = 0.28.
    let optics = FibreOptics { model: OpticsModel::Chiang, ..FibreOptics::default() };
    let p = Parameters::of(&optics).unwrap();
    assert!((p.longitudinal_roughness - 0.28).abs() < 0.005, "{}", p.longitudinal_roughness);
    assert_eq!(p.scale_tilt_deg, optics.shift_r_deg);
    // Standard deviation of θ_i about the mirror direction at θ_o = 0, by quadrature of M.
    for width_deg in [2.0f32, 5.0, 10.0] {
        let beta = f64::from(roughness_of_width(width_deg).unwrap());
        let m = Longitudinal::new(spread(beta).powi(2), Bessel::Exact);
        let (mut sum, mut second) = (0.0, 0.0);
        for k in 0..20_000 {
            let theta = std::f64::consts::PI * ((f64::from(k) + 0.5) / 20_000.0 - 0.5);
            let w = f64::from(m.value((theta.sin() as f32, theta.cos() as f32), (0.0, 1.0))) * theta.cos();
            sum += w;
            second += w * theta * theta;
        }
        let got = (second / sum).sqrt().to_degrees() * 0.5;
        // The lobe's variance is v (1 + O(v)): v is 0.12 at 10°.
        assert!((got - f64::from(width_deg)).abs() < 0.04 * f64::from(width_deg), "{width_deg}: {got}");
    }
}

#[test]
fn narrow_and_wide_longitudinal_lobes_integrate_to_one() {
    for v in [3e-5, 1e-3, 0.02, 0.1, 0.5, 4.0, 100.0] {
        let m = Longitudinal::new(v, Bessel::Exact);
        for theta_o in [0.0f64, 0.7, -1.3, 1.57] {
            let o = (theta_o.sin() as f32, theta_o.cos() as f32);
            let n = 40_000;
            let sum: f64 = (0..n)
                .map(|k| {
                    let theta = std::f64::consts::PI * ((f64::from(k) + 0.5) / f64::from(n) - 0.5);
                    f64::from(m.value((theta.sin() as f32, theta.cos() as f32), o)) * theta.cos()
                })
                .sum::<f64>()
                * std::f64::consts::PI
                / f64::from(n);
            // Rounding 1e-7 of the directions times the slope, 3 / sqrt(v), averaged out; Bessel 1e-6.
            assert!((sum - 1.0).abs() < 2e-5, "v {v}, θ_o {theta_o}: {sum}");
        }
    }
}

#[test]
fn the_bessel_function_of_mitsuba_is_off_by_what_its_terms_leave_out() {
    let (exact, theirs) = (Longitudinal::new(0.05, Bessel::Exact), Longitudinal::new(0.05, Bessel::Mitsuba));
    let ratio = |cos_i: f32| {
        let at = |m: &Longitudinal| f64::from(m.value(((1.0 - cos_i * cos_i).sqrt(), cos_i), (0.0, 1.0)));
        at(&theirs) / at(&exact)
    };
    // x = 20 cos θ_i. Past 12: exp(1/16x) for 1 + 1/8x + 9/128x². At 12 the series lacks 0.5 %.
    for x in [12.5f64, 15.0, 19.5] {
        let want =
            (-4.7e-5f64).exp() * (1.0 / (16.0 * x)).exp() / (1.0 + 1.0 / (8.0 * x) + 9.0 / (128.0 * x * x));
        let got = ratio((x / 20.0) as f32);
        assert!((got - want).abs() < 2e-4, "x {x}: {got}, {want}");
    }
    let near_twelve = ratio(0.599);
    assert!((0.993..0.997).contains(&near_twelve), "{near_twelve}");
    assert!((ratio(0.1) - 1.0).abs() < 6e-5);
}

#[test]
fn lobes_spread_as_their_variances() {
    // v, v/4, 4v and 4v (Chiang et al. 2016, section 4.1): standard deviations of θ_i of 1, 1/2, 2 and 2.
    let f = Fibre::new(&Parameters { longitudinal_roughness: 0.1, ..Parameters::default() }).unwrap();
    for (m, share) in f.longitudinal.iter().zip([1.0, 0.5, 2.0, 2.0]) {
        let (mut sum, mut second) = (0.0, 0.0);
        for k in 0..20_000 {
            let theta = std::f64::consts::PI * ((f64::from(k) + 0.5) / 20_000.0 - 0.5);
            let w = f64::from(m.value((theta.sin() as f32, theta.cos() as f32), (0.0, 1.0))) * theta.cos();
            sum += w;
            second += w * theta * theta;
        }
        // The variance is v (1 + O(v)), 4v is 0.026.
        let (got, want) = ((second / sum).sqrt(), share * spread(0.1));
        assert!((got - want).abs() < 0.03 * want, "{got}, {want}");
    }
}

//! Tests of the whole model: against a cylinder traced ray by ray, energy, symmetry, positions of highlights.

use super::*;
use glam::{DVec2, DVec3};
use std::f64::consts::PI;

const CAUSTIC: Caustic = Caustic { glint_scale: 1.0, width: 15.0 * PI / 180.0, fade_range: 0.3, limit: 0.5 };

fn optics() -> FibreOptics {
    FibreOptics::default()
}

/// Traces one ray through a smooth cylinder along y with vector refraction in three dimensions, entering at
/// offset `h`; yields (exit azimuth relative to the light, energy, inside length) for p = 0, 1, 2, ...
pub(super) fn trace_cylinder<const PATHS: usize>(h: f64, theta: f64, eta: f64) -> [(f64, f64, f64); PATHS] {
    let reflectance = |cos_i: f64, n: f64| {
        let sin2_t = (1.0 - cos_i * cos_i) / (n * n);
        if sin2_t >= 1.0 {
            return 1.0;
        }
        let cos_t = (1.0 - sin2_t).sqrt();
        let s = (cos_i - n * cos_t) / (cos_i + n * cos_t);
        let p = (n * cos_i - cos_t) / (n * cos_i + cos_t);
        0.5 * (s * s + p * p)
    };
    let refract = |d: DVec3, n: DVec3, ratio: f64| {
        let c = -d.dot(n);
        let k = 1.0 - ratio * ratio * (1.0 - c * c);
        d * ratio + n * (ratio * c - k.max(0.0).sqrt())
    };
    let azimuth = |d: DVec3| DVec2::new(1.0, 0.0).angle_to(DVec2::new(d.x, d.z));
    // Light comes from +x (azimuth 0) and from inclination θ.
    let d = DVec3::new(-theta.cos(), -theta.sin(), 0.0);
    let p0 = DVec3::new((1.0 - h * h).sqrt(), 0.0, h);
    let n0 = p0;
    let f0 = reflectance(-d.dot(n0), eta);
    let reflected = d - n0 * (2.0 * d.dot(n0));
    let mut out = [(azimuth(reflected), f0, 0.0); PATHS];
    let mut direction = refract(d, n0, 1.0 / eta);
    let mut p = p0;
    let (mut energy, mut length) = (1.0 - f0, 0.0);
    for o in &mut out[1..] {
        let flat = DVec2::new(direction.x, direction.z);
        let t = -2.0 * DVec2::new(p.x, p.z).dot(flat) / flat.length_squared();
        p += direction * t;
        length += t;
        let outward = DVec3::new(p.x, 0.0, p.z);
        let f = reflectance(direction.dot(outward), 1.0 / eta);
        *o = (azimuth(refract(direction, -outward, eta)), energy * (1.0 - f), length);
        energy *= f;
        direction -= outward * (2.0 * direction.dot(outward));
    }
    out
}

/// ∫ f over [a, b] split at `poles`, where f may have integrable poles: each piece is mapped by a smooth step
/// whose slope vanishes at both ends, and summed at midpoints.
fn integrate(a: f64, b: f64, poles: &[f64], steps: u32, f: impl Fn(f64) -> f64) -> f64 {
    let mut cuts = vec![a, b];
    cuts.extend(poles.iter().copied().filter(|&p| p > a && p < b));
    cuts.sort_by(f64::total_cmp);
    let piece = |a: f64, b: f64| {
        let sum: f64 = (0..steps)
            .map(|i| {
                let s = (f64::from(i) + 0.5) / f64::from(steps);
                f(a + (b - a) * s * s * (3.0 - 2.0 * s)) * 6.0 * s * (1.0 - s)
            })
            .sum();
        sum * (b - a) / f64::from(steps)
    };
    cuts.windows(2).map(|w| piece(w[0], w[1])).sum()
}

/// Azimuths in [0, 2π] at which TRT has a caustic.
fn poles(section: &CrossSection, p: u32) -> Vec<f64> {
    match section.caustic_azimuth() {
        Some(phi) if p == 2 => [phi, -phi].map(|x| x.rem_euclid(2.0 * PI)).to_vec(),
        _ => Vec::new(),
    }
}

#[test]
fn azimuthal_terms_match_a_cylinder_traced_ray_by_ray() {
    const BINS: usize = 90;
    let sigma = 0.3;
    for theta_deg in [0.0f64, 25.0, 60.0] {
        let theta = theta_deg.to_radians();
        let mut traced = [[0.0; BINS]; 3];
        let rays = 400_000;
        for i in 0..rays {
            let h = 2.0 * (f64::from(i) + 0.5) / f64::from(rays) - 1.0;
            for (p, (phi, energy, length)) in trace_cylinder::<3>(h, theta, 1.55).into_iter().enumerate() {
                let bin = ((phi.rem_euclid(2.0 * PI)) / (2.0 * PI) * BINS as f64) as usize;
                traced[p][bin.min(BINS - 1)] += energy * (-sigma * length).exp() / f64::from(rays);
            }
        }
        let section = CrossSection::new(1.55, theta.cos(), Roots::Exact);
        for p in 0..3u32 {
            let mut worst = 0.0f64;
            for (bin, &want) in traced[p as usize].iter().enumerate() {
                let width = 2.0 * PI / BINS as f64;
                let got = integrate(
                    bin as f64 * width,
                    (bin + 1) as f64 * width,
                    &poles(&section, p),
                    100,
                    |phi| section.parts(p, phi).iter().map(|x| x.weight * (-sigma * x.length).exp()).sum(),
                );
                worst = worst.max((got - want).abs());
            }
            let total: f64 = traced[p as usize].iter().sum();
            assert!(worst <= 2e-4 * total, "p {p}, θ {theta_deg}°: {worst} of {total}");
        }
    }
}

#[test]
fn azimuthal_energy_is_the_fresnel_sum_for_exact_and_cubic_roots() {
    for roots in [Roots::Exact, Roots::Cubic] {
        for theta_deg in [0.0f64, 40.0] {
            let section = CrossSection::new(1.55, theta_deg.to_radians().cos(), roots);
            let (ep, es) = bravais(1.55, theta_deg.to_radians().cos());
            for p in 0..3u32 {
                // Uniform in h as the light is.
                let n = 20_000;
                let want: f64 = (0..n)
                    .map(|i| {
                        let h = 2.0 * (f64::from(i) + 0.5) / f64::from(n) - 1.0;
                        let f = reflectance((1.0 - h * h).sqrt(), ep, es);
                        (if p == 0 { f } else { (1.0 - f).powi(2) * f.powi(p as i32 - 1) }) / f64::from(n)
                    })
                    .sum();
                let got = integrate(0.0, 2.0 * PI, &poles(&section, p), 2000, |phi| {
                    section.parts(p, phi).iter().map(|x| x.weight).sum()
                });
                assert!((got - want).abs() < 1e-3 * want, "{roots:?} p {p} θ {theta_deg}: {got}, {want}");
            }
        }
    }
}

/// Energy returned by a fibre that absorbs nothing, lit from everywhere: ∫ S cos θ_i dω_i.
fn furnace(fibre: &Fibre, theta_r: f64, pick: impl Fn(&Fibre, &Angles) -> f64) -> f64 {
    let (nt, np) = (1500, 500);
    let mut sum = 0.0;
    for i in 0..nt {
        let theta = PI * ((f64::from(i) + 0.5) / f64::from(nt) - 0.5);
        for j in 0..np {
            let phi = PI * (f64::from(j) + 0.5) / f64::from(np);
            let angles = Angles {
                sin_i: theta.sin() as f32,
                sin_r: theta_r.sin() as f32,
                cos_phi: phi.cos() as f32,
                cos_2phi_h: 0.0,
            };
            sum += pick(fibre, &angles) * theta.cos().powi(2);
        }
    }
    sum * 2.0 * PI * PI / f64::from(nt) / f64::from(np)
}

/// Energy of R, TT and TRT of a cylinder at inclination θ: what p = 0..2 of the series 1 = Σ A_p hold.
fn three_paths(eta: f64, theta: f64) -> [f64; 3] {
    let (ep, es) = bravais(eta, theta.cos());
    let n = 20_000;
    let mut e = [0.0; 3];
    for i in 0..n {
        let h = 2.0 * (f64::from(i) + 0.5) / f64::from(n) - 1.0;
        let f = reflectance((1.0 - h * h).sqrt(), ep, es);
        for (p, e) in e.iter_mut().enumerate() {
            *e += (if p == 0 { f } else { (1.0 - f).powi(2) * f.powi(p as i32 - 1) }) / f64::from(n);
        }
    }
    e
}

#[test]
fn white_furnace_returns_the_energy_of_three_paths_at_every_tilt() {
    // Narrow lobes, so that θ_d is that of the mirror direction, and no replacement of the caustic.
    for tilt in [0.0f32, 2.0, 5.0, 10.0, -5.0] {
        let o = FibreOptics { shift_r_deg: tilt, width_r_deg: 1.0, ..optics() };
        let fibre = Fibre::new(&o, Roots::Exact).unwrap();
        for theta_deg in [0.0f64, 20.0, 40.0] {
            let theta = theta_deg.to_radians();
            let want = three_paths(1.55, theta);
            // R and TT alone (TRT's caustic is replaced by a lobe of another energy).
            let got = furnace(&fibre, theta, |f, a| f64::from(f.scatter_lobes(a, [0.0; 3])[0][0]));
            let shifted = |alpha: f64| {
                // A shifted lobe leaves at 2α - θ: Jacobian cos²θ_i / cos²θ_d of the far-field form.
                let (ti, td) = (2.0 * alpha - theta, alpha - theta);
                (ti.cos() / td.cos()).powi(2)
            };
            let alpha = f64::from(tilt).to_radians();
            let want_r = three_paths(1.55, theta - alpha)[0] * shifted(alpha);
            assert!((got - want_r).abs() < 0.01 * want_r, "R, tilt {tilt}, θ {theta_deg}: {got}, {want_r}");
            let got = furnace(&fibre, theta, |f, a| f64::from(f.scatter_lobes(a, [0.0; 3])[1][0]));
            let want_tt = three_paths(1.55, theta + 0.5 * alpha)[1] * shifted(-0.5 * alpha);
            assert!(
                (got - want_tt).abs() < 0.01 * want_tt,
                "TT, tilt {tilt}, θ {theta_deg}: {got}, {want_tt}"
            );
            assert!(want.iter().sum::<f64>() < 1.0);
        }
    }
}

#[test]
fn furnace_of_the_published_parameters_loses_a_known_share() {
    // Measured energies of R, TT and TRT at Table 1's middle values: 0.951, 1.009 and 1.042 together. Three
    // paths of a smooth cylinder hold 0.992, 0.990 and 0.973 of the light. The replacement of the caustic takes
    // a quarter of TRT at 0°; the shifts and widths move light to inclinations where cos²θ_i / cos²θ_d is
    // not 1, which is why the far-field form can return more than it got.
    let fibre = Fibre::new(&optics(), Roots::Exact).unwrap();
    for (theta_deg, want) in [
        (0.0f64, [0.0686, 0.8395, 0.0428]),
        (30.0, [0.0708, 0.8873, 0.0511]),
        (60.0, [0.0968, 0.8635, 0.0813]),
    ] {
        let theta = theta_deg.to_radians();
        let got: [f64; 3] = std::array::from_fn(|lobe| {
            furnace(&fibre, theta, |f, a| f64::from(f.scatter_lobes(a, [0.0; 3])[lobe][0]))
        });
        for lobe in 0..3 {
            assert!((got[lobe] - want[lobe]).abs() < 0.002, "θ {theta_deg}°: {got:?}, stated {want:?}");
        }
    }
}

#[test]
fn scattering_is_reciprocal() {
    let fibre = Fibre::new(&optics(), Roots::Exact).unwrap();
    for (a, b, c) in [(0.1, -0.4, 0.9), (0.7, 0.2, -0.8), (-0.95, 0.3, 0.0), (0.0, 0.0, 1.0)] {
        let s = |sin_i, sin_r| {
            fibre.scatter(&Angles { sin_i, sin_r, cos_phi: c, cos_2phi_h: 0.0 }, [0.2, 0.5, 1.0])
        };
        let (x, y) = (s(a, b), s(b, a));
        for k in 0..3 {
            assert!((x[k] - y[k]).abs() <= 1e-5 * x[k].max(1e-6), "{x:?} {y:?}");
        }
    }
}

#[test]
fn highlights_lie_where_the_cuticle_sends_them() {
    // The tangent points to the tip: with α_R = -7.5° the reflection leaves 15° nearer to the root than the
    // mirror direction, TRT 22.5° nearer to the tip, TT 7.5° nearer to the tip.
    // Narrow lobes: 1/cos²θ_d and N_p(θ_d) pull the maximum of a wide one aside.
    let fibre = Fibre::new(&FibreOptics { width_r_deg: 1.0, ..optics() }, Roots::Exact).unwrap();
    for theta_i_deg in [-20.0f64, 0.0, 20.0] {
        for (lobe, cos_phi, shift_deg) in [(0, 1.0, -15.0), (1, -1.0, 7.5), (2, 1.0, 22.5)] {
            let value = |theta_r_deg: f64| {
                let angles = Angles {
                    sin_i: theta_i_deg.to_radians().sin() as f32,
                    sin_r: theta_r_deg.to_radians().sin() as f32,
                    cos_phi,
                    cos_2phi_h: 0.0,
                };
                fibre.scatter_lobes(&angles, [0.0; 3])[lobe][0]
            };
            let best = (-800..800)
                .map(|k| f64::from(k) * 0.1)
                .max_by(|&a, &b| value(a).total_cmp(&value(b)))
                .unwrap();
            let want = -theta_i_deg + shift_deg;
            assert!((best - want).abs() <= 1.0, "lobe {lobe}, θ_i {theta_i_deg}°: {best}°, want {want}°");
        }
    }
}

#[test]
fn table_agrees_with_direct_evaluation() {
    let table = Table::new(1.55, 1.0, &CAUSTIC, Roots::Exact);
    let (mut worst, mut peak) = ([0.0f64; 3], [0.0f64; 3]);
    for i in 0..60 {
        let theta = 80.0f64.to_radians() * (f64::from(i) + 0.37) / 60.0;
        for j in 0..97 {
            let phi = PI * (f64::from(j) + 0.41) / 97.0;
            let want = Azimuthal::direct(1.55, 1.55, theta.cos(), phi, &CAUSTIC, Roots::Exact);
            let got = table.lookup(theta as f32, phi as f32, 1.55);
            for (k, (g, w)) in
                [(got.r, want.r), (got.tt, want.tt), (got.trt, want.trt)].into_iter().enumerate()
            {
                worst[k] = worst[k].max(f64::from((g - w).abs()));
                peak[k] = peak[k].max(f64::from(w));
            }
        }
    }
    println!("table against direct: {worst:?} of peaks {peak:?}");
    // TRT is worst where the caustic fades (η' near 2); elsewhere it is five times better.
    for (k, limit) in [1e-3, 1e-3, 1e-2].into_iter().enumerate() {
        assert!(worst[k] < limit * peak[k], "lobe {k}: {} of {}", worst[k], peak[k]);
    }
}

#[test]
fn absorption_by_expansion_agrees_with_the_sum_over_paths() {
    let fibre = Fibre::new(&optics(), Roots::Exact).unwrap();
    for sigma in [0.1f64, 0.5, 1.0, 2.0] {
        for phi_deg in [2.0f64, 10.0, 20.0, 40.0, 90.0] {
            let parts =
                CrossSection::new(1.55, 0.98, Roots::Exact).smoothed_trt(phi_deg.to_radians(), &CAUSTIC);
            let want: f64 = parts.iter().map(|p| p.weight * (-sigma * p.length).exp()).sum();
            let n = Azimuthal::direct(1.55, 1.55, 0.98, phi_deg.to_radians(), &CAUSTIC, Roots::Exact);
            let (mean, var) = (f64::from(n.trt_length), f64::from(n.trt_variance));
            let got = f64::from(n.trt) * (-sigma * mean + 0.5 * sigma * sigma * var).exp();
            assert!((got - want).abs() < 2e-3 * want.max(1e-3), "σ {sigma} φ {phi_deg}: {got}, {want}");
        }
    }
    // Strong absorption leaves R alone, and nothing turns back up.
    let a = Angles { sin_i: 0.1, sin_r: -0.2, cos_phi: 0.9, cos_2phi_h: 0.0 };
    let lobes = fibre.scatter_lobes(&a, [200.0; 3]);
    assert!(lobes[0][0] > 0.0 && lobes[1] == [0.0; 3] && lobes[2] == [0.0; 3], "{lobes:?}");
}

#[test]
fn parameters_out_of_range_are_named_and_edges_stay_finite() {
    for (bad, name) in [
        (FibreOptics { index: f32::NAN, ..optics() }, "index"),
        (FibreOptics { width_r_deg: 0.0, ..optics() }, "width_r_deg"),
        (FibreOptics { eccentricity: 9.0, ..optics() }, "eccentricity"),
        (FibreOptics { caustic_width_deg: -1.0, ..optics() }, "caustic_width_deg"),
    ] {
        let error = Fibre::new(&bad, Roots::Exact).unwrap_err();
        assert!(error.contains(name), "{error}");
    }
    for o in [optics(), FibreOptics { eccentricity: 0.85, width_r_deg: 1.0, ..optics() }] {
        let fibre = Fibre::new(&o, Roots::Exact).unwrap();
        for sin_i in [-1.0f32, -0.999_999, 0.0, 1.0, 1.1] {
            for sin_r in [-1.0f32, 0.5, 0.999_999_9, 1.0] {
                for cos_phi in [-1.0f32, 0.0, 1.0, 1.000_1] {
                    let a = Angles { sin_i, sin_r, cos_phi, cos_2phi_h: 0.3 };
                    let s = fibre.scatter(&a, [0.0, 1.0, 1e6]);
                    assert!(s.iter().all(|v| v.is_finite() && *v >= 0.0), "{a:?}: {s:?}");
                }
            }
        }
    }
}

#[test]
fn eccentricity_moves_the_index_of_trt_alone() {
    let round = Fibre::new(&optics(), Roots::Exact).unwrap();
    let oval = Fibre::new(&FibreOptics { eccentricity: 0.9, ..optics() }, Roots::Exact).unwrap();
    let at = |cos_2phi_h| Angles { sin_i: 0.0, sin_r: 0.38, cos_phi: 0.85, cos_2phi_h };
    let (r, a, b) = (
        round.scatter_lobes(&at(0.0), [0.0; 3]),
        oval.scatter_lobes(&at(1.0), [0.0; 3]),
        oval.scatter_lobes(&at(-1.0), [0.0; 3]),
    );
    assert_eq!((r[0], r[1]), (a[0], a[1]));
    assert!((a[2][0] - b[2][0]).abs() > 0.05 * r[2][0], "{a:?} {b:?}");
    // The indices of section 5 at a = 0.9.
    let (e1, e2) = eccentric_indices(1.55, 0.9);
    assert!((e1 - 1.341).abs() < 1e-9 && (e2 - (1.1 / 0.81 + 0.45)).abs() < 1e-9);
}

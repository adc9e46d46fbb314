//! Where light goes: highlights along the fibre, and near-field lobes against a ray traced by hand.

use super::*;

/// A ray followed through a smooth dielectric cylinder of radius 1 with vectors in three dimensions, entering
/// where the normal is `n`: (direction out, energy, way inside) for p = 0, 1, 2.
fn follow(tangent: DVec3, n: DVec3, d: DVec3, eta: f64) -> [(DVec3, f64, f64); 3] {
    let reflectance = |cos_i: f64, eta: f64| {
        let sin2_t = (1.0 - cos_i * cos_i) / (eta * eta);
        if sin2_t >= 1.0 {
            return 1.0;
        }
        let cos_t = (1.0 - sin2_t).sqrt();
        let s = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
        let p = (cos_t - eta * cos_i) / (cos_t + eta * cos_i);
        0.5 * (s * s + p * p)
    };
    let refract = |d: DVec3, n: DVec3, ratio: f64| {
        let c = -d.dot(n);
        d * ratio + n * (ratio * c - (1.0 - ratio * ratio * (1.0 - c * c)).max(0.0).sqrt())
    };
    let f = reflectance(-d.dot(n), eta);
    let mut out = [(d - n * (2.0 * d.dot(n)), f, 0.0); 3];
    let (mut direction, mut at) = (refract(d, n, 1.0 / eta), n);
    let (mut energy, mut way) = (1.0 - f, 0.0);
    for o in &mut out[1..] {
        let flat = direction - tangent * direction.dot(tangent);
        let t = -2.0 * at.dot(flat) / flat.length_squared();
        way += t;
        at += direction * t;
        at -= tangent * at.dot(tangent);
        let f = reflectance(direction.dot(at), 1.0 / eta);
        *o = (refract(direction, -at, eta), energy * (1.0 - f), way);
        energy *= f;
        direction -= at * (2.0 * direction.dot(at));
    }
    out
}

#[test]
fn chiang_follows_a_ray_through_a_cylinder() {
    // Energies with absorption are A_p; without tilt, each lobe of a polished fibre is brightest where the ray
    // leaves. The camera's ray is followed backwards.
    let sigma = 0.4;
    let model = FibreModel::new(&chiang(0.05, 0.05, 0.0)).unwrap();
    for theta_deg in [0.0, 25.0, -60.0] {
        for h in [0.0, 0.5, -0.8, 0.97] {
            let s = Setup::new(theta_deg, h, [sigma; 3]);
            let Toward::Chiang(t) = s.toward(&model) else { unreachable!() };
            let (tangent, n) = (s.point.tangent.as_dvec3(), s.point.normal.as_dvec3());
            let traced = follow(tangent, n, -s.to_camera.as_dvec3(), 1.55);
            let attenuation = t.attenuation();
            for (p, (out, energy, way)) in traced.into_iter().enumerate() {
                let want = energy * (-f64::from(sigma) * way).exp();
                let got = f64::from(attenuation[p][0]);
                // h near 1 magnifies its rounding: dF/dh is some 50 there.
                assert!((got - want).abs() < 1e-5, "θ_r {theta_deg}°, h {h}, p {p}: A {got}, traced {want}");
                let lobe = |d: Vec3| f64::from(t.eval_lobes(d)[p][0]);
                let (theta, phi) = angles(&s, out.as_vec3());
                let peak = lobe(s.direction(theta, phi));
                // Half a degree off in azimuth in either sense is darker, and as dark in both.
                let (left, right) =
                    (lobe(s.direction(theta, phi - 0.5)), lobe(s.direction(theta, phi + 0.5)));
                assert!(left < peak && right < peak, "θ_r {theta_deg}°, h {h}, p {p}: {left} {peak} {right}");
                assert!((left - right).abs() < 0.01 * peak, "θ_r {theta_deg}°, h {h}, p {p}: {left} {right}");
                // Along the fibre M itself is brightest 0.5 v tan θ off the mirror direction: below 0.2°.
                let (root, tip) = (lobe(s.direction(theta - 1.5, phi)), lobe(s.direction(theta + 1.5, phi)));
                assert!(root < peak && tip < peak, "θ_r {theta_deg}°, h {h}, p {p}: {root} {peak} {tip}");
            }
        }
    }
}

/// Inclination in degrees at which a lobe is brightest at this azimuth.
fn brightest(value: impl Fn(f64) -> f32) -> f64 {
    (-850..=850).map(|k| f64::from(k) * 0.1).max_by(|&a, &b| value(a).total_cmp(&value(b))).unwrap()
}

#[test]
fn highlights_of_both_models_lie_where_the_cuticle_sends_them() {
    // Scales point to the tip, so R leaves nearer to the root than a mirror would send it, TRT nearer to the tip
    // and TT between: by 2α, -3α and -α in Marschner's terms, 2α, -4α and -α in Chiang's. Narrow lobes.
    let alpha = -4.0;
    let chiang = chiang(0.05, 0.3, alpha);
    let marschner = FibreOptics { shift_r_deg: alpha, width_r_deg: 0.5, ..marschner() };
    for (optics, shifts) in [(marschner, [2.0, -1.0, -3.0]), (chiang, [2.0, -1.0, -4.0])] {
        let model = FibreModel::new(&optics).unwrap();
        for theta_r in [-30.0f32, 0.0, 20.0] {
            let s = Setup::new(theta_r, 0.0, [0.0; 3]);
            let mut places = [0.0; 3];
            for (p, phi) in [(0, 0.0), (1, 180.0), (2, 0.0)] {
                places[p] = match s.toward(&model) {
                    Toward::Chiang(t) => brightest(|x| t.eval_lobes(s.direction(x, phi))[p][0]),
                    Toward::Marschner(_) => {
                        let FibreModel::Marschner(f) = &model else { unreachable!() };
                        brightest(|x| {
                            let angles = marschner::Angles {
                                sin_i: x.to_radians().sin() as f32,
                                sin_r: theta_r.to_radians().sin(),
                                cos_phi: f64::to_radians(phi).cos() as f32,
                                cos_2phi_h: 0.0,
                            };
                            f.scatter_lobes(&angles, [0.0; 3])[p][0]
                        })
                    }
                };
                let want = f64::from(-theta_r + shifts[p] * alpha);
                // TRT is the widest: 1/cos²θ_d and v tan θ / 2 pull it by up to 0.4°.
                assert!(
                    (places[p] - want).abs() < 0.6,
                    "{:?} θ_r {theta_r}° p {p}: {places:?}",
                    optics.model
                );
            }
            // The tangent points to the tip.
            assert!(places[0] < -f64::from(theta_r) && places[1] > places[0] && places[2] > places[1]);
            // And the whole of a dark fibre, seen through the interface, is brightest on the root's side.
            let dark = Setup::new(theta_r, 0.0, [3.0; 3]);
            let (s, t) = (&dark, dark.toward(&model));
            let whole = brightest(|x| t.eval(s.direction(x, 0.0))[0]);
            assert!((whole - places[0]).abs() < 0.6, "{:?} θ_r {theta_r}°: {whole}", optics.model);
        }
    }
}

#[test]
fn seen_along_its_axis_a_fibre_is_finite() {
    // There the azimuth has no meaning, and what the models say depends on it: no limit to hold it against.
    for optics in [marschner(), FibreOptics { eccentricity: 0.85, ..marschner() }, chiang(0.3, 0.3, -2.0)] {
        let model = FibreModel::new(&optics).unwrap();
        for to_camera in [Vec3::Z, -Vec3::Z, Vec3::new(1e-20, 0.0, 1.0), Vec3::new(-1e-6, 0.0, 1.0)] {
            let mut s = Setup::turned(Quat::IDENTITY, 0.0, 0.3, [0.2; 3]);
            s.to_camera = to_camera;
            let t = s.toward(&model);
            for to_light in [s.direction(-70.0, 40.0), s.direction(90.0, 0.0), Vec3::Z, -Vec3::Z] {
                let (value, pdf) = t.eval_pdf(to_light);
                assert!(value.iter().all(|v| v.is_finite() && *v >= 0.0) && pdf.is_finite() && pdf >= 0.0);
            }
            assert!(t.sample([0.5; 4]).is_none_or(|x| x.weight_rgb.iter().all(|v| v.is_finite())));
        }
    }
}

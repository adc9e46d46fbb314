//! Tests of both models through their common interface.

mod energy;
mod places;
mod sampling;

use super::*;
use glam::{DVec3, Quat};
use strandbench_rng::Rng;
use strandbench_scenes::OpticsRoots;

pub(super) fn marschner() -> FibreOptics {
    FibreOptics::default()
}

pub(super) fn chiang(beta_m: f32, beta_n: f32, tilt_deg: f32) -> FibreOptics {
    FibreOptics {
        model: OpticsModel::Chiang,
        longitudinal_roughness: Some(beta_m),
        azimuthal_roughness: Some(beta_n),
        scale_tilt_deg: Some(tilt_deg),
        ..FibreOptics::default()
    }
}

/// A fibre turned arbitrarily in space, its point at offset `h` (side of positive azimuth) and the camera at
/// inclination `theta_deg`; directions are given as inclination and azimuth from the camera's, degrees.
pub(super) struct Setup {
    pub turn: Quat,
    pub point: FibrePoint,
    pub to_camera: Vec3,
}

impl Setup {
    pub fn new(theta_deg: f32, h: f32, absorption_rgb: [f32; 3]) -> Setup {
        let mut rng = Rng::keyed(&[11, theta_deg.to_bits().into(), h.to_bits().into()]);
        let axis = Vec3::new(rng.range(-1.0, 1.0), rng.range(-1.0, 1.0), rng.range(-1.0, 1.0)).normalize();
        Setup::turned(Quat::from_axis_angle(axis, rng.range(0.0, 6.0)), theta_deg, h, absorption_rgb)
    }

    pub fn turned(turn: Quat, theta_deg: f32, h: f32, absorption_rgb: [f32; 3]) -> Setup {
        let normal = Vec3::new((1.0 - h * h).max(0.0).sqrt(), h, 0.0);
        let point = FibrePoint {
            tangent: turn * Vec3::Z,
            normal: turn * normal,
            absorption_rgb,
            major: turn * Vec3::new(0.6, 0.8, 0.0),
        };
        let mut s = Setup { turn, point, to_camera: Vec3::ZERO };
        s.to_camera = s.direction(f64::from(theta_deg), 0.0);
        s
    }

    pub fn direction(&self, theta_deg: f64, phi_deg: f64) -> Vec3 {
        let ((st, ct), (sp, cp)) = (theta_deg.to_radians().sin_cos(), phi_deg.to_radians().sin_cos());
        self.turn * DVec3::new(ct * cp, ct * sp, st).as_vec3()
    }

    pub fn toward<'a>(&self, model: &'a FibreModel) -> Toward<'a> {
        model.toward(&self.point, self.to_camera)
    }
}

/// Inclination and azimuth in degrees from the camera's, of a world direction.
pub(super) fn angles(s: &Setup, direction: Vec3) -> (f64, f64) {
    let d = (s.turn.inverse() * direction).as_dvec3();
    (d.z.atan2(d.x.hypot(d.y)).to_degrees(), d.y.atan2(d.x).to_degrees())
}

/// ∫ f dω over the sphere: Simpson's rule in inclination (`steps.0` even), midpoints in azimuth.
pub(super) fn integrate(s: &Setup, steps: (u32, u32), f: impl FnMut(Vec3) -> f64) -> f64 {
    // The cosine vanishes at both ends.
    let weights = |i: u32| if i % 2 == 1 { 4.0 / 3.0 } else { 2.0 / 3.0 };
    rows(s, steps, (1..steps.0).map(|i| (f64::from(i), weights(i))), f)
}

/// The same by midpoints, for what grows as 1 / cos θ at the poles.
pub(super) fn integrate_open(s: &Setup, steps: (u32, u32), f: impl FnMut(Vec3) -> f64) -> f64 {
    rows(s, steps, (0..steps.0).map(|i| (f64::from(i) + 0.5, 1.0)), f)
}

fn rows(
    s: &Setup,
    steps: (u32, u32),
    places: impl Iterator<Item = (f64, f64)>,
    mut f: impl FnMut(Vec3) -> f64,
) -> f64 {
    let (dt, dp) = (180.0 / f64::from(steps.0), 360.0 / f64::from(steps.1));
    let sum: f64 = places
        .map(|(place, weight)| {
            let theta = -90.0 + dt * place;
            let row: f64 =
                (0..steps.1).map(|j| f(s.direction(theta, -180.0 + dp * (f64::from(j) + 0.5)))).sum();
            row * theta.to_radians().cos() * weight
        })
        .sum();
    sum * dt.to_radians() * dp.to_radians()
}

#[test]
fn parameters_out_of_range_or_of_the_other_model_are_named() {
    let bad = [
        (FibreOptics { index: 1.0, ..chiang(0.3, 0.3, -2.0) }, "index"),
        (chiang(0.0, 0.3, -2.0), "longitudinal_roughness"),
        (chiang(f32::NAN, 0.3, -2.0), "longitudinal_roughness"),
        (chiang(0.3, 1.5, -2.0), "azimuthal_roughness"),
        (chiang(0.3, 0.3, f32::INFINITY), "scale_tilt_deg"),
        (FibreOptics { glint_scale: 2.0, ..chiang(0.3, 0.3, -2.0) }, "glint_scale"),
        (FibreOptics { rest: true, ..chiang(0.3, 0.3, -2.0) }, "rest"),
        (FibreOptics { roots: OpticsRoots::Cubic, ..chiang(0.3, 0.3, -2.0) }, "roots"),
        (FibreOptics { scale_tilt_deg: Some(-2.0), ..marschner() }, "scale_tilt_deg"),
        (FibreOptics { mitsuba_bessel: true, ..marschner() }, "mitsuba_bessel"),
        (FibreOptics { longitudinal_roughness: Some(0.3), ..marschner() }, "longitudinal_roughness"),
        (FibreOptics { model: OpticsModel::Chiang, width_r_deg: 0.2, ..marschner() }, "width_r_deg"),
        (FibreOptics { model: OpticsModel::Chiang, width_r_deg: f32::NAN, ..marschner() }, "width_r_deg"),
        (FibreOptics { shift_r_deg: f32::NAN, ..marschner() }, "shift_r_deg"),
    ];
    for (optics, name) in bad {
        let error = FibreModel::new(&optics).expect_err(name);
        assert!(error.contains(name), "{error}");
    }
}

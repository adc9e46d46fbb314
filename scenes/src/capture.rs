//! Cameras and lights from their parameters.

use crate::spec::{CalibrationError, LightSpec, RigSpec};
use crate::{AreaLight, Lens};
use glam::{DMat3, DVec3, Vec3};
use strandbench_rng::Rng;
use strandbench_types::{Camera, Rig};

/// Stream of calibration errors.
const CALIBRATION: u64 = 0xCA11;

/// Axes of the reference camera: right, up, and from the target towards the camera.
fn axes(spec: &RigSpec) -> (DVec3, DVec3, DVec3) {
    let (az, el) = (spec.azimuth_deg.to_radians(), spec.elevation_deg.to_radians());
    let back = DVec3::new(libm::sin(az) * libm::cos(el), libm::sin(el), libm::cos(az) * libm::cos(el));
    let right = DVec3::Y.cross(back).normalize();
    (right, back.cross(right), back)
}

/// The rig as it is: centre, left, right (as seen in the image), top, in one plane, turned towards the target.
pub(crate) fn rig(spec: &RigSpec) -> Rig {
    let target = DVec3::from_array(spec.target_mm);
    let (right, up, back) = axes(spec);
    let reference = target + back * spec.distance_mm;
    let camera = |name: &str, offset: DVec3| {
        Camera::look_at(name, (spec.width_px, spec.height_px), spec.focal_px, reference + offset, target, -up)
    };
    Rig {
        cameras: vec![
            camera("center", DVec3::ZERO),
            camera("left", right * -spec.baseline_x_mm),
            camera("right", right * spec.baseline_x_mm),
            camera("top", up * spec.baseline_y_mm),
        ],
        near_mm: spec.near_mm,
        far_mm: spec.far_mm,
        frame_rate_hz: spec.frame_rate_hz,
        exposure_s: spec.exposure_s,
    }
}

/// The lens that every camera has, if the rig states one.
pub(crate) fn lens(spec: &RigSpec) -> Option<Lens> {
    spec.lens.map(|l| Lens {
        aperture_radius_mm: 0.5 * l.focal_length_mm / l.f_number,
        focus_mm: l.focus_mm.unwrap_or(spec.distance_mm),
    })
}

/// The rig as calibration believes it to be; the reference is exact.
pub(crate) fn calibrated(rig: &Rig, error: &CalibrationError, seed: u64) -> Rig {
    let mut out = rig.clone();
    for (i, camera) in out.cameras.iter_mut().enumerate().skip(1) {
        let mut rng = Rng::keyed(&[seed, CALIBRATION, i as u64]);
        let mut normals =
            || DVec3::from_array(std::array::from_fn(|_| f64::from(crate::groom::standard_normal(&mut rng))));
        let turn = normals() * (error.rotation_mdeg * 1e-3).to_radians();
        let shift = normals() * error.translation_mm;
        let zoom = 1.0 + normals().x * error.focal_relative;
        let centre = camera.centre_mm() + camera.camera_from_world.transpose() * shift;
        camera.camera_from_world = rotation(turn) * camera.camera_from_world;
        camera.translation_mm = -(camera.camera_from_world * centre);
        camera.focal_px *= zoom;
    }
    out
}

/// Rotation about the direction of `v` by its length in radians (Rodrigues); none for a vector of no length.
pub fn rotation(v: DVec3) -> DMat3 {
    let angle = v.length();
    if angle == 0.0 {
        return DMat3::IDENTITY;
    }
    let k = v / angle;
    let cross =
        DMat3::from_cols(DVec3::new(0.0, k.z, -k.y), DVec3::new(-k.z, 0.0, k.x), DVec3::new(k.y, -k.x, 0.0));
    DMat3::IDENTITY + cross * libm::sin(angle) + cross * cross * (1.0 - libm::cos(angle))
}

/// A rectangle at `centre` that faces `target`: centre and half edges, the first at right angles to `up`, or along `right`
/// where the rectangle faces along `up`.
pub(crate) fn rectangle(
    centre: DVec3,
    target: DVec3,
    (up, right): (DVec3, DVec3),
    half: [f64; 2],
) -> (DVec3, DVec3, DVec3) {
    let towards = (target - centre).normalize();
    let u = up.cross(towards).normalize_or(right);
    (centre, u * half[0], towards.cross(u) * half[1])
}

/// The lights, all of one radiance, such that a white diffuse card at the target that faces the reference
/// reflects the radiance asked for.
pub(crate) fn lights(spec: &LightSpec, rig: &RigSpec) -> Vec<AreaLight> {
    let target = DVec3::from_array(rig.target_mm);
    let (right, up, back) = axes(rig);
    let half = 0.5 * spec.edge_mm;
    let placed: Vec<(DVec3, DVec3, DVec3)> = (0..spec.count)
        .map(|i| {
            let a =
                spec.first_deg.to_radians() + std::f64::consts::TAU * f64::from(i) / f64::from(spec.count);
            let offset = right * libm::cos(a) + up * libm::sin(a);
            let centre = target + back * spec.distance_mm + offset * spec.circle_mm;
            rectangle(centre, target, (up, right), [half; 2])
        })
        .collect();
    card_radiance(&placed, target, back, spec.white_card_radiance, spec.colour_rgb)
}

/// Rectangles (centre and half edges) as lights of one radiance, such that a white diffuse card at `target` that faces
/// `facing` reflects `white_card_radiance`.
pub(crate) fn card_radiance(
    placed: &[(DVec3, DVec3, DVec3)],
    target: DVec3,
    facing: DVec3,
    white_card_radiance: f64,
    colour_rgb: [f64; 3],
) -> Vec<AreaLight> {
    // E = Σ L ∫ cos cos / r² dA by midpoints; a white card reflects E / π.
    const GRID: u32 = 8;
    let mut irradiance = 0.0;
    for (centre, u, v) in placed {
        let normal = u.cross(*v).normalize();
        let cell = 4.0 * u.cross(*v).length() / f64::from(GRID * GRID);
        for k in 0..GRID * GRID {
            let at = |n: u32| (f64::from(n) + 0.5) / f64::from(GRID) * 2.0 - 1.0;
            let ray = *centre + *u * at(k % GRID) + *v * at(k / GRID) - target;
            let cosines = (facing.dot(ray)).max(0.0) * (-normal.dot(ray)).max(0.0) / ray.length_squared();
            irradiance += cosines * cell / ray.length_squared();
        }
    }
    let mean = colour_rgb.iter().sum::<f64>() / 3.0;
    let radiance = white_card_radiance * std::f64::consts::PI / irradiance.max(1e-12);
    placed
        .iter()
        .map(|(centre, u, v)| AreaLight {
            centre_mm: single(*centre),
            half_u_mm: single(*u),
            half_v_mm: single(*v),
            radiance_rgb: colour_rgb.map(|c| (radiance * c / mean) as f32),
        })
        .collect()
}

fn single(v: DVec3) -> Vec3 {
    v.as_vec3()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_t_has_its_baselines_and_looks_at_the_target() {
        for (azimuth_deg, elevation_deg) in [(0.0, 0.0), (90.0, 20.0), (180.0, -10.0)] {
            let spec = RigSpec {
                azimuth_deg,
                elevation_deg,
                baseline_x_mm: 120.0,
                baseline_y_mm: 90.0,
                ..RigSpec::default()
            };
            let rig = rig(&spec);
            rig.validate().unwrap();
            let eyes: Vec<DVec3> = rig.cameras.iter().map(Camera::centre_mm).collect();
            assert!((eyes[0].distance(eyes[1]) - 120.0).abs() < 1e-9);
            assert!((eyes[0].distance(eyes[2]) - 120.0).abs() < 1e-9);
            assert!((eyes[0].distance(eyes[3]) - 90.0).abs() < 1e-9);
            let target = DVec3::from_array(spec.target_mm);
            assert!((eyes[0].distance(target) - 900.0).abs() < 1e-9);
            for c in &rig.cameras {
                assert!((c.project(target).unwrap().0 - c.principal_px).length() < 1e-9);
            }
            // Each camera stands where its name says, seen by the reference; the top one is higher up.
            let seen = |i: usize| rig.cameras[0].to_camera(eyes[i]);
            assert!(seen(1).x < -100.0 && seen(2).x > 100.0 && seen(3).y < -80.0);
            assert!(eyes[3].y > eyes[0].y + 80.0);
            if azimuth_deg == 0.0 {
                assert!(
                    eyes[0].z > 890.0 && eyes[2].x > 0.0,
                    "0° sees the face, the subject's left on the right"
                );
            }
        }
    }

    #[test]
    fn calibration_errs_as_asked_and_not_at_all_at_zero() {
        let spec = RigSpec::default();
        let truth = rig(&spec);
        let none = CalibrationError { rotation_mdeg: 0.0, translation_mm: 0.0, focal_relative: 0.0 };
        let target = DVec3::from_array(spec.target_mm);
        let far = |a: &Rig, b: &Rig, i: usize| {
            let p = target + DVec3::new(30.0, 60.0, 20.0);
            (a.cameras[i].project(p).unwrap().0 - b.cameras[i].project(p).unwrap().0).length()
        };
        for i in 0..4 {
            assert!(far(&truth, &calibrated(&truth, &none, 3), i) < 1e-9);
        }
        let (mut sum, n) = (0.0, 200);
        for seed in 0..n {
            let c = calibrated(&truth, &spec.calibration_error, seed);
            c.validate().unwrap();
            assert_eq!(c.cameras[0], truth.cameras[0]);
            sum += (1..4).map(|i| far(&truth, &c, i).powi(2)).sum::<f64>() / 3.0;
        }
        // Two rotations move the image by f · 3e-3° = 0.065 px each, two translations by f / z · 0.05 = 0.069.
        let rms = (sum / n as f64).sqrt();
        let want = (2.0f64 * (0.0654f64.powi(2) + 0.0694f64.powi(2)) * 0.911).sqrt();
        assert!((rms / want - 1.0).abs() < 0.12, "{rms} px against {want} px");
    }

    #[test]
    fn lights_face_the_target_and_give_the_card_its_radiance() {
        let rig = RigSpec { azimuth_deg: 25.0, ..RigSpec::default() };
        let target = Vec3::from_array(rig.target_mm.map(|v| v as f32));
        for l in lights(&LightSpec::default(), &rig) {
            let out = l.half_u_mm.cross(l.half_v_mm).normalize();
            assert!(out.dot((target - l.centre_mm).normalize()) > 0.999);
        }
        // One small light on the axis: E = L A / d², so L = π w d² / A.
        let one = LightSpec {
            count: 1,
            circle_mm: 0.0,
            edge_mm: 10.0,
            distance_mm: 2000.0,
            white_card_radiance: 0.5,
            colour_rgb: [2.0, 1.0, 0.0],
            ..LightSpec::default()
        };
        let got = lights(&one, &rig)[0].radiance_rgb;
        let want = std::f32::consts::PI * 0.5 * 2000.0 * 2000.0 / 100.0;
        assert!((got[0] / (2.0 * want) - 1.0).abs() < 1e-3 && (got[1] / want - 1.0).abs() < 1e-3, "{got:?}");
        assert_eq!(got[2], 0.0);
    }
}

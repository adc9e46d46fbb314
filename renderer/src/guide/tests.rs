use super::*;
use crate::fibre::{FibreModel, FibrePoint};
use strandbench_rng::Rng;
use strandbench_scenes::{AreaLight, FibreOptics};

fn lights() -> Lights {
    let light = |x: f32, y: f32, z: f32, level: f32| AreaLight {
        centre_mm: Vec3::new(x, y, z),
        half_u_mm: Vec3::new(z, 0.0, -x).normalize() * -80.0,
        half_v_mm: Vec3::Y * 60.0,
        radiance_rgb: [level; 3],
    };
    // To the side, far along the fibre, and behind.
    Lights::new(&[
        light(500.0, 100.0, 600.0, 3.0),
        light(30.0, 900.0, 80.0, 500.0),
        light(-400.0, -200.0, -300.0, 2.0),
    ])
    .unwrap()
}

#[test]
fn samples_follow_their_density_which_integrates_to_one() {
    let model = FibreModel::new(&FibreOptics::default()).unwrap();
    let tangent = Vec3::new(0.1, 0.97, -0.2).normalize();
    let normal = tangent.any_orthonormal_vector();
    let at = FibrePoint { tangent, normal, absorption_rgb: [0.1, 0.2, 0.4], major: normal };
    let lobe = Lobe::Fibre(model.toward(&at, Vec3::new(0.4, 0.3, 0.8).normalize()));
    let lights = lights();
    let guide = Guide::new(&lights, Vec3::ZERO, tangent, &lobe);
    assert!(guide.count == 3 && guide.guided > 0.0);
    // Cells of equal solid angle in sine of inclination and azimuth about the fibre.
    let (rows, columns, draws, fine) = (64usize, 32usize, 300_000u32, 8usize);
    let (x, y) = tangent.any_orthonormal_pair();
    let mut expected = vec![0.0f64; rows * columns];
    for (k, e) in expected.iter_mut().enumerate() {
        for a in 0..fine * fine {
            let sub = |n: usize| (n as f32 + 0.5) / fine as f32;
            let sin = 2.0 * ((k / columns) as f32 + sub(a % fine)) / rows as f32 - 1.0;
            let phi = 2.0 * PI * (((k % columns) as f32 + sub(a / fine)) / columns as f32 - 0.5);
            let flat = (1.0 - sin * sin).sqrt();
            let d = tangent * sin + (x * phi.cos() + y * phi.sin()) * flat;
            let lobe_pdf = lobe.eval_pdf(d).1;
            *e += f64::from(guide.pdf(d, lobe_pdf)) * 4.0 * std::f64::consts::PI
                / (rows * columns * fine * fine) as f64;
        }
    }
    let total: f64 = expected.iter().sum();
    // The midpoint rule over cells of an eighth of 1.8 by 11 degrees.
    assert!((total - 1.0).abs() < 2e-3, "{total}");
    let mut counts = vec![0.0f64; rows * columns];
    let mut rng = Rng::keyed(&[5]);
    let mut none = 0.0;
    for _ in 0..draws {
        let u = [rng.f32(), rng.f32(), rng.f32(), rng.f32()];
        let Some(drawn) = guide.sample(&lobe, u) else {
            none += 1.0;
            continue;
        };
        let (eval, lobe_pdf) = lobe.eval_pdf(drawn.to_light);
        assert!((drawn.pdf / guide.pdf(drawn.to_light, lobe_pdf) - 1.0).abs() < 1e-3);
        assert!((drawn.weight_rgb[0] * drawn.pdf - eval[0]).abs() <= 2e-3 * eval[0].max(1e-6));
        let sin = drawn.to_light.dot(tangent);
        let phi = drawn.to_light.dot(y).atan2(drawn.to_light.dot(x)) / (2.0 * PI) + 0.5;
        let row = ((0.5 * (sin + 1.0) * rows as f32) as usize).min(rows - 1);
        counts[row * columns + ((phi * columns as f32) as usize).min(columns - 1)] += 1.0;
    }
    assert!(none < 1e-3 * f64::from(draws), "{none} of {draws} draws give nothing");
    let (mut chi, mut free, mut pool) = (0.0, -1.0f64, (0.0, 0.0));
    for (n, e) in counts.iter().zip(&expected) {
        pool = (pool.0 + n, pool.1 + e * f64::from(draws) / total);
        if pool.1 >= 20.0 {
            chi += (pool.0 - pool.1).powi(2) / pool.1;
            free += 1.0;
            pool = (0.0, 0.0);
        }
    }
    assert!(chi < free + 5.0 * (2.0 * free).sqrt(), "χ² {chi:.0} with {free} degrees of freedom");
}

#[test]
fn a_light_along_the_fibre_leaves_the_density_whole() {
    // Two degrees from the fibre's own direction half of an untruncated inclination would lie beyond the pole: the
    // guide's own density, without the lobe's, must still integrate to one and be what is drawn.
    let model = FibreModel::new(&FibreOptics::default()).unwrap();
    let at = FibrePoint { tangent: Vec3::Y, normal: Vec3::Z, absorption_rgb: [0.1; 3], major: Vec3::X };
    let lobe = Lobe::Fibre(model.toward(&at, Vec3::new(0.2, 0.4, 0.9).normalize()));
    for theta_deg in [88.0f32, -80.0, 0.0] {
        let (sin, cos) = theta_deg.to_radians().sin_cos();
        let to = Vec3::new(0.0, sin, cos);
        let along = AreaLight {
            centre_mm: to * 800.0,
            half_u_mm: Vec3::X * 50.0,
            half_v_mm: Vec3::X.cross(-to) * -50.0,
            radiance_rgb: [10.0; 3],
        };
        let facing = if along.half_u_mm.cross(along.half_v_mm).dot(to) > 0.0 {
            AreaLight { half_u_mm: -along.half_u_mm, ..along }
        } else {
            along
        };
        let guide = Guide::new(&Lights::new(&[facing]).unwrap(), Vec3::ZERO, Vec3::Y, &lobe);
        assert!(guide.guided == GUIDED && guide.count == 1);
        // Over inclination and azimuth, each at 2000 midpoints: the logistic's scales are 0.12 and 0.35 radians.
        let n = 2000;
        let (mut whole, mut upper) = (0.0f64, 0.0f64);
        for i in 0..n {
            let theta = PI * ((i as f32 + 0.5) / n as f32 - 0.5);
            for j in 0..40 {
                let phi = 2.0 * PI * (j as f32 + 0.5) / 40.0;
                let (s, c) = theta.sin_cos();
                let d = Vec3::new(c * phi.sin(), s, c * phi.cos());
                let mass = f64::from(guide.pdf(d, 0.0) / GUIDED * c) * 2.0 * std::f64::consts::PI.powi(2)
                    / f64::from(n * 40);
                whole += mass;
                upper += if theta_deg.signum() * theta > theta_deg.abs().to_radians() { mass } else { 0.0 };
            }
        }
        // Single precision of the angles near the pole, and 40 midpoints over a logistic of 0.35 radians.
        assert!((whole - 1.0).abs() < 2e-3, "{theta_deg}°: {whole}");
        // Share of the directions drawn that lie beyond the light, against the density's.
        let mut rng = Rng::keyed(&[31]);
        let (mut beyond, draws) = (0.0f64, 40_000);
        for _ in 0..draws {
            let u = [GUIDED * 0.999 * rng.f32(), rng.f32(), rng.f32(), rng.f32()];
            let d = guide.sample(&lobe, u).expect("the lobe scatters everywhere").to_light;
            let theta = asin(d.y.clamp(-1.0, 1.0));
            beyond += f64::from(theta_deg.signum() * theta > theta_deg.abs().to_radians()) / f64::from(draws);
        }
        let error = (upper * (1.0 - upper) / f64::from(draws)).sqrt();
        assert!(
            (beyond - upper).abs() < 4.5 * error + 2e-3,
            "{theta_deg}°: {beyond} drawn, {upper} ± {error}"
        );
    }
}

#[test]
fn skin_many_lights_and_no_light_leave_directions_to_scattering() {
    let model = FibreModel::new(&FibreOptics::default()).unwrap();
    let at = FibrePoint { tangent: Vec3::Y, normal: Vec3::Z, absorption_rgb: [0.1; 3], major: Vec3::X };
    let lobe = || Lobe::Fibre(model.toward(&at, Vec3::Z));
    let one = AreaLight {
        centre_mm: Vec3::Z * 500.0,
        half_u_mm: Vec3::NEG_X * 50.0,
        half_v_mm: Vec3::Y * 50.0,
        radiance_rgb: [1.0; 3],
    };
    // Behind the light, above it along the fibre, and with too many of it.
    let guided = |n: usize, point: Vec3| {
        Guide::new(&Lights::new(&vec![one; n]).unwrap(), point, Vec3::Y, &lobe()).guided
    };
    assert_eq!([guided(0, Vec3::ZERO), guided(1, Vec3::Z * 900.0), guided(FEW + 1, Vec3::ZERO)], [0.0; 3]);
    assert_eq!(guided(FEW, Vec3::ZERO), GUIDED);
}

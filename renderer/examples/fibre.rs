//! What the fibre models return and what they cost: `fibre`.
//!
//! Prints the energy of each of Marschner's azimuthal lobes beside that of a smooth cylinder's paths, the share of
//! light that a fibre without absorption returns with and without the paths of p >= 3, and nanoseconds per call.

use glam::Vec3;
use std::f64::consts::PI;
use std::time::Instant;
use strandbench_renderer::marschner::{Fibre, Roots, bravais, reflectance};
use strandbench_renderer::{FibreModel, FibrePoint};
use strandbench_rng::Rng;
use strandbench_scenes::{FibreOptics, OpticsModel};

/// Energy of p = 0, 1, 2 and of all further paths of a smooth cylinder, light uniform in h.
fn cylinder(eta: f64, theta: f64) -> [f64; 4] {
    let (prime, second) = bravais(eta, theta.cos());
    let n = 20_000;
    let mut e = [0.0; 4];
    for i in 0..n {
        let h = 2.0 * (f64::from(i) + 0.5) / f64::from(n) - 1.0;
        let f = reflectance((1.0 - h * h).sqrt(), prime, second);
        let paths = [f, (1.0 - f).powi(2), (1.0 - f).powi(2) * f, (1.0 - f) * f * f];
        for (e, p) in e.iter_mut().zip(paths) {
            *e += p / f64::from(n);
        }
    }
    e
}

fn point(absorption: f32, h: f32) -> FibrePoint {
    FibrePoint {
        tangent: Vec3::Z,
        normal: Vec3::new((1.0 - h * h).sqrt(), h, 0.0),
        absorption_rgb: [absorption; 3],
        major: Vec3::X,
    }
}

fn direction(theta: f64, phi: f64) -> Vec3 {
    let ((st, ct), (sp, cp)) = (theta.sin_cos(), phi.sin_cos());
    Vec3::new((ct * cp) as f32, (ct * sp) as f32, st as f32)
}

/// ∫ eval dω for a camera at inclination `theta`, no absorption.
fn returned(optics: &FibreOptics, theta: f64) -> f64 {
    let model = FibreModel::new(optics).expect("the example's own parameters");
    let toward = model.toward(&point(0.0, 0.0), direction(theta, 0.0));
    let (nt, np) = (1440, 360);
    let mut sum = 0.0;
    for i in 1..nt {
        let t = PI * (f64::from(i) / f64::from(nt) - 0.5);
        let row: f64 = (0..np)
            .map(|j| f64::from(toward.eval(direction(t, 2.0 * PI * (f64::from(j) + 0.5) / f64::from(np)))[0]))
            .sum();
        sum += row * t.cos() * if i % 2 == 1 { 4.0 / 3.0 } else { 2.0 / 3.0 };
    }
    sum * PI / f64::from(nt) * 2.0 * PI / f64::from(np)
}

fn energies() {
    let published = FibreOptics::default();
    let with_rest = FibreOptics { rest: true, ..published };
    let untilted = FibreOptics { shift_r_deg: 0.0, width_r_deg: 1.0, ..published };
    let untilted_rest = FibreOptics { rest: true, ..untilted };
    let fibre = Fibre::new(&with_rest, Roots::Exact).expect("the example's own parameters");
    println!(
        "azimuthal energy of a smooth cylinder (R TT TRT p>=3), and of the model's lobes (TRT smoothed)"
    );
    println!("| θ_d | R | TT | TRT | p>=3 | model R | TT | TRT | rest | lacking | with rest |");
    println!("|---|---|---|---|---|---|---|---|---|---|---|");
    for deg in [0.0f64, 30.0, 60.0, 75.0, 85.0] {
        let theta = deg.to_radians();
        let c = cylinder(1.55, theta);
        let m = fibre.azimuthal_energies(theta as f32).map(f64::from);
        let lacking = 1.0 - m[0] - m[1] - m[2];
        println!(
            "| {deg} | {:.4} | {:.4} | {:.4} | {:.4} | {:.4} | {:.4} | {:.4} | {:.4} | {lacking:.4} | {:.4} |",
            c[0],
            c[1],
            c[2],
            c[3],
            m[0],
            m[1],
            m[2],
            m[3],
            lacking - m[3]
        );
    }
    println!("\nshare of light returned by a fibre without absorption");
    println!("| θ_r | Table 1 | with rest | no shift, β_R 1° | with rest | chiang |");
    println!("|---|---|---|---|---|---|");
    let chiang = FibreOptics { model: OpticsModel::Chiang, ..published };
    for deg in [-60.0f64, -30.0, 0.0, 30.0, 60.0, 80.0] {
        let r = [&published, &with_rest, &untilted, &untilted_rest, &chiang]
            .map(|o| returned(o, deg.to_radians()));
        println!("| {deg} | {:.3} | {:.3} | {:.3} | {:.3} | {:.3} |", r[0], r[1], r[2], r[3], r[4]);
    }
}

fn costs() {
    println!("\nnanoseconds per call, one thread (toward, eval, eval and pdf, sample)");
    let published = FibreOptics::default();
    let cases = [
        ("marschner", published),
        ("marschner with rest", FibreOptics { rest: true, ..published }),
        ("marschner elliptical", FibreOptics { eccentricity: 0.9, ..published }),
        ("chiang", FibreOptics { model: OpticsModel::Chiang, ..published }),
    ];
    let n = 1_000_000u32;
    let mut rng = Rng::keyed(&[1]);
    let mut on_sphere = || {
        let z = rng.range(-1.0, 1.0);
        let phi = rng.range(0.0, std::f32::consts::TAU);
        let r = (1.0 - z * z).sqrt();
        Vec3::new(r * phi.cos(), r * phi.sin(), z)
    };
    let directions: Vec<Vec3> = (0..4096).map(|_| on_sphere()).collect();
    for (name, optics) in cases {
        let model = FibreModel::new(&optics).expect("the example's own parameters");
        let at = |i: u32| directions[i as usize % 4096];
        let mut sum = 0.0f32;
        let mut time = |f: &mut dyn FnMut(u32) -> f32| {
            let clock = Instant::now();
            sum += (0..n).map(&mut *f).sum::<f32>();
            clock.elapsed().as_secs_f64() * 1e9 / f64::from(n)
        };
        let p = point(0.5, 0.3);
        let toward = time(&mut |i| {
            std::hint::black_box(model.toward(&p, std::hint::black_box(at(i))));
            0.0
        });
        let fixed = model.toward(&p, at(0));
        let eval = time(&mut |i| fixed.eval(at(i))[0]);
        let both = time(&mut |i| fixed.eval_pdf(at(i)).1);
        let mut rng = Rng::keyed(&[2]);
        let sample = time(&mut |_| {
            let u = std::array::from_fn(|_| rng.f32());
            fixed.sample(u).map_or(0.0, |s| s.weight_rgb[0])
        });
        println!(
            "{name}: {:.0} {eval:.0} {both:.0} {sample:.0}{}",
            toward,
            if sum.is_nan() { " NaN" } else { "" }
        );
    }
}

fn main() {
    energies();
    costs();
}

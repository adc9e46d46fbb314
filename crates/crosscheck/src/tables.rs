//! Level 2: scattering functions on a grid of directions.

use crate::{Bundle, Case, CrossError, Gate, Size};
use glam::Vec3;
use rayon::prelude::*;
use serde_json::{Value, json};
use strandbench_renderer::fibre::{FibreModel, FibrePoint};
use strandbench_renderer::marschner::{Angles, LOBES};
use strandbench_scenes::{FibreOptics, OpticsModel, OpticsRoots};

/// Largest relative difference with Mitsuba's own Bessel function.
const SAME_BESSEL: f64 = 5e-4;
/// The same with the exact one, which Mitsuba's is up to 0.6 % off.
const EXACT_BESSEL: f64 = 8e-3;
/// Limits on what Marschner's tables leave by interpolation, for round fibres: mean difference over mean,
/// difference of the sums, largest difference over the peak. Measured 4e-4, 1.6e-4 and 1.5e-3; a parameter that
/// is off by 1 % moves the first by 3e-3 or more.
const ROUND: [f64; 3] = [1e-3, 5e-4, 3e-3];
/// The same for elliptical fibres, whose TRT is interpolated over the index as well, near caustics that move
/// with it: measured 6e-3 and 3.3e-4. The largest difference (6 % of the peak) hangs on where the grid meets a
/// caustic and is shown without a limit.
const ELLIPTICAL: [f64; 2] = [1.2e-2, 1e-3];
/// Largest relative difference between two routes to one value in single precision: a table's slope times the
/// error of an azimuth.
const SUM: f64 = 5e-3;
/// Values below this share of a table's largest are compared with that share and not with themselves: single
/// precision has lost them.
const FLOOR: f64 = 1e-5;

/// Pairs of local directions (x across the fibre, y its tangent, z the normal): the grid over (θ_i, φ_i, θ_r, h),
/// where the camera's azimuth from the normal is asin h.
fn grid(size: Size) -> (Vec<Vec3>, Vec<Vec3>) {
    let (n_theta_r, n_h, n_theta_i, n_phi) = match size {
        Size::Fixture => (5, 5, 9, 11),
        Size::Quick => (7, 7, 11, 17),
        Size::Full => (9, 11, 17, 31),
    };
    // Inclinations up to 80 degrees, offsets up to 0.95; nothing is special about the places between.
    let spread = |k: u32, n: u32, end: f64| -end + 2.0 * end * f64::from(k) / f64::from(n - 1);
    let direction = |theta: f64, azimuth: f64| {
        Vec3::new(
            (libm::cos(theta) * libm::sin(azimuth)) as f32,
            libm::sin(theta) as f32,
            (libm::cos(theta) * libm::cos(azimuth)) as f32,
        )
    };
    let (mut to_camera, mut to_light) = (Vec::new(), Vec::new());
    for r in 0..n_theta_r {
        for h in 0..n_h {
            let camera = direction(
                spread(r, n_theta_r, 80f64.to_radians()) + 0.01,
                libm::asin(spread(h, n_h, 0.95) + 0.013),
            );
            for i in 0..n_theta_i {
                for p in 0..n_phi {
                    to_camera.push(camera);
                    let azimuth = std::f64::consts::TAU * (f64::from(p) + 0.37) / f64::from(n_phi);
                    to_light.push(direction(spread(i, n_theta_i, 80f64.to_radians()) - 0.007, azimuth));
                }
            }
        }
    }
    (to_camera, to_light)
}

pub(crate) fn cases(size: Size) -> Vec<Case> {
    let (to_camera, to_light) = grid(size);
    let make = |name: &str, job: &'static str, optics: Vec<Value>| Case {
        level: 2,
        name: name.to_owned(),
        job,
        input: Bundle::new(name)
            .with_vec3("to_camera", &to_camera)
            .with_vec3("to_light", &to_light)
            .with_meta("optics", optics),
    };
    let chiang = |beta_m: f32, beta_n: f32, tilt: f32, index: f32, absorption: [f32; 3]| {
        json!({
            "longitudinal_roughness": beta_m,
            "azimuthal_roughness": beta_n,
            "scale_tilt_deg": tilt,
            "index": index,
            "absorption_rgb": absorption,
        })
    };
    let marschner =
        |index: f32, shift: f32, width: f32, eccentricity: f32, roots: &str, absorption: [f32; 3]| {
            json!({
                "index": index,
                "shift_r_deg": shift,
                "width_r_deg": width,
                "glint_scale": 1.5,
                "caustic_width_deg": 12.0,
                "fade_range": 0.3,
                "caustic_limit": 0.5,
                "eccentricity": eccentricity,
                "roots": roots,
                "absorption_rgb": absorption,
            })
        };
    vec![
        make(
            "chiang",
            "chiang",
            vec![
                chiang(0.28, 0.3, -2.0, 1.55, [0.2, 0.4, 0.8]),
                chiang(0.12, 0.15, -5.0, 1.55, [0.0, 1.0, 4.0]),
                chiang(0.5, 0.6, 3.0, 1.4, [0.05, 0.5, 8.0]),
                chiang(0.2, 0.25, -3.0, 1.55, [0.6, 0.6, 0.6]),
            ],
        ),
        make(
            "marschner",
            "marschner",
            vec![
                marschner(1.55, -7.5, 7.5, 1.0, "exact", [0.0, 0.2, 1.0]),
                marschner(1.55, -5.0, 10.0, 1.0, "cubic", [0.0, 0.2, 1.0]),
                marschner(1.55, -7.5, 7.5, 0.9, "exact", [0.0, 0.2, 1.0]),
            ],
        ),
    ]
}

#[derive(serde::Deserialize)]
struct Chiang {
    longitudinal_roughness: f32,
    azimuthal_roughness: f32,
    scale_tilt_deg: f32,
    index: f32,
    absorption_rgb: [f32; 3],
}

#[derive(serde::Deserialize)]
struct Marschner {
    index: f32,
    shift_r_deg: f32,
    width_r_deg: f32,
    glint_scale: f32,
    caustic_width_deg: f32,
    fade_range: f32,
    caustic_limit: f32,
    eccentricity: f32,
    roots: OpticsRoots,
    absorption_rgb: [f32; 3],
}

/// The optics of a Chiang fibre as the reference jobs are told them, and its absorption.
pub(crate) fn chiang_optics(told: &Value, mitsuba_bessel: bool) -> Result<(FibreOptics, [f32; 3]), String> {
    let c: Chiang = serde_json::from_value(told.clone()).map_err(|e| e.to_string())?;
    let optics = FibreOptics {
        model: OpticsModel::Chiang,
        index: c.index,
        longitudinal_roughness: Some(c.longitudinal_roughness),
        azimuthal_roughness: Some(c.azimuthal_roughness),
        scale_tilt_deg: Some(c.scale_tilt_deg),
        mitsuba_bessel,
        ..FibreOptics::default()
    };
    Ok((optics, c.absorption_rgb))
}

/// The same for a Marschner fibre.
pub(crate) fn marschner_optics(told: &Value) -> Result<(FibreOptics, [f32; 3]), String> {
    let m: Marschner = serde_json::from_value(told.clone()).map_err(|e| e.to_string())?;
    let optics = FibreOptics {
        model: OpticsModel::Marschner,
        index: m.index,
        shift_r_deg: m.shift_r_deg,
        width_r_deg: m.width_r_deg,
        glint_scale: m.glint_scale,
        caustic_width_deg: m.caustic_width_deg,
        fade_range: m.fade_range,
        caustic_limit: m.caustic_limit,
        eccentricity: m.eccentricity,
        roots: m.roots,
        ..FibreOptics::default()
    };
    Ok((optics, m.absorption_rgb))
}

/// The grid's fibre: tangent y, normal z, major axis x.
fn point(absorption_rgb: [f32; 3]) -> FibrePoint {
    FibrePoint { tangent: Vec3::Y, normal: Vec3::Z, absorption_rgb, major: Vec3::X }
}

/// The largest relative difference, and where it is.
struct Differences {
    worst: f64,
    at: String,
}

impl Differences {
    /// Compares tables of equal length; `name` says what an index is.
    fn of(ours: &[f32], theirs: &[f32], name: impl Fn(usize) -> String) -> Differences {
        let peak = theirs.iter().fold(0.0f64, |m, v| m.max(f64::from(v.abs())));
        let mut d = Differences { worst: 0.0, at: String::new() };
        for (i, (a, b)) in ours.iter().zip(theirs).enumerate() {
            let (a, b) = (f64::from(*a), f64::from(*b));
            let off = (a - b).abs() / b.abs().max(FLOOR * peak).max(f64::MIN_POSITIVE);
            // What is not a number is as far off as can be.
            let off = if off.is_nan() { f64::INFINITY } else { off };
            if off > d.worst {
                (d.worst, d.at) = (off, format!("{}: {a:.6e} where the witness says {b:.6e}", name(i)));
            }
        }
        d
    }
}

/// Inclinations and azimuths of a pair, degrees, for messages.
fn place(camera: Vec3, light: Vec3) -> String {
    let angles = |d: Vec3| (d.y.asin().to_degrees(), d.x.atan2(d.z).to_degrees());
    let ((tr, pr), (ti, pi)) = (angles(camera), angles(light));
    format!("θ_r {tr:.1}° φ_r {pr:.1}° θ_i {ti:.1}° φ_i {pi:.1}°")
}

pub(crate) fn judge(case: &Case, answer: &Bundle) -> Result<Vec<Gate>, CrossError> {
    let to_camera = case.input.vec3("to_camera", 0)?;
    let n = to_camera.len();
    let to_light = case.input.vec3("to_light", n)?;
    let told: Vec<Value> = case.input.meta("optics")?;
    if case.job == "chiang" {
        judge_chiang(case, answer, &to_camera, &to_light, &told)
    } else {
        judge_marschner(case, answer, &to_camera, &to_light, &told)
    }
}

fn judge_chiang(
    case: &Case,
    answer: &Bundle,
    to_camera: &[Vec3],
    to_light: &[Vec3],
    told: &[Value],
) -> Result<Vec<Gate>, CrossError> {
    let n = to_camera.len();
    let theirs: Vec<f32> = answer.get("eval", &[told.len(), n, 3])?;
    let densities: Vec<f32> = answer.get("pdf", &[told.len(), n])?;
    let mut gates = vec![
        Gate::shown(2, &case.name, "pairs of directions", n as f64, "pairs")
            .because(format!("{} fibres", told.len())),
    ];
    for (k, told) in told.iter().enumerate() {
        let theirs = &theirs[k * n * 3..(k + 1) * n * 3];
        let densities = &densities[k * n..(k + 1) * n];
        for (same, limit) in [(true, SAME_BESSEL), (false, EXACT_BESSEL)] {
            let (optics, absorption) = chiang_optics(told, same).map_err(CrossError::Ours)?;
            let model = FibreModel::new(&optics).map_err(CrossError::Ours)?;
            let at = point(absorption);
            let (mut value, mut density) = (Vec::new(), Vec::new());
            for (camera, light) in to_camera.iter().zip(to_light) {
                let toward = model.toward(&at, *camera);
                value.extend(toward.eval(*light));
                density.push(toward.pdf(*light));
            }
            let bessel = if same { "Mitsuba's I0" } else { "exact I0" };
            let d = Differences::of(&value, theirs, |i| {
                format!("fibre {k}, {}, channel {}", place(to_camera[i / 3], to_light[i / 3]), i % 3)
            });
            let p = Differences::of(&density, densities, |i| {
                format!("fibre {k}, {}", place(to_camera[i], to_light[i]))
            });
            let gate = |what: &str, d: Differences| {
                let name = format!("fibre {k}, {what}, {bessel}: largest relative");
                Gate::at_most(2, &case.name, &name, d.worst, limit, "").because(d.at)
            };
            gates.push(gate("value", d));
            // Lobes are drawn by luminance there and by the mean of the channels here, which is a choice: the
            // densities are the same function where the channels are equal.
            if absorption.iter().all(|a| *a == absorption[0]) {
                gates.push(gate("density", p));
            }
        }
    }
    Ok(gates)
}

/// Angles of a pair, as Marschner's lobes take them.
fn angles(camera: Vec3, light: Vec3) -> Angles {
    let azimuth = |d: Vec3| f64::from(d.z).atan2(f64::from(d.x));
    let (r, i) = (azimuth(camera), azimuth(light));
    Angles {
        sin_i: light.y,
        sin_r: camera.y,
        cos_phi: libm::cos(r - i) as f32,
        cos_2phi_h: libm::cos(r + i) as f32,
    }
}

fn judge_marschner(
    case: &Case,
    answer: &Bundle,
    to_camera: &[Vec3],
    to_light: &[Vec3],
    told: &[Value],
) -> Result<Vec<Gate>, CrossError> {
    let n = to_camera.len();
    let theirs: Vec<f32> = answer.get("lobes", &[told.len(), n, 3, 3])?;
    let mut gates = vec![
        Gate::shown(2, &case.name, "pairs of directions", n as f64, "pairs")
            .because(format!("{} fibres", told.len())),
    ];
    for (k, told) in told.iter().enumerate() {
        let (optics, absorption) = marschner_optics(told).map_err(CrossError::Ours)?;
        let model = FibreModel::new(&optics).map_err(CrossError::Ours)?;
        let at = point(absorption);
        let FibreModel::Marschner(fibre) = &model else { unreachable!("the optics choose Marschner") };
        // Each lobe, and the sum as shading takes it.
        let values: Vec<([[f32; 3]; LOBES], [f32; 3])> = (0..n)
            .into_par_iter()
            .map(|i| {
                let (camera, light) = (to_camera[i], to_light[i]);
                let cos_i = (1.0 - light.y * light.y).max(0.0).sqrt();
                let lobes = fibre.scatter_lobes(&angles(camera, light), absorption);
                (lobes.map(|l| l.map(|v| v * cos_i)), model.toward(&at, camera).eval(light))
            })
            .collect();
        let sums = Differences::of(
            &values.iter().flat_map(|v| v.1).collect::<Vec<_>>(),
            &values
                .iter()
                .flat_map(|v| [0, 1, 2].map(|c| v.0.iter().map(|l| l[c]).sum()))
                .collect::<Vec<_>>(),
            |i| place(to_camera[i / 3], to_light[i / 3]),
        );
        gates.push(
            Gate::at_most(2, &case.name, &format!("fibre {k}: sum against its lobes"), sums.worst, SUM, "")
                .because(sums.at),
        );
        let round = optics.eccentricity == 1.0;
        for (p, lobe) in ["R", "TT", "TRT"].iter().enumerate() {
            let (mut worst, mut sums, mut peaks) = ((0.0, String::new()), 0.0f64, 0.0f64);
            for c in 0..3 {
                let mine = || values.iter().map(|v| f64::from(v.0[p][c]));
                let other = || (0..n).map(|i| f64::from(theirs[((k * n + i) * 3 + p) * 3 + c]));
                let (total, peak) = other().fold((0.0, 0.0f64), |(t, m), v| (t + v, m.max(v)));
                let off = mine().zip(other()).map(|(a, b)| (a - b).abs()).sum::<f64>() / total;
                let (at, largest) = mine()
                    .zip(other())
                    .map(|(a, b)| (a - b).abs())
                    .enumerate()
                    .fold((0, 0.0), |m, (i, d)| if d > m.1 { (i, d) } else { m });
                if off > worst.0 || off.is_nan() {
                    let where_to = place(to_camera[at], to_light[at]);
                    worst = (off, format!("σ {}; furthest off at {where_to}", absorption[c]));
                }
                sums = sums.max((mine().sum::<f64>() / total - 1.0).abs());
                peaks = peaks.max(largest / peak);
            }
            let limits = if round { [ROUND[0], ROUND[1]] } else { ELLIPTICAL };
            let name = |what: &str| format!("fibre {k}, {lobe}: {what}");
            let gate = |what: &str, value, limit| Gate::at_most(2, &case.name, &name(what), value, limit, "");
            gates.push(gate("mean difference over mean", worst.0, limits[0]).because(worst.1));
            gates.push(gate("difference of the sums", sums, limits[1]));
            let largest = "largest difference over peak";
            gates.push(if round {
                gate(largest, peaks, ROUND[2])
            } else {
                Gate::shown(2, &case.name, &name(largest), peaks, "")
            });
        }
    }
    Ok(gates)
}

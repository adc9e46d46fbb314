//! Level 2: scattering functions on a grid of directions.

mod chiang;
mod marschner;
mod optics;

use crate::{Bundle, Case, CrossError, Gate, Size};
use glam::Vec3;
pub(crate) use optics::{chiang_optics, marschner_optics};
use serde_json::{Value, json};
use strandbench_renderer::fibre::FibrePoint;

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

/// Pairs of directions, and the fibres that they are asked of.
struct Grid {
    to_camera: Vec<Vec3>,
    to_light: Vec<Vec3>,
    told: Vec<Value>,
}

pub(crate) fn judge(case: &Case, answer: &Bundle) -> Result<Vec<Gate>, CrossError> {
    let to_camera = case.input.vec3("to_camera", 0)?;
    let n = to_camera.len();
    let grid =
        Grid { to_light: case.input.vec3("to_light", n)?, told: case.input.meta("optics")?, to_camera };
    let shown = Gate::shown(2, &case.name, "pairs of directions", n as f64, "pairs")
        .because(format!("{} fibres", grid.told.len()));
    let gates = match case.job {
        "chiang" => chiang::judge(case, answer, &grid)?,
        _ => marschner::judge(case, answer, &grid)?,
    };
    Ok([vec![shown], gates].concat())
}

//! Level 0: every camera, its rays and its projections, by both.

use crate::fixed;
use crate::{Bundle, Case, CrossError, Gate, Size};
use glam::{DMat3, DVec2, DVec3};
use serde_json::{Value, json};
use strandbench_rng::Rng;
use strandbench_types::Camera;

/// Largest distance in the image, pixels. Single precision at 640 pixels leaves 2e-4.
const LIMIT_PX: f64 = 1e-3;
/// Distance at which rays are held against each other, mm.
const REACH_MM: f64 = 900.0;

pub(crate) fn described(camera: &Camera) -> Value {
    let r = camera.camera_from_world.transpose();
    json!({
        "name": camera.name,
        "width": camera.width,
        "height": camera.height,
        "focal_px": camera.focal_px.to_array(),
        "principal_px": camera.principal_px.to_array(),
        // The transpose's columns are the matrix' rows.
        "rotation": r.to_cols_array_2d(),
        "translation_mm": camera.translation_mm.to_array(),
    })
}

#[derive(serde::Deserialize)]
struct Described {
    name: String,
    width: u32,
    height: u32,
    focal_px: DVec2,
    principal_px: DVec2,
    rotation: [[f64; 3]; 3],
    translation_mm: DVec3,
}

fn cameras_of(input: &Bundle) -> Result<Vec<Camera>, CrossError> {
    let all: Vec<Described> = input.meta("cameras")?;
    let camera = |d: Described| Camera {
        name: d.name,
        width: d.width,
        height: d.height,
        focal_px: d.focal_px,
        principal_px: d.principal_px,
        camera_from_world: DMat3::from_cols_array_2d(&d.rotation).transpose(),
        translation_mm: d.translation_mm,
    };
    Ok(all.into_iter().map(camera).collect())
}

/// Cameras that no scene file can change: off-centre principal points, near and far, tilted.
fn made_up() -> Vec<Camera> {
    let mut out = vec![fixed::camera(320, 240, 40.0)];
    for i in 0..7u64 {
        let mut rng = Rng::keyed(&[0xCA33, i]);
        let mut u = || rng.f64() * 2.0 - 1.0;
        let eye = DVec3::new(600.0 * u(), 400.0 * u(), 600.0 + 300.0 * u());
        let down = DVec3::new(0.3 * u(), -1.0, 0.3 * u());
        let size = [(640, 480), (1024, 768), (480, 640)][i as usize % 3];
        let target = DVec3::new(30.0 * u(), 40.0 * u(), 20.0 * u());
        let mut camera = Camera::look_at(&format!("c{i}"), size, 900.0 + 500.0 * u(), eye, target, down);
        camera.principal_px += DVec2::new(25.0 * u(), 18.0 * u());
        out.push(camera);
    }
    out
}

/// The cameras of every rig of the catalogue, named by scene and camera; also as calibration believes them.
fn catalogue() -> Result<Vec<Camera>, CrossError> {
    let mut out = Vec::new();
    for entry in strandbench_scenes::catalog() {
        let ours = |e: strandbench_scenes::SceneError| CrossError::Ours(e.to_string());
        // The rig does not depend on how much hair there is.
        let scene =
            strandbench_scenes::build(&entry.spec().map_err(ours)?.with_strands(8), 1, None).map_err(ours)?;
        for (kind, rig) in [("", &scene.rig), (" calibrated", &scene.calibrated_rig)] {
            for camera in &rig.cameras {
                out.push(Camera { name: format!("{} {}{kind}", entry.name, camera.name), ..camera.clone() });
            }
        }
    }
    Ok(out)
}

pub(crate) fn cases(size: Size) -> Result<Vec<Case>, CrossError> {
    let mut out = vec![case("cameras", &made_up())];
    if size != Size::Fixture {
        out.push(case("catalogue-rigs", &catalogue()?));
    }
    Ok(out)
}

fn case(name: &str, cameras: &[Camera]) -> Case {
    // Places in the image as shares of its size, corners and middle among them, and points around the head.
    let shares: Vec<DVec2> =
        (0..=4).flat_map(|y| (0..=4).map(move |x| DVec2::new(x.into(), y.into()) / 4.0)).collect();
    let (w, h) = cameras.iter().fold((u32::MAX, u32::MAX), |(w, h), c| (w.min(c.width), h.min(c.height)));
    let pixels = shares.iter().flat_map(|s| [s.x * f64::from(w), s.y * f64::from(h)]);
    let points: Vec<f64> = (0..40u64)
        .flat_map(|i| {
            let mut rng = Rng::keyed(&[0xCA34, i]);
            [0; 3].map(|_| (rng.f64() * 2.0 - 1.0) * 80.0)
        })
        .collect();
    let input = Bundle::new(name)
        .with("pixels", &[shares.len(), 2], pixels)
        .with("points", &[points.len() / 3, 3], points)
        .with_meta("cameras", cameras.iter().map(described).collect::<Vec<_>>());
    Case { level: 0, name: name.to_owned(), job: "camera", input }
}

pub(crate) fn judge(case: &Case, answer: &Bundle) -> Result<Vec<Gate>, CrossError> {
    let pixels: Vec<DVec2> =
        case.input.get::<f64>("pixels", &[0, 2])?.chunks(2).map(DVec2::from_slice).collect();
    let points: Vec<DVec3> =
        case.input.get::<f64>("points", &[0, 3])?.chunks(3).map(DVec3::from_slice).collect();
    let cameras = cameras_of(&case.input)?;
    let (mut worst_ray, mut worst_point, mut seen) = (0.0f64, 0.0f64, 0u32);
    let mut worst_camera = "";
    for (i, camera) in cameras.iter().enumerate() {
        let origins = answer.vec3(&format!("origins.{i}"), pixels.len())?;
        let directions = answer.vec3(&format!("directions.{i}"), pixels.len())?;
        for ((pixel, o), d) in pixels.iter().zip(origins).zip(directions) {
            let at = o.as_dvec3() + d.as_dvec3() * REACH_MM;
            let off = camera.project(at).map_or(f64::INFINITY, |(p, _)| (p - *pixel).length());
            if off > worst_ray {
                (worst_ray, worst_camera) = (off, &camera.name);
            }
        }
        let projected = answer.get::<f32>(&format!("projected.{i}"), &[points.len(), 2])?;
        for (point, theirs) in points.iter().zip(projected.chunks(2)) {
            let ours = camera.project(*point).map(|(p, _)| p).filter(|p| camera.contains(*p));
            let theirs = DVec2::new(theirs[0].into(), theirs[1].into());
            match (ours, theirs.is_finite()) {
                (Some(p), true) => {
                    seen += 1;
                    worst_point = worst_point.max((p - theirs).length());
                }
                (None, false) => {}
                // In one image and not in the other: fine only at the very edge.
                _ => {
                    let (p, _) = camera.project(*point).unwrap_or((DVec2::INFINITY, 0.0));
                    let (w, h) = (f64::from(camera.width), f64::from(camera.height));
                    let edge = p.x.abs().min((p.x - w).abs()).min(p.y.abs()).min((p.y - h).abs());
                    worst_point = worst_point.max(edge);
                }
            }
        }
    }
    let gate = |what: &str, value| Gate::at_most(0, &case.name, what, value, LIMIT_PX, "px");
    Ok(vec![
        gate("rays, largest distance in the image", worst_ray).because(format!(
            "{} cameras, {} rays each; worst: {worst_camera}",
            cameras.len(),
            pixels.len()
        )),
        gate("projections, largest distance", worst_point)
            .because(format!("{seen} points inside the images")),
        Gate::at_least(0, &case.name, "points that fell into an image", f64::from(seen), 100.0, "points")
            .because("fewer would mean that nothing was compared"),
    ])
}

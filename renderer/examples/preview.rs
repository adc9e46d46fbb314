//! Renders one view of a scene to a colour PNG, to look at.
//!
//! `preview SCENE out.png [--camera N] [--scale S] [--samples N] [--max N]
//! [--azimuth DEG] [--seed N] [--exposure F] [--depth N] [--every N]`
//!
//! SCENE is a name of the catalogue, a `.toml` file, or `demo`, a hand-made tuft. `--exposure` brightens the
//! picture; 1 shows the sensor's full scale as white. `--max` lets noisy pixels take up to that many samples.
//! `--scale` multiplies image size and focal length; `--azimuth` turns the camera about the vertical axis through
//! the scene's middle. `--depth` limits the scatterings of a path; one ray in `--every` is followed.

#[path = "preview/demo.rs"]
mod demo;

use glam::{DMat3, Vec3};
use std::path::Path;
use std::process::ExitCode;
use strandbench_renderer::{RenderScene, Settings};
use strandbench_scenes::{Scene, build, catalog, parse};
use strandbench_types::{Camera, Silent};

struct Options {
    scene: String,
    out: String,
    camera: usize,
    scale: f64,
    samples: u32,
    max: u32,
    azimuth_deg: f64,
    seed: u64,
    exposure: f32,
    depth: u32,
    every: u32,
}

fn options() -> Result<Options, String> {
    let mut o = Options {
        scene: String::new(),
        out: String::new(),
        camera: 0,
        scale: 1.0,
        samples: 16,
        max: 0,
        azimuth_deg: 0.0,
        seed: 1,
        exposure: 1.0,
        depth: Settings::default().depth,
        every: Settings::default().indirect_every,
    };
    let mut free = Vec::new();
    let mut args = std::env::args().skip(1);
    while let Some(a) = args.next() {
        let Some(name) = a.strip_prefix("--") else {
            free.push(a);
            continue;
        };
        let value = args.next().ok_or(format!("--{name} needs a value"))?;
        let bad = |e: &dyn std::fmt::Display| format!("--{name} {value}: {e}");
        match name {
            "camera" => o.camera = value.parse().map_err(|e| bad(&e))?,
            "scale" => o.scale = value.parse().map_err(|e| bad(&e))?,
            "samples" => o.samples = value.parse().map_err(|e| bad(&e))?,
            "max" => o.max = value.parse().map_err(|e| bad(&e))?,
            "azimuth" => o.azimuth_deg = value.parse().map_err(|e| bad(&e))?,
            "seed" => o.seed = value.parse().map_err(|e| bad(&e))?,
            "exposure" => o.exposure = value.parse().map_err(|e| bad(&e))?,
            "depth" => o.depth = value.parse().map_err(|e| bad(&e))?,
            "every" => o.every = value.parse().map_err(|e| bad(&e))?,
            _ => return Err(format!("unknown option --{name}")),
        }
    }
    match <[String; 2]>::try_from(free) {
        Ok([scene, out]) => Ok(Options { scene, out, ..o }),
        Err(_) => {
            Err("usage: preview SCENE out.png [--camera N] [--scale S] [--samples N] [--azimuth DEG]".into())
        }
    }
}

fn load(name: &str, seed: u64) -> Result<Scene, String> {
    if name == "demo" {
        return Ok(demo::tuft());
    }
    let path = Path::new(name);
    let spec = if name.ends_with(".toml") {
        let text = std::fs::read_to_string(path).map_err(|e| format!("{name}: {e}"))?;
        parse(&text, path).map_err(|e| e.to_string())?
    } else {
        let known = || catalog().iter().map(|e| e.name).collect::<Vec<_>>().join(", ");
        let entry = catalog().iter().find(|e| e.name == name);
        let entry = entry
            .ok_or_else(|| format!("scene {name} is neither a .toml file nor one of: demo, {}", known()))?;
        entry.spec().map_err(|e| e.to_string())?
    };
    build(&spec, seed, path.parent()).map_err(|e| e.to_string())
}

/// The camera with image size and focal length scaled, turned about the vertical through `middle`.
fn adjusted(c: &Camera, scale: f64, azimuth_deg: f64, middle: Vec3) -> Camera {
    let turn = DMat3::from_rotation_y(azimuth_deg.to_radians());
    let m = middle.as_dvec3();
    let rotation = c.camera_from_world * turn.transpose();
    let eye = turn * (c.centre_mm() - m) + m;
    Camera {
        name: c.name.clone(),
        width: ((f64::from(c.width) * scale).round() as u32).max(1),
        height: ((f64::from(c.height) * scale).round() as u32).max(1),
        focal_px: c.focal_px * scale,
        principal_px: c.principal_px * scale,
        camera_from_world: rotation,
        translation_mm: -(rotation * eye),
    }
}

/// The sRGB transfer curve, after exposure to the sensor's full scale.
fn to_srgb(v: f32) -> u8 {
    let v = v.clamp(0.0, 1.0);
    let s = if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
    (s * 255.0 + 0.5) as u8
}

fn run() -> Result<(), String> {
    let o = options()?;
    let clock = std::time::Instant::now();
    let mut scene = load(&o.scene, o.seed)?;
    scene.sensor.full_scale_radiance /= o.exposure;
    let cameras = scene.rig.cameras.len();
    let camera = scene.rig.cameras.get(o.camera).ok_or(format!("the rig has {cameras} cameras"))?;
    let n = scene.strands.points.len().max(1);
    let middle = scene.strands.points.iter().map(|p| p.as_dvec3()).sum::<glam::DVec3>() / n as f64;
    scene.rig.cameras[o.camera] = adjusted(camera, o.scale, o.azimuth_deg, middle.as_vec3());
    eprintln!("scene: {} strands, {n} points, {:.1} s", scene.strands.len(), clock.elapsed().as_secs_f64());
    let clock = std::time::Instant::now();
    let prepared = RenderScene::new(&scene).map_err(|e| e.to_string())?;
    eprintln!("build: {:.2} s", clock.elapsed().as_secs_f64());
    let settings = Settings {
        samples_per_pixel: o.samples,
        max_samples_per_pixel: o.max.max(o.samples),
        depth: o.depth,
        indirect_every: o.every,
        ..Settings::default()
    };
    let view = prepared.render(o.camera, &settings, o.seed, &Silent).map_err(|e| e.to_string())?;
    let s = &view.stats;
    eprintln!(
        "render: {:.2} s, {:.2} M camera rays, {:.2} M shadow rays, {:.2} M bounce rays, {:.1} % of pixels converged",
        s.wall_s,
        s.primary_rays as f64 / 1e6,
        s.shadow_rays as f64 / 1e6,
        s.bounce_rays as f64 / 1e6,
        s.converged * 100.0
    );
    let (w, h) = view.radiance_rgb.size();
    let full = scene.sensor.full_scale_radiance;
    let bytes = view.radiance_rgb.data.iter().flat_map(|c| c.map(|v| to_srgb(v / full))).collect();
    let image = image::RgbImage::from_raw(w as u32, h as u32, bytes).ok_or("image size")?;
    image.save(&o.out).map_err(|e| format!("{}: {e}", o.out))
}

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("preview: {e}");
            ExitCode::FAILURE
        }
    }
}

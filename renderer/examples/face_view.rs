//! Renders one camera's view of a face of the catalogue, or of a scene file, to look at.
//!
//! `face_view OUT.png SCENE [CAMERA] [WIDTH_PX] [TIME_S] [SAMPLES] [PIXEL_MM X Y Z]`
//!
//! CAMERA is a name of the rig (`front-up-a`, `left-a`, `hair-left`, ...). With PIXEL_MM the view is a close-up of that scale at
//! the point X Y Z, mm.

use std::path::Path;
use strandbench_renderer::{RenderScene, Settings, expose_rgb};
use strandbench_scenes::face::{FaceScene, FaceStage, catalog};
use strandbench_types::Silent;

fn srgb(v: f32) -> u8 {
    let v = v.clamp(0.0, 1.0);
    let s = if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
    (s * 255.0 + 0.5) as u8
}

fn run() -> Result<(), String> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let number = |i: usize, default: f64| -> Result<f64, String> {
        args.get(i).map_or(Ok(default), |a| a.parse().map_err(|e| format!("{a}: {e}")))
    };
    let (Some(out), Some(name)) = (args.first(), args.get(1)) else {
        return Err(
            "usage: face_view OUT.png SCENE [CAMERA] [WIDTH_PX] [TIME_S] [SAMPLES] [PIXEL_MM X Y Z]".into()
        );
    };
    let text = match catalog().iter().find(|e| e.name == name) {
        Some(entry) => entry.toml.to_owned(),
        None => std::fs::read_to_string(name).map_err(|e| format!("{name}: {e}"))?,
    };
    let mut spec = FaceScene::parse(&text, Path::new(name)).map_err(|e| e.to_string())?;
    let width = number(3, 600.0)? as u32;
    (spec.rig.width_px, spec.rig.height_px) = (Some(width), Some(width * 4 / 3));
    if args.len() > 6 {
        spec.rig.pixel_mm = Some(number(6, 0.1)?);
        spec.rig.height_px = Some(width);
        spec.rig.target_mm = Some([number(7, 0.0)?, number(8, -60.0)?, number(9, 60.0)?]);
    }
    let clock = std::time::Instant::now();
    let stage = FaceStage::new(&spec, 1, None).map_err(|e| e.to_string())?;
    eprintln!("{} hairs grown in {:.2} s", stage.hair.kinds.len(), clock.elapsed().as_secs_f64());
    let clock = std::time::Instant::now();
    let moment = stage.moment(number(4, 0.0)?).map_err(|e| e.to_string())?;
    eprintln!("posed in {:.2} s", clock.elapsed().as_secs_f64());
    let scene = &moment.scene;
    let wanted = args.get(2).map_or("front-up-a", String::as_str);
    let camera =
        scene.rig.cameras.iter().position(|c| c.name == wanted).ok_or(format!("no camera {wanted}"))?;
    let samples = number(5, 16.0)? as u32;
    let settings = Settings {
        samples_per_pixel: samples,
        max_samples_per_pixel: samples,
        depth: 4,
        ..Settings::default()
    };
    let clock = std::time::Instant::now();
    let prepared = RenderScene::new(scene).map_err(|e| e.to_string())?;
    eprintln!("prepared in {:.2} s", clock.elapsed().as_secs_f64());
    let view = prepared.render(camera, &settings, 1, &Silent).map_err(|e| e.to_string())?;
    eprintln!("rendered in {:.2} s", view.stats.wall_s);
    let image = expose_rgb(&scene.sensor, camera, &view.radiance_rgb, 1);
    let (w, h) = image.size();
    let bytes = image.data.iter().flat_map(|c| c.map(srgb)).collect();
    let picture = image::RgbImage::from_raw(w as u32, h as u32, bytes).expect("three bytes a pixel");
    picture.save(out).map_err(|e| format!("{out}: {e}"))
}

fn main() -> std::process::ExitCode {
    match run() {
        Ok(()) => std::process::ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("face_view: {e}");
            std::process::ExitCode::FAILURE
        }
    }
}

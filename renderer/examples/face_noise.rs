//! How far a face's renders are from converged: the difference between renders of two seeds, beside the sensor's noise and
//! beside the renderer's own estimate; and what both differ by from renders whose shadows are not kept.
//!
//! `face_noise SCENE CAMERA X Y Z SPACING RAYS...`: a close-up of 128 x 128 pixels of 0.13 mm at the point X Y Z, mm, with
//! `shadow_spacing_px` of SPACING and each of the numbers as `max_samples_per_pixel`, from eight rays a pixel on. Variances are
//! relative to the sensor's, per channel: 1 is as much noise as the sensor's. Bias is the product of two seeds' differences from
//! two references, in the same unit: no noise is in its mean, and it may come out below 0.

use std::path::Path;
use strandbench_renderer::{Render, RenderScene, Settings, noise_variance};
use strandbench_scenes::face::{FaceScene, FaceStage, catalog};
use strandbench_types::Silent;

const SIDE_PX: u32 = 128;
const PIXEL_MM: f64 = 0.13;
const REFERENCE_RAYS: u32 = 128;
const FIRST_RAYS: u32 = 8;
const KINDS: [&str; 3] = ["skin", "hair in part", "hair"];

fn run() -> Result<(), String> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [name, camera, x, y, z, spacing, rays @ ..] = args.as_slice() else {
        return Err("usage: face_noise SCENE CAMERA X Y Z SPACING RAYS...".into());
    };
    let number = |a: &String| a.parse::<f64>().map_err(|e| format!("{a}: {e}"));
    let entry = catalog().iter().find(|e| e.name == name).ok_or(format!("no scene {name}"))?;
    let mut spec = FaceScene::parse(entry.toml, Path::new(name)).map_err(|e| e.to_string())?;
    (spec.rig.width_px, spec.rig.height_px) = (Some(SIDE_PX), Some(SIDE_PX));
    spec.rig.pixel_mm = Some(PIXEL_MM);
    spec.rig.target_mm = Some([number(x)?, number(y)?, number(z)?]);
    let stage = FaceStage::new(&spec, 1, None).map_err(|e| e.to_string())?;
    let moment = stage.moment(1.0).map_err(|e| e.to_string())?;
    let scene = &moment.scene;
    let found = scene.rig.cameras.iter().position(|c| c.name == *camera);
    let camera = found.ok_or(format!("no camera {camera}"))?;
    let prepared = RenderScene::new(scene).map_err(|e| e.to_string())?;
    let spacing = number(spacing)? as f32;
    let render = |rays: u32, seed: u64, adaptive: bool| -> Result<Render, String> {
        let settings = Settings {
            sensor_noise: if adaptive { 1.0 } else { 0.0 },
            samples_per_pixel: if adaptive { rays.min(FIRST_RAYS) } else { rays },
            max_samples_per_pixel: rays,
            shadow_spacing_px: if adaptive { spacing } else { 0.0 },
            depth: 4,
            indirect_every: 1,
            ..Settings::default()
        };
        prepared.prepare(&settings, seed, &Silent).map_err(|e| e.to_string())?;
        prepared.render(camera, &settings, seed, &Silent).map_err(|e| e.to_string())
    };
    let references = [render(REFERENCE_RAYS, 98, false)?, render(REFERENCE_RAYS, 99, false)?];
    let full = f64::from(scene.sensor.full_scale_radiance);
    let weights: f32 = scene.sensor.response_rgb.iter().sum();
    for rays in rays {
        let rays = rays.parse().map_err(|e| format!("{rays}: {e}"))?;
        let [a, b] = [render(rays, 1, true)?, render(rays, 2, true)?];
        // Indexed [kind]: pixels, error, the renderer's estimate, pixels within the sensor's noise in all channels, bias.
        let mut sums = [[0.0f64; 5]; KINDS.len()];
        for i in 0..a.radiance_rgb.data.len() {
            let [first, second] = [0, 1].map(|k: usize| references[k].radiance_rgb.data[i]);
            let truth: [f32; 3] = std::array::from_fn(|c| 0.5 * (first[c] + second[c]));
            if truth == scene.background_rgb {
                continue;
            }
            let hair = references[0].hits.pixel(i).len() as f64 / f64::from(REFERENCE_RAYS);
            let sum = &mut sums[if hair == 0.0 { 0 } else { 1 + usize::from(hair > 0.9) }];
            let (mut error, mut noise, mut within, mut bias) = (0.0, 0.0, true, 0.0);
            for c in 0..3 {
                let sensor = noise_variance(&scene.sensor, f64::from(truth[c]) / full);
                let of = |r: &Render| f64::from(r.radiance_rgb.data[i][c]) / full;
                error += (of(&a) - of(&b)).powi(2) * 0.5 / sensor / 3.0;
                noise += sensor / 3.0;
                let off = |r: &Render, from: [f32; 3]| of(r) - f64::from(from[c]) / full;
                bias += off(&a, first) * off(&b, second) / sensor / 3.0;
                within &= (of(&a) - f64::from(truth[c]) / full).powi(2) <= sensor;
            }
            // The estimate is of the sum of the channels by their weights.
            let estimate = f64::from(a.variance.data[i]) / (full * f64::from(weights)).powi(2);
            for (s, v) in sum.iter_mut().zip([1.0, error, estimate / noise, f64::from(within), bias]) {
                *s += v;
            }
        }
        println!(
            "at most {rays} samples: {:.2} s, then {:.2} s; {:.1} million shadow rays",
            a.stats.wall_s,
            b.stats.wall_s,
            a.stats.shadow_rays as f64 / 1e6
        );
        for (kind, [n, error, estimate, within, bias]) in KINDS.iter().zip(sums).filter(|(_, s)| s[0] > 0.0) {
            let (error, estimate, within, bias) = (error / n, estimate / n, 100.0 * within / n, bias / n);
            println!(
                "  {kind:12} {n:6} px: {error:8.2} times the sensor's variance (estimated {estimate:8.2}), bias {bias:6.2}; {within:5.1} % of pixels within its noise"
            );
        }
    }
    Ok(())
}

fn main() -> std::process::ExitCode {
    match run() {
        Ok(()) => std::process::ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("face_noise: {e}");
            std::process::ExitCode::FAILURE
        }
    }
}

//! Pictures of an estimate for people, and its diagnostics on the terminal.

use image::{GrayImage, RgbImage};
use std::path::Path;
use strandbench_recon::Reconstruction;
use strandbench_types::{Frame, Plane, Rig};

type Failure = Box<dyn std::error::Error>;

/// Writes the images, orientation (hue is twice the line's angle) and depth, and prints times and energies.
pub fn write_all(out: &Path, rig: &Rig, frame: &Frame, r: &Reconstruction) -> Result<(), Failure> {
    let d = &r.diagnostics;
    let total: f64 = d.stages.iter().map(|s| s.wall_s).sum();
    for s in &d.stages {
        println!("  {:<12} {:7.3} s", s.name, s.wall_s);
    }
    println!(
        "  {:<12} {total:7.3} s; energy {:.1}, bound {:?}, gap {:?}; {} labels of {:.2} mm",
        "total", d.energy, d.lower_bound, d.gap, d.labels, d.label_step_mm
    );
    for (camera, image) in rig.cameras.iter().zip(&frame.images) {
        let top = image.data.iter().copied().fold(1e-6, f32::max);
        let grey = image.data.iter().map(|v| ((v / top).max(0.0).sqrt() * 255.0) as u8).collect();
        save_grey(&out.join(format!("image_{}.png", camera.name)), image.size(), grey)?;
    }
    if let Some(o) = &r.estimate.orientation {
        let rgb = (0..o.re.data.len()).flat_map(|i| match o.line(i) {
            Some((angle, strength)) => hue(angle / std::f32::consts::PI, strength.min(1.0)),
            None => [0; 3],
        });
        save_rgb(&out.join("orientation.png"), o.size(), rgb.collect())?;
    }
    if let Some(depth) = &r.estimate.depth {
        save_grey(&out.join("depth.png"), depth.size(), shades(depth.raw(), rig))?;
        save_grey(&out.join("relief.png"), depth.size(), relief(depth.raw(), rig))?;
    }
    Ok(())
}

fn shades(depth: &Plane<f32>, rig: &Rig) -> Vec<u8> {
    let (near, far) = (rig.near_mm as f32, rig.far_mm as f32);
    let shade = |z: &f32| if z.is_nan() { 0 } else { (255.0 - 225.0 * ((z - near) / (far - near))) as u8 };
    depth.data.iter().map(shade).collect()
}

/// The surface lit from the upper left.
fn relief(depth: &Plane<f32>, rig: &Rig) -> Vec<u8> {
    let (w, h) = depth.size();
    let focal = rig.cameras[0].focal_px.x as f32;
    (0..w * h)
        .map(|i| {
            let (x, y) = (i % w, i / w);
            if x == 0 || y == 0 {
                return 0;
            }
            let z = depth.data[i];
            let pitch = z / focal;
            let (gx, gy) = ((z - depth.data[i - 1]) / pitch, (z - depth.data[i - w]) / pitch);
            let n = (gx * gx + gy * gy + 1.0).sqrt();
            let lit = (0.5 * gx + 0.5 * gy + 0.7) / n;
            if lit.is_nan() { 0 } else { (lit.clamp(0.03, 1.0) * 255.0) as u8 }
        })
        .collect()
}

fn hue(turn: f32, value: f32) -> [u8; 3] {
    let channel = |shift: f32| {
        let t = (turn + shift).fract() * 6.0;
        (((t - 3.0).abs() - 1.0).clamp(0.0, 1.0) * value * 255.0) as u8
    };
    [channel(0.0), channel(2.0 / 3.0), channel(1.0 / 3.0)]
}

fn save_grey(path: &Path, (w, h): (usize, usize), data: Vec<u8>) -> Result<(), Failure> {
    let image = GrayImage::from_raw(w as u32, h as u32, data).ok_or("wrong size")?;
    Ok(image.save(path)?)
}

fn save_rgb(path: &Path, (w, h): (usize, usize), data: Vec<u8>) -> Result<(), Failure> {
    let image = RgbImage::from_raw(w as u32, h as u32, data).ok_or("wrong size")?;
    Ok(image.save(path)?)
}

//! Frame folders of a sequence through the method: stage times, notes, and strands drawn over the input.
//!
//! `cargo run --release -p strandbench-recon --example sequence -- OUT_DIR VARIANT [key=value ...] FRAME_DIR ...`

use image::{Rgb, RgbImage};
use std::path::{Path, PathBuf};
use strandbench_recon::{SequenceReconstructor, Variant};
use strandbench_types::{Camera, Frame, Silent, StrandSet};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut args = std::env::args().skip(1);
    let usage = "usage: sequence OUT_DIR VARIANT [key=value ...] FRAME_DIR ...";
    let out = PathBuf::from(args.next().ok_or(usage)?);
    let mut variant = Variant::named(&args.next().ok_or(usage)?)?;
    let mut folders = Vec::new();
    for arg in args {
        match arg.split_once('=') {
            Some((key, value)) => variant = variant.with(key, value)?,
            None => folders.push(PathBuf::from(arg)),
        }
    }
    std::fs::create_dir_all(&out)?;
    let mut sequence = None;
    let mut frames = Vec::new();
    let mut answers = Vec::new();
    for (i, folder) in folders.iter().enumerate() {
        let (rig, mut frame) = strandbench_io::read_frame(folder)?;
        frame.index = i as u32;
        if sequence.is_none() {
            sequence = Some((SequenceReconstructor::new(&rig, &variant)?, rig));
        }
        let (s, _) = sequence.as_mut().ok_or(usage)?;
        answers.extend(s.push(&frame, &Silent)?);
        frames.push(frame);
    }
    let (s, rig) = sequence.ok_or(usage)?;
    answers.extend(s.finish(&Silent)?);
    for a in answers {
        let r = a.outcome?;
        println!("frame {}", a.frame_index);
        for stage in &r.diagnostics.stages {
            println!("  {:<16} {:6.2} s", stage.name, stage.wall_s);
        }
        r.diagnostics.notes.iter().for_each(|n| println!("  {n}"));
        if let Some(strands) = &r.estimate.strands {
            let path = out.join(format!("strands_{:03}.png", a.frame_index));
            draw(&path, &rig.cameras[0], &frames[a.frame_index as usize], strands)?;
            let ids = r.estimate.strand_ids.as_deref().unwrap_or(&[]);
            draw_side(&out.join(format!("side_{:03}.png", a.frame_index)), strands, ids)?;
        }
        strandbench_io::write_estimate(&out.join(format!("estimate_{:03}", a.frame_index)), &r.estimate)?;
    }
    Ok(())
}

/// Strands over the darkened input, coloured by direction in the image; every twentieth of them, beside the input.
fn draw(path: &Path, camera: &Camera, frame: &Frame, strands: &StrandSet) -> Result<(), image::ImageError> {
    let (w, h) = (camera.width, camera.height);
    let mut picture = RgbImage::new(2 * w, h);
    for (i, v) in frame.images[0].data.iter().enumerate() {
        let (x, y) = (i as u32 % w, i as u32 / w);
        let full = (v.max(0.0).sqrt() * 255.0).min(255.0) as u8;
        picture.put_pixel(x, y, Rgb([full; 3]));
        picture.put_pixel(w + x, y, Rgb([full / 4; 3]));
    }
    for i in (0..strands.len()).step_by(20) {
        for pair in strands.strand(i).windows(2) {
            let ends = [pair[0], pair[1]].map(|p| camera.project(p.as_dvec3()));
            let [Some((a, _)), Some((b, _))] = ends else { continue };
            let angle = 2.0 * (b - a).y.atan2((b - a).x);
            let tone = |shift: f64| (127.0 + 127.0 * (angle + shift).cos()) as u8;
            let colour = Rgb([tone(0.0), tone(2.1), tone(4.2)]);
            for k in 0..4 {
                let q = a + (b - a) * f64::from(k) / 4.0;
                if camera.contains(q) {
                    picture.put_pixel(w + q.x as u32, q.y as u32, colour);
                }
            }
        }
    }
    picture.save(path)
}

/// Every tenth strand from the reference camera's left, two pixels a millimetre: surface strands light, interior ones dark.
fn draw_side(path: &Path, strands: &StrandSet, ids: &[u64]) -> Result<(), image::ImageError> {
    let (side, scale) = (800u32, 2.0);
    let mut picture = RgbImage::new(side, side);
    for (i, &id) in ids.iter().enumerate().step_by(10) {
        let colour = if id >> 32 > 0 { Rgb([230, 210, 150]) } else { Rgb([70, 110, 190]) };
        for p in strands.strand(i) {
            let (x, y) = (400.0 + p.z * scale, 400.0 - p.y * scale);
            if x >= 0.0 && y >= 0.0 && x < side as f32 && y < side as f32 {
                picture.put_pixel(x as u32, y as u32, colour);
            }
        }
    }
    picture.save(path)
}

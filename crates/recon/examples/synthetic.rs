//! Streaks on a sphere through the whole method: error in mm, stage times, pictures.
//!
//! `cargo run --release -p strandbench-recon --example synthetic -- OUT_DIR [variant] [key=value ...]`

#[path = "../tests/common/mod.rs"]
mod common;
#[path = "pictures/mod.rs"]
mod pictures;

use std::path::PathBuf;
use strandbench_recon::{Variant, reconstruct};
use strandbench_types::Silent;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut args = std::env::args().skip(1);
    let out = PathBuf::from(args.next().ok_or("usage: synthetic OUT_DIR [variant] [key=value ...]")?);
    let mut variant = Variant::named(&args.next().unwrap_or_else(|| "luo".into()))?;
    for arg in args {
        let (key, value) = arg.split_once('=').ok_or("overrides are key=value")?;
        variant = variant.with(key, value)?;
    }
    std::fs::create_dir_all(&out)?;
    let rig = common::rig((640, 480), 1440.0, 120.0);
    let shape = common::Shape::Sphere { radius_mm: 115.0 };
    let frame = common::frame(&rig, shape, common::Streaks { seed: 1, width_mm: 0.8, wave_mm: 3.0 }, 3);
    let result = reconstruct(&rig, &frame, &variant, &Silent)?;
    let depth = result.estimate.depth.as_ref().ok_or("no depth")?;
    let e = common::errors_mm(&rig, shape, &frame.masks[0], depth, 2);
    println!(
        "{}: median {:.2} mm, p90 {:.2}, p95 {:.2}, within 10 mm {:.4}",
        variant.name,
        common::quantile(&e, 0.5),
        common::quantile(&e, 0.9),
        common::quantile(&e, 0.95),
        e.iter().filter(|v| **v < 10.0).count() as f64 / e.len() as f64,
    );
    pictures::write_all(&out, &rig, &frame, &result)?;
    Ok(())
}

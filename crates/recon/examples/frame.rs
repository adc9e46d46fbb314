//! A frame folder through the method: stage times, energies, pictures of orientation and depth.
//!
//! `cargo run --release -p strandbench-recon --example frame -- FRAME_DIR OUT_DIR [variant] [key=value ...]`

#[path = "pictures/mod.rs"]
mod pictures;

use std::path::PathBuf;
use strandbench_recon::{Variant, reconstruct};
use strandbench_types::Silent;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut args = std::env::args().skip(1);
    let usage = "usage: frame FRAME_DIR OUT_DIR [variant] [key=value ...]";
    let (frame, out) = (args.next().ok_or(usage)?, PathBuf::from(args.next().ok_or(usage)?));
    let mut variant = Variant::named(&args.next().unwrap_or_else(|| "luo".into()))?;
    for arg in args {
        let (key, value) = arg.split_once('=').ok_or("overrides are key=value")?;
        variant = variant.with(key, value)?;
    }
    let (rig, frame) = strandbench_io::read_frame(frame.as_ref())?;
    std::fs::create_dir_all(&out)?;
    let result = reconstruct(&rig, &frame, &variant, &Silent)?;
    pictures::write_all(&out, &rig, &frame, &result)
}

//! How much flicker temporal de-noising takes from a head at rest under camera noise, a line a setting.
//!
//! `cargo run --release -p strandbench-recon --example denoise -- FRAME_DIR NOISE [key=value ...]`
//!
//! The frame is seen five times, each time with Gaussian noise of its own (NOISE at full scale 1); what changes from
//! frame to frame in a pixel's depth is noise.

use strandbench_recon::surface::FrameSurface;
use strandbench_recon::temporal::{FrameTracker, average};
use strandbench_recon::{LUO, TemporalParameters, reconstruct};
use strandbench_rng::Rng;
use strandbench_types::{DepthMap, Silent};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut args = std::env::args().skip(1);
    let usage = "usage: denoise FRAME_DIR NOISE [key=value ...]";
    let (rig, frame) = strandbench_io::read_frame(args.next().ok_or(usage)?.as_ref())?;
    let noise: f32 = args.next().ok_or(usage)?.parse()?;
    let mut variant = LUO;
    for arg in args {
        let (key, value) = arg.split_once('=').ok_or(usage)?;
        variant = variant.with(key, value)?;
    }
    let camera = &rig.cameras[0];
    let mut raw = Vec::new();
    for k in 0..5u32 {
        let mut seen = frame.clone();
        seen.index = k;
        for (c, image) in seen.images.iter_mut().enumerate() {
            for (i, v) in image.data.iter_mut().enumerate() {
                let mut rng = Rng::keyed(&[u64::from(k), c as u64, i as u64]);
                *v += noise * ((0..12).map(|_| rng.f32()).sum::<f32>() - 6.0);
            }
        }
        let depth = reconstruct(&rig, &seen, &variant, &Silent)?.estimate.depth.ok_or("no depth")?;
        raw.push(FrameSurface::new(camera, k, depth, variant.parameters.cut_mm)?);
    }
    let maps: Vec<DepthMap> = raw[1..4].iter().map(|s| s.depth.clone()).collect();
    let [p50, p95] = flicker_mm(&maps);
    println!("by itself                    flicker p50 {p50:.3} mm, p95 {p95:.3} mm");
    let own = variant.temporal;
    let rows = [
        ("as set", own),
        ("rigid_end 10, smooth_end 1", TemporalParameters { rigid_end: 10.0, smooth_end: 1.0, ..own }),
        ("rigid_end 100, smooth_end 10", TemporalParameters { rigid_end: 100.0, smooth_end: 10.0, ..own }),
        (
            "rigid_end 1000, smooth_end 100",
            TemporalParameters { rigid_end: 1000.0, smooth_end: 100.0, ..own },
        ),
        ("node_spacing_mm 30", TemporalParameters { node_spacing_mm: 30.0, samples_per_node: 80, ..own }),
    ];
    for (name, p) in rows {
        let start = std::time::Instant::now();
        let mut maps = Vec::new();
        for k in 1..4 {
            let mut tracker = FrameTracker::new(camera, &raw[k], &p)?;
            let found = [k - 1, k + 1].map(|o| tracker.find(&raw[o], &Silent));
            let [before, after] = found;
            maps.push(average(&raw[k], &[&before?, &after?]));
        }
        let [p50, p95] = flicker_mm(&maps);
        let wall = start.elapsed().as_secs_f64() / 3.0;
        println!("{name:<30} flicker p50 {p50:.3} mm, p95 {p95:.3} mm, {wall:.2} s a frame");
    }
    Ok(())
}

/// Median and 95 % quantile over pixels of the standard deviation through time.
fn flicker_mm(maps: &[DepthMap]) -> [f64; 2] {
    let mut all = Vec::new();
    for i in 0..maps[0].raw().data.len() {
        let own: Vec<f64> = maps.iter().filter_map(|m| m.get_index(i).map(f64::from)).collect();
        if own.len() == maps.len() {
            let mean = own.iter().sum::<f64>() / own.len() as f64;
            let square = own.iter().map(|z| (z - mean).powi(2)).sum::<f64>();
            all.push((square / (own.len() - 1) as f64).sqrt());
        }
    }
    all.sort_by(f64::total_cmp);
    [0.5, 0.95].map(|share| all[((all.len() - 1) as f64 * share) as usize])
}

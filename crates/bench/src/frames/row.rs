//! What a job found, as rows of a table.

use crate::report::{mib, optional};
use std::fmt::Write;

/// One renderer's figures for one job.
#[derive(Clone, Debug, serde::Serialize)]
pub struct FrameRow {
    /// What was rendered.
    pub job: String,
    /// By whom.
    pub renderer: String,
    /// Images with different seeds.
    pub seeds: usize,
    /// Processor seconds of building, without reading files.
    pub build_cpu_s: f64,
    /// Processor seconds of an image, median.
    pub frame_cpu_s: f64,
    /// Seconds by the clock of an image, median.
    pub frame_wall_s: f64,
    /// Root mean variance of the luminance of 8x8 blocks over the mean luminance.
    pub noise: f64,
    /// Standard error of `noise`, of blocks that are independent.
    pub noise_error: f64,
    /// Mean luminance over image and seeds.
    pub mean: f64,
    /// Standard error of `mean`, of pixels that are independent.
    pub mean_error: f64,
    /// Processor seconds of building and of as many samples as reach this project's noise.
    pub equal_noise_cpu_s: f64,
    /// That over this project's.
    pub speedup: Option<f64>,
    /// Size of the renderer's process before it got the scene, bytes.
    pub idle_bytes: Option<u64>,
    /// Largest size of the renderer's process, bytes.
    pub peak_bytes: Option<u64>,
}

impl FrameRow {
    /// Rows as plain text, under a heading.
    pub fn table(rows: &[FrameRow]) -> String {
        let mut out = String::new();
        // Writing to a string cannot fail.
        let _ = FrameRow::write_table(rows, &mut out);
        out
    }

    fn write_table(rows: &[FrameRow], out: &mut String) -> std::fmt::Result {
        if rows.is_empty() {
            return Ok(());
        }
        writeln!(
            out,
            "\n{:<20} {:<40} {:>5} {:>7} {:>7} {:>7} {:>15} {:>7} {:>7} {:>5} {:>5} {:>15}",
            "frame",
            "renderer",
            "seeds",
            "build s",
            "frame s",
            "wall s",
            "noise %",
            "equal s",
            "speedup",
            "MiB",
            "idle",
            "mean"
        )?;
        for f in rows {
            writeln!(
                out,
                "{:<20} {:<40} {:>5} {:>7.2} {:>7.2} {:>7.2} {:>8.3} ±{:>5.3} {:>7.2} {:>7} {:>5} {:>5} {:>7.5} ±{:.5}",
                f.job,
                f.renderer,
                f.seeds,
                f.build_cpu_s,
                f.frame_cpu_s,
                f.frame_wall_s,
                100.0 * f.noise,
                100.0 * f.noise_error,
                f.equal_noise_cpu_s,
                optional(f.speedup, 2),
                mib(f.peak_bytes),
                mib(f.idle_bytes),
                f.mean,
                f.mean_error,
            )?;
        }
        writeln!(
            out,
            "seconds are the processor's (wall: by the clock); equal s: build and as many samples as reach our \
             noise; noise: of blocks of 8x8 pixels, over the mean; MiB: largest size of the process; idle: its \
             size before it had the scene"
        )
    }

    /// Heading of [`FrameRow::csv`].
    pub const CSV: &str = "job,renderer,seeds,build_cpu_s,frame_cpu_s,frame_wall_s,noise,noise_error,mean,mean_error,equal_noise_cpu_s,speedup,idle_bytes,peak_bytes";

    /// One line of a table of values separated by commas.
    pub fn csv(&self) -> String {
        let quoted = |s: &str| format!("\"{}\"", s.replace('"', "\"\""));
        let whole = |v: Option<u64>| v.map_or_else(String::new, |v| v.to_string());
        format!(
            "{},{},{},{},{},{},{},{},{},{},{},{},{},{}",
            quoted(&self.job),
            quoted(&self.renderer),
            self.seeds,
            self.build_cpu_s,
            self.frame_cpu_s,
            self.frame_wall_s,
            self.noise,
            self.noise_error,
            self.mean,
            self.mean_error,
            self.equal_noise_cpu_s,
            self.speedup.map_or_else(String::new, |v| v.to_string()),
            whole(self.idle_bytes),
            whole(self.peak_bytes)
        )
    }
}

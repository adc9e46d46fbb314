//! Those who render.

use super::Job;
use crate::error::BenchError;
use crate::memory;
use crate::python::{Python, Spent};
use serde_json::json;
use strandbench_renderer::{RenderScene, Settings};
use strandbench_types::{Monitor, StopOnly};

/// Something that renders.
pub(super) trait Painter {
    fn paint(&mut self, job: Job, seed: u64) -> Result<(Spent, Vec<f32>), BenchError>;
    fn peak_bytes(&self) -> Option<u64>;
}

/// This project's renderer.
pub(super) struct Own<'a> {
    pub scene: RenderScene<'a>,
    pub monitor: &'a dyn Monitor,
}

impl Painter for Own<'_> {
    fn paint(&mut self, job: Job, seed: u64) -> Result<(Spent, Vec<f32>), BenchError> {
        let settings = Settings {
            samples_per_pixel: job.samples,
            max_samples_per_pixel: job.samples,
            noise_target: 0.0,
            depth: job.depth,
            clamp: 0.0,
            ..Settings::default()
        };
        let (spent, render) =
            memory::spent(|| self.scene.render(0, &settings, seed, &StopOnly(self.monitor)));
        Ok((spent, render?.radiance_rgb.data.into_iter().flatten().collect()))
    }

    fn peak_bytes(&self) -> Option<u64> {
        memory::peak_bytes()
    }
}

impl Painter for Python {
    fn paint(&mut self, job: Job, seed: u64) -> Result<(Spent, Vec<f32>), BenchError> {
        let command = json!({"do": "frame", "folder": self.folder(), "depth": job.depth, "spp": job.samples, "seed": seed});
        let (spent, _) = self.timed(command)?;
        Ok((spent, self.read("pixels")?))
    }

    fn peak_bytes(&self) -> Option<u64> {
        self.ask(json!({"do": "memory"})).ok()?["peak_bytes"].as_u64()
    }
}

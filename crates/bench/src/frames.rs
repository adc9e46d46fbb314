//! Whole images at equal noise: this project's renderer beside Mitsuba, same hair, camera and light.

use crate::contest::median;
use crate::error::BenchError;
use crate::python::{Python, Spent, write_array};
use crate::{Options, Report, hair, memory};
use serde_json::{Value, json};
use std::path::Path;
use std::time::Instant;
use strandbench_renderer::{RenderScene, Settings};
use strandbench_scenes::Scene;
use strandbench_types::{Monitor, Plane};

/// Image size, pixels.
const SIZE: (u32, u32) = (640, 480);
/// Side of the blocks whose variance is taken, pixels. Single pixels of hair are so far from normal that their
/// variance is hard to estimate.
const BLOCK: usize = 8;

/// What is rendered.
#[derive(Clone, Copy, Debug)]
struct Job {
    name: &'static str,
    samples: u32,
    /// Scatterings.
    depth: u32,
}

const JOBS: [Job; 3] = [
    Job { name: "direct, 16 samples", samples: 16, depth: 1 },
    Job { name: "direct, 64 samples", samples: 64, depth: 1 },
    Job { name: "depth 8, 16 samples", samples: 16, depth: 8 },
];

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
    /// Mean luminance over image and seeds.
    pub mean: f64,
    /// Processor seconds of building and of as many samples as reach this project's noise.
    pub equal_noise_cpu_s: f64,
    /// That over this project's.
    pub speedup: Option<f64>,
    /// Largest size of the renderer's process, bytes.
    pub peak_bytes: Option<u64>,
}

/// Luminance of linear RGB (Rec. 709).
fn luminance(rgb: &[f32]) -> f64 {
    0.2126 * f64::from(rgb[0]) + 0.7152 * f64::from(rgb[1]) + 0.0722 * f64::from(rgb[2])
}

/// Mean luminance of each block of an image of rows of RGB.
fn blocks(rgb: &[f32], width: usize) -> Vec<f64> {
    let (across, down) = (width / BLOCK, rgb.len() / 3 / width / BLOCK);
    let mut sums = vec![0.0; across * down];
    for (i, pixel) in rgb.chunks_exact(3).enumerate() {
        let (x, y) = (i % width / BLOCK, i / width / BLOCK);
        if x < across && y < down {
            sums[y * across + x] += luminance(pixel) / (BLOCK * BLOCK) as f64;
        }
    }
    sums
}

/// Noise and mean of images with different seeds, each given by its blocks; at least two of one size.
fn noise(images: &[Vec<f64>]) -> (f64, f64) {
    let (n, blocks) = (images.len() as f64, images[0].len());
    let (mut variance, mut mean) = (0.0, 0.0);
    for b in 0..blocks {
        let m = images.iter().map(|i| i[b]).sum::<f64>() / n;
        variance += images.iter().map(|i| (i[b] - m).powi(2)).sum::<f64>() / (n - 1.0) / blocks as f64;
        mean += m / blocks as f64;
    }
    (variance.sqrt() / mean, mean)
}

/// Something that renders.
trait Painter {
    fn paint(&mut self, job: Job, seed: u64) -> Result<(Spent, Vec<f32>), BenchError>;
    fn peak_bytes(&self) -> Option<u64>;
}

struct Own<'a> {
    scene: RenderScene<'a>,
    monitor: &'a dyn Monitor,
}

/// Hands on whether to stop; the images' own progress is not shown.
struct Stop<'a>(&'a dyn Monitor);

impl Monitor for Stop<'_> {
    fn begin(&self, _: &str, _: u64) {}
    fn advance(&self, _: u64) {}
    fn cancelled(&self) -> bool {
        self.0.cancelled()
    }
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
        let (clock, cpu) = (Instant::now(), memory::cpu_s());
        let image: Plane<[f32; 3]> = self.scene.render(0, &settings, seed, &Stop(self.monitor))?.radiance_rgb;
        let wall_s = clock.elapsed().as_secs_f64();
        let cpu_s = memory::cpu_s().zip(cpu).map_or(wall_s, |(now, before)| now - before);
        Ok((Spent { wall_s, cpu_s }, image.data.into_iter().flatten().collect()))
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

/// The scene in Mitsuba's words: its camera looks along +z with +x to the left and +y up, its unit rectangle along
/// +z from (-1, -1) to (1, 1).
fn described(scene: &Scene, curve: &str, sampler: &str, folder: &Path) -> Value {
    let camera = &scene.rig.cameras[0];
    let (r, eye) = (camera.camera_from_world.transpose(), camera.centre_mm());
    let column = |axis: usize, sign: f64| r.col(axis).to_array().map(|v| sign * v);
    let (x, y, z, o) = (column(0, -1.0), column(1, -1.0), column(2, 1.0), eye.to_array());
    let rows = |x: [f64; 3], y: [f64; 3], z: [f64; 3], o: [f64; 3]| {
        json!([
            [x[0], y[0], z[0], o[0]],
            [x[1], y[1], z[1], o[1]],
            [x[2], y[2], z[2], o[2]],
            [0.0, 0.0, 0.0, 1.0]
        ])
    };
    let light = &scene.lights[0];
    let (u, v) = (light.half_u_mm.as_dvec3(), light.half_v_mm.as_dvec3());
    let n = u.cross(v).normalize();
    let centre = light.centre_mm.as_dvec3();
    let fov_deg = 2.0 * (f64::from(camera.width) / (2.0 * camera.focal_px.x)).atan().to_degrees();
    let optics = &scene.optics;
    json!({
        "do": "load", "folder": folder, "curve": curve,
        "camera": {
            "width": camera.width, "height": camera.height, "fov_deg": fov_deg, "sampler": sampler,
            "to_world": rows(x, y, z, o),
        },
        "light": {
            "to_world": rows(u.to_array(), v.to_array(), n.to_array(), centre.to_array()),
            "radiance_rgb": light.radiance_rgb,
        },
        "bsdf": {
            "type": "hair", "int_ior": optics.index, "ext_ior": 1.0,
            "longitudinal_roughness": optics.longitudinal_roughness,
            "azimuthal_roughness": optics.azimuthal_roughness, "scale_tilt": optics.scale_tilt_deg,
        },
        "absorption_rgb": scene.pigments[0].absorption_rgb(),
    })
}

/// Mitsuba's variants and curves. Its linear curves have no tangent, so that hair on them is shaded wrongly; they
/// are there for their speed alone.
const RIVALS: [(&str, &str); 3] =
    [("llvm_ad_rgb", "bsplinecurve"), ("llvm_ad_rgb", "linearcurve"), ("scalar_rgb", "bsplinecurve")];

/// All jobs by all renderers, which take turns with each seed.
pub(crate) fn frames(
    options: &Options,
    folder: &Path,
    report: &mut Report,
    monitor: &dyn Monitor,
) -> Result<(), BenchError> {
    let scene = hair::scene(hair::wavy(options.strands, options.segments, 1), SIZE);
    let cpu = memory::cpu_s();
    let clock = Instant::now();
    let own = RenderScene::new(&scene)?;
    let wall_s = clock.elapsed().as_secs_f64();
    let own_build = memory::cpu_s().zip(cpu).map_or(wall_s, |(now, before)| now - before);
    let s = &scene.strands;
    let points = s.points.iter().zip(&s.radii_mm).flat_map(|(p, &r)| [p.x, p.y, p.z, r]);
    write_array(folder, "points", points, f32::to_le_bytes)?;
    write_array(folder, "offsets", s.offsets.iter().copied(), u32::to_le_bytes)?;
    let mut painters: Vec<(String, f64, Box<dyn Painter + '_>)> =
        vec![("strandbench".into(), own_build, Box::new(Own { scene: own, monitor }))];
    for (variant, curve) in RIVALS {
        let started = Python::start(&options.interpreter(), variant, folder).and_then(|p| {
            let (spent, _) = p.timed(described(&scene, curve, "multijitter", folder))?;
            Ok((p, spent.cpu_s))
        });
        match started {
            Ok((p, build)) => {
                painters.push((format!("{} {variant} {curve}", p.version), build, Box::new(p)));
            }
            Err(e) => report.skipped.push(e.to_string()),
        }
    }
    // A variance needs two.
    let seeds = options.rounds.max(2);
    for job in JOBS {
        monitor.begin(job.name, (seeds * painters.len()) as u64);
        let mut images = vec![Vec::new(); painters.len()];
        let mut spent = vec![Vec::new(); painters.len()];
        for seed in 0..seeds as u64 {
            for (k, (_, _, painter)) in painters.iter_mut().enumerate() {
                monitor.check()?;
                let (took, rgb) = painter.paint(job, seed + 1)?;
                images[k].push(blocks(&rgb, SIZE.0 as usize));
                spent[k].push(took);
                monitor.advance(1);
            }
        }
        let own_noise = noise(&images[0]).0;
        let mut own_equal = None;
        for (k, (renderer, build_cpu_s, painter)) in painters.iter().enumerate() {
            let (noise, mean) = noise(&images[k]);
            let frame_cpu_s = median(spent[k].iter().map(|s| s.cpu_s).collect());
            // Variance falls with the number of samples.
            let equal = build_cpu_s + frame_cpu_s * (noise / own_noise).powi(2);
            let own_equal = *own_equal.get_or_insert(equal);
            report.frames.push(FrameRow {
                job: job.name.into(),
                renderer: renderer.clone(),
                seeds,
                build_cpu_s: *build_cpu_s,
                frame_cpu_s,
                frame_wall_s: median(spent[k].iter().map(|s| s.wall_s).collect()),
                noise,
                mean,
                equal_noise_cpu_s: equal,
                speedup: (k > 0).then_some(equal / own_equal),
                peak_bytes: painter.peak_bytes(),
            });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use strandbench_rng::Rng;

    #[test]
    fn noise_is_that_of_the_blocks_over_the_mean() {
        // Grey pixels of mean 2 with independent errors, even in ±0.6: a block's mean varies by 0.12 / 64.
        let image = |seed: u64| -> Vec<f32> {
            let mut rng = Rng::keyed(&[seed]);
            (0..160 * 120).flat_map(|_| [2.0 + rng.range(-0.6, 0.6); 3]).collect()
        };
        let images: Vec<Vec<f64>> = (0..12).map(|s| blocks(&image(s), 160)).collect();
        assert_eq!(images[0].len(), 20 * 15);
        let (noise, mean) = noise(&images);
        let want = (0.12f64 / 64.0).sqrt() / 2.0;
        // 300 blocks with 11 degrees of freedom each: the standard deviation of the estimate is 1.2 %.
        assert!((noise / want - 1.0).abs() < 0.06, "{noise} against {want}");
        assert!((mean - 2.0).abs() < 0.005, "{mean}");
    }

    #[test]
    fn mitsuba_is_told_the_same_camera_and_light() {
        let scene = hair::scene(hair::wavy(2, 3, 1), SIZE);
        let d = described(&scene, "linearcurve", "independent", Path::new("."));
        let matrix = |v: &Value, row: usize, column: usize| v["to_world"][row][column].as_f64().unwrap();
        // What its camera sees at +z, left and up of it, projects to the middle, left and upper half.
        let at = |x: f64, y: f64, z: f64| {
            let c = &d["camera"];
            let world: [f64; 3] = std::array::from_fn(|r| {
                matrix(c, r, 0) * x + matrix(c, r, 1) * y + matrix(c, r, 2) * z + matrix(c, r, 3)
            });
            scene.rig.cameras[0].to_camera(world.into())
        };
        assert!((at(0.0, 0.0, 5.0) - glam::DVec3::new(0.0, 0.0, 5.0)).length() < 1e-9);
        assert!((at(1.0, 2.0, 5.0) - glam::DVec3::new(-1.0, -2.0, 5.0)).length() < 1e-9);
        let half = (d["camera"]["fov_deg"].as_f64().unwrap() * 0.5).to_radians().tan();
        let camera = &scene.rig.cameras[0];
        assert!((half * camera.focal_px.x - 320.0).abs() < 1e-9);
        // The rectangle's normal looks at the hair.
        let l = &d["light"];
        let towards: f64 = (0..3).map(|r| matrix(l, r, 2) * -matrix(l, r, 3)).sum();
        assert!(towards > 0.0);
    }
}

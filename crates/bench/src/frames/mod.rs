//! Whole images at equal noise: this project's renderer beside Mitsuba, same hair, camera and light.

mod described;
mod noise;
mod painter;
mod row;

use crate::contest::median;
use crate::error::BenchError;
use crate::python::{Python, Spent};
use crate::{Options, Report, curves, hair, memory};
use noise::{Image, Noise};
use painter::{Own, Painter};
pub use row::FrameRow;
use std::path::Path;
use std::time::{Duration, Instant};
use strandbench_renderer::RenderScene;
use strandbench_types::Monitor;

/// Image size, pixels.
const SIZE: (u32, u32) = (640, 480);
/// Time by the clock after which a job gets no further seeds; it has at least two.
const MOST_PER_JOB: Duration = Duration::from_secs(420);

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

/// Someone who renders, and what is known before the first image.
struct Rival<'a> {
    name: String,
    build_cpu_s: f64,
    idle_bytes: Option<u64>,
    painter: Box<dyn Painter + 'a>,
}

/// Mitsuba's variants and curves. Its linear curves have no tangent, so that hair on them is shaded wrongly; they
/// are there for their speed alone. Splines round the corners of the strands, so that their image is not quite
/// ours.
const RIVALS: [(&str, &str); 3] =
    [("llvm_ad_rgb", curves::SPLINE), ("llvm_ad_rgb", curves::LINEAR), ("scalar_rgb", curves::SPLINE)];

/// All jobs by all renderers, which take turns with each seed. `say` gets a line after every image, and every job's
/// rows as soon as it is done.
pub(crate) fn frames(
    options: &Options,
    folder: &Path,
    report: &mut Report,
    monitor: &dyn Monitor,
    say: &dyn Fn(&str),
) -> Result<(), BenchError> {
    let idle_bytes = memory::resident_bytes();
    let scene = hair::scene(hair::wavy(options.strands, options.segments, 1), SIZE);
    let (built, own) = memory::spent(|| RenderScene::new(&scene));
    let painter = Box::new(Own { scene: own?, monitor });
    let name = "strandbench".to_owned();
    let mut rivals = vec![Rival { name, build_cpu_s: built.cpu_s, idle_bytes, painter }];
    for (variant, curve) in RIVALS {
        monitor.check()?;
        curves::write(&scene.strands, curve, folder)?;
        let started = Python::start(&options.interpreter(), variant, folder).and_then(|p| {
            let idle_bytes = p.peak_bytes();
            let (spent, _) = p.timed(described::scene(&scene, curve, "multijitter", folder))?;
            let name = format!("{} {variant} {curve}", p.version);
            Ok(Rival { name, build_cpu_s: spent.cpu_s, idle_bytes, painter: Box::new(p) })
        });
        match started {
            Ok(rival) => rivals.push(rival),
            Err(e) => report.skipped.push(e.to_string()),
        }
    }
    for job in JOBS {
        let rows = contest(job, &mut rivals, options.rounds, monitor, say)?;
        let from = report.frames.len();
        report.frames.extend(rows);
        say(&FrameRow::table(&report.frames[from..]));
    }
    Ok(())
}

/// One job by all.
fn contest(
    job: Job,
    rivals: &mut [Rival<'_>],
    rounds: usize,
    monitor: &dyn Monitor,
    say: &dyn Fn(&str),
) -> Result<Vec<FrameRow>, BenchError> {
    // A variance needs two.
    let seeds = rounds.max(2);
    monitor.begin(job.name, (seeds * rivals.len()) as u64);
    let clock = Instant::now();
    let mut images: Vec<Vec<Image>> = rivals.iter().map(|_| Vec::new()).collect();
    let mut spent: Vec<Vec<Spent>> = rivals.iter().map(|_| Vec::new()).collect();
    for seed in 1..=seeds as u64 {
        if seed > 2 && clock.elapsed() > MOST_PER_JOB {
            say(&format!("{}: time is up after {} seeds", job.name, seed - 1));
            break;
        }
        for (k, rival) in rivals.iter_mut().enumerate() {
            monitor.check()?;
            let (took, rgb) = rival.painter.paint(job, seed)?;
            say(&format!(
                "{}, seed {seed}, {}: {:.2} CPU s, {:.2} s",
                job.name, rival.name, took.cpu_s, took.wall_s
            ));
            images[k].push(Image::of(&rgb, SIZE.0 as usize));
            spent[k].push(took);
            monitor.advance(1);
        }
    }
    let of: Vec<Noise> = images.iter().map(|i| Noise::of(i)).collect();
    let own_noise = of[0].noise;
    let mut own_equal = None;
    let row = |(k, rival): (usize, &Rival<'_>)| {
        let frame_cpu_s = median(spent[k].iter().map(|s| s.cpu_s).collect());
        // Variance falls with the number of samples.
        let equal = rival.build_cpu_s + frame_cpu_s * (of[k].noise / own_noise).powi(2);
        let own_equal = *own_equal.get_or_insert(equal);
        FrameRow {
            job: job.name.into(),
            renderer: rival.name.clone(),
            seeds: images[k].len(),
            build_cpu_s: rival.build_cpu_s,
            frame_cpu_s,
            frame_wall_s: median(spent[k].iter().map(|s| s.wall_s).collect()),
            noise: of[k].noise,
            noise_error: of[k].noise_error,
            mean: of[k].mean,
            mean_error: of[k].mean_error,
            equal_noise_cpu_s: equal,
            speedup: (k > 0).then_some(equal / own_equal),
            idle_bytes: rival.idle_bytes,
            peak_bytes: rival.painter.peak_bytes(),
        }
    };
    Ok(rivals.iter().enumerate().map(row).collect())
}

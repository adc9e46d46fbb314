//! Render noise against the sensor's own noise, and what it costs:
//! `noise SCENE [CAMERA] [SCALE] [FIRST,MAX,TARGET,DEPTH,EVERY ...]`.
//!
//! Renders one view twice with each of several settings, by two seeds. In pixels that hair covers by half or
//! more, the difference of the two gives the actual standard error, free of any assumption about the samples. SCALE
//! multiplies image size and focal length.
//! Times are CPU seconds of the process (Linux; wall seconds elsewhere).

use std::process::ExitCode;
use std::time::Instant;
use strandbench_renderer::{Render, RenderScene, Settings, noise_variance};
use strandbench_scenes::{Sensor, build, catalog};
use strandbench_types::Silent;

/// User and system seconds of this process, in ticks of 10 ms.
fn cpu_s() -> Option<f64> {
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    let fields: Vec<&str> = stat.rsplit_once(')')?.1.split_whitespace().collect();
    let ticks = fields.get(11)?.parse::<f64>().ok()? + fields.get(12)?.parse::<f64>().ok()?;
    Some(ticks / 100.0)
}

/// Peak memory so far, where the system tells.
fn peak() -> String {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find(|l| l.starts_with("VmHWM")).unwrap_or_default();
    line.split_once(':').map_or(String::new(), |l| format!(", peak memory {}", l.1.trim()))
}

struct Noise {
    render: f64,
    stated: f64,
    sensor: f64,
    signal: f64,
}

/// Root mean squares over hair pixels, relative to full scale.
fn noise(a: &Render, b: &Render, s: &Sensor) -> Noise {
    let full = f64::from(s.full_scale_radiance);
    let mono = |c: &[f32; 3]| (0..3).map(|k| f64::from(c[k] * s.response_rgb[k])).sum::<f64>() / full;
    let (mut n, mut sums) = (0.0, [0.0; 4]);
    for i in 0..a.radiance_rgb.data.len() {
        if 2 * a.hits.pixel(i).len() < usize::from(a.hits.rays[i]) {
            continue;
        }
        let (x, y) = (mono(&a.radiance_rgb.data[i]), mono(&b.radiance_rgb.data[i]));
        let signal = 0.5 * (x + y);
        // Clipped pixels show no noise.
        if signal > 1.0 {
            continue;
        }
        n += 1.0;
        sums[0] += 0.5 * (x - y).powi(2);
        sums[1] += 0.5 * f64::from(a.variance.data[i] + b.variance.data[i]) / (full * full);
        sums[2] += noise_variance(s, signal);
        sums[3] += signal;
    }
    let rms = |v: f64| (v / n).sqrt();
    Noise { render: rms(sums[0]), stated: rms(sums[1]), sensor: rms(sums[2]), signal: sums[3] / n }
}

/// Direct light alone, then paths, with the defaults last.
const DEFAULT_ROWS: [&str; 6] =
    ["16,16,0,1,1", "32,32,0,1,1", "32,32,0,8,8", "32,32,0,8,4", "32,32,0,8,2", "32,64,0.04,8,4"];

fn row(text: &str) -> Result<Settings, String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(str::parse).collect();
    let numbers = numbers.map_err(|e| format!("{text}: {e}"))?;
    let [first, most, target, depth, every] =
        <[f64; 5]>::try_from(numbers).map_err(|n| format!("{text} has {} numbers, not 5", n.len()))?;
    Ok(Settings {
        samples_per_pixel: first as u32,
        max_samples_per_pixel: most as u32,
        noise_target: target as f32,
        depth: depth as u32,
        indirect_every: every as u32,
        clamp: 0.0,
        ..Settings::default()
    })
}

fn run() -> Result<(), String> {
    let mut args = std::env::args().skip(1);
    let name = args.next().ok_or("usage: noise SCENE [CAMERA]")?;
    let camera = args.next().map_or(Ok(0), |a| a.parse()).map_err(|e| format!("camera: {e}"))?;
    let scale: f64 = args.next().map_or(Ok(1.0), |a| a.parse()).map_err(|e| format!("scale: {e}"))?;
    let entry = catalog().iter().find(|e| e.name == name).ok_or(format!("there is no scene {name}"))?;
    let spec = entry.spec().map_err(|e| e.to_string())?;
    let mut scene = build(&spec, 1, None).map_err(|e| e.to_string())?;
    let c = scene.rig.cameras.get_mut(camera).ok_or("there is no such camera")?;
    c.width = (f64::from(c.width) * scale).round().max(1.0) as u32;
    c.height = (f64::from(c.height) * scale).round().max(1.0) as u32;
    (c.focal_px, c.principal_px) = (c.focal_px * scale, c.principal_px * scale);
    let start = Instant::now();
    let now = || cpu_s().unwrap_or_else(|| start.elapsed().as_secs_f64());
    print!("scene built{}; ", peak());
    let t = now();
    let prepared = RenderScene::new(&scene).map_err(|e| e.to_string())?;
    println!("{} points, build {:.1} CPU s{}", scene.strands.points.len(), now() - t, peak());
    println!(
        "first  max target depth every | CPU s a view  M rays camera shadow bounce  converged | render stated sensor (% of full) | render/sensor  mean signal  CPU s x variance"
    );
    let mut rows: Vec<Settings> = args.map(|a| row(&a)).collect::<Result<_, _>>()?;
    if rows.is_empty() {
        rows = DEFAULT_ROWS.iter().map(|r| row(r)).collect::<Result<_, _>>()?;
    }
    for settings in rows {
        let t = now();
        let make = |seed| prepared.render(camera, &settings, seed, &Silent).map_err(|e| e.to_string());
        let (a, b) = (make(1)?, make(2)?);
        let cost = 0.5 * (now() - t);
        let q = noise(&a, &b, &scene.sensor);
        println!(
            "{:5} {:4} {:6.3} {:5} {:5} | {cost:12.1} {:13.1} {:6.1} {:6.1} {:9.3} | {:6.3} {:6.3} {:6.3} | {:.2}  {:.3}  {:.4}",
            settings.samples_per_pixel,
            settings.max_samples_per_pixel,
            settings.noise_target,
            settings.depth,
            settings.indirect_every,
            a.stats.primary_rays as f64 / 1e6,
            a.stats.shadow_rays as f64 / 1e6,
            a.stats.bounce_rays as f64 / 1e6,
            a.stats.converged,
            100.0 * q.render,
            100.0 * q.stated,
            100.0 * q.sensor,
            q.render / q.sensor,
            q.signal,
            cost * q.render * q.render
        );
    }
    Ok(())
}

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("noise: {e}");
            ExitCode::FAILURE
        }
    }
}

//! A bearded head before sixteen LED banks, to look at and to time:
//! `beard OUT.png [whole | beard | cheek | eye | mouth | WIDTHxHEIGHT] [plain | crossed] [FIRST,MAX,SHARE,DEPTH,EVERY,PATHS] [twice] [flat]`.
//!
//! `whole` is one view of 3 megapixels, the close-ups are 480 px wide at its scale, `WIDTHxHEIGHT` is the whole at that
//! size. SHARE is `Settings::sensor_noise`. `twice` renders with two seeds and says how their noise compares with the
//! colour sensor's, on skin and on hair. `flat` leaves light where it enters the skin, and traces all of it by paths.
//! The hairs are short arcs all over the beard's region, a stand-in for a groom with as many hairs.

#[path = "beard/subject.rs"]
mod subject;

use std::time::Instant;
use strandbench_renderer::{Render, RenderScene, Settings, expose_rgb, noise_variance};
use strandbench_scenes::Sensor;
use strandbench_types::Silent;

fn srgb(v: f32) -> u8 {
    let v = v.clamp(0.0, 1.0);
    let s = if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
    (s * 255.0 + 0.5) as u8
}

/// User and system seconds of this process, in ticks of 10 ms (Linux).
fn cpu_s() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields: Vec<&str> = stat.rsplit_once(')').map_or("", |s| s.1).split_whitespace().collect();
    let tick = |i: usize| fields.get(i).and_then(|v| v.parse::<f64>().ok()).unwrap_or(f64::NAN);
    (tick(11) + tick(12)) / 100.0
}

fn peak() -> String {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find(|l| l.starts_with("VmHWM")).unwrap_or_default();
    line.split_once(':').map_or(String::new(), |l| l.1.trim().to_owned())
}

/// Root mean square of render noise over sensor noise by channel, on pixels without hair and on those with; and the
/// share of those pixels.
fn noise(a: &Render, b: &Render, s: &Sensor, background: [f32; 3]) -> [([f64; 3], f64); 2] {
    let full = f64::from(s.full_scale_radiance);
    let mut sums = [[0.0f64; 3]; 2];
    let mut counts = [0.0f64; 2];
    for i in 0..a.radiance_rgb.data.len() {
        let (x, y) = (a.radiance_rgb.data[i], b.radiance_rgb.data[i]);
        if x == background && y == background {
            continue;
        }
        let kind = usize::from(a.hits.pixel(i).len() + b.hits.pixel(i).len() > 0);
        counts[kind] += 1.0;
        for c in 0..3 {
            let (x, y) = (f64::from(x[c]) / full, f64::from(y[c]) / full);
            sums[kind][c] += 0.5 * (x - y).powi(2) / noise_variance(s, 0.5 * (x + y));
        }
    }
    let all = a.radiance_rgb.data.len() as f64;
    [0, 1].map(|k| (sums[k].map(|v| (v / counts[k].max(1.0)).sqrt()), counts[k] / all))
}

fn run() -> Result<(), String> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let out =
        args.first().ok_or("usage: beard OUT.png [VIEW] [plain | crossed] [SETTINGS] [twice] [flat]")?;
    let view = args.get(1).map_or("cheek", String::as_str);
    let crossed = args.get(2).is_some_and(|a| a == "crossed");
    let numbers = args.get(3).map_or("8,128,1,8,2,64", String::as_str);
    let numbers: Vec<f32> =
        numbers.split(',').map(str::parse).collect::<Result<_, _>>().map_err(|e| format!("{e}"))?;
    let [first, most, share, depth, every, paths] = numbers[..] else {
        return Err("six numbers, please".into());
    };
    let has = |word: &str| args.iter().skip(4).any(|a| a == word);
    let settings = Settings {
        samples_per_pixel: first as u32,
        max_samples_per_pixel: most as u32,
        sensor_noise: share,
        depth: depth as u32,
        indirect_every: every as u32,
        skin_paths: paths as u32,
        ..Settings::default()
    };
    let scene = subject::scene(view, crossed, !has("flat"))?;
    let (t, c) = (Instant::now(), cpu_s());
    let prepared = RenderScene::new(&scene).map_err(|e| e.to_string())?;
    println!(
        "{} hairs, tree {:.1} s, {:.1} CPU s",
        scene.strands.len(),
        t.elapsed().as_secs_f64(),
        cpu_s() - c
    );
    let (t, c) = (Instant::now(), cpu_s());
    prepared.prepare(&settings, 1, &Silent).map_err(|e| e.to_string())?;
    println!("light below the skin {:.1} s, {:.1} CPU s", t.elapsed().as_secs_f64(), cpu_s() - c);
    let (t, c) = (Instant::now(), cpu_s());
    let a = prepared.render(0, &settings, 1, &Silent).map_err(|e| e.to_string())?;
    let (wall, cpu) = (t.elapsed().as_secs_f64(), cpu_s() - c);
    let rays = a.stats.primary_rays + a.stats.shadow_rays + a.stats.bounce_rays;
    println!(
        "view {:?}: {wall:.1} s, {cpu:.1} CPU s, {:.1} M rays ({:.1} camera, {:.1} shadow, {:.1} bounce), {:.2} M rays/CPU s, converged {:.3}, peak memory {}",
        a.radiance_rgb.size(),
        rays as f64 / 1e6,
        a.stats.primary_rays as f64 / 1e6,
        a.stats.shadow_rays as f64 / 1e6,
        a.stats.bounce_rays as f64 / 1e6,
        rays as f64 / 1e6 / cpu,
        a.stats.converged,
        peak()
    );
    if has("twice") {
        let b = prepared.render(0, &settings, 2, &Silent).map_err(|e| e.to_string())?;
        for (name, (rgb, part)) in
            ["skin", "hair"].iter().zip(noise(&a, &b, &scene.sensor, scene.background_rgb))
        {
            println!(
                "render noise over the sensor's, {name} ({:.2} of all): {:.2} {:.2} {:.2}",
                part, rgb[0], rgb[1], rgb[2]
            );
        }
    }
    let shown = expose_rgb(&scene.sensor, 0, &a.radiance_rgb, 1);
    let (w, h) = shown.size();
    let mut picture = image::RgbImage::new(w as u32, h as u32);
    for (i, c) in shown.data.iter().enumerate() {
        picture.put_pixel((i % w) as u32, (i / w) as u32, image::Rgb(c.map(srgb)));
    }
    picture.save(out).map_err(|e| format!("{out}: {e}"))
}

fn main() -> std::process::ExitCode {
    match run() {
        Ok(()) => std::process::ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("beard: {e}");
            std::process::ExitCode::FAILURE
        }
    }
}

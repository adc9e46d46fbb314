//! Level 4: images, by the statistics of 8x8-pixel blocks over many seeds.
//!
//! Single pixels of hair are far from normally distributed (their z-scores fail calibration); means over blocks
//! are near enough. Each renderer gives one image a seed, so the spread over seeds is measured and nothing is
//! assumed about it.

use crate::setting::{LUMINANCE, Setting, light};
use crate::stats::{moments, welch};
use crate::{Bundle, Case, CrossError, Gate, Size, fixed};
use glam::Vec3;
use strandbench_renderer::{RenderScene, Settings};
use strandbench_scenes::{OpticsModel, Pigment};
use strandbench_types::{Plane, Silent};

/// Side of a block, pixels.
pub(crate) const BLOCK: usize = 8;
/// Chance that a right pair of renderers fails one of these tests.
const FALSE_ALARM: f64 = 1e-3;
/// Largest standard error of the ratio of the images' means: with more noise the tests would pass anything.
const NOISE: f64 = 1e-2;
/// The same where light of few scatterings is taken off: a scattering that is lost is off by all of it.
const NOISE_BEYOND: f64 = 0.1;
/// Share of the brightest block's light below which a block is not tested: a sliver of a fibre in its corner is
/// met by few rays, and their sum is not near a normal distribution.
const DIM: f64 = 0.02;
/// Seeds of each renderer.
const SEEDS: usize = 24;

/// One view and how it is rendered.
struct Shot {
    name: &'static str,
    setting: Setting,
    /// Most scatterings.
    depth: u32,
    /// Light of so many scatterings and fewer is taken off, seed by seed: what is left is that of the later ones
    /// alone, whose loss would drown in the noise of all.
    beyond: u32,
    samples: u32,
}

fn settings(size: Size) -> Vec<Shot> {
    let (width, height) = if size == Size::Full { (160, 120) } else { (80, 64) };
    let lights = || {
        vec![
            light(Vec3::new(250.0, 200.0, 300.0), 60.0, [30.0, 27.0, 24.0]),
            light(Vec3::new(-300.0, 60.0, 150.0), 80.0, [10.0, 11.0, 13.0]),
        ]
    };
    // Dark enough that Mitsuba's fault in sampling the residual lobe stays below 0.1 %.
    let pigment = Pigment { eumelanin: 2.0, pheomelanin: 0.0 };
    let make = |strands, model, radius_mm| Setting {
        strands,
        model,
        pigment,
        camera: fixed::camera(width, height, radius_mm),
        lights: lights(),
    };
    let chiang = OpticsModel::Chiang;
    let shot = |name, setting, depth, samples| Shot { name, setting, depth, beyond: 0, samples };
    let mut out = vec![
        shot("single", make(fixed::single(), chiang, 14.0), 1, 384),
        shot("crossing", make(fixed::crossing(), chiang, 14.0), 7, 128),
        shot("tuft-direct", make(fixed::tuft(200, 24), chiang, 34.0), 1, 96),
        shot("tuft-path", make(fixed::tuft(200, 24), chiang, 34.0), 7, 96),
        Shot { beyond: 1, ..shot("tuft-second", make(fixed::tuft(200, 24), chiang, 34.0), 2, 48) },
        Shot { beyond: 2, ..shot("tuft-third", make(fixed::tuft(200, 24), chiang, 34.0), 3, 48) },
        Shot { beyond: 3, ..shot("tuft-later", make(fixed::tuft(200, 24), chiang, 34.0), 7, 48) },
    ];
    if size == Size::Full {
        out.push(shot("hairstyle-direct", make(fixed::tuft(6_000, 40), chiang, 40.0), 1, 64));
        out.push(shot("hairstyle-path", make(fixed::tuft(6_000, 40), chiang, 40.0), 7, 64));
        out.push(shot("marschner-direct", make(fixed::tuft(200, 24), OpticsModel::Marschner, 34.0), 1, 64));
    }
    out
}

pub(crate) fn cases(size: Size) -> Vec<Case> {
    settings(size)
        .into_iter()
        .map(|shot| Case {
            level: 4,
            name: shot.name.to_owned(),
            job: "image",
            input: shot
                .setting
                .export(shot.name)
                .with_meta("scatterings", shot.depth)
                .with_meta("beyond", shot.beyond)
                .with_meta("samples_per_pixel", shot.samples)
                .with_meta("full", size == Size::Full)
                .with_meta("seeds", (1..=SEEDS).collect::<Vec<_>>()),
        })
        .collect()
}

/// Both renderers' images of one case.
#[derive(Clone, Debug)]
pub struct Pictures {
    /// Mean over the seeds, linear RGB.
    pub ours: Plane<[f32; 3]>,
    /// The same of the witness.
    pub theirs: Plane<[f32; 3]>,
    /// Relative difference of each block's mean luminance, and its p-value; none where both are dark.
    pub blocks: Plane<Option<(f64, f64)>>,
}

/// One renderer's luminance of every block for every seed.
struct Seeds {
    mean: Plane<[f32; 3]>,
    /// Indexed [block][seed].
    blocks: Vec<Vec<f64>>,
    /// Indexed [seed].
    whole: Vec<f64>,
}

fn gather(images: &[Plane<[f32; 3]>]) -> Seeds {
    let (w, h) = images[0].size();
    let (across, down) = (w / BLOCK, h / BLOCK);
    let mut mean = Plane::filled(w, h, [0.0f32; 3]);
    let mut blocks = vec![Vec::new(); across * down];
    let mut whole = Vec::new();
    for image in images {
        for (m, v) in mean.data.iter_mut().zip(&image.data) {
            *m = std::array::from_fn(|c| m[c] + v[c] / images.len() as f32);
        }
        let light = image.map(|v| (0..3).map(|c| f64::from(v[c] * LUMINANCE[c])).sum::<f64>());
        whole.push(light.data.iter().sum::<f64>() / light.data.len() as f64);
        for (b, block) in blocks.iter_mut().enumerate() {
            let (x0, y0) = (b % across * BLOCK, b / across * BLOCK);
            let inside = (0..BLOCK * BLOCK).map(|k| *light.at(x0 + k % BLOCK, y0 + k / BLOCK));
            block.push(inside.sum::<f64>() / (BLOCK * BLOCK) as f64);
        }
    }
    Seeds { mean, blocks, whole }
}

fn summary(values: &[f64]) -> (f64, f64, usize) {
    let (mean, variance) = moments(values);
    (mean, variance, values.len())
}

pub(crate) fn judge(case: &Case, answer: &Bundle) -> Result<(Vec<Gate>, Pictures), CrossError> {
    let size = if case.input.meta::<bool>("full")? { Size::Full } else { Size::Quick };
    let Shot { setting, depth, beyond, samples, .. } = settings(size)
        .into_iter()
        .find(|shot| shot.name == case.name)
        .ok_or_else(|| CrossError::Ours(format!("no setting {}", case.name)))?;
    let (w, h) = (setting.camera.width as usize, setting.camera.height as usize);
    let flat: Vec<f32> = answer.get("images", &[SEEDS, h, w, 3])?;
    let theirs: Vec<Plane<[f32; 3]>> = flat
        .chunks_exact(w * h * 3)
        .map(|image| Plane::from_vec(w, h, image.as_chunks().0.to_vec()))
        .collect();
    let scene = setting.scene()?;
    let render = RenderScene::new(&scene)?.flat_tangents();
    let image = |depth, seed| {
        let settings = Settings {
            samples_per_pixel: samples,
            max_samples_per_pixel: samples,
            noise_target: 0.0,
            depth,
            indirect_every: 1,
            clamp: 0.0,
            ..Settings::default()
        };
        render.render(0, &settings, seed, &Silent).map(|r| r.radiance_rgb)
    };
    let ours = (1..=SEEDS as u64)
        .map(|seed| {
            let mut whole = image(depth, seed)?;
            if beyond > 0 {
                for (v, less) in whole.data.iter_mut().zip(&image(beyond, seed)?.data) {
                    *v = std::array::from_fn(|c| v[c] - less[c]);
                }
            }
            Ok(whole)
        })
        .collect::<Result<Vec<_>, CrossError>>()?;
    Ok(compare(&case.name, &gather(&ours), &gather(&theirs), beyond > 0))
}

/// `beyond`: whether light of few scatterings is taken off. Of what is left blocks are too far from normally
/// distributed to be tested: few paths make most of it.
fn compare(name: &str, ours: &Seeds, theirs: &Seeds, beyond: bool) -> (Vec<Gate>, Pictures) {
    let (w, h) = ours.mean.size();
    let brightest = theirs.blocks.iter().map(|b| moments(b).0).fold(f64::MIN_POSITIVE, f64::max);
    let dim = DIM * brightest;
    let tested: Vec<Option<(f64, f64)>> = ours
        .blocks
        .iter()
        .zip(&theirs.blocks)
        .map(|(a, b)| {
            let (a, b) = (summary(a), summary(b));
            (a.0 + b.0 > 2.0 * dim).then(|| ((a.0 - b.0) / (0.5 * (a.0 + b.0)), welch(a, b).2))
        })
        .collect();
    let p_values: Vec<f64> = tested.iter().flatten().map(|b| b.1).collect();
    let n = p_values.len() as f64;
    let smallest = p_values.iter().copied().fold(1.0, f64::min);
    let low = p_values.iter().filter(|p| **p < 0.05).count() as f64;
    let (a, b) = (summary(&ours.whole), summary(&theirs.whole));
    let (t, _, p) = welch(a, b);
    let relative = a.0 / b.0 - 1.0;
    let error = (a.1 / a.2 as f64 + b.1 / b.2 as f64).sqrt() / b.0;
    // Number of blocks below 5 % at which chance alone has less than a thousandth: normal approximation of the
    // binomial with continuity, three standard deviations and a tenth.
    let most = 0.05 * n + 3.1 * (0.05 * 0.95 * n).sqrt() + 0.5;
    let at_most = |what: &str, v: f64, l: f64, unit: &str| Gate::at_most(4, name, what, v, l, unit);
    let at_least = |what: &str, v: f64, l: f64, unit: &str| Gate::at_least(4, name, what, v, l, unit);
    let mut gates = vec![
        at_least("whole image, p-value", p, FALSE_ALARM, "").because(format!(
            "t = {t:.2}; ours brighter by {:.3} % ± {:.3} %",
            100.0 * relative,
            100.0 * error
        )),
        at_most(
            "whole image, standard error of the ratio",
            error,
            if beyond { NOISE_BEYOND } else { NOISE },
            "",
        )
        .because("with more noise the tests would pass anything"),
        Gate::shown(4, name, "noise, ours over theirs", (a.1 / b.1).sqrt(), "")
            .because("standard deviation of the whole image's mean at equal samples a pixel"),
    ];
    if !beyond {
        gates.extend([
            at_least("blocks with light", n, 8.0, "blocks"),
            at_least("blocks, smallest p-value", smallest, FALSE_ALARM / n.max(1.0), "")
                .because("limit: a thousandth over the number of blocks (Bonferroni)"),
            at_most("blocks with p below 5 %", low, most, "blocks")
                .because(format!("of {n}; {:.1} expected", 0.05 * n)),
        ]);
    }
    let blocks = Plane::from_vec(w / BLOCK, h / BLOCK, tested);
    (gates, Pictures { ours: ours.mean.clone(), theirs: theirs.mean.clone(), blocks })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Verdict;
    use strandbench_rng::Rng;

    /// Images of noise around a pattern; `wrong` scales one corner.
    fn noisy(seed: u64, wrong: f32) -> Vec<Plane<[f32; 3]>> {
        let image = |s: u64| {
            let mut rng = Rng::keyed(&[seed, s]);
            let mut plane = Plane::filled(64, 48, [0.0f32; 3]);
            for (i, v) in plane.data.iter_mut().enumerate() {
                let (x, y) = (i % 64, i / 64);
                let scale = if x < 16 && y < 16 { wrong } else { 1.0 };
                // Heavy-tailed, as path tracing is.
                let u = rng.f32().max(1e-3);
                *v = [scale * (1.0 + 0.1 * x as f32) * (0.5 / u.sqrt()); 3];
            }
            plane
        };
        (0..SEEDS as u64).map(image).collect()
    }

    #[test]
    fn equal_distributions_pass_and_a_wrong_corner_does_not() {
        let reference = gather(&noisy(1, 1.0));
        let failed = |wrong: f32| {
            let (gates, pictures) = compare("noise", &gather(&noisy(2, wrong)), &reference, false);
            assert_eq!(pictures.blocks.size(), (8, 6));
            gates.into_iter().filter(|g| g.verdict == Verdict::Failed).map(|g| g.what).collect::<Vec<_>>()
        };
        assert_eq!(failed(1.0), Vec::<String>::new());
        let said = failed(1.2);
        assert!(said.iter().any(|w| w.contains("smallest p-value")), "{said:?}");
    }
}

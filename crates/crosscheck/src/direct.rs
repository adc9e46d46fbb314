//! Level 3: light of point lights along shared rays, without random numbers.

use crate::setting::{LUMINANCE, Setting};
use crate::stats::quantile;
use crate::{Bundle, Case, CrossError, Gate, Size, fixed};
use glam::Vec3;
use strandbench_renderer::accel::Hit;
use strandbench_renderer::{Offsets, PointLight, RenderScene};
use strandbench_scenes::{OpticsModel, Pigment};

/// Ratio of the means less 1.
const MEAN: f64 = 1e-3;
/// Median of the rays' relative differences.
const MEDIAN: f64 = 2e-3;
/// 99th percentile of them: what differs there is seen by one light in one renderer and not in the other.
const TAIL: f64 = 0.1;
/// Share of shadow tests that differ.
const FLIPS: f64 = 1e-3;
/// Share of rays that meet another segment: Mitsuba's open cones have no spheres at their joints.
const PRIMITIVES: f64 = 2e-3;
/// 99th percentile of the angle between tangents, degrees: single precision of a segment of 2 mm.
const TANGENT_DEG: f64 = 0.05;

fn setting(model: OpticsModel) -> Setting {
    Setting {
        strands: fixed::tuft(200, 24),
        model,
        pigment: Pigment { eumelanin: 0.6, pheomelanin: 0.15 },
        camera: fixed::camera(320, 240, 34.0),
        lights: Vec::new(),
    }
}

/// Four lights around the tuft, one of them behind it.
fn lights() -> [PointLight; 4] {
    let light = |x: f32, y: f32, z: f32, rgb: [f32; 3]| PointLight {
        position_mm: Vec3::new(x, y, z),
        intensity_rgb: rgb.map(|v| v * 1e5),
    };
    [
        light(300.0, 250.0, 300.0, [1.0, 0.9, 0.8]),
        light(-350.0, 50.0, 250.0, [0.8, 0.9, 1.0]),
        light(0.0, 400.0, -200.0, [1.0, 1.0, 1.0]),
        light(40.0, -120.0, 420.0, [0.5, 0.6, 0.7]),
    ]
}

pub(crate) fn cases(size: Size) -> Vec<Case> {
    let count = match size {
        Size::Fixture => 3_000,
        Size::Quick => 10_000,
        Size::Full => 200_000,
    };
    let make = |name: &str, model: OpticsModel| {
        let setting = setting(model);
        let rays = fixed::rays_at_fibres(&setting.camera, &setting.strands, count);
        let lights = lights();
        let input = setting
            .export(name)
            .with_vec3("origins", &rays.origins)
            .with_vec3("directions", &rays.directions)
            .with_vec3("light_mm", &lights.map(|l| l.position_mm))
            .with("intensity", &[lights.len(), 3], lights.iter().flat_map(|l| l.intensity_rgb));
        Case { level: 3, name: name.to_owned(), job: "direct", input }
    };
    vec![make("chiang", OpticsModel::Chiang), make("marschner", OpticsModel::Marschner)]
}

pub(crate) fn judge(case: &Case, answer: &Bundle) -> Result<Vec<Gate>, CrossError> {
    let model = if case.name == "marschner" { OpticsModel::Marschner } else { OpticsModel::Chiang };
    let setting = setting(model);
    let origins = case.input.vec3("origins", 0)?;
    let n = origins.len();
    let rays: Vec<_> = origins.into_iter().zip(case.input.vec3("directions", n)?).collect();
    let lights = lights();
    let t: Vec<f32> = answer.get("t", &[n])?;
    let primitive: Vec<i32> = answer.get("primitive", &[n])?;
    let tangent = answer.vec3("tangent", n)?;
    let visible: Vec<u8> = answer.get("visible", &[n, lights.len()])?;
    let radiance = answer.vec3("radiance", n)?;

    let scene = setting.scene()?;
    let render = RenderScene::new(&scene)?.flat_tangents();
    let ours = render.direct_from_points(&rays, &lights, Offsets::Mitsuba)?;
    let luminance = |v: Vec3| f64::from(v.dot(Vec3::from_array(LUMINANCE)));
    let (mut hits, mut renamed, mut flips, mut tests) = (0u64, 0u64, 0u64, 0u64);
    let (mut all, mut sums) = ((0.0, 0.0), (0.0, 0.0));
    let (mut relative, mut angles, mut dt) = (Vec::new(), Vec::new(), Vec::new());
    for (i, (mine, (origin, direction))) in ours.iter().zip(&rays).enumerate() {
        let theirs = luminance(radiance[i]);
        let own = luminance(Vec3::from_array(mine.radiance_rgb));
        hits += u64::from(primitive[i] >= 0);
        all.0 += own;
        all.1 += theirs;
        let segment = match mine.hit {
            Some(Hit::Fibre { strand, point, .. }) => (point - strand) as i32,
            _ => -1,
        };
        if segment != primitive[i] {
            renamed += 1;
            continue;
        }
        sums.0 += own;
        sums.1 += theirs;
        let Some(hit) = mine.hit else { continue };
        let Hit::Fibre { t: distance, .. } = hit else { continue };
        dt.push(f64::from((distance - t[i]).abs()));
        let own_tangent = render.surface_point(&hit, *origin, *direction).tangent;
        angles.push(f64::from(own_tangent.angle_between(tangent[i]).to_degrees()));
        for k in 0..lights.len() {
            tests += 1;
            flips += u64::from((mine.visible >> k & 1 == 1) != (visible[i * lights.len() + k] == 1));
        }
        if theirs > 0.0 || own > 0.0 {
            relative.push((own - theirs).abs() / own.max(theirs));
        }
    }
    let at_most = |what: &str, v: f64, l: f64, unit: &str| Gate::at_most(3, &case.name, what, v, l, unit);
    let lit = relative.len();
    Ok(vec![
        Gate::shown(3, &case.name, "rays", n as f64, "rays")
            .because(format!("{hits} hit, {lit} of them lit in either; {tests} shadow tests")),
        Gate::at_least(3, &case.name, "share of rays that hit", hits as f64 / n as f64, 0.5, "")
            .because("rays that miss everything prove little"),
        at_most("another segment", renamed as f64 / n as f64, PRIMITIVES, "of rays"),
        at_most("distance, 99th percentile", quantile(&mut dt, 0.99), 5e-4, "mm"),
        at_most("tangent, 99th percentile", quantile(&mut angles, 0.99), TANGENT_DEG, "degrees"),
        at_most("shadow tests that differ", flips as f64 / tests.max(1) as f64, FLIPS, "of tests"),
        at_most("ratio of the means less 1", (sums.0 / sums.1 - 1.0).abs(), MEAN, "")
            .because(format!(
                "over rays that met the same segment; over all rays {:.2e}, where ours end in spheres and theirs are open",
                all.0 / all.1 - 1.0
            )),
        at_most("per ray, median", quantile(&mut relative, 0.5), MEDIAN, ""),
        at_most("per ray, 99th percentile", quantile(&mut relative, 0.99), TAIL, ""),
    ])
}

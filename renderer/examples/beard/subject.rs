//! The bearded head: face, hairs, lights, cameras.

use glam::{DVec3, Vec3};
use std::sync::Arc;
use strandbench_rng::Rng;
use strandbench_scenes::face::{FaceModel, FaceSpec, Identity, Part};
use strandbench_scenes::{
    AreaLight, FibreOptics, Pigment, RigMotion, Scene, Sensor, SkinDetail, SkinOptics, SkinTexture, Surface,
};
use strandbench_types::{Camera, Rig, StrandSet};

const HAIRS: usize = 8000;

/// Sixteen banks of LEDs in four rows on a sphere around the face.
fn lights() -> Vec<AreaLight> {
    let mut out = Vec::new();
    for up in [-25.0f32, 5.0, 35.0, 60.0] {
        for left in [-65.0f32, -25.0, 25.0, 65.0] {
            let (u, l) = (up.to_radians(), left.to_radians());
            let from = Vec3::new(l.sin() * u.cos(), u.sin(), l.cos() * u.cos());
            let centre_mm = from * 1100.0 + Vec3::new(0.0, -40.0, 40.0);
            let half_u_mm = Vec3::Y.cross(-from).normalize() * 110.0;
            let half_v_mm = (-from).cross(half_u_mm).normalize() * 110.0;
            out.push(AreaLight { centre_mm, half_u_mm, half_v_mm, radiance_rgb: [3.2; 3] });
        }
    }
    out
}

/// How likely a place at rest bears hair: 0..1.
fn beard(p: Vec3) -> f32 {
    let mouth = Vec3::new(p.x * 0.8, p.y + 90.0, 0.0).length();
    let low = ((-62.0 - 0.12 * p.x.abs() - p.y) / 8.0).clamp(0.0, 1.0);
    let front = ((p.z - 25.0) / 10.0).clamp(0.0, 1.0) * ((p.y + 165.0) / 10.0).clamp(0.0, 1.0);
    let lips = ((mouth - 21.0) / 4.0).clamp(0.0, 1.0);
    low * front * lips
}

fn brow(p: Vec3) -> f32 {
    let x = p.x.abs();
    let line = 8.0 + 5.0 * (1.0 - ((x - 34.0) / 20.0).powi(2));
    let near = (1.0 - ((p.y - line) / 4.0).powi(2)).max(0.0);
    if (12.0..54.0).contains(&x) && p.z > 60.0 { near } else { 0.0 }
}

fn hairs(model: &FaceModel, rest: &[Vec3], posed: &[Vec3], normals: &[Vec3]) -> (StrandSet, Vec<Pigment>) {
    let places: Vec<[usize; 3]> = model
        .triangles()
        .iter()
        .zip(model.parts())
        .filter(|(_, p)| **p == Part::Skin)
        .map(|(t, _)| t.map(|k| k as usize))
        .collect();
    let mut sums = Vec::with_capacity(places.len());
    let mut total = 0.0f64;
    for t in &places {
        let [a, b, c] = t.map(|k| posed[k]);
        let middle = (rest[t[0]] + rest[t[1]] + rest[t[2]]) / 3.0;
        let density = beard(middle) + 1.5 * brow(middle);
        total += f64::from((b - a).cross(c - a).length() * density);
        sums.push(total);
    }
    let (mut strands, mut pigments) = (StrandSet::new(), Vec::new());
    for i in 0..HAIRS as u64 {
        let mut rng = Rng::keyed(&[0xBEA2D, i]);
        let mark = rng.f64() * total;
        let k = sums.partition_point(|&s| s <= mark).min(places.len() - 1);
        let (u, v) = (rng.f32().sqrt(), rng.f32());
        let w = [1.0 - u, u * (1.0 - v), u * v];
        let mix = |of: &[Vec3]| (0..3).map(|j| of[places[k][j]] * w[j]).sum::<Vec3>();
        let (root, n, at) = (mix(posed), mix(normals).normalize(), mix(rest));
        let is_brow = brow(at) > beard(at);
        let way = if is_brow {
            Vec3::new(at.x.signum(), 0.25, 0.0)
        } else {
            Vec3::new(0.25 * at.x / 40.0, -1.0, 0.0)
        };
        let along = way.reject_from_normalized(n).normalize();
        let length = if is_brow { rng.range(5.0, 9.0) } else { rng.range(7.0, 16.0) };
        let stray = Vec3::new(rng.range(-1.0, 1.0), rng.range(-1.0, 1.0), rng.range(-1.0, 1.0)) * 0.35;
        let mut direction = (n * 0.8 + along * 0.9 + stray).normalize();
        let mut p = root - n * 0.1;
        let mut points = vec![p];
        for _ in 0..12 {
            direction = (direction + along * 0.09 + stray * 0.06).normalize();
            p += direction * length / 12.0;
            points.push(p);
        }
        strands.push(&points, rng.range(0.03, 0.055));
        let fair = if rng.f32() < 0.08 { 0.15 } else { rng.range(0.8, 1.8) };
        pigments.push(Pigment { eumelanin: fair, pheomelanin: 0.3 });
    }
    (strands, pigments)
}

/// Where a close-up's middle is, mm, and its size in pixels at the scale of the whole; or the whole.
fn camera(view: &str) -> Result<Camera, String> {
    let (eye, middle) = (DVec3::new(330.0, -20.0, 1000.0), DVec3::new(0.0, -45.0, 60.0));
    let whole = (1536, 2048);
    let focal_px = 2048.0 / 250.0 * (eye - middle).length();
    let close = |x: f64, y: f64, z: f64| {
        let mut c = Camera::look_at("c", whole, focal_px, eye, middle, DVec3::NEG_Y);
        let at = c.to_camera(DVec3::new(x, y, z));
        let px = c.focal_px * glam::DVec2::new(at.x, at.y) / at.z + c.principal_px;
        c.principal_px -= px - glam::DVec2::new(240.0, 180.0);
        (c.width, c.height) = (480, 360);
        c
    };
    Ok(match view {
        "whole" => Camera::look_at("c", whole, focal_px, eye, middle, DVec3::NEG_Y),
        "beard" => close(20.0, -115.0, 105.0),
        "cheek" => close(40.0, -48.0, 90.0),
        "eye" => close(32.0, -10.0, 98.0),
        "mouth" => close(2.0, -88.0, 118.0),
        _ => {
            let (w, h) = view.split_once('x').ok_or(format!("{view}: no such view"))?;
            let size = w.parse::<u32>().and_then(|w| h.parse::<u32>().map(|h| (w, h)));
            let size = size.map_err(|e| format!("{view}: {e}"))?;
            Camera::look_at("c", size, focal_px * f64::from(size.1) / 2048.0, eye, middle, DVec3::NEG_Y)
        }
    })
}

pub fn scene(view: &str, crossed: bool, below: bool) -> Result<Scene, String> {
    let model = FaceModel::embedded();
    let spec = FaceSpec { identity: 4, male: Some(1.0), ..FaceSpec::default() };
    let identity = Identity::draw(model, &spec).map_err(|e| e.to_string())?;
    let face = model.pose(&identity, &model.neutral()).map_err(|e| e.to_string())?;
    let rest = Identity::mean(model).vertices(model);
    let texture = SkinTexture { seed: 3, ..SkinTexture::default() };
    let part = |parts: &[Part]| model.part_mesh(&face.vertices, parts);
    let skin_rest = model.part_mesh(&rest, &[Part::Skin]).vertices;
    let stubble = skin_rest.iter().map(|&p| 0.7 * beard(p)).collect();
    let eyes = [Part::LeftEye, Part::RightEye];
    let detailed = |mesh, detail| Surface { mesh, albedo_rgb: [0.5; 3], detail: Some(Arc::new(detail)) };
    let surfaces = vec![
        detailed(part(&[Part::Skin]), SkinDetail::skin(texture.clone(), skin_rest, stubble)),
        detailed(part(&eyes), SkinDetail::eyes(texture, model.part_mesh(&rest, &eyes).vertices)),
        Surface::plain(part(&[Part::UpperTeeth, Part::LowerTeeth]), [0.7, 0.66, 0.58]),
        Surface::plain(part(&[Part::Tongue]), [0.4, 0.18, 0.17]),
    ];
    let (strands, pigments) = hairs(model, &rest, &face.vertices, &face.normals);
    let rig = Rig {
        cameras: vec![camera(view)?],
        near_mm: 600.0,
        far_mm: 1500.0,
        frame_rate_hz: 25.0,
        exposure_s: 1e-3,
    };
    Ok(Scene {
        name: "beard".into(),
        strands,
        pigments,
        optics: FibreOptics::default(),
        surfaces,
        lights: lights(),
        calibrated_rig: rig.clone(),
        rig,
        skin: SkinOptics { scatter_mm: if below { 2.72 } else { 0.0 }, ..SkinOptics::default() },
        environment: None,
        lens: None,
        motion: RigMotion::default(),
        polarised: vec![crossed],
        sensor: Sensor { full_scale_radiance: 0.4, response_rgb: [1.0 / 3.0; 3], ..Sensor::default() },
        background_rgb: [0.02; 3],
        head_breadth_mm: 155.0,
    })
}

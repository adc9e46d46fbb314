//! Renders faces on a contact sheet, to look at.
//!
//! `faces out.png [identities | expressions | rotation | dialogue | smile-puff | brows] [SEED] [LEFT_DEG UP_DEG]`
//!
//! Rows are persons drawn from SEED on. `identities` shows ten neutral persons, `expressions` five persons in four
//! expressions, the others six moments of a performance. The camera stands LEFT_DEG to the subject's left and UP_DEG
//! above the face.

use glam::{DVec3, Vec3};
use strandbench_renderer::{RenderScene, Settings};
use strandbench_scenes::face::{Act, FaceModel, FacePose, FaceSpec, Identity, Part, Performance, PosedFace};
use strandbench_scenes::{AreaLight, FibreOptics, RigMotion, Scene, Sensor, SkinOptics, Surface};
use strandbench_types::{Camera, Rig, Silent, StrandSet};

const SIZE_PX: (u32, u32) = (280, 340);

const SHOWN: [&[(&str, f32)]; 4] = [
    &[],
    &[("jawOpen", 0.8), ("eyeBlinkLeft", 1.0), ("eyeBlinkRight", 1.0)],
    &[
        ("mouthSmileLeft", 0.9),
        ("mouthSmileRight", 0.9),
        ("cheekSquintLeft", 0.5),
        ("cheekSquintRight", 0.5),
        ("browInnerUp", 0.7),
    ],
    &[("mouthPucker", 0.8), ("cheekPuff", 0.7), ("browDownLeft", 0.9), ("browDownRight", 0.9)],
];

fn light(centre_mm: Vec3, radiance: f32) -> AreaLight {
    let n = -centre_mm.normalize();
    let u = Vec3::Y.cross(n).normalize();
    let (half_u_mm, half_v_mm) = (u * 300.0, n.cross(u) * 300.0);
    AreaLight { centre_mm, half_u_mm, half_v_mm, radiance_rgb: [radiance; 3] }
}

fn scene(model: &FaceModel, face: &PosedFace, from: DVec3) -> Scene {
    let surface =
        |parts: &[Part], albedo_rgb| Surface::plain(model.part_mesh(&face.vertices, parts), albedo_rgb);
    let middle = DVec3::new(0.0, -35.0, 30.0);
    let camera = Camera::look_at("c", SIZE_PX, 980.0, middle + from * 1100.0, middle, DVec3::NEG_Y);
    let rig =
        Rig { cameras: vec![camera], near_mm: 700.0, far_mm: 1500.0, frame_rate_hz: 25.0, exposure_s: 1e-3 };
    Scene {
        name: "face".into(),
        strands: StrandSet::new(),
        pigments: Vec::new(),
        optics: FibreOptics::default(),
        surfaces: vec![
            surface(&[Part::Skin], [0.5; 3]),
            surface(&[Part::LeftEye, Part::RightEye], [0.7; 3]),
            surface(&[Part::UpperTeeth, Part::LowerTeeth], [0.8; 3]),
            surface(&[Part::Tongue], [0.4, 0.2, 0.2]),
        ],
        lights: vec![
            light(Vec3::new(-900.0, 700.0, 900.0), 5.0),
            light(Vec3::new(900.0, 300.0, 1000.0), 2.5),
            light(Vec3::new(0.0, -700.0, 900.0), 0.8),
        ],
        calibrated_rig: rig.clone(),
        rig,
        skin: SkinOptics::default(),
        environment: None,
        lens: None,
        motion: RigMotion::default(),
        polarised: Vec::new(),
        sensor: Sensor { full_scale_radiance: 0.4, ..Sensor::default() },
        background_rgb: [0.02; 3],
        head_breadth_mm: 155.0,
    }
}

fn srgb(v: f32) -> u8 {
    let v = v.clamp(0.0, 1.0);
    let s = if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
    (s * 255.0 + 0.5) as u8
}

fn moments(model: &FaceModel, what: &str, seed: u64) -> Result<Vec<(u64, FacePose)>, String> {
    let act = match what {
        "identities" => return Ok((0..10).map(|i| (seed + i, model.neutral())).collect()),
        "expressions" => {
            let mut out = Vec::new();
            for i in 0..5 {
                for named in SHOWN {
                    let weights = model.weights(named.iter().copied()).map_err(|e| e.to_string())?;
                    out.push((seed + i, FacePose { weights, ..model.neutral() }));
                }
            }
            return Ok(out);
        }
        "rotation" => Act::Rotation,
        "dialogue" => Act::Dialogue,
        "smile-puff" => Act::SmilePuff,
        "brows" => Act::Brows,
        _ => return Err(format!("{what}: neither identities, expressions nor an act")),
    };
    let p = Performance { act, seed };
    Ok((0..8).map(|k| (seed, p.pose(model, (0.5 + f64::from(k)) / 8.0 * p.duration_s()))).collect())
}

fn run() -> Result<(), String> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let number = |i: usize, default: f64| -> Result<f64, String> {
        args.get(i).map_or(Ok(default), |a| a.parse().map_err(|e| format!("{a}: {e}")))
    };
    let out = args.first().ok_or("usage: faces out.png [WHAT] [SEED] [LEFT_DEG UP_DEG]")?;
    let what = args.get(1).map_or("expressions", String::as_str);
    let (left, up) = (number(3, 15.0)?.to_radians(), number(4, 5.0)?.to_radians());
    let from = DVec3::new(left.sin() * up.cos(), up.sin(), left.cos() * up.cos());
    let clock = std::time::Instant::now();
    let model = FaceModel::embedded();
    eprintln!("load: {:.1} ms, {} vertices", clock.elapsed().as_secs_f64() * 1e3, model.vertex_count());
    let moments = moments(model, what, number(2, 1.0)? as u64)?;
    let columns = if what == "identities" { 5 } else { 4 };
    let rows = (moments.len() as u32).div_ceil(columns);
    let mut sheet = image::RgbImage::new(columns * SIZE_PX.0, rows * SIZE_PX.1);
    for (k, (seed, pose)) in (0..).zip(&moments) {
        let spec = FaceSpec { identity: *seed, ..FaceSpec::default() };
        let identity = Identity::draw(model, &spec).map_err(|e| e.to_string())?;
        let clock = std::time::Instant::now();
        let face = model.pose(&identity, pose).map_err(|e| e.to_string())?;
        eprintln!("pose {k}: {:.1} ms", clock.elapsed().as_secs_f64() * 1e3);
        let scene = scene(model, &face, from);
        let prepared = RenderScene::new(&scene).map_err(|e| e.to_string())?;
        let settings =
            Settings { samples_per_pixel: 16, max_samples_per_pixel: 16, depth: 3, ..Settings::default() };
        let view = prepared.render(0, &settings, 1, &Silent).map_err(|e| e.to_string())?;
        let (w, _) = view.radiance_rgb.size();
        for (i, c) in view.radiance_rgb.data.iter().enumerate() {
            let (x, y) =
                ((i % w) as u32 + (k % columns) * SIZE_PX.0, (i / w) as u32 + (k / columns) * SIZE_PX.1);
            sheet.put_pixel(x, y, image::Rgb(c.map(|v| srgb(v / scene.sensor.full_scale_radiance))));
        }
    }
    sheet.save(out).map_err(|e| format!("{out}: {e}"))
}

fn main() -> std::process::ExitCode {
    match run() {
        Ok(()) => std::process::ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("faces: {e}");
            std::process::ExitCode::FAILURE
        }
    }
}

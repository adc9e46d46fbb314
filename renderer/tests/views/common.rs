//! Small scenes for tests of whole views.

use glam::{DVec3, Vec3};
use strandbench_renderer::{Render, RenderScene, Settings};
use strandbench_scenes::{AreaLight, FibreOptics, Pigment, RigMotion, Scene, Sensor, SkinOptics, Surface};
use strandbench_types::{Camera, Rig, Silent, StrandSet, TriMesh};

pub const EYE: DVec3 = DVec3::new(0.0, 0.0, 900.0);

/// A camera on +z that looks at the origin; 0.5 mm a pixel at the origin.
pub fn camera(width: u32, height: u32) -> Camera {
    Camera::look_at("c0", (width, height), 1800.0, EYE, DVec3::ZERO, DVec3::NEG_Y)
}

/// A square light of half side `half` at `centre` that faces the origin.
pub fn light(centre: Vec3, half: f32, radiance: f32) -> AreaLight {
    let n = -centre.normalize();
    let u = n.any_orthonormal_vector();
    AreaLight {
        centre_mm: centre,
        half_u_mm: u * half,
        half_v_mm: n.cross(u) * half,
        radiance_rgb: [radiance, 0.5 * radiance, 0.25 * radiance],
    }
}

pub fn scene(strands: StrandSet, surfaces: Vec<Surface>, lights: Vec<AreaLight>, size: (u32, u32)) -> Scene {
    let rig = Rig {
        cameras: vec![camera(size.0, size.1)],
        near_mm: 800.0,
        far_mm: 1000.0,
        frame_rate_hz: 100.0,
        exposure_s: 1e-3,
    };
    Scene {
        name: "test".into(),
        pigments: vec![Pigment { eumelanin: 0.5, pheomelanin: 0.0 }; strands.len()],
        strands,
        optics: FibreOptics::default(),
        surfaces,
        lights,
        calibrated_rig: rig.clone(),
        rig,
        skin: SkinOptics::default(),
        environment: None,
        lens: None,
        motion: RigMotion::default(),
        polarised: Vec::new(),
        sensor: Sensor::default(),
        background_rgb: [0.0; 3],
        head_breadth_mm: 155.0,
    }
}

/// Direct light from a fixed number of rays.
pub fn fixed(samples: u32) -> Settings {
    Settings {
        samples_per_pixel: samples,
        max_samples_per_pixel: samples,
        noise_target: 0.0,
        depth: 1,
        clamp: 0.0,
        ..Settings::default()
    }
}

pub fn render(scene: &Scene, settings: &Settings, seed: u64) -> Render {
    RenderScene::new(scene).unwrap().render(0, settings, seed, &Silent).unwrap()
}

/// Vertical fibre through `x`, root at the bottom.
pub fn fibre(x: f32, radius: f32) -> StrandSet {
    let mut s = StrandSet::new();
    s.push(&(-20..=20).map(|i| Vec3::new(x, i as f32 * 2.0, 0.0)).collect::<Vec<_>>(), radius);
    s
}

pub fn plate(half: f32, z: f32) -> TriMesh {
    TriMesh {
        vertices: [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
            .map(|(x, y)| Vec3::new(x * half, y * half, z))
            .to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    }
}

pub fn tuft(n: usize) -> StrandSet {
    let mut set = StrandSet::new();
    for i in 0..n {
        let mut rng = strandbench_rng::Rng::keyed(&[4, i as u64]);
        let (x, z) = (rng.range(-8.0, 8.0), rng.range(-8.0, 8.0));
        let lean = rng.range(-0.2, 0.2);
        let points: Vec<Vec3> =
            (0..12).map(|k| Vec3::new(x + lean * k as f32 * 2.0, 10.0 - 2.0 * k as f32, z)).collect();
        set.push(&points, rng.range(0.03, 0.05));
    }
    set
}

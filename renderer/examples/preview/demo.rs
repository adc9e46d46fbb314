//! A hand-made tuft on a ball: enough to see fibres, light and shadow without any scene file.

use glam::{DVec3, Vec3};
use strandbench_rng::Rng;
use strandbench_scenes::{AreaLight, FibreOptics, Pigment, RigMotion, Scene, Sensor, SkinOptics, Surface};
use strandbench_types::{Camera, Rig, StrandSet, TriMesh};

/// A ball of radius `r` mm of `n` by `2 n` facets.
fn ball(r: f32, n: u32) -> TriMesh {
    let mut mesh = TriMesh::default();
    for i in 0..=n {
        for j in 0..2 * n {
            let (t, p) = (i as f32 / n as f32, j as f32 / n as f32);
            let (a, b) = (t * std::f32::consts::PI, p * std::f32::consts::PI);
            mesh.vertices.push(Vec3::new(a.sin() * b.cos(), a.cos(), a.sin() * b.sin()) * r);
        }
    }
    for i in 0..n {
        for j in 0..2 * n {
            let k = (j + 1) % (2 * n);
            let at = |i: u32, j: u32| i * 2 * n + j;
            mesh.triangles.push([at(i, j), at(i, k), at(i + 1, j)]);
            mesh.triangles.push([at(i, k), at(i + 1, k), at(i + 1, j)]);
        }
    }
    mesh
}

/// 20,000 wavy fibres that hang from the upper half of a ball of 90 mm radius.
pub fn tuft() -> Scene {
    let mut strands = StrandSet::new();
    let mut pigments = Vec::new();
    for i in 0..20_000u64 {
        let mut rng = Rng::keyed(&[7, i]);
        let z = rng.range(-0.1, 1.0);
        let phi = rng.range(0.0, std::f32::consts::TAU);
        let flat = (1.0 - z * z).sqrt();
        let out = Vec3::new(flat * phi.cos(), z, flat * phi.sin());
        let lock = (phi * 9.0).floor();
        let (phase, size) = (lock * 1.7 + rng.range(0.0, 0.8), rng.range(1.5, 3.0));
        let mut p = out * 90.0;
        let mut direction = (out + Vec3::new(0.0, 0.3, 0.0)).normalize();
        let mut points = vec![p];
        for k in 0..40 {
            direction = (direction + Vec3::new(0.0, -0.12, 0.0)).normalize();
            p += direction * 4.0;
            if p.length() < 91.0 {
                p = p.normalize() * 91.0;
            }
            let wave = (k as f32 * 0.35 + phase).sin() * size * (k as f32 / 10.0).min(1.0);
            points.push(p + out.cross(Vec3::Y).normalize_or_zero() * wave);
        }
        strands.push(&points, rng.range(0.03, 0.045));
        pigments.push(Pigment { eumelanin: rng.range(0.8, 1.4), pheomelanin: 0.3 });
    }
    let light = |x: f32, y: f32, radiance: f32| {
        let centre = Vec3::new(x, y, 1200.0);
        let n = -centre.normalize();
        let u = n.cross(Vec3::Y).normalize() * 250.0;
        let v = n.cross(u.normalize()) * 250.0;
        let (half_u_mm, half_v_mm) = if u.cross(v).dot(n) > 0.0 { (u, v) } else { (v, u) };
        AreaLight { centre_mm: centre, half_u_mm, half_v_mm, radiance_rgb: [radiance; 3] }
    };
    let camera =
        Camera::look_at("c0", (640, 480), 1400.0, DVec3::new(0.0, 0.0, 900.0), DVec3::ZERO, DVec3::NEG_Y);
    let rig =
        Rig { cameras: vec![camera], near_mm: 700.0, far_mm: 1100.0, frame_rate_hz: 100.0, exposure_s: 1e-3 };
    Scene {
        name: "demo".into(),
        strands,
        pigments,
        optics: FibreOptics::default(),
        surfaces: vec![Surface::plain(ball(90.0, 40), [0.7, 0.5, 0.4])],
        lights: vec![light(-900.0, 700.0, 60.0), light(900.0, 700.0, 60.0), light(0.0, -300.0, 40.0)],
        calibrated_rig: rig.clone(),
        rig,
        skin: SkinOptics::default(),
        environment: None,
        lens: None,
        motion: RigMotion::default(),
        polarised: Vec::new(),
        sensor: Sensor { full_scale_radiance: 1.0, ..Sensor::default() },
        background_rgb: [0.02; 3],
        head_breadth_mm: 155.0,
    }
}

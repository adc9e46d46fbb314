//! The hair that everything is timed on.

use glam::{DVec3, Vec3};
use strandbench_rng::Rng;
use strandbench_scenes::{
    AreaLight, FibreOptics, OpticsModel, Pigment, RigMotion, Scene, Sensor, SkinOptics,
};
use strandbench_types::{Camera, Rig, StrandSet};

/// Radius of the ball on which the strands are rooted, mm.
const HEAD_MM: f32 = 90.0;
/// Length of a strand, mm.
const LENGTH_MM: f32 = 200.0;

/// Brown hair: absorption per fibre radius at least 0.8 in each channel, below which Mitsuba 3.9.1's sampling of
/// hair is visibly biased.
pub const PIGMENT: Pigment = Pigment { eumelanin: 2.0, pheomelanin: 0.3 };
/// Chiang's model with the parameters that Mitsuba's `hair` is given too.
pub fn optics() -> FibreOptics {
    FibreOptics {
        model: OpticsModel::Chiang,
        longitudinal_roughness: Some(0.3),
        azimuthal_roughness: Some(0.3),
        scale_tilt_deg: Some(-2.0),
        ..FibreOptics::default()
    }
}

/// `strands` wavy strands of `segments` segments each, 200 mm long and 0.06-0.09 mm thick, that hang in locks from
/// the upper part of a ball of 90 mm radius around the origin.
pub fn wavy(strands: usize, segments: usize, seed: u64) -> StrandSet {
    let mut set = StrandSet::new();
    let step = LENGTH_MM / segments as f32;
    let mut points = Vec::with_capacity(segments + 1);
    for i in 0..strands as u64 {
        let mut rng = Rng::keyed(&[seed, 0x7761_7679, i]);
        let (z, phi) = (rng.range(-0.1, 1.0), rng.range(0.0, std::f32::consts::TAU));
        let flat = (1.0 - z * z).sqrt();
        let out = Vec3::new(flat * libm::cosf(phi), z, flat * libm::sinf(phi));
        let lock = (phi * 9.0).floor();
        let (phase, size) = (lock * 1.7 + rng.range(0.0, 0.8), rng.range(1.5, 3.0));
        let across = out.cross(Vec3::Y).normalize_or_zero();
        let mut p = out * HEAD_MM;
        let mut direction = (out + Vec3::new(0.0, 0.3, 0.0)).normalize();
        points.clear();
        points.push(p);
        for k in 1..=segments {
            direction = (direction - Vec3::Y * (0.03 * step)).normalize();
            p += direction * step;
            if p.length() < HEAD_MM + 1.0 {
                p = p.normalize() * (HEAD_MM + 1.0);
            }
            let from_root = k as f32 * step;
            let wave = libm::sinf(from_root * 0.0875 + phase) * size * (from_root / 40.0).min(1.0);
            points.push(p + across * wave);
        }
        set.push(&points, rng.range(0.03, 0.045));
    }
    set
}

/// A camera that the whole of the hair fills, `width` x `height` pixels.
pub fn camera((width, height): (u32, u32)) -> Camera {
    Camera::look_at(
        "front",
        (width, height),
        f64::from(width) * 2.2,
        DVec3::new(0.0, -20.0, 900.0),
        DVec3::new(0.0, -20.0, 0.0),
        DVec3::NEG_Y,
    )
}

/// The strands before [`camera`], lit by [`light`] alone.
pub fn scene(strands: StrandSet, size: (u32, u32)) -> Scene {
    let camera = camera(size);
    let rig =
        Rig { cameras: vec![camera], near_mm: 600.0, far_mm: 1200.0, frame_rate_hz: 100.0, exposure_s: 1e-3 };
    Scene {
        name: "bench".into(),
        pigments: vec![PIGMENT; strands.len()],
        strands,
        optics: optics(),
        surfaces: Vec::new(),
        skin: SkinOptics::default(),
        lights: vec![light()],
        environment: None,
        lens: None,
        motion: RigMotion::default(),
        polarised: Vec::new(),
        calibrated_rig: rig.clone(),
        rig,
        sensor: Sensor { full_scale_radiance: 1.0, ..Sensor::default() },
        background_rgb: [0.0; 3],
        head_breadth_mm: 155.0,
    }
}

/// A square of 500 mm that looks at the origin from 1.5 m.
pub fn light() -> AreaLight {
    let centre_mm = Vec3::new(-700.0, 800.0, 1000.0);
    let towards = -centre_mm.normalize();
    let half_v_mm = towards.cross(Vec3::X).normalize() * 250.0;
    let half_u_mm = half_v_mm.cross(towards).normalize() * 250.0;
    AreaLight { centre_mm, half_u_mm, half_v_mm, radiance_rgb: [40.0; 3] }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hair_has_the_size_asked_for_and_the_light_looks_at_it() {
        let set = wavy(30, 7, 1);
        assert_eq!((set.len(), set.points.len()), (30, 240));
        set.validate().unwrap();
        assert_eq!(set, wavy(30, 7, 1));
        assert_ne!(set, wavy(30, 7, 2));
        assert!(set.points.iter().all(|p| p.length() < 2.0 * LENGTH_MM + HEAD_MM));
        let l = light();
        // The side that emits: half_u x half_v.
        assert!(l.half_u_mm.cross(l.half_v_mm).dot(-l.centre_mm) > 0.0);
    }
}

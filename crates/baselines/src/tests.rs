use super::*;
use crate::testing::{DISTANCE_MM, Shape, frame, rig};
use glam::{DVec2, DVec3};
use strandbench_types::{Plane, Silent};

const RADIUS_MM: f64 = 80.0;
const FOCAL_PX: f64 = 1200.0;

fn run(name: &str, rig: &Rig, frame: &Frame) -> Result<Reconstruction, BaselineError> {
    reconstruct(rig, frame, &Baseline::named(name).unwrap(), &Silent)
}

fn ball() -> (Rig, Frame) {
    let rig = rig((320, 240), FOCAL_PX);
    let frame = frame(&rig, Shape::Ball(RADIUS_MM));
    (rig, frame)
}

/// First depth of a reference ray at which all other cameras' cones around the ball hold it, by small steps.
fn cone_depth(rig: &Rig, pixel: DVec2) -> f64 {
    let c = &rig.cameras[0];
    let inside = |z: f64| {
        let at = c.unproject(pixel, z);
        rig.cameras[1..].iter().all(|k| {
            let (o, d) = (k.centre_mm(), at - k.centre_mm());
            let sine = RADIUS_MM / o.length();
            d.angle_between(-o) <= sine.asin()
        })
    };
    let step = 0.02;
    (0..40_000).map(|i| rig.near_mm + f64::from(i) * step).find(|&z| inside(z)).unwrap()
}

#[test]
fn the_hull_of_a_ball_is_where_the_tangent_cones_meet() {
    let (rig, frame) = ball();
    let made = run("visual-hull", &rig, &frame).unwrap().estimate;
    let depth = made.depth.unwrap();
    // A pixel of the other camera is worth z² / (f B) of depth; a mask is off by up to half a pixel along each axis.
    let slack = DISTANCE_MM * DISTANCE_MM / (FOCAL_PX * 150.0);
    for (x, y) in [(160, 120), (170, 110), (150, 135)] {
        let want = cone_depth(&rig, DVec2::new(x as f64 + 0.5, y as f64 + 0.5));
        let got = f64::from(depth.get(x, y).unwrap());
        assert!((got - want).abs() < slack, "({x}, {y}): {got} for {want}");
    }
    // Nothing of the ball lies outside the hull; masks by pixel centres cut off at most half a diagonal.
    let c = &rig.cameras[0];
    let shape = Shape::Ball(RADIUS_MM);
    let mut seen = 0;
    for i in 0..320 * 240usize {
        let pixel = DVec2::new((i % 320) as f64 + 0.5, (i / 320) as f64 + 0.5);
        if let (Some(z), Some(t)) = (depth.get_index(i), shape.hit(c.centre_mm(), c.ray_direction(pixel))) {
            assert!(f64::from(z) <= t + slack, "pixel {i}: the hull {z} lies behind the ball {t}");
            seen += 1;
        }
    }
    let hair = frame.masks[0].data.iter().filter(|m| **m).count();
    assert!(seen * 50 > hair * 49, "{seen} of {hair}");
    let mesh = made.envelope.unwrap();
    mesh.validate().unwrap();
    let footprint = DISTANCE_MM / FOCAL_PX;
    let least = mesh.vertices.iter().map(|v| v.as_dvec3().length()).fold(f64::INFINITY, f64::min);
    assert!(least > RADIUS_MM - 1.5 * footprint, "{least} mm");
    assert!(least < RADIUS_MM + 4.0, "it touches the ball: {least} mm");
}

#[test]
fn the_constant_is_the_depth_that_the_rig_is_aimed_at() {
    let (rig, frame) = ball();
    let depth = run("constant-depth", &rig, &frame).unwrap().estimate.depth.unwrap();
    for (i, &hair) in frame.masks[0].data.iter().enumerate() {
        match depth.get_index(i) {
            Some(z) => assert!(hair && (f64::from(z) - DISTANCE_MM).abs() < 1e-3, "{z}"),
            None => assert!(!hair),
        }
    }
    // Where the world's origin lies does not matter.
    let mut moved = rig.clone();
    for c in &mut moved.cameras {
        c.translation_mm -= c.camera_from_world * DVec3::new(40.0, -70.0, 300.0);
    }
    let answer = run("constant-depth", &moved, &frame).unwrap().estimate.depth.unwrap();
    assert!((f64::from(answer.get(160, 120).unwrap()) - DISTANCE_MM).abs() < 1e-3);
    // Parallel cameras are aimed nowhere, and one camera neither: the middle of the working volume.
    let mut parallel = rig.clone();
    for (k, c) in parallel.cameras.iter_mut().enumerate() {
        let name = c.name.clone();
        let eye = DVec3::new(k as f64 * 100.0, 0.0, DISTANCE_MM);
        *c = strandbench_types::Camera::look_at(
            &name,
            (320, 240),
            FOCAL_PX,
            eye,
            eye - DVec3::Z,
            DVec3::NEG_Y,
        );
    }
    let answer = run("constant-depth", &parallel, &frame).unwrap().estimate.depth.unwrap();
    assert_eq!(answer.get(160, 120), Some(900.0));
    let alone = Rig { cameras: rig.cameras[..1].to_vec(), near_mm: 400.0, ..rig };
    let one = Frame { index: 0, images: frame.images[..1].to_vec(), masks: frame.masks[..1].to_vec() };
    let answer = run("constant-depth", &alone, &one).unwrap().estimate.depth.unwrap();
    assert_eq!(answer.get(160, 120), Some(850.0));
    assert!(matches!(run("visual-hull", &alone, &one), Err(BaselineError::Cameras { cameras: 1, .. })));
}

#[test]
fn masks_that_share_nothing_and_cancelled_work_are_errors() {
    struct Stop;
    impl Monitor for Stop {
        fn begin(&self, _: &str, _: u64) {}
        fn advance(&self, _: u64) {}
        fn cancelled(&self) -> bool {
            true
        }
    }
    let (rig, mut frame) = ball();
    for b in BASELINES {
        let stopped = reconstruct(&rig, &frame, b, &Stop);
        assert!(matches!(stopped, Err(BaselineError::Cancelled(_))), "{}", b.name);
    }
    // A working volume that the left camera sees all of.
    let rig = Rig { near_mm: 850.0, far_mm: 950.0, ..rig };
    frame.masks[1] = Plane::filled(320, 240, false);
    let fault = run("visual-hull", &rig, &frame).map(|_| ()).unwrap_err();
    assert!(matches!(fault, BaselineError::NoHull { .. }), "{fault}");
}

//! The whole method on painted surfaces, its variants, and what it refuses.

mod common;

use common::{Shape, Streaks};
use glam::DVec3;
use std::sync::atomic::{AtomicU64, Ordering};
use strandbench_recon::{LUO, Minimiser, ReconError, Reconstruction, VARIANTS, Variant, reconstruct};
use strandbench_types::{Cancelled, Frame, Monitor, Plane, Rig, Silent};

const STREAKS: Streaks = Streaks { seed: 3, width_mm: 3.0, wave_mm: 4.0 };
const BALL: Shape = Shape::Sphere { radius_mm: 80.0 };

fn scene(shape: Shape) -> (Rig, Frame) {
    let rig = common::rig((128, 96), 420.0, 170.0);
    let frame = common::frame(&rig, shape, STREAKS, 2);
    (rig, frame)
}

fn small(variant: &Variant) -> Variant {
    let mut v = *variant;
    v.parameters.labels = 64;
    v.parameters.levels = v.parameters.levels.min(3);
    v
}

fn run(rig: &Rig, frame: &Frame, variant: &Variant) -> Reconstruction {
    reconstruct(rig, frame, variant, &Silent).unwrap()
}

fn errors(rig: &Rig, frame: &Frame, shape: Shape, r: &Reconstruction) -> Vec<f64> {
    common::errors_mm(rig, shape, &frame.masks[0], r.estimate.depth.as_ref().unwrap(), 2)
}

/// Depth that shifts a point by one pixel between the reference and the left camera, mm: z² / (f b).
const DISPARITY_PX_MM: f64 = 900.0 * 900.0 / (420.0 * 170.0);

#[test]
fn a_tilted_plane_and_a_sphere_come_out_below_a_pixel_of_disparity() {
    let tilted = DVec3::new(0.35, -0.25, 1.0).normalize();
    for shape in [Shape::Square { normal: tilted, half_mm: 75.0 }, BALL] {
        let (rig, frame) = scene(shape);
        let r = run(&rig, &frame, &small(&LUO));
        let e = errors(&rig, &frame, shape, &r);
        let (m, q) = (common::quantile(&e, 0.5), common::quantile(&e, 0.9));
        println!("{shape:?}: median {m:.3} mm, p90 {q:.3} mm, a pixel is {DISPARITY_PX_MM:.1} mm");
        assert!(
            e.len() > 2000 && m < 0.25 * DISPARITY_PX_MM && q < DISPARITY_PX_MM,
            "{shape:?}: {m}, {q} mm"
        );
        let depth = r.estimate.depth.unwrap();
        for (i, hair) in frame.masks[0].data.iter().enumerate() {
            assert_eq!(depth.get_index(i).is_some(), *hair, "answered exactly in the mask");
        }
        let mesh = r.estimate.envelope.unwrap();
        mesh.validate().unwrap();
        let eye = rig.cameras[0].centre_mm().as_vec3();
        for t in &mesh.triangles {
            let [a, b, c] = t.map(|i| mesh.vertices[i as usize]);
            assert!((b - a).cross(c - a).dot(eye - a) > 0.0);
        }
        let d = &r.diagnostics;
        assert!(d.lower_bound.unwrap() <= d.energy && d.gap.unwrap() < 0.05, "{d:?}");
        assert_eq!(d.parameters["labels"], "64");
    }
}

#[test]
fn lines_in_space_lie_on_the_sphere_along_its_streaks() {
    let (rig, frame) = scene(BALL);
    let r = run(&rig, &frame, &small(&LUO));
    let lines = r.estimate.orientation_3d.unwrap();
    let mut errors = Vec::new();
    for (i, l) in lines.data.iter().enumerate().filter(|(_, l)| **l != glam::Vec3::ZERO) {
        assert!((l.length() - 1.0).abs() < 1e-5);
        let pixel = glam::DVec2::new((i % 128) as f64 + 0.5, (i / 128) as f64 + 0.5);
        let Some(z) = common::depth(BALL, &rig.cameras[0], pixel) else { continue };
        let n = rig.cameras[0].unproject(pixel, z).normalize();
        if n.z > 0.6 && n.y.abs() < 0.6 {
            errors.push(f64::from(l.as_dvec3().dot(n).abs() as f32).asin().to_degrees());
        }
    }
    errors.sort_by(f64::total_cmp);
    let median = common::quantile(&errors, 0.5);
    println!("{} lines leave the sphere's surface by {median:.2} degrees (median)", errors.len());
    assert!(errors.len() > 500 && median < 12.0, "{median} degrees");
}

#[test]
fn every_variant_runs_and_answers() {
    let (rig, frame) = scene(BALL);
    for v in VARIANTS {
        let mut v = small(v);
        v.parameters.labels = 24;
        let r = run(&rig, &frame, &v);
        let e = errors(&rig, &frame, BALL, &r);
        let m = common::quantile(&e, 0.5);
        println!("{}: median {m:.2} mm", v.name);
        assert!(m < DISPARITY_PX_MM, "{}: median {m} mm", v.name);
        assert_eq!(r.diagnostics.gap.is_some(), r.diagnostics.lower_bound.is_some());
        for (key, value) in v.entries() {
            assert_eq!(r.diagnostics.parameters[key], value);
        }
    }
}

#[test]
fn refinement_and_smoothness_pay() {
    let (rig, frame) = scene(BALL);
    let median = |v: &Variant| {
        let mut v = small(v);
        v.parameters.labels = 24;
        common::quantile(&errors(&rig, &frame, BALL, &run(&rig, &frame, &v)), 0.5)
    };
    let full = median(&LUO);
    let raw = median(&Variant::named("luo-no-refinement").unwrap());
    let alone = median(&Variant { minimiser: Minimiser::WinnerTakesAll, ..LUO });
    println!("full {full:.2}, unrefined {raw:.2}, winner takes all {alone:.2} mm");
    assert!(full < raw && full < alone, "full {full}, unrefined {raw}, winner takes all {alone} mm");
}

#[test]
fn bits_do_not_depend_on_threads_nor_on_other_cameras_order_of_work() {
    let (rig, frame) = scene(BALL);
    for name in ["luo", "luo-ncc"] {
        let mut v = small(&Variant::named(name).unwrap());
        v.parameters.labels = 24;
        let with = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let r = pool.install(|| run(&rig, &frame, &v));
            (r.estimate, r.diagnostics.energy.to_bits(), r.diagnostics.lower_bound.map(f64::to_bits))
        };
        assert_eq!(with(1), with(2), "{name}");
    }
}

#[test]
fn exposure_does_not_matter() {
    let (rig, frame) = scene(BALL);
    let mut dim = frame.clone();
    // A power of two, so that only the scale changes and no rounding.
    dim.images.iter_mut().for_each(|i| i.data.iter_mut().for_each(|v| *v *= 0.125));
    let (a, b) = (run(&rig, &frame, &small(&LUO)), run(&rig, &dim, &small(&LUO)));
    assert_eq!(a.estimate.depth, b.estimate.depth);
}

fn refusal(rig: &Rig, frame: &Frame, v: &Variant) -> ReconError {
    reconstruct(rig, frame, v, &Silent).expect_err("bad input was taken")
}

#[test]
fn bad_input_is_refused_by_name() {
    let (rig, frame) = scene(BALL);
    let luo = small(&LUO);

    let mut empty = frame.clone();
    empty.masks[0].data.fill(false);
    assert!(matches!(refusal(&rig, &empty, &luo), ReconError::EmptyMask { .. }));

    let mut nan = frame.clone();
    nan.images[2].data.fill(f32::NAN);
    let text = refusal(&rig, &nan, &luo).to_string();
    assert!(text.contains("c2") && text.contains("not finite"), "{text}");

    let mut flat = frame.clone();
    flat.images.iter_mut().for_each(|i| i.data.fill(0.0));
    assert!(matches!(refusal(&rig, &flat, &luo), ReconError::NoResponse { .. }));

    let mut lone = rig.clone();
    lone.cameras.truncate(1);
    let mut one = frame.clone();
    one.images.truncate(1);
    one.masks.truncate(1);
    assert!(matches!(refusal(&lone, &one, &luo), ReconError::Views { cameras: 1, .. }));

    let mut other = frame.clone();
    other.images[1] = Plane::filled(64, 96, 0.5);
    assert!(refusal(&rig, &other, &luo).to_string().contains("64x96"));

    let mut inverted = rig.clone();
    std::mem::swap(&mut inverted.near_mm, &mut inverted.far_mm);
    assert!(matches!(refusal(&inverted, &frame, &luo), ReconError::Input(_)));

    let missing = luo.with("views", "0,7").unwrap();
    assert!(matches!(refusal(&rig, &frame, &missing), ReconError::Views { cameras: 4, .. }));
    let deep = luo.with("levels", "8").unwrap();
    assert!(refusal(&rig, &frame, &deep).to_string().contains("levels"));
}

#[test]
fn a_volume_too_large_is_refused_before_it_is_made() {
    let (w, h) = (4096u32, 4096u32);
    let rig = common::rig((w, h), 4000.0, 100.0);
    let mut frame = Frame { index: 0, images: Vec::new(), masks: Vec::new() };
    for _ in 0..4 {
        frame.images.push(Plane::filled(w as usize, h as usize, 0.5));
        let mut mask = Plane::filled(w as usize, h as usize, false);
        mask.data[0] = true;
        mask.data[(w * h - 1) as usize] = true;
        frame.masks.push(mask);
    }
    assert!(matches!(refusal(&rig, &frame, &LUO), ReconError::TooLarge { labels: 192, .. }));
}

/// Stops once a number of steps have been reported.
struct StopAfter {
    left: AtomicU64,
}

impl Monitor for StopAfter {
    fn begin(&self, _what: &str, _total: u64) {}
    fn advance(&self, steps: u64) {
        let _ = self.left.fetch_update(Ordering::SeqCst, Ordering::SeqCst, |v| Some(v.saturating_sub(steps)));
    }
    fn cancelled(&self) -> bool {
        self.left.load(Ordering::SeqCst) == 0
    }
}

#[test]
fn cancelling_stops_every_stage() {
    let (rig, frame) = scene(BALL);
    for left in [0, 3, 10, 40, 120] {
        let monitor = StopAfter { left: AtomicU64::new(left) };
        let result = reconstruct(&rig, &frame, &small(&LUO), &monitor);
        assert!(matches!(result, Err(ReconError::Cancelled(Cancelled))), "after {left} steps");
    }
}

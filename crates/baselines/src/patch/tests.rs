use super::*;
use crate::account::Clock;
use crate::testing::{BASELINE_MM, DISTANCE_MM, Shape, frame, rig};
use crate::{BASELINES, Kind};
use glam::DVec2;
use strandbench_types::{Plane, Silent};

const FOCAL_PX: f64 = 400.0;
const P: PatchStereo = PatchStereo { level: 0, min_images: 3, ..PatchStereo::TUNED };

/// Depth that a tenth of a pixel of disparity is worth: what matching of clean images by interpolated windows reaches.
const DEPTH_BOUND_MM: f64 = 0.1 * DISTANCE_MM * DISTANCE_MM / (FOCAL_PX * BASELINE_MM);

fn scene(shape: Shape) -> (Rig, Frame) {
    let rig = rig((160, 120), FOCAL_PX);
    let frame = frame(&rig, shape);
    (rig, frame)
}

/// Depth errors where the surface is seen at less than the largest angle of a patch from all cameras, 10 degrees apart.
fn errors(rig: &Rig, shape: Shape, depth: &DepthMap) -> Vec<f64> {
    let least = (P.angle_deg - 10.0).to_radians().cos();
    let camera = &rig.cameras[0];
    let (w, h) = depth.size();
    let mut all: Vec<f64> = (0..w * h)
        .filter_map(|i| {
            let d = camera.ray_direction(DVec2::new((i % w) as f64 + 0.5, (i / w) as f64 + 0.5));
            let t = shape.hit(camera.centre_mm(), d)?;
            let facing = -shape.normal(camera.centre_mm() + d * t).dot(d.normalize());
            (facing > least).then_some((f64::from(depth.get_index(i)?) - t).abs())
        })
        .collect();
    all.sort_unstable_by(f64::total_cmp);
    all
}

#[test]
fn a_plane_and_a_ball_are_found() {
    let tilted = DVec3::new(0.4, -0.3, 1.0).normalize();
    for shape in [Shape::Square(tilted, 70.0), Shape::Ball(80.0)] {
        let (rig, frame) = scene(shape);
        let mut clock = Clock::new(&Silent);
        let patches = patches(&rig, &frame, &P, &mut clock).unwrap();
        let hair = frame.masks[0].data.iter().filter(|m| **m).count();
        assert!(patches.len() * 8 > hair, "{} patches for {hair} pixels", patches.len());
        // The depth's error at one edge of the window, three pixels from the middle, tilts it.
        let footprint = DISTANCE_MM / FOCAL_PX;
        let tilt = (DEPTH_BOUND_MM / (3.0 * footprint)).atan().to_degrees();
        let mut angles: Vec<f64> =
            patches.iter().map(|p| p.normal.angle_between(shape.normal(p.centre)).to_degrees()).collect();
        angles.sort_unstable_by(f64::total_cmp);
        let middle = angles[angles.len() / 2];
        assert!(middle < tilt, "{shape:?}: {middle} of {tilt} degrees");

        let made = reconstruct(&rig, &frame, &P, &Silent).unwrap();
        let depth = made.estimate.depth.unwrap();
        let errors = errors(&rig, shape, &depth);
        let (median, ninety) = (errors[errors.len() / 2], errors[errors.len() * 9 / 10]);
        assert!(median < DEPTH_BOUND_MM, "{shape:?}: {median} of {DEPTH_BOUND_MM} mm");
        assert!(ninety < 3.0 * DEPTH_BOUND_MM, "{shape:?}: {ninety}");
        assert!(depth.answered() * 10 > hair * 9, "{} of {hair} pixels", depth.answered());
    }
}

#[test]
fn consistency_is_best_at_the_true_depth_and_normal() {
    let tilted = DVec3::new(0.4, -0.3, 1.0).normalize();
    let (rig, frame) = scene(Shape::Square(tilted, 70.0));
    let views = View::all(&rig, &frame, 0);
    let patch = Patch {
        centre: DVec3::ZERO,
        normal: tilted,
        reference: 0,
        visible: 0b1111,
        agreeing: 0b1111,
        cost: 0.0,
    };
    let matching = refine::Matching::new(&views, &patch, &P).unwrap();
    let at = |z: f64, n: DVec3| matching.mean_cost(0b1111, DVec3::Z * z, n);
    let best = at(0.0, tilted);
    assert!(best < 0.01, "{best}");
    // Three pixels of disparity either way.
    let off = 3.0 * DISTANCE_MM * DISTANCE_MM / (FOCAL_PX * BASELINE_MM);
    assert!(at(off, tilted) > 0.2 && at(-off, tilted) > 0.2);
    assert!(at(0.0, DVec3::new(-0.6, 0.5, 1.0).normalize()) > best + 0.01);
    // The search finds the way back from a pixel and 17 degrees off, to the bound of a tenth of a pixel.
    let mut start = Patch { centre: DVec3::Z * off / 3.0, normal: DVec3::Z, ..patch };
    matching.refine(&mut start);
    assert!(start.centre.length() < DEPTH_BOUND_MM, "{}", start.centre);
    assert!(start.normal.angle_between(tilted).to_degrees() < 10.0, "{}", start.normal);
}

#[test]
fn threads_change_nothing() {
    let (rig, frame) = scene(Shape::Ball(70.0));
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| reconstruct(&rig, &frame, &P, &Silent).unwrap().estimate)
    };
    assert_eq!(run(1), run(3));
}

#[test]
fn a_patch_that_a_better_one_hides_is_dropped() {
    let shape = Shape::Square(DVec3::Z, 70.0);
    let (rig, frame) = scene(shape);
    let views = View::all(&rig, &frame, 0);
    let mut clock = Clock::new(&Silent);
    let mut all = patches(&rig, &frame, &P, &mut clock).unwrap();
    let good = all.len();
    // A lone patch 60 mm in front, with a poor score, and one as far behind.
    let nearest = all.iter().min_by(|a, b| a.centre.length().total_cmp(&b.centre.length())).copied().unwrap();
    all.push(Patch { centre: nearest.centre + DVec3::Z * 60.0, cost: 0.6, ..nearest });
    all.push(Patch { centre: nearest.centre - DVec3::Z * 60.0, cost: 0.0, ..nearest });
    let mut state = Reconstruction {
        cells: Cells::new(&views, P.cell_px, &all),
        views: &views,
        p: &P,
        range_mm: (rig.near_mm, rig.far_mm),
        patches: all,
    };
    let middle = state.patches.iter().position(|p| *p == nearest).unwrap();
    assert!(!state.consistent(good), "others of its cells agree better than it");
    assert!(state.seen_enough(good) && !state.seen_enough(good + 1), "only the one behind is hidden");
    assert!(!state.in_company(good) && !state.in_company(good + 1), "nothing is near to either");
    assert!(state.in_company(middle));
    state.filter();
    assert!(state.patches.iter().all(|p| p.centre.z.abs() < 20.0), "the lone patch is gone");
    assert!(state.patches.len() * 10 > good * 9, "{} of {good} stay", state.patches.len());
}

#[test]
fn images_without_texture_one_camera_and_no_hair_are_errors() {
    let (rig, mut frame) = scene(Shape::Ball(70.0));
    let kind = Kind::PatchStereo(P);
    let run = |rig: &Rig, frame: &Frame| {
        let baseline = crate::Baseline { kind, ..BASELINES[0] };
        crate::reconstruct(rig, frame, &baseline, &Silent).map(|_| ()).unwrap_err()
    };
    let alone = Rig { cameras: rig.cameras[..1].to_vec(), ..rig.clone() };
    let one = Frame { index: 0, images: frame.images[..1].to_vec(), masks: frame.masks[..1].to_vec() };
    assert!(matches!(run(&alone, &one), BaselineError::Cameras { cameras: 1, .. }));
    for image in &mut frame.images {
        image.data.fill(0.3);
    }
    let flat = run(&rig, &frame);
    let views = View::all(&rig, &frame, 0);
    let one =
        Patch { centre: DVec3::Z * 70.0, normal: DVec3::Z, reference: 0, visible: 1, agreeing: 1, cost: 0.0 };
    assert!(refine::Matching::new(&views, &one, &P).is_none(), "a flat window matches nothing");
    assert!(
        matches!(flat, BaselineError::NoPatches { .. }) && flat.to_string().contains("texture"),
        "{flat}"
    );
    frame.masks[0] = Plane::filled(160, 120, false);
    let empty = run(&rig, &frame);
    assert!(matches!(&empty, BaselineError::EmptyMask { camera, .. } if camera == "center"), "{empty}");
    frame.masks.pop();
    assert!(matches!(run(&rig, &frame), BaselineError::Input(_)));
}

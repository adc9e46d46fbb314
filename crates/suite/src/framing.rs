//! What hair from a file leaves open: how thick its fibres are, and how the cameras frame it.

use glam::{DVec2, DVec3, Vec3};
use strandbench_scenes::{RigSpec, Scene};
use strandbench_types::{Rig, StrandSet};

/// Share of half of the image that the hair's box may take.
const FILL: f64 = 0.92;
/// Share of the points that may lie outside on each side: single flyaways do not decide the framing.
const OUTSIDE: f64 = 0.002;
/// Room before and behind the hair, mm, where the default working volume is too small.
const ROOM_MM: f64 = 50.0;
/// Fibres of a human head of hair.
const FIBRES_OF_A_HEAD: f64 = 100_000.0;
/// Radius of such a fibre, mm.
const FIBRE_RADIUS_MM: f64 = 0.04;
/// How long the longest side of the box of a head of hair is, from a crew cut to hair below the hips, mm.
const HEAD_OF_HAIR_MM: std::ops::RangeInclusive<f32> = 120.0..=1500.0;

/// Fibre radius (mm) of a set that states none: 0.04 mm for a full head of hair (100,000 fibres); a sparser set
/// gets the same volume of hair, each fibre standing for several of its cross-section, up to four times the
/// radius.
pub(crate) fn radius_mm(strands: usize) -> f32 {
    let each_stands_for = (FIBRES_OF_A_HEAD / strands.max(1) as f64).clamp(1.0, 16.0);
    // A thousandth of a millimetre is precise enough, and short to print.
    ((FIBRE_RADIUS_MM * each_stands_for.sqrt() * 1000.0).round() / 1000.0) as f32
}

/// Aims and zooms: all cameras of the T turn to the middle of the hair's box (along the reference's axes), and
/// the box fills the image of whichever camera sees it largest. The working volume grows where the hair would
/// leave it. Whole pixels and millimetres. `scene` is as `spec` builds it; its target may be kept.
pub(crate) fn frame(spec: &RigSpec, scene: &Scene, keep_target: bool) -> RigSpec {
    let reference = &scene.rig.cameras[0];
    let points = || scene.strands.points.iter().map(|p| p.as_dvec3());
    let axes = reference.camera_from_world;
    let middle = [0, 1, 2].map(|k| {
        let (low, high) = most(points().map(|p| (axes * p)[k]).collect());
        0.5 * (low + high)
    });
    let target = if keep_target {
        DVec3::from_array(spec.target_mm)
    } else {
        (axes.transpose() * DVec3::from_array(middle)).round()
    };
    let moved = target - DVec3::from_array(spec.target_mm);
    let zoom = zoom(&scene.rig, || points().map(|p| p - moved));
    let depths = points().map(|p| reference.to_camera(p - moved).z);
    let (near, far) = depths.fold((f64::INFINITY, 0.0f64), |(a, b), z| (a.min(z), b.max(z)));
    RigSpec {
        target_mm: target.to_array(),
        focal_px: (spec.focal_px * zoom).floor().clamp(10.0, 1e5),
        near_mm: spec.near_mm.min((near - ROOM_MM).floor().max(1.0)),
        far_mm: spec.far_mm.max((far + ROOM_MM).ceil()),
        ..spec.clone()
    }
}

/// By how much every focal length can grow until the points fill the tightest image.
fn zoom<I: Iterator<Item = DVec3>>(rig: &Rig, points: impl Fn() -> I) -> f64 {
    let mut zoom = f64::INFINITY;
    for camera in &rig.cameras {
        let half = DVec2::new(f64::from(camera.width), f64::from(camera.height)) * 0.5;
        let seen: Vec<DVec2> = points()
            .filter_map(|p| camera.project(p))
            .map(|(u, _)| (u - camera.principal_px) / half)
            .collect();
        for k in 0..2 {
            let (low, high) = most(seen.iter().map(|u| u[k]).collect());
            zoom = zoom.min(FILL / (-low).max(high).max(1e-9));
        }
    }
    zoom
}

/// Least and greatest value when [`OUTSIDE`] of them are left out at each end.
fn most(mut values: Vec<f64>) -> (f64, f64) {
    values.sort_unstable_by(f64::total_cmp);
    let n = values.len();
    if n == 0 {
        return (0.0, 0.0);
    }
    let out = (n as f64 * OUTSIDE) as usize;
    (values[out], values[n - 1 - out])
}

/// How large the hair is, and a hint where no head of hair is as large: its file's unit was guessed wrong.
pub(crate) fn size_note(strands: &StrandSet) -> String {
    let none = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    let (lo, hi) = strands.points.iter().fold(none, |(lo, hi), &p| (lo.min(p), hi.max(p)));
    let size = (hi - lo).max(Vec3::ZERO);
    let hint = if HEAD_OF_HAIR_MM.contains(&size.max_element()) {
        ""
    } else {
        "; a head of hair is 120 to 1500 mm: state the file's unit and axes with --preset, or --scale-mm, --up and \
         --forward"
    };
    format!("the hair is {:.0} x {:.0} x {:.0} mm (width, height, depth){hint}", size.x, size.y, size.z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use strandbench_scenes::SceneSpec;

    const SCENE: &str = "difficulty = \"easy\"\nstresses = \"framing\"\n[groom]\nfamily = \"straight\"\n\
        strands = 40\nradius_mm = 0.1\n[groom.length]\ntop_mm = 200.0\n[groom.style]\nlift_mm = 4.0\n[rig]\nazimuth_deg = 150.0\nelevation_deg = 12.0\n";

    /// A scene whose strands run to the corners of a box.
    fn with_box(low: Vec3, high: Vec3) -> (SceneSpec, Scene) {
        let spec = strandbench_scenes::parse(SCENE, std::path::Path::new("box.toml")).unwrap();
        let mut scene = strandbench_scenes::build(&spec, 1, None).unwrap();
        scene.strands = strandbench_types::StrandSet::new();
        for i in 0..4 {
            let corner = |x: bool, y: bool, z: bool| Vec3::select(glam::BVec3::new(x, y, z), high, low);
            scene
                .strands
                .push(&[corner(i & 1 == 1, i & 2 == 2, false), corner(i & 1 == 1, i & 2 == 2, true)], 0.04);
        }
        (spec, scene)
    }

    #[test]
    fn a_box_fills_the_tightest_image_from_its_middle() {
        let (low, high) = (Vec3::new(40.0, -260.0, -90.0), Vec3::new(190.0, 180.0, 30.0));
        let (mut spec, mut scene) = with_box(low, high);
        let framed = frame(&spec.rig, &scene, false);
        spec.rig = framed.clone();
        let again = strandbench_scenes::build(&spec, 1, None).unwrap();
        scene.rig = again.rig;
        let mut widest = 0.0f64;
        for camera in &scene.rig.cameras {
            for p in &scene.strands.points {
                let (u, _) = camera.project(p.as_dvec3()).unwrap();
                let off = (u - camera.principal_px) / DVec2::new(320.0, 240.0);
                widest = widest.max(off.abs().max_element());
            }
        }
        assert!((widest - FILL).abs() < 0.004, "the corner farthest out is at {widest} of half of the image");
        let middle = ((low + high) * 0.5).as_dvec3();
        assert!(DVec3::from_array(framed.target_mm).distance(middle) < 1.0, "{:?}", framed.target_mm);
        assert_eq!((framed.near_mm, framed.far_mm), (700.0, 1100.0), "the box lies within");
    }

    #[test]
    fn deep_hair_widens_the_working_volume_and_flyaways_do_not_decide() {
        let (spec, scene) = with_box(Vec3::new(-40.0, -40.0, -300.0), Vec3::new(40.0, 40.0, 300.0));
        let framed = frame(&spec.rig, &scene, false);
        assert!(framed.near_mm < 620.0 && framed.far_mm > 1180.0, "{} {}", framed.near_mm, framed.far_mm);
        let mut values: Vec<f64> = (0..1000).map(f64::from).collect();
        values[17] = 1e6;
        assert_eq!(most(values), (2.0, 998.0));
        assert_eq!(most(Vec::new()), (0.0, 0.0));
    }

    #[test]
    fn a_sparse_set_keeps_the_volume_of_a_head_of_hair() {
        assert_eq!((radius_mm(100_000), radius_mm(150_000)), (0.04, 0.04));
        let volume = |n: usize| n as f32 * radius_mm(n).powi(2);
        assert!((volume(10_000) / volume(100_000) - 1.0).abs() < 0.02);
        assert_eq!(radius_mm(10), 0.16);
    }

    #[test]
    fn hair_that_no_head_bears_is_noticed() {
        let of = |mm: f32| {
            let mut set = StrandSet::new();
            set.push(&[Vec3::ZERO, Vec3::new(10.0, mm, 20.0)], 0.05);
            size_note(&set)
        };
        assert_eq!(of(300.0), "the hair is 10 x 300 x 20 mm (width, height, depth)");
        assert!(of(80.0).contains("--preset") && of(2000.0).contains("--scale-mm"));
    }
}

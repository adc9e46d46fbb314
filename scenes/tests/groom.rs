//! Properties of built scenes, on few strands.

use glam::Vec3;
use std::path::Path;
use strandbench_scenes::{
    DEFAULT_SCENE, Family, Parting, Scene, SceneError, SceneSpec, WaveSpec, build, catalog, parse,
};

fn spec(name: &str) -> SceneSpec {
    catalog().iter().find(|e| e.name == name).expect("a scene of the catalogue").spec().unwrap()
}

/// FNV-1a over the bits of points, radii and pigments.
fn hash(scene: &Scene) -> u64 {
    let points = scene.strands.points.iter().flat_map(|p| p.to_array());
    let pigments = scene.pigments.iter().flat_map(|p| [p.eumelanin, p.pheomelanin]);
    points
        .chain(scene.strands.radii_mm.iter().copied())
        .chain(pigments)
        .flat_map(|v| v.to_bits().to_le_bytes())
        .fold(0xcbf2_9ce4_8422_2325, |h, b| (h ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3))
}

/// Signed distance by brute force: the sign is that of the winding number, the distance of all triangles.
struct Solid<'a> {
    scene: &'a Scene,
}

impl Solid<'_> {
    /// Depth below the skin in mm, 0 outside, by the generalised winding number (Jacobson et al. 2013).
    fn depth_mm(&self, p: Vec3) -> f32 {
        let mesh = &self.scene.surfaces[0].mesh;
        let mut solid_angle = 0.0f64;
        let mut nearest = f32::INFINITY;
        for t in &mesh.triangles {
            let [a, b, c] = t.map(|i| (mesh.vertices[i as usize] - p).as_dvec3());
            let (la, lb, lc) = (a.length(), b.length(), c.length());
            let numerator = a.dot(b.cross(c));
            let denominator = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
            solid_angle += 2.0 * numerator.atan2(denominator);
            // A bound of the distance to the triangle from above is enough for a depth from below.
            nearest = nearest.min(la.min(lb).min(lc) as f32).min(plane_distance(t, mesh, p));
        }
        // The bust is open below: inside counts as more than half of the sphere.
        if solid_angle > std::f64::consts::TAU * 1.2 { nearest } else { 0.0 }
    }
}

/// Distance to the triangle's plane where the foot lies inside the triangle, else infinite.
fn plane_distance(t: &[u32; 3], mesh: &strandbench_types::TriMesh, p: Vec3) -> f32 {
    let [a, b, c] = t.map(|i| mesh.vertices[i as usize]);
    let n = (b - a).cross(c - a).normalize_or_zero();
    let foot = p - n * (p - a).dot(n);
    let inside = [(a, b), (b, c), (c, a)].iter().all(|(u, v)| (*v - *u).cross(foot - *u).dot(n) >= 0.0);
    if inside { (p - a).dot(n).abs() } else { f32::INFINITY }
}

#[test]
fn every_scene_builds_with_what_it_states() {
    assert!(catalog().len() >= 12);
    for entry in catalog() {
        let stated = entry.spec().unwrap();
        assert_eq!(stated.name, entry.name);
        assert!(!stated.description.is_empty() && !stated.stresses.is_empty());
        let groom = stated.groom.clone().unwrap();
        assert!((10_000..=150_000).contains(&groom.strands), "{}", entry.name);
        let scene = build(&stated.clone().with_strands(120), 1, None).unwrap();
        assert_eq!((scene.strands.len(), scene.pigments.len()), (120, 120));
        scene.strands.validate().unwrap();
        scene.rig.validate().unwrap();
        scene.calibrated_rig.validate().unwrap();
        assert_ne!(scene.rig, scene.calibrated_rig);
        let longest = groom.length.top_mm.max(groom.length.sides_mm.unwrap_or(0.0));
        for i in 0..scene.strands.len() {
            let length = scene.strands.length_mm(i) as f32;
            // Waves take up length; four deviations of the spreads above the median are not reached.
            let stretch = 1.0 + 2.0 * std::f32::consts::TAU * groom.wave.radius_mm / groom.wave.pitch_mm;
            assert!(length < 2.2 * longest * stretch, "{} strand {i}: {length} mm", entry.name);
            for k in scene.strands.range(i) {
                let r = scene.strands.radii_mm[k];
                assert!((0.02..0.065).contains(&r), "{} strand {i}: radius {r} mm", entry.name);
            }
            for w in scene.strands.strand(i).windows(2) {
                assert!(w[0].distance(w[1]) < 1.7 * groom.max_segment_mm, "{} strand {i}", entry.name);
            }
        }
    }
    for family in [Family::Straight, Family::Wavy, Family::Curly, Family::Messy] {
        assert!(catalog().iter().any(|e| e.spec().unwrap().groom.unwrap().family == family));
    }
    assert!(catalog().iter().any(|e| e.name == DEFAULT_SCENE));
}

#[test]
fn equal_seeds_give_equal_bits_on_any_number_of_threads_and_others_do_not() {
    let s = spec("messy-red").with_strands(150);
    let with_threads = |n: usize, seed: u64| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
        pool.install(|| hash(&build(&s, seed, None).unwrap()))
    };
    assert_eq!(with_threads(1, 3), with_threads(2, 3));
    assert_ne!(with_threads(1, 3), with_threads(1, 4));
}

/// A scene of its own, so that the catalogue may change: parting, fringe, clumps, waves, frizz and flyaways.
const PINNED: &str = r#"
difficulty = "hard"
stresses = "bits"
[groom]
family = "curly"
strands = 60
[groom.length]
top_mm = 180
cut_height_mm = -120
fringe = { length_mm = 50, half_width_mm = 60, depth_mm = 40 }
[groom.style]
parting = "left"
[groom.wave]
radius_mm = 4
coherence_mm = 20
[groom.disorder]
flyaway_share = 0.2
[pigment]
eumelanin = 1.0
"#;

/// The bits that every machine must make. A change of the groomer changes them: whoever means to changes the
/// number here, and regenerates the reference results.
#[test]
fn a_scene_has_the_same_bits_on_every_machine() {
    let spec = parse(PINNED, Path::new("pinned.toml")).unwrap();
    let scene = build(&spec, 1, None).unwrap();
    let counted = (scene.strands.len(), scene.strands.points.len());
    assert_eq!((counted, hash(&scene)), ((60, 5523), 0xb56d_f8c8_94de_61f5), "{:016x}", hash(&scene));
}

#[test]
fn no_strand_goes_through_the_skin() {
    for name in [DEFAULT_SCENE, "curly-blonde", "messy-brown-short"] {
        let scene = build(&spec(name).with_strands(60), 2, None).unwrap();
        let solid = Solid { scene: &scene };
        let (low, high) = scene.surfaces[0].mesh.bounds().unwrap();
        assert!(solid.depth_mm(Vec3::ZERO) > 30.0, "the oracle knows what inside is");
        for i in (0..60).step_by(3) {
            for (k, &p) in scene.strands.strand(i).iter().enumerate().skip(1).step_by(3) {
                if p.y < low.y + 60.0 || p.cmpgt(high).any() {
                    continue;
                }
                let depth = solid.depth_mm(p);
                assert!(depth <= 0.05, "{name} strand {i} point {k} {p}: {depth} mm deep");
            }
        }
    }
}

#[test]
fn a_parting_parts() {
    for (parting, offset) in [(Parting::Centre, 0.0f32), (Parting::Left, 28.0), (Parting::Right, -28.0)] {
        let mut s = spec("straight-blonde").with_strands(600);
        s.groom.as_mut().unwrap().style.parting = parting;
        let scene = build(&s, 5, None).unwrap();
        let (mut kept, mut crossed) = (0, 0);
        for strand in scene.strands.iter() {
            let root = strand[0];
            let x = root.x - offset;
            if root.z > 25.0 && root.y > 45.0 && x.abs() > 4.0 {
                let end = strand[strand.len() / 2];
                if (end.x - offset) * x > 0.0 { kept += 1 } else { crossed += 1 }
            }
        }
        assert!(
            kept > 40 && crossed * 25 < kept,
            "{parting:?}: {kept} kept to their side, {crossed} crossed"
        );
    }
}

/// Radius and pitch of a strand from its geometry, against what was asked: a helix of radius r and pitch p has
/// curvature r / (r² + c²) and torsion c / (r² + c²) with c = p / 2π.
#[test]
fn curls_have_their_radius_and_pitch() {
    let (radius, pitch) = (5.0f32, 40.0f32);
    let mut s = spec("straight-blonde").with_strands(200);
    {
        let g = s.groom.as_mut().unwrap();
        g.wave = WaveSpec {
            radius_mm: radius,
            pitch_mm: pitch,
            radius_spread: 0.0,
            pitch_spread: 0.0,
            drift: 0.0,
            strand_phase_deg: 0.0,
            onset_mm: 5.0,
            reach_mm: 30.0,
            flatness: 0.0,
            coherence_mm: 0.0,
        };
        (g.disorder.frizz_mm, g.disorder.flyaway_share) = (0.0, 0.0);
        g.disorder.tuft_wander_deg = 0.0;
        g.disorder.wisp_wander_deg = 0.0;
        g.disorder.strand_wander_deg = 0.0;
        g.chord_error_mm = 0.005;
    }
    let scene = build(&s, 1, None).unwrap();
    let c = pitch / std::f32::consts::TAU;
    let want = radius / (radius * radius + c * c);
    let mut curvatures = Vec::new();
    for strand in scene.strands.iter() {
        for w in strand[strand.len() / 2..].windows(3) {
            let (a, b) = (w[1] - w[0], w[2] - w[1]);
            curvatures.push(2.0 * a.cross(b).length() / (a.length() * b.length() * (a + b).length()));
        }
    }
    curvatures.sort_by(f32::total_cmp);
    let median = curvatures[curvatures.len() / 2];
    assert!((median / want - 1.0).abs() < 0.1, "median curvature {median} per mm against {want}");
}

#[test]
fn polylines_follow_their_curves_as_closely_as_asked() {
    // The same scene at a tenth of the chord error stands for the curve.
    for name in ["straight-blonde", "wavy-brown", "curly-blonde"] {
        let coarse_spec = spec(name).with_strands(40);
        let asked = coarse_spec.groom.as_ref().unwrap().chord_error_mm;
        let mut fine_spec = coarse_spec.clone();
        fine_spec.groom.as_mut().unwrap().chord_error_mm = asked * 0.1;
        let (coarse, fine) = (build(&coarse_spec, 1, None).unwrap(), build(&fine_spec, 1, None).unwrap());
        let mut errors = Vec::new();
        for i in 0..40 {
            for p in fine.strands.strand(i) {
                let d = coarse
                    .strands
                    .strand(i)
                    .windows(2)
                    .map(|w| {
                        let t = ((*p - w[0]).dot(w[1] - w[0]) / w[0].distance_squared(w[1])).clamp(0.0, 1.0);
                        p.distance(w[0] + (w[1] - w[0]) * t)
                    })
                    .fold(f32::INFINITY, f32::min);
                errors.push(d);
            }
        }
        errors.sort_by(f32::total_cmp);
        let p95 = errors[errors.len() * 95 / 100];
        assert!(p95 < 1.1 * asked, "{name}: 95 % within {p95} mm, {asked} asked");
        assert!(p95 > 0.05 * asked, "{name}: {p95} mm is finer than anything asked for");
    }
}

#[test]
fn hair_files_that_cannot_be_are_named() {
    let text = "difficulty = \"hard\"\nstresses = \"x\"\n[head]\nembedded = false\n[hair_file]\npath = \"none.hair\"\n";
    let s = parse(text, Path::new("x.toml")).unwrap();
    let e = build(&s, 0, Some(Path::new("nowhere"))).unwrap_err();
    assert!(matches!(e, SceneError::File { .. }) && e.to_string().contains("nowhere/none.hair"), "{e}");
    let mut both = spec(DEFAULT_SCENE);
    both.hair_file = s.hair_file.clone();
    assert!(matches!(build(&both, 0, None).unwrap_err(), SceneError::Spec { .. }));
}

#[test]
fn real_hair_is_imported_and_centred() {
    let Some(data) = std::env::var_os("STRANDBENCH_DATA") else {
        println!("ignored, no data: set STRANDBENCH_DATA");
        return;
    };
    let folder = Path::new(&data).join("hair/cem_yuksel");
    let import = strandbench_io::ImportOptions {
        scale_mm: 2.5,
        up: "z".into(),
        forward: "-y".into(),
        ..Default::default()
    };
    let s = SceneSpec::from_hair_file(folder.join("straight.hair"), import.clone(), None);
    let scene = build(&s, 0, None).unwrap();
    assert!(scene.strands.len() > 9_000 && scene.pigments.len() == scene.strands.len());
    let (low, high) = scene
        .strands
        .points
        .iter()
        .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(a, b), &p| (a.min(p), b.max(p)));
    assert!((low + high).length() < 1e-2);
    assert!((high - low).y > 200.0, "a head of hair is this high: {}", high - low);
    let small = SceneSpec::from_hair_file(
        folder.join("straight.hair"),
        strandbench_io::ImportOptions { scale_mm: 0.01, ..import },
        None,
    );
    let e = build(&small, 0, None).unwrap_err().to_string();
    assert!(e.contains("scale_mm"), "{e}");
}

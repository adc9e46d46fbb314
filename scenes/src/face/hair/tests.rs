use super::*;
use crate::face::{Act, FaceScene, Performance, catalog};
use std::path::PathBuf;

fn spec(name: &str) -> FaceScene {
    let entry = catalog().iter().find(|e| e.name == name).expect("in the catalogue");
    FaceScene::parse(entry.toml, Path::new("f.toml")).unwrap()
}

/// A subject with a share of its hairs.
fn grown(name: &str, share: f32, seed: u64) -> (FaceScene, Identity, FacialHair) {
    let mut scene = spec(name);
    scene.hair.patches.values_mut().for_each(|p| p.density_per_cm2 = (p.density_per_cm2 * share).max(0.1));
    let model = FaceModel::embedded();
    let identity = Identity::draw(model, &scene.face).unwrap();
    let hair = FacialHair::grow(model, &identity, &scene.hair, seed, None).unwrap();
    (scene, identity, hair)
}

#[test]
fn the_same_seed_gives_the_same_bits_on_one_thread_and_the_neutral_pose_is_the_hair_itself() {
    let model = FaceModel::embedded();
    let (_, identity, a) = grown("face-moustache-goatee", 0.1, 3);
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let (_, _, b) = one.install(|| grown("face-moustache-goatee", 0.1, 3));
    assert!(
        a.strands == b.strands
            && a.follicles == b.follicles
            && a.pigments == b.pigments
            && a.kinds == b.kinds
    );
    let neutral = model.pose(&identity, &model.neutral()).unwrap();
    assert!(a.posed(model, &neutral, 0.0).strands == a.strands);
    let (_, _, other) = grown("face-moustache-goatee", 0.1, 4);
    assert!(a.strands != other.strands);
}

#[test]
fn five_subjects_are_as_the_paper_has_them_from_stubble_to_a_dense_beard() {
    let mut counts = Vec::new();
    for entry in catalog() {
        let (_, _, hair) = grown(entry.name, 1.0, 1);
        hair.strands.validate().unwrap();
        let n = hair.kinds.len();
        assert!((300..=20_000).contains(&n), "{}: {n} hairs", entry.name);
        for kind in [HairKind::Brow, HairKind::Lash] {
            assert!(hair.kinds.iter().filter(|k| **k == kind).count() > 60, "{}: {kind:?}", entry.name);
        }
        let roots: f32 = hair.shapes.iter().map(|s| 2000.0 * s.radii_mm[0]).sum::<f32>() / n as f32;
        assert!((60.0..140.0).contains(&roots), "{}: {roots} µm", entry.name);
        let lengths: Vec<f64> = (0..n).map(|i| hair.strands.length_mm(i)).collect();
        assert!(lengths.iter().all(|l| (0.39..=130.0).contains(l)), "{}", entry.name);
        let tone = hair.pigments.iter().map(|p| p.eumelanin).sum::<f32>() / n as f32;
        counts.push((n, entry.name, tone));
    }
    let of = |name: &str| counts.iter().find(|c| c.1.ends_with(name)).unwrap();
    assert!(
        of("full-beard").0 > of("medium").0
            && of("medium").0 > of("goatee").0
            && of("goatee").0 > of("short").0
    );
    assert!(of("short").2 < 0.4 && of("full-beard").2 > 2.0, "fair and dark");
}

#[test]
fn the_skin_keeps_hair_out_lengths_stay_and_roots_are_in_it_at_every_moment() {
    let model = FaceModel::embedded();
    let skin = model.part(&[Part::Skin]);
    let acts = [
        (Act::Rotation, 3.5),
        (Act::Dialogue, 2.1),
        (Act::Dialogue, 3.3),
        (Act::SmilePuff, 1.5),
        (Act::SmilePuff, 4.2),
        (Act::Brows, 1.1),
        (Act::Brows, 2.6),
    ];
    for entry in catalog() {
        let (_, identity, hair) = grown(entry.name, 0.02, 2);
        for (act, time_s) in acts {
            let pose = Performance { act, seed: 5 }.pose(model, time_s);
            let face = model.pose(&identity, &pose).unwrap();
            let posed = hair.posed(model, &face, time_s);
            let bvh = MeshBvh::new(&skin.gather(&face.vertices), &skin.triangles);
            let (mut deepest, mut where_mm) = (0.0f32, 0.0);
            for i in 0..hair.kinds.len() {
                let points = posed.strands.strand(i);
                assert!(points[0].distance(posed.frames[i].position) == 0.0, "the root is in the skin");
                assert!(bvh.closest(points[0], None).distance.abs() < 1e-3);
                let (now, then) = (posed.strands.length_mm(i), hair.strands.length_mm(i));
                assert!((now / then - 1.0).abs() < 1e-3, "{}: {then} mm became {now}", entry.name);
                let mut s = 0.0;
                for pair in points.windows(2) {
                    let length = pair[0].distance(pair[1]);
                    let steps = (length / 0.25).ceil().max(1.0);
                    for k in 1..=steps as u32 {
                        let at = k as f32 / steps;
                        if s + at * length > 1.0 {
                            let d = bvh.closest(pair[0].lerp(pair[1], at), None).distance;
                            if -d > deepest {
                                (deepest, where_mm) = (-d, s + at * length);
                            }
                        }
                    }
                    s += length;
                }
            }
            assert!(
                deepest <= 0.05,
                "{} {act:?} at {time_s} s: {deepest} mm deep, {where_mm} mm from the root",
                entry.name
            );
        }
    }
}

#[test]
fn hair_moves_with_the_skin_and_a_little_of_its_own() {
    let model = FaceModel::embedded();
    let (_, identity, hair) = grown("face-medium", 0.04, 2);
    let neutral = model.pose(&identity, &model.neutral()).unwrap();
    let still = hair.posed(model, &neutral, 0.7).strands;
    let mut moved: Vec<f32> =
        still.points.iter().zip(&hair.strands.points).map(|(a, b)| a.distance(*b)).collect();
    moved.sort_by(f32::total_cmp);
    let at = |share: usize| moved[(moved.len() - 1) * share / 100];
    // Where a hair leans on the skin a little may decide on which side of a fold it lies.
    assert!(at(90) > 0.01 && at(95) < 2.0 * motion::OWN_MOST_MM, "own motion of {} to {} mm", at(90), at(95));
    assert!(at(100) < 6.0, "{} mm", at(100));
    let mut turned = model.neutral();
    turned.turn = glam::DVec3::new(0.0, 0.4, 0.0);
    let face = model.pose(&identity, &turned).unwrap();
    let posed = hair.posed(model, &face, 0.0).strands;
    // The chin turns rigidly: so does its hair.
    let rigid = |p: &Vec3| p.y + 0.35 * p.z > -95.0;
    let chin: Vec<usize> = (0..hair.kinds.len())
        .filter(|&i| hair.kinds[i] == HairKind::Goatee && rigid(&hair.rest[i].position))
        .collect();
    assert!(chin.len() > 5);
    let rotation = crate::rotation(turned.turn);
    let pivot = glam::DVec3::new(0.0, -110.0, -10.0);
    for i in chin {
        for (a, b) in hair.strands.strand(i).iter().zip(posed.strand(i)) {
            let want = rotation * (a.as_dvec3() - pivot) + pivot;
            assert!(want.distance(b.as_dvec3()) < 0.05, "{want} {b}");
        }
    }
}

#[test]
fn hair_grows_where_each_kind_does_on_every_person() {
    let model = FaceModel::embedded();
    let scene = spec("face-medium");
    let mut counts = Vec::new();
    for identity in [3, 77, 400] {
        let person =
            Identity::draw(model, &crate::face::FaceSpec { identity, ..scene.face.clone() }).unwrap();
        let mut few = scene.hair.clone();
        few.patches.values_mut().for_each(|p| p.density_per_cm2 *= 0.1);
        let hair = FacialHair::grow(model, &person, &few, 1, None).unwrap();
        counts.push(hair.kinds.iter().filter(|k| **k == HairKind::Beard).count() as f64);
        let mean = Identity::mean(model).vertices(model);
        for (f, kind) in hair.follicles.iter().zip(&hair.kinds).filter(|(_, k)| **k != HairKind::Lash) {
            let corners = model.triangles()[f.triangle as usize];
            let p: Vec3 = (0..3).map(|k| mean[corners[k] as usize] * f.barycentric[k]).sum();
            assert!(model.parts()[f.triangle as usize] == Part::Skin);
            assert!(crate::face::texture::lips(p) < 0.5, "{kind:?} on the lips at {p}");
            let inside = match kind {
                HairKind::Brow => (-12.0..12.0).contains(&p.y),
                HairKind::Moustache => (-106.0..-62.0).contains(&p.y) && p.x.abs() < 40.0,
                HairKind::Goatee => p.y < -90.0 && p.x.abs() < 40.0,
                _ => (-165.0..8.0).contains(&p.y) && p.z > 0.0,
            };
            assert!(inside, "{kind:?} at {p}");
        }
    }
    let mean = counts.iter().sum::<f64>() / counts.len() as f64;
    assert!(counts.iter().all(|c| (c / mean - 1.0).abs() < 0.35), "{counts:?}");
}

#[test]
fn follicles_keep_a_distance_that_chance_would_not() {
    let (scene, _, hair) = grown("face-medium", 0.1, 1);
    let per_mm2 = 0.001 * scene_density(&scene);
    let near = 0.4 / per_mm2.sqrt();
    let roots: Vec<Vec3> = (0..hair.kinds.len())
        .filter(|&i| hair.kinds[i] == HairKind::Beard)
        .map(|i| hair.strands.strand(i)[0])
        .collect();
    let crowded = |p: &&Vec3| roots.iter().filter(|q| q.distance(**p) < near).count() > 1;
    let share = roots.iter().filter(crowded).count() as f32 / roots.len() as f32;
    // Of points that know nothing of one another 1 - exp(-0.16 pi), four in ten, have another so near.
    assert!(roots.len() > 500 && share < 0.05, "{share} of {}", roots.len());
}

/// Hairs of the whole beard a square centimetre, of a tenth of which [`grown`] was told.
fn scene_density(scene: &FaceScene) -> f32 {
    scene.hair.patches[&HairKind::Beard].density_per_cm2 * 10.0
}

#[test]
fn maps_take_the_place_of_regions_and_those_that_do_not_fit_are_named() {
    let dir = tempfile::tempdir().unwrap();
    let model = FaceModel::embedded();
    let identity = Identity::mean(model);
    let patch = Patch { density_per_cm2: 6.0, length_mm: 3.0, ..Patch::default() };
    let maps = HairMaps::draw(model, HairKind::Goatee, 1024).unwrap();
    let save = |name: &str, map: &strandbench_types::Plane<f32>| {
        let grey = map.map(|v| (v.clamp(0.0, 1.0) * 255.0).round() as u8);
        strandbench_io::write_png_grey(&dir.path().join(name), &grey).unwrap();
    };
    save("density.png", &maps.density);
    save("half.png", &maps.length.map(|v| 0.5 * v));
    save("narrow.png", &strandbench_types::Plane::filled(512, 256, 1.0));
    save("odd.png", &strandbench_types::Plane::filled(300, 300, 1.0));
    save("all.png", &strandbench_types::Plane::filled(512, 512, 1.0));
    // A soft brush over a chart's border is fine; a spot away from all charts is not.
    let mut soft = maps.density.map(|v| v.max(0.004));
    save("soft.png", &soft);
    *soft.at_mut(3, 1020) = 0.02;
    save("spot.png", &soft);
    let grow = |patch: Patch| {
        let spec = FacialHairSpec { patches: [(HairKind::Goatee, patch)].into() };
        FacialHair::grow(model, &identity, &spec, 1, Some(dir.path()))
    };
    let own = grow(patch.clone()).unwrap();
    let mapped = grow(Patch {
        density_map: Some(PathBuf::from("density.png")),
        length_map: Some(PathBuf::from("half.png")),
        ..patch.clone()
    })
    .unwrap();
    let (a, b) = (own.kinds.len() as f64, mapped.kinds.len() as f64);
    assert!(a > 100.0 && (b / a - 1.0).abs() < 0.05, "{a} hairs by the region, {b} by its map");
    let mean = |h: &FacialHair| {
        (0..h.kinds.len()).map(|i| h.strands.length_mm(i)).sum::<f64>() / h.kinds.len() as f64
    };
    assert!((mean(&mapped) / mean(&own) - 0.5).abs() < 0.03, "{} {}", mean(&mapped), mean(&own));
    assert!(grow(Patch { density_map: Some(PathBuf::from("soft.png")), ..patch.clone() }).is_ok());
    for (file, wants) in [
        ("narrow.png", "512x256"),
        ("odd.png", "300x300"),
        ("none.png", "none.png"),
        ("all.png", "texture coordinates"),
        (
            "spot.png",
            "1 pixels have hair where no skin's texture coordinates lie, more than 16 px from any, the first in \
                      column 3, row 1020 (u 0.003, v 0.003)",
        ),
    ] {
        let bad = grow(Patch { density_map: Some(PathBuf::from(file)), ..patch.clone() });
        let text = bad.err().expect("refused").to_string();
        assert!(text.contains(file) && text.contains(wants), "{text}");
    }
    let many = grow(Patch { density_per_cm2: 399.0, ..patch.clone() });
    assert!(many.is_ok() || many.err().unwrap().to_string().contains("density_per_cm2"));
    let bad = FacialHairSpec { patches: [(HairKind::Brow, Patch { length_mm: f32::NAN, ..patch })].into() };
    assert!(bad.check().unwrap_err().to_string().contains("hair.brow.length_mm"));
}

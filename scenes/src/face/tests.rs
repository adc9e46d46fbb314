use super::asset::{Asset, FACE_BIN};
use super::*;
use crate::head::MeshBvh;
use crate::rotation;
use crate::subdivision::triangles;
use glam::{DVec3, Vec3};
use proptest::prelude::*;
use strandbench_types::TriMesh;

fn model() -> &'static FaceModel {
    FaceModel::embedded()
}

fn person(identity: u64) -> Identity {
    Identity::draw(model(), &FaceSpec { identity, ..FaceSpec::default() }).unwrap()
}

fn posed(identity: &Identity, named: &[(&str, f32)]) -> PosedFace {
    let weights = model().weights(named.iter().copied()).unwrap();
    model().pose(identity, &FacePose { weights, ..model().neutral() }).unwrap()
}

#[test]
fn the_face_has_the_size_of_a_face_and_the_promised_resolution() {
    let m = model();
    assert!(FACE_BIN.len() < 3_000_000);
    assert_eq!((m.control_count(), m.expressions().count()), (5112, 52));
    let mean = m.refined(&Identity::mean(m).control);
    assert_eq!(mean.len(), m.vertex_count());
    // Between the chin and the hairline, in front of the ears, facing forward.
    let normals = TriMesh { vertices: mean.clone(), triangles: m.triangles().to_vec() }.vertex_normals();
    let face = (mean.iter().zip(&normals))
        .filter(|(p, n)| p.z > 20.0 && (-145.0..57.0).contains(&p.y) && n.z > 0.0)
        .count();
    assert!(face >= 20_000, "{face} vertices over the face");
    let skin = m.part_mesh(&mean, &[Part::Skin]);
    let (low, high) = skin.bounds().unwrap();
    assert!((110.0..150.0).contains(&high.z) && (90.0..140.0).contains(&high.y), "{low} {high}");
    let cranium = mean.iter().filter(|p| p.y > 6.0 && p.z < 5.0).fold(0.0f32, |m, p| m.max(p.x));
    assert!((75.0..78.0).contains(&cranium), "half of 155 mm, less what subdivision rounds off: {cranium}");
    for (name, path) in m.lash_lines() {
        assert!(path.len() > 8, "{name}");
        for w in path.windows(2) {
            let joined = |q: &[u32; 4]| {
                (0..4).any(|k| {
                    let e = (q[k], q[(k + 1) % 4]);
                    e == (w[0], w[1]) || e == (w[1], w[0])
                })
            };
            assert!(m.asset.quads.iter().any(joined), "{name}: {w:?} is no edge");
        }
    }
}

#[test]
fn the_same_seed_is_the_same_person_and_another_is_another() {
    let (a, b) = (person(3), person(3));
    assert_eq!(a, b);
    let apart = |x: &Identity, y: &Identity| -> f32 {
        let sum: f32 = x.control.iter().zip(&y.control).map(|(p, q)| p.distance(*q)).sum();
        sum / x.control.len() as f32
    };
    for i in 4..14 {
        let d = apart(&a, &person(i));
        assert!((0.5..25.0).contains(&d), "persons 3 and {i} lie {d} mm apart");
    }
    let spec = FaceSpec { identity: 3, variety: 0.0, male: Some(1.0), ..FaceSpec::default() };
    let plain = Identity::draw(model(), &spec).unwrap();
    assert!(apart(&a, &plain) > 0.5);
    let at = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| posed(&person(5), &[("jawOpen", 0.5)]))
    };
    assert_eq!(at(1), at(2));
}

#[test]
fn weights_out_of_range_and_unknown_names_are_named() {
    let m = model();
    for bad in [-0.1, 1.1, f32::NAN, f32::INFINITY] {
        let text = m.weights([("jawOpen", bad)]).unwrap_err().to_string();
        assert!(text.contains("jawOpen") && text.contains("between 0 and 1"), "{text}");
        let mut pose = m.neutral();
        pose.weights[7] = bad;
        assert!(matches!(m.pose(&Identity::mean(m), &pose), Err(FaceError::Weight { .. })));
    }
    let text = m.weights([("jawOpened", 0.1)]).unwrap_err().to_string();
    assert!(text.contains("jawOpened") && text.contains("jawOpen,"), "{text}");
    let pose = FacePose { weights: vec![0.0; 3], ..m.neutral() };
    assert!(m.pose(&Identity::mean(m), &pose).is_err());
    let pose = FacePose { turn: DVec3::new(f64::NAN, 0.0, 0.0), ..m.neutral() };
    assert!(m.pose(&Identity::mean(m), &pose).is_err());
    for spec in [
        FaceSpec { male: Some(1.5), ..FaceSpec::default() },
        FaceSpec { age: Some(f32::NAN), ..FaceSpec::default() },
        FaceSpec { variety: -1.0, ..FaceSpec::default() },
        FaceSpec { expressions: [("blink".to_owned(), 0.5)].into(), ..FaceSpec::default() },
    ] {
        assert!(spec.check().is_err() && Identity::draw(m, &spec).is_err(), "{spec:?}");
    }
}

#[test]
fn a_description_survives_toml() {
    let text = "identity = 7\nmale = 1.0\nperformance = \"smile-puff\"\n[expressions]\njawOpen = 0.25\n";
    let spec: FaceSpec = toml::from_str(text).unwrap();
    assert_eq!((spec.performance, spec.expressions["jawOpen"]), (Some(Act::SmilePuff), 0.25));
    assert_eq!(toml::from_str::<FaceSpec>(&toml::to_string(&spec).unwrap()).unwrap(), spec);
    assert!(toml::from_str::<FaceSpec>("identty = 7").is_err());
}

#[test]
fn a_damaged_asset_is_an_error_with_its_place() {
    for n in [0, 7, 8, 20, 35, 36, 1000, 61_000, 120_000, 190_000, 500_000, FACE_BIN.len() - 1] {
        let text = FaceModel::parse(&FACE_BIN[..n]).err().expect("truncated").to_string();
        assert!(text.contains("byte") && text.contains("derive_face.py"), "{text}");
    }
    let changed = |at: usize, with: &[u8]| {
        let mut bytes = FACE_BIN.to_vec();
        bytes[at..at + with.len()].copy_from_slice(with);
        FaceModel::parse(&bytes).err().map_or("none".into(), |e| e.to_string())
    };
    let (vertices, uvs) = (36, 36 + 12 * 5112);
    assert!(changed(vertices + 24, &f32::NAN.to_le_bytes()).contains("not finite"));
    assert!(changed(uvs + 8, &1.01f32.to_le_bytes()).contains("outside its map"));
    let quads = uvs + 8 * model().asset.uvs.len();
    assert!(changed(quads, &u16::MAX.to_le_bytes()).contains("vertex 65535 of 5112"));
    assert!(changed(quads, &FACE_BIN[quads + 2..quads + 4]).contains("twice"));
    assert!(changed(quads + 17, &FACE_BIN[quads..quads + 8]).contains("several quads"));
    assert!(changed(8, &u32::MAX.to_le_bytes()).contains("do not fit"));
    assert!(FaceModel::parse(&[FACE_BIN, b"x"].concat()).is_err());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]
    #[test]
    fn any_bytes_are_an_asset_or_an_error(at in 0usize..400_000, with in any::<[u8; 4]>(), keep in 0usize..2_300_000) {
        let mut bytes = FACE_BIN.to_vec();
        bytes[at..at + 4].copy_from_slice(&with);
        bytes.truncate(keep.max(40));
        let _ = Asset::parse(&bytes);
    }

    #[test]
    fn any_header_is_an_asset_or_an_error(tail in proptest::collection::vec(any::<u8>(), 0..200)) {
        let _ = Asset::parse(&[&b"SBFACE1\0"[..], &tail].concat());
    }
}

#[test]
fn every_triangle_has_its_own_place_on_the_map() {
    let m = model();
    assert_eq!((m.uv_triangles().len(), m.parts().len()), (m.triangles().len(), m.triangles().len()));
    assert!(m.uvs().iter().all(|uv| uv.clamp(glam::Vec2::ZERO, glam::Vec2::ONE) == *uv));
    let area = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| m.uvs()[i as usize]);
        0.5 * f64::from((b - a).perp_dot(c - a))
    };
    // A texel of a map of 32,768 a side is 1e-9: what is smaller carries no texture. None may have no area.
    let areas: Vec<f64> = m.uv_triangles().iter().map(area).collect();
    let flat = areas.iter().filter(|a| a.abs() < 1e-11).count();
    let turned = areas.iter().zip(m.parts()).filter(|(a, p)| **a < 0.0 && **p == Part::Skin).count();
    let skin = m.parts().iter().filter(|p| **p == Part::Skin).count();
    println!("{flat} flat, {turned} of {skin} triangles of skin turned over, of {}", areas.len());
    assert_eq!(flat, 0);
    // The charts are not mirrored, but for a fold of the source's own in one place.
    assert!(turned <= 2, "{turned}");
    // Corners correspond through both steps: the first corner of a refined quad is the old corner it lies at.
    for step in 0..2 {
        let coarse = if step == 0 { &m.asset.quads } else { &m.steps[0].quads };
        for (f, q) in coarse.iter().enumerate() {
            for k in 0..4 {
                assert_eq!(m.steps[step].quads[4 * f + k][0], q[k]);
            }
        }
    }
    // The map of places to texture has no tear inside a chart: an edge of two triangles that share both vertices
    // and both texture corners, or neither corner pair (a seam). Seams are those of the control mesh, twice halved.
    let seams = |v: &[[u32; 3]], t: &[[u32; 3]]| {
        let mut of = std::collections::BTreeMap::new();
        for (v, t) in v.iter().zip(t) {
            for k in 0..3 {
                let (a, b) = ((v[k], t[k]), (v[(k + 1) % 3], t[(k + 1) % 3]));
                of.entry((a.0.min(b.0), a.0.max(b.0)))
                    .or_insert_with(std::collections::BTreeSet::new)
                    .insert(if a.0 < b.0 { (a.1, b.1) } else { (b.1, a.1) });
            }
        }
        of.values().filter(|s| s.len() > 1).count()
    };
    let coarse = seams(&triangles(&m.asset.quads), &triangles(&m.asset.uv_quads));
    assert!(coarse > 50);
    assert_eq!(seams(m.triangles(), m.uv_triangles()), 4 * coarse);
}

/// The triangles of the chart of the head, which holds all skin that a camera can see above the neck: not the mouth's
/// bag nor the pockets behind the lids, which run through the eyeballs out of sight.
fn outer(uvs: &[glam::Vec2], tris: &[[u32; 3]]) -> Vec<bool> {
    tris.iter().map(|t| t.iter().all(|&i| uvs[i as usize].y > 0.47)).collect()
}

/// How deep outer skin lies inside the eyeballs at most, mm, of these vertices and triangles.
fn depth_in_eyes(vertices: &[Vec3], tris: &[[u32; 3]], parts: &[Part], outer: &[bool]) -> f32 {
    let mut worst = 0.0f32;
    for eye in [Part::LeftEye, Part::RightEye] {
        let ball: Vec<[u32; 3]> =
            tris.iter().zip(parts).filter(|(_, p)| **p == eye).map(|(t, _)| *t).collect();
        let bvh = MeshBvh::new(vertices, &ball);
        let middle =
            ball.iter().flatten().map(|&i| vertices[i as usize]).sum::<Vec3>() / (3 * ball.len()) as f32;
        for (t, _) in tris.iter().zip(outer).filter(|(_, o)| **o) {
            for &i in t {
                let p = vertices[i as usize];
                if p.distance(middle) < 30.0 && p.z > middle.z {
                    worst = worst.max(-bvh.closest(p, None).distance);
                }
            }
        }
    }
    worst
}

#[test]
fn closed_lids_stay_before_the_eyes_as_well_as_the_asset_has_them() {
    let m = model();
    let coarse_parts: Vec<Part> = m.asset.parts.iter().flat_map(|&p| [p; 2]).collect();
    let blink: &[(&str, f32)] = &[("eyeBlinkLeft", 1.0), ("eyeBlinkRight", 1.0)];
    for (who, identity) in [("mean", Identity::mean(m)), ("person 1", person(1)), ("person 2", person(2))] {
        for named in [&[][..], blink] {
            let mut control = identity.control.clone();
            let weights = m.weights(named.iter().copied()).unwrap();
            for (t, w) in m.expression_targets().zip(&weights) {
                t.deltas.iter().for_each(|&(i, d)| control[i as usize] += d * *w);
            }
            let seen = outer(&m.asset.uvs, &triangles(&m.asset.uv_quads));
            let asset = depth_in_eyes(&control, &triangles(&m.asset.quads), &coarse_parts, &seen);
            let seen = outer(m.uvs(), m.uv_triangles());
            let face = depth_in_eyes(&posed(&identity, named).vertices, m.triangles(), m.parts(), &seen);
            println!("{who}, {} expressions: asset {asset:.3} mm, face {face:.3} mm", named.len());
            assert!(face <= asset.max(0.05), "{who}: {face} mm of {asset} mm");
        }
    }
}

const ACTS: [Act; 4] = [Act::Rotation, Act::Dialogue, Act::SmilePuff, Act::Brows];

#[test]
fn performances_are_smooth_begin_neutral_and_move() {
    let m = model();
    for act in ACTS {
        let p = Performance { act, seed: 2 };
        assert_eq!(p.pose(m, 0.0), m.neutral(), "{act:?}");
        let still = p.pose(m, p.duration_s());
        assert!(still.weights.iter().all(|w| w.abs() < 1e-6) && still.turn.length() < 1e-9, "{act:?}");
        // Third differences by dt³ stay bounded where the second derivative is continuous; they would grow by 2 where
        // it jumps, by 4 at a kink and by 8 at a step when dt is halved.
        let rates = |dt: f64| -> Vec<f64> {
            let track = |t: f64| -> Vec<f64> {
                let pose = p.pose(m, t);
                let weights = pose.weights.iter().map(|&w| f64::from(w));
                weights.chain(pose.turn.to_array()).chain(pose.shift_mm.to_array()).collect()
            };
            let all: Vec<Vec<f64>> =
                (0..(p.duration_s() / dt) as usize).map(|i| track(i as f64 * dt)).collect();
            let third = |w: &[Vec<f64>], k: usize| w[3][k] - 3.0 * w[2][k] + 3.0 * w[1][k] - w[0][k];
            (0..all[0].len())
                .map(|k| all.windows(4).map(|w| third(w, k).abs()).fold(0.0, f64::max) / (dt * dt * dt))
                .collect()
        };
        let (dt, half) = (8e-3, 4e-3);
        // A weight is a float of 24 bits: eight of its half units in a third difference.
        let noise = 8.0 * 0.5 * f64::from(f32::EPSILON) / f64::powi(half, 3);
        for (k, (a, b)) in rates(dt).iter().zip(rates(half)).enumerate() {
            assert!(b <= 1.5 * a + noise, "{act:?}, track {k}: {a} then {b}");
        }
        let moving = (0..p.frames()).map(|f| p.pose(m, f64::from(f) / FRAME_RATE_HZ));
        let (most, far) = moving.fold((0.0f32, 0.0f64), |(w, r), pose| {
            let weight = pose.weights.iter().fold(w, |a, &b| a.max(b));
            (weight, r.max(pose.turn.length()))
        });
        assert!(far > 0.02 && (act == Act::Rotation) == (most == 0.0), "{act:?}: {most}, {far} rad");
    }
}

#[test]
fn no_frame_turns_skin_inside_out() {
    // Margins of lids and lips roll by more than a right angle when they close; their triangles are many but small. At
    // most this share of the area of the outer skin may: one blink of the source turns 0.026 % over.
    const SHARE: f64 = 0.001;
    let m = model();
    for (act, seed) in ACTS[1..].iter().flat_map(|&a| [(a, 1), (a, 2)]) {
        let p = Performance { act, seed };
        let who = person(seed);
        let face = |t: f64| {
            let pose = FacePose { weights: p.pose(m, t).weights, ..m.neutral() };
            model().pose(&who, &pose).unwrap().vertices
        };
        let normals = |v: &[Vec3]| -> Vec<Vec3> {
            let cross = |t: &[u32; 3]| {
                let [a, b, c] = t.map(|i| v[i as usize]);
                (b - a).cross(c - a)
            };
            m.triangles().iter().map(cross).collect()
        };
        let rest = normals(&face(0.0));
        let seen = outer(m.uvs(), m.uv_triangles());
        let area = |of: &mut dyn Iterator<Item = &Vec3>| of.map(|n| f64::from(n.length())).sum::<f64>();
        let all = area(&mut rest.iter().zip(&seen).filter(|(_, o)| **o).map(|(n, _)| n));
        let mut worst = 0.0f64;
        for k in (0..p.frames()).step_by(6) {
            let now = normals(&face(f64::from(k) / FRAME_RATE_HZ));
            let turned = rest.iter().zip(&now).zip(&seen).filter(|((a, b), o)| **o && a.dot(**b) < 0.0);
            worst = worst.max(area(&mut turned.map(|((a, _), _)| a)) / all);
        }
        println!("{act:?} {seed}: at most {:.3} % turned over", 100.0 * worst);
        assert!(worst <= SHARE, "{act:?}: {worst}");
    }
}

#[test]
fn follicles_keep_their_place_and_turn_with_the_skin() {
    let m = model();
    let who = person(4);
    let rest = posed(&who, &[]);
    // Above the ears all skin follows the head.
    let high = m.triangles().iter().zip(m.parts()).enumerate().filter(|(_, (t, part))| {
        **part == Part::Skin && t.iter().all(|&i| rest.vertices[i as usize].y > 0.0)
    });
    let follicles: Vec<Follicle> = high
        .map(|(i, _)| Follicle { triangle: i as u32, barycentric: [0.2, 0.3, 0.5] })
        .step_by(97)
        .collect();
    assert!(follicles.len() > 100);
    let turn = DVec3::new(0.1, 0.4, -0.05);
    let pose = FacePose { turn, ..m.neutral() };
    let turned = m.pose(&who, &pose).unwrap();
    let pivot = DVec3::new(0.0, -110.0, -10.0);
    for f in &follicles {
        let (a, b) = (f.frame(m, &rest), f.frame(m, &turned));
        let identity = (a.axes * a.axes.transpose()).abs_diff_eq(glam::Mat3::IDENTITY, 1e-5);
        assert!(identity, "{a:?}");
        let hair = a.position + a.axes.z_axis * 8.0 + a.axes.x_axis * 3.0;
        let want = rotation(turn) * (hair.as_dvec3() - pivot) + pivot;
        let got = a.carry(&b, hair).as_dvec3();
        assert!(got.distance(want) < 5e-3, "{got} for {want}");
        assert!(f.uv(m).clamp(glam::Vec2::ZERO, glam::Vec2::ONE) == f.uv(m));
    }
    // u and v grow along the axes, and no frame jumps: a step half as long is about half as large.
    let p = Performance { act: Act::Dialogue, seed: 1 };
    let at = |t: f64| model().pose(&who, &p.pose(m, t)).unwrap();
    let (a, b, c) = (at(2.0), at(2.0 + 2e-3), at(2.0 + 1e-3));
    for triangle in (0..m.triangles().len() as u32).step_by(501) {
        let f = Follicle { triangle, barycentric: [0.4, 0.3, 0.3] };
        let (a, b, c) = (f.frame(m, &a), f.frame(m, &b), f.frame(m, &c));
        let whole = (b.axes.x_axis - a.axes.x_axis).length();
        let part = (c.axes.x_axis - a.axes.x_axis).length();
        assert!(
            whole < 0.05 && (part - 0.5 * whole).abs() < 0.1 * whole + 2e-4,
            "{triangle}: {whole} {part}"
        );
    }
}

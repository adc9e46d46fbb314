//! Frames in time: unwarping, de-noising, the temporal filter, and sequences from images to strands.

mod common;

use common::{Shape, Streaks};
use glam::{DQuat, DVec2, DVec3, Vec3};
use strandbench_recon::field3d::{Neighbour, temporal_pass};
use strandbench_recon::surface::FrameSurface;
use strandbench_recon::temporal::{Correspondence, FrameTracker, average};
use strandbench_recon::tensor::{Tensor, outer, principal};
use strandbench_recon::{
    Checkpoint, LUO, ReconError, SequenceFrame, SequenceReconstructor, StrandParameters, TemporalParameters,
    Variant, reconstruct,
};
use strandbench_rng::Rng;
use strandbench_solve::deform::Registered;
use strandbench_types::{Camera, DepthMap, Frame, Plane, Rig, Silent};

fn camera() -> Camera {
    common::rig((200, 180), 700.0, 100.0).cameras.swap_remove(0)
}

/// Depth of a bumpy sheet after a rigid motion, by marching along each ray; `noise_mm` is added.
fn sheet(camera: &Camera, index: u32, turn: DQuat, shift: DVec3, noise_mm: f64) -> FrameSurface {
    let height = |p: DVec3| {
        p.z - 6.0 * (p.x / 9.0).sin() * (p.y / 12.0).cos() - 3.0 * (p.x / 5.0 + p.y / 7.0).sin()
            + (p.x * p.x + p.y * p.y) / 400.0
    };
    let (w, h) = (camera.width as usize, camera.height as usize);
    let mut map = DepthMap::empty(w, h);
    for i in 0..w * h {
        let q = DVec2::new((i % w) as f64 + 0.5, (i / w) as f64 + 0.5);
        let at = |z: f64| turn.inverse() * (camera.unproject(q, z) - shift);
        let (mut near, mut far) = (850.0, 960.0);
        let own = at(900.0);
        if own.x.abs() > 80.0 || own.y.abs() > 70.0 {
            continue;
        }
        for _ in 0..60 {
            let middle = 0.5 * (near + far);
            if height(at(middle)) > 0.0 { near = middle } else { far = middle }
        }
        let mut rng = Rng::keyed(&[11, u64::from(index), i as u64]);
        let gauss = (0..12).map(|_| rng.f64()).sum::<f64>() - 6.0;
        map.set(i % w, i / w, Some((near + gauss * noise_mm) as f32));
    }
    FrameSurface::new(camera, index, map, 10.0).unwrap()
}

fn inner(s: &FrameSurface) -> impl Iterator<Item = usize> + '_ {
    (0..s.len()).filter(|&v| (s.centre_px(v) - DVec2::new(100.0, 90.0)).abs().max_element() < 45.0)
}

fn quantile(mut v: Vec<f64>, share: f64) -> f64 {
    v.sort_by(f64::total_cmp);
    common::quantile(&v, share)
}

#[test]
fn a_rigid_motion_is_unwarped() {
    let c = camera();
    let (turn, shift) =
        (DQuat::from_rotation_y(0.02) * DQuat::from_rotation_z(0.01), DVec3::new(1.5, -1.0, 2.0));
    let own = sheet(&c, 4, DQuat::IDENTITY, DVec3::ZERO, 0.0);
    let other = sheet(&c, 5, turn, shift, 0.0);
    let mut tracker = FrameTracker::new(&c, &own, &TemporalParameters::LUO).unwrap();
    let found = tracker.find(&other, &Silent).unwrap();
    assert_eq!((found.other, found.pixels.len()), (5, own.len()));
    let (mut depth_mm, mut aside_px) = (Vec::new(), Vec::new());
    for v in inner(&own) {
        let at = own.envelope.mesh.vertices[v].as_dvec3();
        let want = c.project(turn * at + shift).unwrap().0;
        aside_px.push(found.pixels[v].expect("in view").distance(want));
        depth_mm.push(f64::from(
            (found.depth_mm[v] - own.depth.get_index(own.pixels[v] as usize).unwrap()).abs(),
        ));
    }
    let (d, a) = (quantile(depth_mm, 0.95), quantile(aside_px, 0.95));
    println!("unwarped depth {d:.3} mm off, places {a:.3} px off (p95), {:?}", found.registered);
    // Bilinear depth between 1.3 mm pixels of bumps with curvature up to 6/9² + 3/5² = 0.2 per mm errs by up to
    // 0.2 · 1.3² / 8 = 0.04 mm, at slopes of up to 1.3; a pixel is the unit in which 5.1 looks up its neighbours.
    assert!(d < 0.15 && a < 0.5, "{d} mm, {a} px");
    // To itself nothing moves.
    let same = tracker.find(&own, &Silent).unwrap();
    for v in 0..own.len() {
        if let Some(q) = same.pixels[v] {
            // Depths are f32: 3e-5 mm at 900 mm, seen at slopes of up to 1.3 and 0.8 px a mm.
            assert!(q.distance(own.centre_px(v)) < 1e-4, "{q}");
        }
    }
}

#[test]
fn averaging_three_frames_takes_noise_away() {
    let c = camera();
    let at = |k: u32| {
        let t = f64::from(k) - 1.0;
        (DQuat::from_rotation_y(0.012 * t), DVec3::new(1.0, -0.5, 1.0) * t)
    };
    let noisy: Vec<FrameSurface> = (0..3).map(|k| sheet(&c, k, at(k).0, at(k).1, 0.5)).collect();
    let clean = sheet(&c, 1, at(1).0, at(1).1, 0.0);
    let mut tracker = FrameTracker::new(&c, &noisy[1], &TemporalParameters::LUO).unwrap();
    let found = [0, 2].map(|k| tracker.find(&noisy[k], &Silent).unwrap());
    let out = average(&noisy[1], &[&found[0], &found[1]]);
    let sd = |map: &DepthMap| {
        let errors = inner(&noisy[1]).map(|v| noisy[1].pixels[v] as usize);
        let (sum, n) = errors.fold((0.0, 0.0), |(s, n), i| {
            let e = map.get_index(i).unwrap() - clean.depth.get_index(i).unwrap();
            (s + f64::from(e * e), n + 1.0)
        });
        f64::sqrt(sum / n)
    };
    let (before, after) = (sd(&noisy[1].depth), sd(&out));
    println!("noise {before:.3} mm, after averaging {after:.3} mm");
    // Three independent errors: 1/√3 = 0.577, and less still since bilinear reading averages the neighbours'; the
    // motion between frames must not eat it up.
    assert!((before - 0.5).abs() < 0.02 && after < 0.62 * before, "{before} to {after} mm");
    // Without neighbours, and with neighbours that have no say, the depth stays.
    assert_eq!(average(&noisy[1], &[]), noisy[1].depth);
    let silent = Correspondence {
        other: 2,
        pixels: vec![None; noisy[1].len()],
        depth_mm: vec![f32::NAN; noisy[1].len()],
        registered: Registered::default(),
    };
    assert_eq!(average(&noisy[1], &[&silent]), noisy[1].depth);
}

#[test]
fn surfaces_too_far_apart_or_beyond_the_gate_have_no_say() {
    let c = camera();
    let own = sheet(&c, 0, DQuat::IDENTITY, DVec3::ZERO, 0.0);
    let far = sheet(&c, 1, DQuat::IDENTITY, DVec3::Z * 45.0, 0.0);
    let p = TemporalParameters { partner_mm: 5.0, ..TemporalParameters::LUO };
    let error = FrameTracker::new(&c, &own, &p).unwrap().find(&far, &Silent).unwrap_err();
    assert!(matches!(error, ReconError::Deform { frame: 0, .. }), "{error}");
    // A flap 30 mm in front of one corner is another surface.
    let mut map = own.depth.clone();
    for y in 60..90 {
        for x in 60..90 {
            map.set(x, y, Some(map.get(x, y).unwrap() - 30.0));
        }
    }
    let flap = FrameSurface::new(&c, 1, map, 10.0).unwrap();
    let found = FrameTracker::new(&c, &own, &TemporalParameters::LUO).unwrap().find(&flap, &Silent).unwrap();
    let hidden = |&v: &usize| {
        let q = own.centre_px(v);
        q.x > 63.0 && q.x < 87.0 && q.y > 63.0 && q.y < 87.0
    };
    let lost: Vec<usize> = inner(&own).filter(hidden).collect();
    assert!(lost.len() > 300 && lost.iter().all(|&v| found.depth_mm[v].is_nan()));
}

/// Eq. 11 by hand on one vertex.
#[test]
fn one_pass_of_the_temporal_filter_is_equation_11() {
    let c = camera();
    let own = sheet(&c, 1, DQuat::IDENTITY, DVec3::ZERO, 0.0);
    let other = sheet(&c, 2, DQuat::IDENTITY, DVec3::new(0.0, 0.0, 3.0), 0.0);
    let v = inner(&own).nth(700).unwrap();
    let there = other.vertex_at(own.centre_px(v)).unwrap();
    let n = own.normals[v];
    let (s, t) = n.any_orthonormal_pair();
    let mut tensors = vec![[0.0; 6]; own.len()];
    let mut others = vec![[0.0; 6]; other.len()];
    tensors[v] = outer(s * 0.8);
    others[there] = outer((s + t * 0.5 + n * 0.3) * 0.9);
    let place = |vertex: usize| (vertex == v).then(|| own.centre_px(v));
    let correspondence = Correspondence {
        other: 2,
        pixels: (0..own.len()).map(place).collect(),
        depth_mm: vec![f32::NAN; own.len()],
        registered: Registered::default(),
    };
    let neighbour = Neighbour {
        surface: &other,
        correspondence: &correspondence,
        registered: &own.envelope.vertex,
        tensors: &others,
    };
    let d2 = f64::from(own.envelope.mesh.vertices[v].distance_squared(other.envelope.mesh.vertices[there]));
    let w = 0.25 * (-d2 / (2.0 * 5.0 * 5.0)).exp();
    assert!(w > 0.1 && w < 0.25);
    let p = StrandParameters { temporal_sigma_mm: 5.0, ..StrandParameters::LUO };
    for (convex, own_weight) in [(false, 1.0), (true, 1.0 - w)] {
        let got =
            temporal_pass(&own, &tensors, &[neighbour], &StrandParameters { convex_filter: convex, ..p })[v];
        let sum: Tensor = std::array::from_fn(|k| {
            (own_weight * f64::from(tensors[v][k]) + w * f64::from(others[there][k])) as f32
        });
        let (value, line) = principal(&sum).unwrap();
        let l = line * value.sqrt();
        let want = outer(l - n * l.dot(n));
        for k in 0..6 {
            assert!((got[k] - want[k]).abs() < 1e-6, "convex {convex}: {got:?} for {want:?}");
        }
        let (_, line) = principal(&got).unwrap();
        assert!(line.dot(n).abs() < 1e-5, "leaves the tangent plane");
        assert!(line.dot(s).abs() < 0.9999, "the neighbour has no say");
    }
    // Alone, a tensor in the tangent plane stays what it is; a zero one stays zero.
    let alone = temporal_pass(&own, &tensors, &[], &p);
    assert!((0..6).all(|k| (alone[v][k] - tensors[v][k]).abs() < 1e-6));
    assert!(alone.iter().enumerate().all(|(i, t)| i == v || *t == [0.0; 6]));
}

const STREAKS: Streaks = Streaks { seed: 5, width_mm: 3.0, wave_mm: 2.0 };
const BALL: Shape = Shape::Sphere { radius_mm: 70.0 };

/// A small variant with strands; three passes, so that frames wait for four.
fn small() -> Variant {
    let mut v = LUO;
    v.parameters.labels = 48;
    v.strands = Some(StrandParameters {
        orientation_passes: 3,
        voxel_mm: 4.0,
        surface_seeds: 300,
        interior_seeds: 300,
        ..StrandParameters::LUO
    });
    v
}

/// A ball that drifts by `step` a frame, seen by the rig.
fn film(count: u32, step: DVec3) -> (Rig, Vec<Frame>) {
    film_of(BALL, count, step)
}

fn film_of(shape: Shape, count: u32, step: DVec3) -> (Rig, Vec<Frame>) {
    let rig = common::rig((128, 96), 420.0, 170.0);
    let frames = (0..count)
        .map(|k| {
            let mut seen = rig.clone();
            for c in &mut seen.cameras {
                c.translation_mm += c.camera_from_world * step * f64::from(k);
            }
            Frame { index: k, ..common::frame(&seen, shape, STREAKS, 2) }
        })
        .collect();
    (rig, frames)
}

fn run(rig: &Rig, frames: &[Frame], variant: &Variant) -> Vec<SequenceFrame> {
    let mut s = SequenceReconstructor::new(rig, variant).unwrap();
    let mut out: Vec<SequenceFrame> = frames.iter().flat_map(|f| s.push(f, &Silent).unwrap()).collect();
    out.extend(s.finish(&Silent).unwrap());
    out
}

#[test]
fn strands_keep_their_identity_and_follow_the_ball() {
    let step = DVec3::new(0.8, 0.0, 0.8);
    let (rig, frames) = film(4, step);
    let out = run(&rig, &frames, &small());
    assert_eq!(out.iter().map(|f| f.frame_index).collect::<Vec<_>>(), [0, 1, 2, 3]);
    let estimates: Vec<_> = out.iter().map(|f| &f.outcome.as_ref().unwrap().estimate).collect();
    let mut middles: Vec<std::collections::BTreeMap<u64, Vec3>> = Vec::new();
    for e in &estimates {
        e.validate_strand_ids().unwrap();
        let (strands, ids) = (e.strands.as_ref().unwrap(), e.strand_ids.as_ref().unwrap());
        strands.validate().unwrap();
        assert!(strands.len() > 300, "{} strands", strands.len());
        let middle = |i: usize| strands.strand(i).iter().sum::<Vec3>() / strands.strand(i).len() as f32;
        middles.push(ids.iter().enumerate().map(|(i, &id)| (id, middle(i))).collect());
    }
    let shared: Vec<u64> = middles[0].keys().copied().filter(|id| middles[3].contains_key(id)).collect();
    assert!(shared.len() > 100 && shared.iter().all(|&id| id < 300), "{} ids persist", shared.len());
    assert!(
        middles.iter().all(|m| m.keys().any(|&id| id >= 1 << 32)),
        "surface strands have ids of their own"
    );
    let went: Vec<f64> = shared.iter().map(|id| f64::from((middles[3][id] - middles[0][id]).z)).collect();
    println!(
        "{} strands persist and go {:.2} mm towards the camera, the ball 2.4",
        shared.len(),
        quantile(went.clone(), 0.5)
    );
    let notes = &out[1].outcome.as_ref().unwrap().diagnostics.notes;
    assert!(notes.iter().any(|n| n.contains("registered to frame 2")), "{notes:?}");
}

#[test]
fn a_sequence_that_goes_on_from_a_checkpoint_has_the_bits_of_one_in_one_go() {
    for reach in ["1", "2"] {
        goes_on_with_the_same_bits(reach);
    }
}

fn goes_on_with_the_same_bits(reach: &str) {
    let (rig, frames) = film(9, DVec3::new(0.6, 0.0, 0.5));
    let v = small().with("orientation_passes", "1").unwrap().with("reach", reach).unwrap();
    let whole = run(&rig, &frames, &v);
    let mut first = SequenceReconstructor::new(&rig, &v).unwrap();
    assert!(first.checkpoint().is_none());
    let before: usize = frames[..7].iter().map(|f| first.push(f, &Silent).unwrap().len()).sum();
    let bytes = first.checkpoint().unwrap().to_bytes();
    drop(first);

    let checkpoint = Checkpoint::from_bytes(&bytes).unwrap();
    assert_eq!(checkpoint.frame as usize + 1, before);
    let mut second = SequenceReconstructor::resume(&rig, &v, &checkpoint).unwrap();
    let from = before.saturating_sub(second.looks_back());
    assert!(from > 0, "the test is of a part of the sequence");
    let mut out: Vec<SequenceFrame> =
        frames[from..].iter().flat_map(|f| second.push(f, &Silent).unwrap()).collect();
    out.extend(second.finish(&Silent).unwrap());
    assert_eq!(
        out.iter().map(|f| f.frame_index as usize).collect::<Vec<_>>(),
        (before..9).collect::<Vec<_>>()
    );
    for (a, b) in out.iter().zip(&whole[before..]) {
        assert_eq!(a.outcome.as_ref().unwrap().estimate, b.outcome.as_ref().unwrap().estimate);
    }

    // A checkpoint that does not fit, and a variant that has no use for one.
    let other = v.with("node_spacing_mm", "22").unwrap();
    let refused = SequenceReconstructor::resume(&rig, &other, &checkpoint).unwrap_err();
    assert!(refused.to_string().contains("begin the sequence anew"), "{refused}");
    let none = v.with("strands", "off").unwrap();
    assert!(SequenceReconstructor::resume(&rig, &none, &checkpoint).is_err());
}

#[test]
fn frames_come_out_in_turn_and_gaps_are_gaps() {
    let (rig, mut frames) = film(6, DVec3::new(0.5, 0.0, 0.0));
    let blank = frames[2].masks[0].map(|_| false);
    frames[2].masks[0] = blank;
    let v = LUO.with("labels", "24").unwrap().with("reach", "1").unwrap();
    let mut s = SequenceReconstructor::new(&rig, &v).unwrap();
    assert_eq!(s.latency(), 1);
    let order: Vec<Vec<u32>> = frames
        .iter()
        .filter(|f| f.index != 4)
        .map(|f| s.push(f, &Silent).unwrap().iter().map(|f| f.frame_index).collect())
        .collect();
    assert_eq!(order, [vec![], vec![0], vec![1, 2], vec![], vec![3]]);
    let again = s.push(&frames[5], &Silent).unwrap_err();
    assert!(matches!(again, ReconError::Order { frame: 5, last: 5 }), "{again}");
    let mut other_size = frames[5].clone();
    other_size.index = 6;
    other_size.images[1] = Plane::filled(10, 10, 0.0);
    assert!(matches!(s.push(&other_size, &Silent), Err(ReconError::Input(_))));
    let mut nan = frames[5].clone();
    nan.index = 6;
    nan.images[0].data[77] = f32::NAN;
    assert!(matches!(s.push(&nan, &Silent), Err(ReconError::Input(_))));
    let last = s.finish(&Silent).unwrap();
    assert_eq!(last.iter().map(|f| f.frame_index).collect::<Vec<_>>(), [5]);
    // Frame 4 never came: 3 and 5 are no neighbours.
    assert!(last[0].outcome.as_ref().unwrap().diagnostics.notes.is_empty());

    let out = run(&rig, &frames[..4], &v);
    assert!(matches!(out[2].outcome, Err(ReconError::EmptyMask { frame: 2, .. })));
    // Frame 1 has frame 0 alone, frame 3 nobody: as good as a frame by itself.
    let notes = |k: usize| &out[k].outcome.as_ref().unwrap().diagnostics.notes;
    assert_eq!((notes(1).len(), notes(3).len()), (1, 0));
    let single = reconstruct(&rig, &frames[3], &v, &Silent).unwrap();
    assert_eq!(out[3].outcome.as_ref().unwrap().estimate, single.estimate);
    // Two frames either way: frame 1 has 0 and 3, frame 3 has 1.
    let far = v.with("reach", "2").unwrap();
    let mut s = SequenceReconstructor::new(&rig, &far).unwrap();
    assert_eq!((s.latency(), s.looks_back()), (2, 2));
    let order: Vec<usize> = frames[..4].iter().map(|f| s.push(f, &Silent).unwrap().len()).collect();
    assert_eq!(order, [0, 0, 1, 2], "frames 1 and 2 come when 3 is in");
    let out = run(&rig, &frames[..4], &far);
    let others = |k: usize| {
        let notes = &out[k].outcome.as_ref().unwrap().diagnostics.notes;
        notes.iter().map(|n| n.split(':').next().unwrap().to_owned()).collect::<Vec<_>>()
    };
    assert_eq!(others(1), ["registered to frame 0", "registered to frame 3"]);
    assert_eq!((others(0).len(), others(3)), (1, vec!["registered to frame 1".to_owned()]));
    // Without de-noising nothing waits.
    let bare = v.with("denoise", "false").unwrap();
    let mut s = SequenceReconstructor::new(&rig, &bare).unwrap();
    let first = s.push(&frames[0], &Silent).unwrap();
    assert_eq!((s.latency(), first.len()), (0, 1));
    let alone = reconstruct(&rig, &frames[0], &bare, &Silent).unwrap();
    assert_eq!(first[0].outcome.as_ref().unwrap().estimate, alone.estimate);
}

const RELIEF: Shape = Shape::Relief { half_mm: 75.0 };

/// A relief at rest or drifting, with camera noise of its own in each frame: how much each pixel's depth error changes
/// from frame to frame; de-noised with `reach` frames either way, or not at all.
fn flicker_mm(step: DVec3, reach: usize) -> [f64; 2] {
    let (rig, mut frames) = film_of(RELIEF, 7, step);
    for (k, f) in frames.iter_mut().enumerate() {
        for (c, image) in f.images.iter_mut().enumerate() {
            for (i, v) in image.data.iter_mut().enumerate() {
                let mut rng = Rng::keyed(&[23, k as u64, c as u64, i as u64]);
                *v += 0.03 * ((0..12).map(|_| rng.f32()).sum::<f32>() - 6.0);
            }
        }
    }
    // 15 mm are 21 pixels of a VGA camera, and 42 mm of this one: noise comes in patches of so many pixels.
    let v = LUO.with("labels", "32").unwrap().with("node_spacing_mm", "42").unwrap();
    let v = v.with("denoise", if reach > 0 { "true" } else { "false" }).unwrap();
    let v = v.with("reach", &reach.max(1).to_string()).unwrap();
    let out = run(&rig, &frames, &v);
    let error = |k: usize, i: usize| {
        let mut camera = rig.cameras[0].clone();
        camera.translation_mm += camera.camera_from_world * step * k as f64;
        let q = DVec2::new((i % 128) as f64 + 0.5, (i / 128) as f64 + 0.5);
        let depth = out[k].outcome.as_ref().unwrap().estimate.depth.as_ref().unwrap();
        Some(f64::from(depth.get_index(i)?) - common::depth(RELIEF, &camera, q)?)
    };
    let mut all = Vec::new();
    for y in 24..72 {
        for x in 40..88 {
            let i = y * 128 + x;
            // The frames at the ends have fewer neighbours.
            let own: Vec<f64> = (2..5).filter_map(|k| error(k, i)).collect();
            let mean = own.iter().sum::<f64>() / own.len() as f64;
            all.push((own.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / (own.len() - 1) as f64).sqrt());
        }
    }
    [0.5, 0.75].map(|q| quantile(all.clone(), q))
}

#[test]
fn denoising_takes_flicker_away_at_rest_and_in_motion() {
    let rest = [0, 1, 2].map(|reach| flicker_mm(DVec3::ZERO, reach));
    let motion = [0, 1, 2].map(|reach| flicker_mm(DVec3::new(0.9, 0.4, 0.9), reach));
    println!("flicker (p50, p75) mm by itself and de-noised: at rest {rest:.3?}, in motion {motion:.3?}");
    // Means of three that share two with the next differ by 0.385 of what the frames differ by, were errors independent
    // and the unwarping perfect; half of that gain is asked for. In motion the errors of a pixel 2 mm wide move too.
    assert!(rest[1][1] < 0.69 * rest[0][1], "{rest:?}");
    assert!(motion[1][0] < motion[0][0] && motion[1][1] < motion[0][1], "{motion:?}");
    // Of five frames, neighbours share four.
    assert!(rest[2][1] < rest[1][1], "{rest:?}");
    assert!(motion[2][0] < motion[1][0] && motion[2][1] < motion[1][1], "{motion:?}");
}

#[test]
fn one_thread_and_two_give_the_same_bits() {
    let (rig, frames) = film(2, DVec3::new(0.5, 0.0, 0.5));
    let all = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let out = pool.install(|| run(&rig, &frames, &small()));
        out.into_iter().map(|f| f.outcome.unwrap().estimate).collect::<Vec<_>>()
    };
    let (one, two) = (all(1), all(2));
    assert!(one[0].strands.as_ref().unwrap().len() > 200);
    assert!(one == two, "threads change bits");
}

#[test]
fn a_single_frame_grows_strands_and_says_what_it_lacks() {
    let (rig, frames) = film(1, DVec3::ZERO);
    let v = small();
    let r = reconstruct(&rig, &frames[0], &v, &Silent).unwrap();
    assert!(r.estimate.strands.unwrap().len() > 300);
    for stage in ["template", "layer", "diffusion", "seeds", "growth"] {
        assert!(r.diagnostics.stages.iter().any(|s| s.name == stage), "{stage}");
    }
    let none = v.with("surface_seeds", "0").unwrap().with("interior_seeds", "0").unwrap();
    assert!(matches!(
        reconstruct(&rig, &frames[0], &none, &Silent),
        Err(ReconError::NoSeeds { frame: 0, .. })
    ));
    let fine = v.with("voxel_mm", "0.2").unwrap();
    assert!(matches!(reconstruct(&rig, &frames[0], &fine, &Silent), Err(ReconError::TooManyVoxels { .. })));
    let mut empty = frames[0].clone();
    empty.masks[0].data.fill(false);
    assert!(matches!(reconstruct(&rig, &empty, &v, &Silent), Err(ReconError::EmptyMask { .. })));
    // Two pixels of hair have depths but no triangle.
    empty.masks[0].data[48 * 128 + 64] = true;
    empty.masks[0].data[48 * 128 + 70] = true;
    let e = reconstruct(&rig, &empty, &v, &Silent).unwrap_err();
    assert!(matches!(e, ReconError::NoSurface { .. } | ReconError::NoResponse { .. }), "{e}");
    let stop = Stopped;
    assert!(matches!(reconstruct(&rig, &frames[0], &v, &stop), Err(ReconError::Cancelled(_))));
}

struct Stopped;

impl strandbench_types::Monitor for Stopped {
    fn begin(&self, _what: &str, _total: u64) {}
    fn advance(&self, _steps: u64) {}
    fn cancelled(&self) -> bool {
        true
    }
}

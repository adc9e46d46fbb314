//! Properties of moving scenes, on few strands and few guides.

use glam::Vec3;
use std::path::Path;
use strandbench_scenes::{
    HeadDrive, MotionCache, MotionError, MotionFrame, SceneError, SceneSpec, Simulation, Swing, WindSpec,
    build, moving_catalog, parse,
};
use strandbench_types::{Cancelled, Monitor, Silent};

fn spec(name: &str, strands: u32, guides: u32, frames: u32) -> SceneSpec {
    let entry = moving_catalog().iter().find(|e| e.name == name).expect("a moving scene");
    let mut s = entry.spec().unwrap().with_strands(strands);
    let motion = s.motion.as_mut().expect("it moves");
    motion.solver.guides = guides;
    motion.frames = frames;
    s
}

fn simulate(s: &SceneSpec) -> Vec<MotionFrame> {
    let mut simulation = Simulation::new(s, 1, None, &Silent).unwrap();
    let mut out = Vec::new();
    while let Some(frame) = simulation.next_frame(&Silent).unwrap() {
        out.push(frame);
    }
    assert_eq!(out.len(), s.motion.as_ref().unwrap().frames as usize);
    out
}

fn bits(frames: &[MotionFrame]) -> u64 {
    frames
        .iter()
        .flat_map(|f| {
            let surfaces = f.scene.surfaces.iter().flat_map(|s| &s.mesh.vertices);
            f.scene.strands.points.iter().chain(surfaces).flat_map(|p| p.to_array())
        })
        .fold(0xcbf2_9ce4_8422_2325, |h, v| (h ^ u64::from(v.to_bits())).wrapping_mul(0x0100_0000_01b3))
}

fn swing(amplitude_deg: f64, frequency_hz: f64) -> Swing {
    Swing { amplitude_deg, frequency_hz, cycles: 1.0, start_s: 0.0 }
}

/// Longest way of any point from its place in the first frame, mm.
fn drift(frames: &[MotionFrame]) -> f32 {
    let first = &frames[0].scene.strands.points;
    frames
        .iter()
        .flat_map(|f| f.scene.strands.points.iter().zip(first).map(|(p, q)| p.distance(*q)))
        .fold(0.0, f32::max)
}

#[test]
fn the_catalogue_has_the_three_kinds_of_the_paper_a_control_and_every_kind_of_motion() {
    let kind = |s: &SceneSpec| {
        let m = s.motion.clone().unwrap();
        match (m.head, m.wind) {
            (HeadDrive::Still, None) => "still",
            (HeadDrive::Still, Some(_)) => "wind",
            (HeadDrive::Shake(_), _) => "shake",
            (HeadDrive::Nod(_), _) => "nod",
            (HeadDrive::Turn { .. }, _) => "turn",
            (HeadDrive::Flick { .. }, _) => "flick",
        }
    };
    let specs: Vec<SceneSpec> = moving_catalog().iter().map(|e| e.spec().unwrap()).collect();
    for (entry, s) in moving_catalog().iter().zip(&specs) {
        assert_eq!(s.name, entry.name);
        let frames = s.motion.as_ref().unwrap().frames;
        assert!((60..=300).contains(&frames) && s.rig.frame_rate_hz == 100.0, "{}", s.name);
        assert!((60_000..=120_000).contains(&s.groom.as_ref().unwrap().strands), "{}", s.name);
    }
    let frames = |name: &str| specs.iter().find(|s| s.name == name).unwrap().motion.clone().unwrap().frames;
    assert_eq!(
        ["moving-straight-blonde", "moving-messy-red", "moving-curly-blonde"].map(frames),
        [300, 130, 200]
    );
    for wanted in ["still", "wind", "shake", "nod", "turn", "flick"] {
        assert!(specs.iter().any(|s| kind(s) == wanted), "{wanted}");
    }
}

#[test]
fn lengths_and_roots_are_kept_and_identity_too_on_every_scene() {
    for entry in moving_catalog() {
        let mut s = spec(entry.name, 150, 24, 36);
        let motion = s.motion.as_mut().unwrap();
        if let Some(wind) = &mut motion.wind {
            (wind.start_s, wind.end_s) = (0.0, 1e9);
        }
        let frames = simulate(&s);
        let first = build(&s, 1, None).unwrap();
        assert!(frames[0].scene.strands.points == first.strands.points, "{}", entry.name);
        for f in &frames {
            let strands = &f.scene.strands;
            assert_eq!(
                (&strands.offsets, &strands.radii_mm),
                (&first.strands.offsets, &first.strands.radii_mm)
            );
            assert_eq!(f.scene.pigments, first.pigments);
            strands.validate().unwrap();
            for i in 0..strands.len() {
                let (now, rest) = (strands.strand(i), first.strands.strand(i));
                assert_eq!(now[0], f.head.carry(rest[0]), "{} frame {} root {i}", entry.name, f.index);
                for (a, b) in now.windows(2).zip(rest.windows(2)) {
                    let (l, l0) = (a[0].distance(a[1]), b[0].distance(b[1]));
                    // Coordinates below 512 mm are rounded by 3e-5 mm: 6e-5 mm on a segment, of which the
                    // shortest here have a few tenths of a millimetre.
                    assert!((l - l0).abs() < 1.2e-4 + 1e-5 * l0, "{}: {l} for {l0}", entry.name);
                    assert!((l / l0 - 1.0).abs() < 0.005, "{}: {l} for {l0}", entry.name);
                }
            }
        }
        let still = entry.name == "moving-still";
        let moved = drift(&frames);
        assert!(if still { moved < 0.01 } else { moved > 5.0 }, "{}: {moved} mm", entry.name);
    }
}

#[test]
fn hair_of_every_kind_hangs_as_it_was_groomed_while_nothing_moves() {
    for name in ["moving-straight-blonde", "moving-messy-red", "moving-curly-blonde", "moving-bob-flick"] {
        let mut s = spec(name, 120, 60, 60);
        let motion = s.motion.as_mut().unwrap();
        (motion.head, motion.wind) = (HeadDrive::Still, None);
        let moved = drift(&simulate(&s));
        assert!(moved < 0.01, "{name}: {moved} mm");
    }
}

#[test]
fn equal_seeds_give_equal_bits_on_any_number_of_threads_and_others_do_not() {
    let mut s = spec("moving-straight-wind", 200, 60, 16);
    s.motion.as_mut().unwrap().head = HeadDrive::Shake(swing(20.0, 4.0));
    let run = |threads: usize, seed: u64| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut simulation = Simulation::new(&s, seed, None, &Silent).unwrap();
            let mut out = Vec::new();
            while let Some(frame) = simulation.next_frame(&Silent).unwrap() {
                out.push(frame);
            }
            bits(&out)
        })
    };
    assert_eq!(run(1, 3), run(2, 3));
    assert_ne!(run(1, 3), run(1, 4));
}

#[test]
fn hair_lags_behind_the_head_and_comes_to_rest() {
    let mut s = spec("moving-straight-blonde", 200, 80, 260);
    s.motion.as_mut().unwrap().head = HeadDrive::Turn { angle_deg: 40.0, duration_s: 0.3, start_s: 0.0 };
    let frames = simulate(&s);
    let strands = &frames[0].scene.strands;
    let tips: Vec<usize> = (0..strands.len())
        .filter(|&i| strands.length_mm(i) > 200.0)
        .map(|i| strands.range(i).end - 1)
        .collect();
    // Angle of a tip about the vertical through the pivot, from where it was, degrees.
    let angle = |f: &MotionFrame| {
        let sum: f32 = tips
            .iter()
            .map(|&t| {
                let pivot = f.head.pivot_mm.as_vec3();
                let (a, b) = (strands.points[t] - pivot, f.scene.strands.points[t] - pivot);
                let turn = (a.z * b.x - a.x * b.z).atan2(a.x * b.x + a.z * b.z);
                turn.to_degrees()
            })
            .sum();
        sum / tips.len() as f32
    };
    let halfway = angle(&frames[15]);
    assert!(halfway < 10.0, "the head has turned by 20 degrees, the tips by {halfway}");
    let end = angle(&frames[259]);
    assert!((15.0..55.0).contains(&end), "the tips have followed to {end} degrees");
    let speed = |k: usize| -> f32 {
        let (a, b) = (&frames[k].scene.strands.points, &frames[k - 1].scene.strands.points);
        tips.iter().map(|&t| a[t].distance(b[t])).sum::<f32>() / tips.len() as f32 * 100.0
    };
    let peak = (1..100).map(speed).fold(0.0, f32::max);
    assert!((100.0..3000.0).contains(&peak), "{peak} mm/s");
    assert!(speed(259) < 0.05 * peak, "still {} mm/s of {peak} after 2.3 s", speed(259));
}

#[test]
fn hair_gives_way_to_the_wind() {
    let mean = |from_deg: f64, speed_m_s: f64| {
        let mut s = spec("moving-straight-wind", 200, 80, 40);
        let wind = WindSpec { speed_m_s, from_deg, gusts: 0.0, start_s: 0.0, end_s: 1e9 };
        s.motion.as_mut().unwrap().wind = Some(wind);
        let frames = simulate(&s);
        let (a, b) = (&frames[0].scene.strands.points, &frames[39].scene.strands.points);
        b.iter().zip(a).map(|(p, q)| *p - *q).sum::<Vec3>() / a.len() as f32
    };
    let (left, right, back, faint) = (mean(90.0, 6.0), mean(-90.0, 6.0), mean(180.0, 6.0), mean(90.0, 2.0));
    assert!(left.x < -1.0 && right.x > 1.0 && back.z > 1.0, "{left} {right} {back}");
    assert!(left.x.abs() > left.z.abs() && right.x.abs() > right.z.abs(), "{left} {right}");
    assert!(faint.x.abs() < 0.5 * left.x.abs(), "{faint} {left}");
}

struct StopsAfter(std::sync::atomic::AtomicI32);

impl Monitor for StopsAfter {
    fn begin(&self, _what: &str, _total: u64) {}
    fn advance(&self, _steps: u64) {}
    fn cancelled(&self) -> bool {
        self.0.fetch_sub(1, std::sync::atomic::Ordering::SeqCst) <= 0
    }
}

#[test]
fn a_cache_gives_any_frame_with_the_simulations_bits() {
    let s = spec("moving-messy-red", 150, 40, 12);
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("motion.bin");
    let frames = simulate(&s);
    MotionCache::write(&path, Simulation::new(&s, 1, None, &Silent).unwrap(), &Silent).unwrap();
    let cache = MotionCache::open(&path, &s, 1, None).unwrap();
    assert_eq!(cache.frames(), 12);
    for i in [11u32, 0, 5] {
        let f = cache.frame(i).unwrap();
        let same = &frames[i as usize];
        assert_eq!(bits(std::slice::from_ref(&f)), bits(std::slice::from_ref(same)));
        assert_eq!((f.index, f.time_s, f.head), (i, same.time_s, same.head));
    }
    let beyond = cache.frame(12).unwrap_err().to_string();
    assert!(beyond.contains("frames 0 to 11, not 12"), "{beyond}");

    let stopped = MotionCache::write(
        &dir.path().join("half.bin"),
        Simulation::new(&s, 1, None, &Silent).unwrap(),
        &StopsAfter(3.into()),
    );
    assert!(matches!(stopped, Err(MotionError::Cancelled(Cancelled))), "{stopped:?}");
    assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 1, "nothing half-written is left");

    // Damage, each with a word that its error must have.
    let good = std::fs::read(&path).unwrap();
    let damaged = |change: &dyn Fn(&mut Vec<u8>), s: &SceneSpec, seed: u64| {
        let mut bytes = good.clone();
        change(&mut bytes);
        let path = dir.path().join("bad.bin");
        std::fs::write(&path, bytes).unwrap();
        match MotionCache::open(&path, s, seed, None) {
            Err(e) => e.to_string(),
            Ok(cache) => cache.frame(5).err().map_or("fine".into(), |e| e.to_string()),
        }
    };
    let set = |at: usize, v: u32| move |b: &mut Vec<u8>| b[at..at + 4].copy_from_slice(&v.to_le_bytes());
    let frame = (good.len() - 32) / 12;
    let mut other = s.clone();
    other.motion.as_mut().unwrap().solver.damping_per_s = 2.0;
    for (change, s, seed, word) in [
        (&(|_: &mut Vec<u8>| ()) as &dyn Fn(&mut Vec<u8>), &s, 1, "fine"),
        (&|b: &mut Vec<u8>| b.clear(), &s, 1, "has 0 bytes"),
        (&|b: &mut Vec<u8>| b.truncate(31), &s, 1, "has 31 bytes"),
        (&|b: &mut Vec<u8>| b.truncate(b.len() - 1), &s, 1, "12 frames"),
        (&|b: &mut Vec<u8>| b.push(0), &s, 1, "12 frames"),
        (&|b: &mut Vec<u8>| b[0] = b'X', &s, 1, "is not a motion"),
        (&set(8, 7), &s, 1, "version 7"),
        (&set(12, u32::MAX), &s, 1, "4294967295 frames"),
        (&set(20, u32::MAX), &s, 1, "4294967295 segments"),
        (&set(16, 3), &s, 1, "another motion"),
        (&|b: &mut Vec<u8>| b[24] ^= 1, &s, 1, "another motion"),
        (&|_: &mut Vec<u8>| (), &s, 2, "another motion"),
        (&|_: &mut Vec<u8>| (), &other, 1, "another motion"),
        (&move |b: &mut Vec<u8>| b[32 + 5 * frame + 40] ^= 4, &s, 1, "frame 5 is damaged"),
    ] {
        let error = damaged(change, s, seed);
        assert!(error.contains(word), "{error:?} lacks {word:?}");
    }
    let missing = MotionCache::open(&dir.path().join("none"), &s, 1, None).err().unwrap().to_string();
    assert!(missing.contains("none: cannot be read"), "{missing}");
}

#[test]
fn scenes_that_do_not_move_and_values_out_of_range_are_named() {
    let mut s = spec("moving-still", 20, 10, 2);
    s.motion = None;
    let error = Simulation::new(&s, 1, None, &Silent).err().unwrap();
    assert!(matches!(&error, MotionError::Still { scene } if scene == "moving-still"), "{error}");
    let stop = StopsAfter(0.into());
    let stopped = Simulation::new(&spec("moving-still", 20, 10, 2), 1, None, &stop).err().unwrap();
    assert!(matches!(stopped, MotionError::Cancelled(_)), "{stopped}");

    let text = moving_catalog().iter().find(|e| e.name == "moving-straight-blonde").unwrap().toml;
    for (from, to, wants) in [
        ("frames = 300", "frames = 0", "motion.frames: 0 is not between 1"),
        ("frames = 300", "frames = -1", "invalid value"),
        ("frames = 300", "frames = 4000000000", "motion.frames: 4000000000"),
        ("frames = 300", "frames = 300\nframe = 1", "unknown field `frame`"),
        ("amplitude_deg = 22", "amplitude_deg = nan", "motion.head.amplitude_deg: NaN is not"),
        ("amplitude_deg = 22", "amplitude_deg = 400", "motion.head.amplitude_deg: 400 is not"),
        ("frequency_hz = 1.6", "frequency_hz = 0", "motion.head.frequency_hz: 0 is not"),
        ("cycles = 3", "cycles = 0", "motion.head.cycles: 0 is not"),
        ("kind = \"shake\"", "kind = \"shiver\"", "unknown variant `shiver`"),
        ("kind = \"shake\"", "kind = \"turn\"", "field"),
        ("[motion.head]", "[motion.solver]\nsubsteps = 0\n[motion.head]", "motion.solver.substeps: 0 is not"),
        ("[motion.head]", "[motion.solver]\nguides = 30000\n[motion.head]", "motion.solver.guides: 30000"),
        (
            "[motion.head]",
            "[motion.wind]\nspeed_m_s = -3\nfrom_deg = 0\n[motion.head]",
            "motion.wind.speed_m_s: -3 is not",
        ),
    ] {
        let changed = text.replace(from, to);
        assert_ne!(changed, text, "{from}");
        let error = match parse(&changed, Path::new("a.toml")) {
            Err(e @ (SceneError::Syntax { .. } | SceneError::Value { .. })) => e.to_string(),
            other => panic!("{from} -> {to}: {other:?}"),
        };
        assert!(error.contains(wants), "{error:?} lacks {wants:?}");
    }
}

use super::*;
use proptest::prelude::*;

fn plane(w: usize, h: usize, f: impl Fn(usize) -> f32) -> Plane<f32> {
    Plane::from_vec(w, h, (0..w * h).map(f).collect())
}

fn bits(p: &Plane<f32>) -> Vec<u32> {
    p.data.iter().map(|v| v.to_bits()).collect()
}

#[test]
fn every_bit_and_every_name_survives() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.exr");
    let odd = [f32::NAN, -f32::NAN, f32::from_bits(0x7fa0_0001), f32::INFINITY, -0.0, 1e-42, f32::MAX, 0.1];
    let a = plane(37, 19, |i| odd[i % odd.len()]);
    let b = plane(37, 19, |i| i as f32 * 0.37);
    let channels = [("orientation_3d.X", &b), ("Z", &a), ("depth_50_mm", &b), ("A", &a)];
    write_exr(&path, &channels).unwrap();
    let back = read_exr(&path).unwrap();
    assert_eq!(back.len(), 4);
    for (name, want) in channels {
        let (_, got) = back.iter().find(|c| c.0 == name).unwrap();
        assert_eq!((got.size(), bits(got)), ((37, 19), bits(want)), "{name}");
    }
    let [z, x] = pick(&path, back.clone(), ["Z", "orientation_3d.X"]).unwrap();
    assert_eq!((bits(&z), bits(&x)), (bits(&a), bits(&b)));
    let e = pick(&path, back, ["Y"]).unwrap_err();
    assert!(e.problem.contains("channel Y is missing (there are A, Z, depth_50_mm"), "{e}");
    assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 1);
}

#[test]
fn bad_images_are_not_written() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.exr");
    let (a, b) = (plane(2, 2, |_| 0.0), plane(2, 3, |_| 0.0));
    let e = |c: &[(&str, &Plane<f32>)]| write_exr(&path, c).unwrap_err().problem;
    assert!(e(&[]).contains("needs a channel"));
    assert!(e(&[("a", &a), ("b", &b)]).contains("channel b is (2, 3)"));
    assert!(e(&[("a", &a), ("a", &a)]).contains("used twice"));
    assert!(e(&[("", &a)]).contains("empty"));
    assert!(e(&[("深", &a)]).contains("Latin-1"));
    assert!(e(&[("a", &plane(0, 3, |_| 0.0))]).contains("outside"));
    assert!(!path.exists());
}

fn encoded(w: usize, h: usize) -> Vec<u8> {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.exr");
    let p = plane(w, h, |i| (i * i % 31) as f32);
    write_exr(&path, &[("Y", &p), ("Z", &p)]).unwrap();
    std::fs::read(path).unwrap()
}

#[test]
fn every_truncation_is_an_error() {
    let good = encoded(9, 40);
    assert_eq!(parse_exr(&good).unwrap().len(), 2);
    for n in 0..good.len() {
        assert!(parse_exr(&good[..n]).is_err(), "{n} of {} bytes", good.len());
    }
}

#[test]
fn a_header_that_claims_too_many_pixels_is_refused_before_anything_is_allocated() {
    let good = encoded(9, 40);
    // Both windows are boxes of four i32: 0, 0, 8, 39.
    let box2i: Vec<u8> = [0i32, 0, 8, 39].into_iter().flat_map(i32::to_le_bytes).collect();
    let places: Vec<usize> =
        good.windows(16).enumerate().filter(|(_, w)| *w == box2i).map(|(i, _)| i).collect();
    assert_eq!(places.len(), 2);
    let claim = |x: i32, y: i32| {
        let mut b = good.clone();
        for &at in &places {
            b[at + 8..at + 12].copy_from_slice(&x.to_le_bytes());
            b[at + 12..at + 16].copy_from_slice(&y.to_le_bytes());
        }
        parse_exr(&b).unwrap_err().to_string()
    };
    assert!(claim(16_383, 16_383).contains("too many for a file"));
    assert!(claim(16_384, 0).contains("outside 1..16384"));
    assert!(!claim(i32::MAX, i32::MAX).is_empty());
    assert!(!claim(-1, 39).is_empty());
    let mut cropped = good.clone();
    cropped[places[0]] = 1;
    assert!(parse_exr(&cropped).is_err());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]
    /// Damaged files end in a value or an error, not in a panic.
    #[test]
    fn damage_never_panics(changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6)) {
        let mut b = encoded(9, 20);
        for (at, v) in changes {
            let i = at.index(b.len());
            b[i] = v;
        }
        let _ = parse_exr(&b);
    }
}

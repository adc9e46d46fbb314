use super::*;
use crate::options::ImportOptions;
use glam::Vec3;
use proptest::prelude::*;

fn word(b: &mut [u8], at: usize, v: u32) {
    b[at..at + 4].copy_from_slice(&v.to_le_bytes());
}

/// Two strands of 3 and 2 points with every array there is.
fn sample() -> Vec<u8> {
    let mut b = b"HAIR".to_vec();
    for v in [2u32, 5, SEGMENTS | POINTS | THICKNESS | TRANSPARENCY | COLOUR, 9] {
        b.extend(v.to_le_bytes());
    }
    b.extend([0.1f32, 0.0, 1.0, 1.0, 1.0].into_iter().flat_map(f32::to_le_bytes));
    b.resize(HEADER, b'i');
    b.extend([2u16, 1].into_iter().flat_map(u16::to_le_bytes));
    b.extend((0..15).flat_map(|i| (i as f32).to_le_bytes()));
    b.extend((0..5).flat_map(|i| (0.1 + i as f32).to_le_bytes()));
    b.extend((0..20).flat_map(|_| 0.5f32.to_le_bytes()));
    b
}

#[test]
fn every_array_is_found_and_thickness_is_a_diameter() {
    let raw = parse_hair(&sample()).unwrap();
    assert_eq!(raw.offsets, [0, 3, 5]);
    assert_eq!(raw.points[4], Vec3::new(12.0, 13.0, 14.0));
    assert_eq!(raw.radii, Radii::PerPoint([0.1f32, 1.1, 2.1, 3.1, 4.1].map(|t| t * 0.5).to_vec()));
    assert!(raw.notes.is_empty());
}

#[test]
fn missing_arrays_take_the_headers_defaults() {
    let mut b = sample();
    word(&mut b, 4, 1);
    word(&mut b, 12, POINTS);
    word(&mut b, 16, 4);
    b.truncate(HEADER);
    b.extend((0..15).flat_map(|i| (i as f32).to_le_bytes()));
    let raw = parse_hair(&b).unwrap();
    assert_eq!((raw.offsets.as_slice(), &raw.radii), (&[0, 5][..], &Radii::Same(0.05)));
    word(&mut b, 20, 0);
    assert_eq!(parse_hair(&b).unwrap().radii, Radii::Unstated);
    b.push(0);
    assert_eq!(parse_hair(&b).unwrap().notes, ["1 bytes after the last array were ignored"]);
}

#[test]
fn every_truncation_is_an_error() {
    let good = sample();
    for n in 0..good.len() {
        let e = parse_hair(&good[..n]).unwrap_err();
        assert!(e.fault.contains("bytes but") || e.fault.contains("magic"), "{n} bytes: {e}");
    }
}

#[test]
fn each_lie_is_an_error_that_names_its_place() {
    let with = |at: usize, v: u32| {
        let mut b = sample();
        word(&mut b, at, v);
        parse_hair(&b).unwrap_err()
    };
    let magic = with(0, u32::from_le_bytes(*b"hair"));
    assert!(magic.place == "byte 0" && magic.fault.contains("\"hair\""), "{magic}");
    let strands = with(4, u32::MAX);
    assert!(strands.fault.contains("the segment array needs 8589934590 bytes"), "{strands}");
    let points = with(8, u32::MAX);
    assert!(points.fault.contains("claims 4294967295 points but its 2 strands have 5"), "{points}");
    assert!(with(12, SEGMENTS).fault.contains("no point array"));
    assert!(with(12, 2 + 32).fault.contains("unknown bits"));
    let nan = with(HEADER + 4 + 40, f32::NAN.to_bits());
    assert!(nan.place == "strand 1, point 0" && nan.fault.contains("not finite"), "{nan}");
    let negative = with(HEADER + 4 + 60 + 8, (-1.0f32).to_bits());
    assert!(negative.place == "strand 0, point 2" && negative.fault.contains("radius"), "{negative}");
    // Four billion points in strands of four billion: no array is announced that could be checked otherwise.
    let mut b = sample();
    for (at, v) in [(4, 1), (8, u32::MAX), (12, POINTS), (16, u32::MAX - 1)] {
        word(&mut b, at, v);
    }
    assert!(parse_hair(&b).unwrap_err().fault.contains("needs 51539607540 bytes"));
}

#[test]
fn what_has_no_length_is_dropped_and_counted() {
    let mut s = StrandSet::new();
    s.push(&[Vec3::ONE; 3], 0.04);
    s.push(&[Vec3::ZERO, Vec3::ZERO, Vec3::Y, Vec3::Y], 0.04);
    let raw = parse_hair(&encode_hair(&s).unwrap()).unwrap();
    let (set, report) = raw.clone().into_world(&ImportOptions::default()).unwrap();
    assert_eq!(set.points, [Vec3::ZERO, Vec3::Y]);
    assert_eq!((report.strands_in_file, report.points_in_file), (2, 7));
    assert_eq!((report.zero_length_strands, report.repeated_points), (1, 4));
    let all = ImportOptions { scale_mm: 1e-9, ..Default::default() };
    assert!(raw.into_world(&all).unwrap_err().fault.contains("none of the 2 strands"));
}

#[test]
fn the_radius_is_the_options_or_the_files_or_an_error() {
    let scaled = |radius_mm| ImportOptions { scale_mm: 10.0, radius_mm, ..Default::default() };
    let raw = parse_hair(&sample()).unwrap();
    let (set, report) = raw.clone().into_world(&scaled(None)).unwrap();
    assert_eq!((set.radii_mm[0], report.radius.as_str()), (0.5, "per point, from the file"));
    let (set, _) = raw.clone().into_world(&scaled(Some(0.03))).unwrap();
    assert!(set.radii_mm.iter().all(|&r| r == 0.03));
    let tapered = RawStrands { radii: Radii::PerPoint(vec![0.01, 0.005, 0.0, 0.01, 0.0]), ..raw.clone() };
    let (set, report) = tapered.into_world(&scaled(None)).unwrap();
    assert_eq!(*set.radii_mm.last().unwrap(), 1e-3);
    assert_eq!(report.notes, ["2 radii below 0.001 mm were raised to it"]);
    let unstated = RawStrands { radii: Radii::Unstated, ..raw };
    assert_eq!(unstated.into_world(&scaled(None)).unwrap_err().place, "option radius_mm");
}

#[test]
fn the_format_without_a_magic_is_recognised_by_its_size_alone() {
    let mut b = Vec::new();
    b.extend([2u32, 5].into_iter().flat_map(u32::to_le_bytes));
    b.extend([3u16, 2].into_iter().flat_map(u16::to_le_bytes));
    b.extend((0..15).flat_map(|i| (i as f32).to_le_bytes()));
    assert!(looks_like_monohair(&b));
    let raw = crate::parse_strands(&b, "hair", None).unwrap();
    assert_eq!((raw.offsets.as_slice(), raw.points[3]), (&[0, 3, 5][..], Vec3::new(9.0, 10.0, 11.0)));
    for n in 0..b.len() {
        assert!(crate::parse_strands(&b[..n], "hair", None).is_err(), "{n} bytes");
    }
    b.push(0);
    assert!(crate::parse_strands(&b, "hair", None).unwrap_err().fault.contains("magic"));
}

proptest! {
    /// Points and radii of any finite strands survive bit for bit.
    #[test]
    fn written_strands_come_back_bit_for_bit(
        strands in prop::collection::vec(prop::collection::vec((any::<[u32; 3]>(), 1u32..0x7f00_0000), 2..9), 0..6)
    ) {
        let mut s = StrandSet::new();
        for strand in &strands {
            // Any finite bit pattern, subnormal and negative zero included.
            let finite = |b: u32| { let v = f32::from_bits(b); if v.is_finite() { v } else { -0.0 } };
            let points: Vec<Vec3> = strand.iter().map(|(p, _)| Vec3::from_array(p.map(finite))).collect();
            let radii: Vec<f32> = strand.iter().map(|&(_, r)| f32::from_bits(r)).collect();
            s.push_tapered(&points, &radii);
        }
        let back = parse_hair(&encode_hair(&s).unwrap()).unwrap().into_exact().unwrap();
        prop_assert_eq!(&back.offsets, &s.offsets);
        let bits = |s: &StrandSet| -> Vec<u32> {
            s.points.iter().flat_map(|p| p.to_array()).chain(s.radii_mm.iter().copied()).map(f32::to_bits).collect()
        };
        prop_assert_eq!(bits(&back), bits(&s));
    }
}

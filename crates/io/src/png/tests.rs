use super::*;
use proptest::prelude::*;

#[test]
fn grey_values_survive_at_both_depths() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("g.png");
    let eight = Plane::from_vec(16, 16, (0..=255u8).collect());
    write_png_grey(&path, &eight).unwrap();
    assert_eq!(read_png_grey(&path).unwrap(), eight.map(|&v| f32::from(v) / 255.0));
    let sixteen = Plane::from_vec(3, 2, vec![0u16, 1, 255, 256, 0x1234, 65_535]);
    write_png_grey16(&path, &sixteen).unwrap();
    let back = read_png_grey(&path).unwrap();
    assert_eq!(back.map(|v| (v * 65_535.0).round() as u16), sixteen);
    assert_eq!((back.data[0], back.data[5]), (0.0, 1.0));
    assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 1);
}

#[test]
fn colour_is_written_row_by_row_and_refused_as_grey() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("c.png");
    let p = Plane::from_vec(2, 1, vec![[1, 2, 3], [250, 251, 252]]);
    write_png_rgb(&path, &p).unwrap();
    let mut d = PngDecoder::new(Cursor::new(std::fs::read(&path).unwrap())).unwrap();
    assert_eq!((d.dimensions(), d.color_type()), ((2, 1), ColorType::Rgb8));
    let _ = d.set_limits(Limits::default());
    let mut raw = [0u8; 6];
    d.read_image(&mut raw).unwrap();
    assert_eq!(raw, [1, 2, 3, 250, 251, 252]);
    assert!(read_png_grey(&path).unwrap_err().problem.contains("not grey"));
    assert!(write_png_grey(&path, &Plane::filled(0, 4, 0)).is_err());
}

fn encoded() -> Vec<u8> {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("g.png");
    write_png_grey(&path, &Plane::from_vec(23, 11, (0..253).map(|i| (i * i % 251) as u8).collect())).unwrap();
    std::fs::read(path).unwrap()
}

#[test]
fn truncation_and_huge_claims_are_errors() {
    let good = encoded();
    assert!(parse_png_grey(&good).is_ok());
    // The 12 bytes of the last chunk say only that it is the last.
    for n in 0..good.len() - 12 {
        assert!(parse_png_grey(&good[..n]).is_err(), "{n} of {} bytes", good.len());
    }
    let claim = |w: u32, h: u32| {
        let mut b = good.clone();
        b[16..20].copy_from_slice(&w.to_be_bytes());
        b[20..24].copy_from_slice(&h.to_be_bytes());
        let crc = crc32(&b[12..29]);
        b[29..33].copy_from_slice(&crc.to_be_bytes());
        parse_png_grey(&b).unwrap_err().to_string()
    };
    assert!(claim(16_384, 16_384).contains("do not fit into a file"));
    assert!(claim(16_385, 1).contains("not a readable PNG"));
    assert!(claim(u32::MAX, u32::MAX).contains("not a readable PNG"));
    assert!(claim(0, 1).contains("not a readable PNG"));
}

/// CRC-32 of PNG chunks (polynomial 0xEDB88320, reflected), bit by bit.
fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0u32, |crc, &b| {
        (0..8).fold(crc ^ u32::from(b), |c, _| if c & 1 == 1 { (c >> 1) ^ 0xedb8_8320 } else { c >> 1 })
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]
    #[test]
    fn damage_never_panics(changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6)) {
        let mut b = encoded();
        for (at, v) in changes {
            let i = at.index(b.len());
            b[i] = v;
        }
        let _ = parse_png_grey(&b);
    }
}

use super::*;
use std::io::Write as _;

/// A `.npy` file of format 1.
fn npy(descr: &str, shape: &str, by_column: bool, body: &[u8]) -> Vec<u8> {
    let order = if by_column { "True" } else { "False" };
    let header = format!("{{'descr': '{descr}', 'fortran_order': {order}, 'shape': {shape}, }}\n");
    let mut out = b"\x93NUMPY\x01\x00".to_vec();
    out.extend((header.len() as u16).to_le_bytes());
    out.extend(header.as_bytes());
    out.extend(body);
    out
}

fn archive(members: &[(&str, Vec<u8>)]) -> Vec<u8> {
    let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
    for (k, (name, bytes)) in members.iter().enumerate() {
        let method =
            if k % 2 == 0 { zip::CompressionMethod::Deflated } else { zip::CompressionMethod::Stored };
        let options = zip::write::SimpleFileOptions::default().compression_method(method);
        zip.start_file(format!("{name}.npy"), options).unwrap();
        zip.write_all(bytes).unwrap();
    }
    zip.finish().unwrap().into_inner()
}

fn sample() -> Vec<u8> {
    let le: Vec<u8> = (0..24).flat_map(|i| (i as f32).to_le_bytes()).collect();
    let be: Vec<u8> = (0..24).flat_map(|i| f64::from(i).to_be_bytes()).collect();
    let words: Vec<u8> = ["jaw", "élan"]
        .iter()
        .flat_map(|w| (0..4).map(move |i| w.chars().nth(i).map_or(0, u32::from)))
        .flat_map(u32::to_le_bytes)
        .collect();
    archive(&[
        ("rows", npy("<f4", "(2, 3, 4)", false, &le)),
        ("columns", npy(">f8", "(2, 3, 4)", true, &be)),
        ("names", npy("<U4", "(2,)", false, &words)),
    ])
}

#[test]
fn arrays_of_either_order_and_names_are_read() {
    let npz = Npz::parse(Path::new("a.npz"), &sample()).unwrap();
    assert_eq!(npz.floats("rows").unwrap(), (vec![2, 3, 4], (0..24).map(|i| i as f32).collect()));
    let (shape, values) = npz.floats("columns").unwrap();
    assert_eq!(shape, [2, 3, 4]);
    for (k, v) in values.iter().enumerate() {
        let (i, j, l) = (k / 12, k / 4 % 3, k % 4);
        assert_eq!(*v, (i + 2 * j + 6 * l) as f32, "[{i}][{j}][{l}]");
    }
    assert_eq!(npz.texts("names").unwrap(), ["jaw", "élan"]);
    let text = npz.floats("x").unwrap_err().to_string();
    assert!(text.contains("a.npz") && text.contains("columns, names, rows"), "{text}");
    assert!(npz.floats("names").unwrap_err().to_string().contains("array names"));
    assert!(npz.texts("rows").unwrap_err().to_string().contains("(2, 3, 4)"));
}

#[test]
fn damage_is_an_error_and_claims_take_no_memory() {
    let good = sample();
    for cut in [0, 10, good.len() / 2, good.len() - 1] {
        let text = Npz::parse(Path::new("a.npz"), &good[..cut]).unwrap_err().to_string();
        assert!(text.contains("a.npz") && text.contains("numpy.savez"), "{text}");
    }
    let huge = archive(&[("a", npy("<f4", "(99999, 99999, 99999, 99999)", false, &[0; 8]))]);
    let text = Npz::parse(Path::new("a.npz"), &huge).unwrap().floats("a").unwrap_err().to_string();
    assert!(text.contains("array a") && text.contains("8 bytes"), "{text}");
}

proptest::proptest! {
    #[test]
    fn any_change_of_a_byte_is_an_archive_or_an_error(place in 0usize..2000, byte in 0u8..) {
        let mut bytes = sample();
        let at = place % bytes.len();
        bytes[at] = byte;
        if let Ok(npz) = Npz::parse(Path::new("a"), &bytes) {
            let _ = (npz.floats("rows"), npz.floats("columns"), npz.texts("names"));
        }
    }
}

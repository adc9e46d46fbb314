#![no_main]

use libfuzzer_sys::fuzz_target;

/// Any bytes as any format, all the way into the world: what comes out must be valid strands.
fuzz_target!(|bytes: &[u8]| {
    let Some((&first, rest)) = bytes.split_first() else { return };
    let endings = ["hair", "data", "ply", "tfx", "obj"];
    let Ok(raw) = strandbench_io::parse_strands(rest, endings[usize::from(first) % 5], Some(2)) else { return };
    // A file of a few kilobytes may span 1e38 mm; the segments must not be finer than it can hold.
    let options = strandbench_io::ImportOptions {
        max_segment_mm: 1e36,
        radius_mm: (first >= 128).then_some(0.04),
        ..Default::default()
    };
    if let Ok((strands, report)) = raw.into_world(&options) {
        strands.validate().expect("an import gives valid strands");
        assert_eq!(report.points_resampled, strands.points.len());
    }
});

#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let path = std::path::Path::new("fuzz.json");
    let _ = strandbench_io::parse_rig(path, bytes);
    let _ = strandbench_io::parse_frame_json(path, bytes);
});

#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let _ = strandbench_io::parse_visibility(bytes);
    let _ = strandbench_io::parse_seen_by(bytes, 1 << 16);
});

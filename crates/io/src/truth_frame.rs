//! The truth of one frame of a sequence: what changes from frame to frame and cannot be computed from the motion.
//!
//! `seen_by.bin`: magic `SBSEENBY`, version u32, then runs of equal camera bits, each a value and a length (u32), all
//! little-endian. How many samples there are follows from the strands.

use crate::atomic::{atomic_write, merge_folder};
use crate::bytes::Cursor;
use crate::error::{FormatError, IoError, Parsed, Result};
use crate::read::read_all;
use crate::rig_json::check_rig;
use crate::truth::{SUFFIX, check, read_views, write_views};
use std::path::Path;
use strandbench_types::{StrandSet, TriMesh, Truth, Visibility};

const MAGIC: &[u8; 8] = b"SBSEENBY";
const VERSION: u32 = 1;
const SEEN_BY: &str = "seen_by.bin";
const REMEDY: &str = "make the truth again";

/// Writes the truth of a frame but for strands and head, which whoever reads it must have: `truth_rig.json`, per
/// camera `<name>_truth.exr` (as [`crate::write_truth`]) and `seen_by.bin`. Other files of an existing folder stay.
///
/// # Errors
/// If views, sizes, strands or visibility disagree, or a file cannot be written.
pub fn write_truth_frame(dir: &Path, truth: &Truth) -> Result<()> {
    check_rig(dir, &truth.rig)?;
    check(dir, truth)?;
    merge_folder(
        dir,
        |name| name == SEEN_BY || name.ends_with(SUFFIX),
        |tmp| {
            write_views(tmp, truth)?;
            let bytes = encode_seen_by(&truth.visibility.seen_by);
            atomic_write(&tmp.join(SEEN_BY), |w| w.write_all(&bytes))
        },
    )
}

/// Reads what [`write_truth_frame`] wrote, bit for bit, given the frame's strands and head.
///
/// # Errors
/// Names the missing or inconsistent file; other strands than those that it was made with are found by their lengths.
pub fn read_truth_frame(dir: &Path, strands: StrandSet, head: Option<TriMesh>) -> Result<Truth> {
    let (rig, views) = read_views(dir)?;
    let path = dir.join(SEEN_BY);
    let mut offsets = vec![0u32];
    let mut samples = 0u64;
    for s in 0..strands.len() {
        samples += Visibility::samples_on(strands.length_mm(s)) as u64;
        let offset = u32::try_from(samples)
            .map_err(|_| IoError::new(dir, "the strands are too long to be sampled every half millimetre"))?;
        offsets.push(offset);
    }
    let seen_by = parse_seen_by(&read_all(&path)?, samples as usize).map_err(|e| e.in_file(&path))?;
    let truth = Truth { rig, views, strands, visibility: Visibility { offsets, seen_by }, head };
    check(dir, &truth)?;
    Ok(truth)
}

/// The bytes of `seen_by.bin`.
pub(crate) fn encode_seen_by(seen_by: &[u32]) -> Vec<u8> {
    let mut out = MAGIC.to_vec();
    out.extend(VERSION.to_le_bytes());
    for run in seen_by.chunk_by(|a, b| a == b) {
        out.extend(run[0].to_le_bytes());
        out.extend((run.len() as u32).to_le_bytes());
    }
    out
}

/// Parses `seen_by.bin`: camera bits of `samples` samples.
///
/// # Errors
/// Wrong magic, another version, truncation, an empty run, or runs that are not of `samples` samples together.
pub fn parse_seen_by(bytes: &[u8], samples: usize) -> Parsed<Vec<u32>> {
    let mut c = Cursor::new(bytes);
    if c.take(1, 8, "the magic")? != MAGIC {
        return Err(FormatError::at_byte(0, "this is not a list of what cameras see", REMEDY));
    }
    let version = c.u32("the header")?;
    if version != VERSION {
        return Err(FormatError::at_byte(8, format!("version {version}, not {VERSION}"), REMEDY));
    }
    // Room grows with what the runs say, at most up to what is wanted.
    let mut seen_by = Vec::new();
    while c.remaining() > 0 {
        let at = c.pos();
        let (value, length) = (c.u32("a run")?, c.u32("a run")? as usize);
        if length == 0 || length > samples - seen_by.len() {
            let left = samples - seen_by.len();
            let fault = format!("a run of {length} samples where {left} of {samples} are left");
            return Err(FormatError::at_byte(at, fault, REMEDY));
        }
        seen_by.resize(seen_by.len() + length, value);
    }
    if seen_by.len() != samples {
        let fault = format!("{} samples where the strands have {samples}", seen_by.len());
        return Err(FormatError::at_byte(c.pos(), fault, REMEDY));
    }
    Ok(seen_by)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_come_back_and_are_short() {
        let mut seen: Vec<u32> = vec![0; 5000];
        seen[70..90].fill(5);
        seen[4999] = 1 << 31;
        let bytes = encode_seen_by(&seen);
        assert_eq!(bytes.len(), 12 + 4 * 8);
        assert_eq!(parse_seen_by(&bytes, 5000).unwrap(), seen);
        assert_eq!(parse_seen_by(&encode_seen_by(&[]), 0).unwrap(), Vec::<u32>::new());
    }

    #[test]
    fn every_truncation_and_every_lie_is_an_error() {
        let good = encode_seen_by(&[1, 1, 1, 0, 2]);
        for n in 0..good.len() {
            assert!(parse_seen_by(&good[..n], 5).is_err(), "{n} bytes");
        }
        let with = |at: usize, bytes: &[u8], samples: usize| {
            let mut b = good.clone();
            b[at..at + bytes.len()].copy_from_slice(bytes);
            parse_seen_by(&b, samples).unwrap_err().to_string()
        };
        assert!(with(0, b"X", 5).contains("not a list"));
        assert!(with(8, &[9], 5).contains("version 9"));
        assert!(with(16, &[0], 5).contains("a run of 0 samples"));
        assert!(with(16, &[0xff; 4], 5).contains("5 of 5 are left"));
        assert!(with(0, b"", 6).contains("5 samples where the strands have 6"));
        assert!(with(0, b"", 4).contains("0 of 4 are left"));
    }

    proptest::proptest! {
        #[test]
        fn any_samples_come_back_and_any_bytes_are_an_answer(
            seen in proptest::collection::vec(0u32..3, 0..200),
            noise in proptest::collection::vec(proptest::num::u8::ANY, 0..64),
            at in 0usize..300,
        ) {
            let mut bytes = encode_seen_by(&seen);
            assert_eq!(parse_seen_by(&bytes, seen.len()).unwrap(), seen);
            for (k, b) in noise.iter().enumerate() {
                let i = (at + 7 * k) % bytes.len();
                bytes[i] ^= b;
            }
            if let Ok(found) = parse_seen_by(&bytes, seen.len()) {
                assert_eq!(found.len(), seen.len());
            }
        }
    }
}

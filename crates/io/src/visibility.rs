//! `visibility.bin`: magic `SBVISIB1`, version u32, bytes a sample u32 (1, 2 or 4), offsets u64, samples u64;
//! then the offsets (u32) and the samples (camera bits), all little-endian. Offsets are one more than there are
//! strands, or none.

use crate::bytes::Cursor;
use crate::error::{FormatError, Parsed};
use strandbench_types::Visibility;

const MAGIC: &[u8; 8] = b"SBVISIB1";
const VERSION: u32 = 1;

/// The bytes of a visibility table, samples as narrow as the highest camera allows.
pub(crate) fn encode_visibility(v: &Visibility) -> Vec<u8> {
    let all = v.seen_by.iter().fold(0, |a, b| a | b);
    let width: u32 = match all {
        0..=0xff => 1,
        0x100..=0xffff => 2,
        _ => 4,
    };
    let mut out = Vec::with_capacity(32 + 4 * v.offsets.len() + width as usize * v.seen_by.len());
    out.extend_from_slice(MAGIC);
    out.extend(VERSION.to_le_bytes());
    out.extend(width.to_le_bytes());
    out.extend((v.offsets.len() as u64).to_le_bytes());
    out.extend((v.seen_by.len() as u64).to_le_bytes());
    out.extend(v.offsets.iter().flat_map(|o| o.to_le_bytes()));
    match width {
        1 => out.extend(v.seen_by.iter().map(|&s| s as u8)),
        2 => out.extend(v.seen_by.iter().flat_map(|&s| (s as u16).to_le_bytes())),
        _ => out.extend(v.seen_by.iter().flat_map(|s| s.to_le_bytes())),
    }
    out
}

/// Parses a visibility table.
///
/// # Errors
/// Wrong magic, another version, truncation, bytes left over, offsets that do not divide the samples.
pub fn parse_visibility(bytes: &[u8]) -> Parsed<Visibility> {
    const REMEDY: &str = "make the truth again";
    let mut c = Cursor::new(bytes);
    if c.take(1, 8, "the magic")? != MAGIC {
        return Err(FormatError::at_byte(0, "this is not a visibility table", REMEDY));
    }
    let version = c.u32("the header")?;
    if version != VERSION {
        return Err(FormatError::at_byte(8, format!("version {version}, not {VERSION}"), REMEDY));
    }
    let width = c.u32("the header")?;
    let counts = c.take(2, 8, "the header")?;
    let count = |b: &[u8]| u64::from_le_bytes(b.try_into().expect("eight bytes"));
    let (offsets, samples) = (count(&counts[..8]), count(&counts[8..]));
    let offsets = c.u32s(offsets, "the offsets")?;
    let at = c.pos();
    let seen_by: Vec<u32> = match width {
        1 => c.take(samples, 1, "the samples")?.iter().map(|&b| u32::from(b)).collect(),
        2 => c.u16s(samples, "the samples")?.into_iter().map(u32::from).collect(),
        4 => c.u32s(samples, "the samples")?,
        _ => {
            return Err(FormatError::at_byte(12, format!("{width} bytes a sample, not 1, 2 or 4"), REMEDY));
        }
    };
    if c.remaining() > 0 {
        return Err(FormatError::at_byte(c.pos(), format!("{} bytes too many", c.remaining()), REMEDY));
    }
    let ascending = offsets.first().is_none_or(|&o| o == 0) && offsets.windows(2).all(|w| w[0] <= w[1]);
    if !ascending || offsets.last().map_or(0, |&o| o as usize) != seen_by.len() {
        return Err(FormatError::at_byte(
            at,
            format!("the offsets do not divide {} samples", seen_by.len()),
            REMEDY,
        ));
    }
    Ok(Visibility { offsets, seen_by })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn round_trip_at_each_width_and_no_wider() {
        for (top, width) in [(0u32, 1), (0xff, 1), (0x100, 2), (0xffff, 2), (0x1_0000, 4), (u32::MAX, 4)] {
            let v = Visibility { offsets: vec![0, 2, 2, 3], seen_by: vec![1, 0, top] };
            let b = encode_visibility(&v);
            assert_eq!(b.len(), 32 + 16 + 3 * width);
            assert_eq!(parse_visibility(&b).unwrap(), v);
        }
        let none = Visibility::default();
        assert_eq!(parse_visibility(&encode_visibility(&none)).unwrap(), none);
    }

    #[test]
    fn every_truncation_and_every_lie_is_an_error() {
        let good = encode_visibility(&Visibility { offsets: vec![0, 2, 3], seen_by: vec![1, 0, 700] });
        for n in 0..good.len() {
            assert!(parse_visibility(&good[..n]).is_err(), "{n} bytes");
        }
        let with = |at: usize, bytes: &[u8]| {
            let mut b = good.clone();
            b[at..at + bytes.len()].copy_from_slice(bytes);
            parse_visibility(&b).unwrap_err().to_string()
        };
        assert!(with(0, b"X").contains("not a visibility table"));
        assert!(with(8, &[9]).contains("version 9"));
        assert!(with(12, &[3]).contains("3 bytes a sample"));
        assert!(with(16, &[0xff; 8]).contains("the offsets needs"));
        assert!(with(24, &[0xff; 8]).contains("the samples needs"));
        assert!(with(36, &[9]).contains("do not divide"));
        assert!(with(32, &[1]).contains("do not divide"));
        let mut long = good.clone();
        long.push(0);
        assert!(parse_visibility(&long).unwrap_err().fault.contains("too many"));
    }
}

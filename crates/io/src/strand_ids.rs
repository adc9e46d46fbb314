//! `strand_ids.bin`: magic `SBSTRID1`, version u32, reserved u32 (0), identities u64; then one u64 a strand, all
//! little-endian.

use crate::bytes::Cursor;
use crate::error::{FormatError, Parsed};

const MAGIC: &[u8; 8] = b"SBSTRID1";
const VERSION: u32 = 1;

/// The bytes of a table of identities.
pub(crate) fn encode_strand_ids(ids: &[u64]) -> Vec<u8> {
    let mut out = Vec::with_capacity(24 + 8 * ids.len());
    out.extend_from_slice(MAGIC);
    out.extend(VERSION.to_le_bytes());
    out.extend(0u32.to_le_bytes());
    out.extend((ids.len() as u64).to_le_bytes());
    out.extend(ids.iter().flat_map(|i| i.to_le_bytes()));
    out
}

/// Parses the identities of an estimate's strands, in the strands' order.
///
/// # Errors
/// Wrong magic, another version, truncation, bytes left over.
pub fn parse_strand_ids(bytes: &[u8]) -> Parsed<Vec<u64>> {
    const REMEDY: &str = "write the estimate again";
    let mut c = Cursor::new(bytes);
    if c.take(1, 8, "the magic")? != MAGIC {
        return Err(FormatError::at_byte(0, "this is not a table of strand identities", REMEDY));
    }
    let (version, reserved) = (c.u32("the header")?, c.u32("the header")?);
    if (version, reserved) != (VERSION, 0) {
        return Err(FormatError::at_byte(8, format!("version {version}, not {VERSION}"), REMEDY));
    }
    let number = |b: &[u8]| u64::from_le_bytes(b.try_into().expect("eight bytes"));
    let count = number(c.take(1, 8, "the header")?);
    let ids = c.take(count, 8, "the identities")?.chunks_exact(8).map(number).collect();
    if c.remaining() > 0 {
        return Err(FormatError::at_byte(c.pos(), format!("{} bytes too many", c.remaining()), REMEDY));
    }
    Ok(ids)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn round_trip_and_every_damage() {
        for ids in [vec![], vec![0, u64::MAX, 1 << 40]] {
            assert_eq!(parse_strand_ids(&encode_strand_ids(&ids)).unwrap(), ids);
        }
        let good = encode_strand_ids(&[3, 4]);
        for n in 0..good.len() {
            assert!(parse_strand_ids(&good[..n]).is_err(), "{n} bytes");
        }
        let with = |at: usize, bytes: &[u8]| {
            let mut b = good.clone();
            b[at..at + bytes.len()].copy_from_slice(bytes);
            parse_strand_ids(&b).unwrap_err().to_string()
        };
        assert!(with(0, b"X").contains("not a table"));
        assert!(with(8, &[2]).contains("version 2"));
        assert!(with(16, &[0xff; 8]).contains("the identities needs"));
        assert!(with(16, &[1]).contains("8 bytes too many"));
    }
}

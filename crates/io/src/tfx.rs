//! TressFX `.tfx` version 4: a header of 160 bytes (version f32, strands u32, points a strand u32, byte offsets
//! u32 of positions, strand UVs, point UVs, strand thickness and colours, 32 reserved u32); positions are 4 f32,
//! of which the last is not geometry. Thickness, one f32 a strand, is read as the fibre's diameter in file units.

use crate::bytes::Cursor;
use crate::error::{FormatError, Parsed};
use crate::strands::{Radii, RawStrands};

const HEADER: usize = 160;

/// Parses a `.tfx` file.
///
/// # Errors
/// Another version, truncation, an offset inside the header or beyond the file, a number that is not finite.
pub fn parse_tfx(bytes: &[u8]) -> Parsed<RawStrands> {
    let mut c = Cursor::new(bytes);
    let header = c.take(1, HEADER, "the header")?;
    let word = |i: usize| {
        u32::from_le_bytes([header[4 * i], header[4 * i + 1], header[4 * i + 2], header[4 * i + 3]])
    };
    let version = f32::from_bits(word(0));
    if version != 4.0 {
        return Err(FormatError::at_byte(
            0,
            format!("TressFX version {version:?}, not 4.0"),
            "export as TressFX 4 (.tfx), or check that this is a .tfx file",
        ));
    }
    let (strands, each) = (word(1), word(2));
    if each < 2 {
        return Err(FormatError::at_byte(
            8,
            format!("{each} points a strand; a strand needs two"),
            "export the file again",
        ));
    }
    let total = u64::from(strands) * u64::from(each);
    let seek = |at: usize, what: &str, c: &mut Cursor<'_>| {
        let offset = word(at) as usize;
        if offset < HEADER {
            return Err(FormatError::at_byte(
                4 * at,
                format!("{what} would start at byte {offset}, inside the header"),
                "the header is wrong: export the file again",
            ));
        }
        c.seek(offset, what)
    };
    seek(3, "the position array", &mut c)?;
    let mut points = Vec::new();
    c.points(total, 4, "the position array", &mut points)?;
    let radii = if word(6) == 0 {
        Radii::Unstated
    } else {
        seek(6, "the thickness array", &mut c)?;
        let thickness = c.f32s(u64::from(strands), "the thickness array")?;
        Radii::PerPoint(thickness.iter().flat_map(|t| (0..each).map(move |_| t * 0.5)).collect())
    };
    RawStrands::new("TressFX 4 .tfx", points, (0..strands).map(|_| each), radii)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    fn sample(thickness: Option<[f32; 2]>) -> Vec<u8> {
        let mut b = Vec::new();
        b.extend(4.0f32.to_le_bytes());
        let after = 160 + 2 * 4 * 16;
        for v in [2, 4, 160, 0, 0, if thickness.is_some() { after } else { 0 }, 0u32] {
            b.extend(v.to_le_bytes());
        }
        b.resize(HEADER, 0);
        for i in 0..8 {
            for v in [i as f32, 1.0 - 0.1 * i as f32, (i * i) as f32, if i % 4 == 0 { 0.0 } else { 1.0 }] {
                b.extend(v.to_le_bytes());
            }
        }
        b.extend(thickness.iter().flatten().flat_map(|v| v.to_le_bytes()));
        b
    }

    #[test]
    fn reads_positions_and_halves_thickness() {
        let raw = parse_tfx(&sample(Some([0.08, 0.1]))).unwrap();
        assert_eq!(raw.offsets, [0, 4, 8]);
        assert_eq!(raw.points[3], Vec3::new(3.0, 1.0 - 0.1 * 3.0, 9.0));
        assert_eq!(raw.radii, Radii::PerPoint([[0.04; 4], [0.05; 4]].concat()));
        assert_eq!(parse_tfx(&sample(None)).unwrap().radii, Radii::Unstated);
    }

    #[test]
    fn every_truncation_and_every_lie_is_an_error() {
        let good = sample(Some([0.08, 0.1]));
        for n in 0..good.len() {
            assert!(parse_tfx(&good[..n]).is_err(), "{n} bytes");
        }
        let with = |at: usize, v: u32| {
            let mut b = good.clone();
            b[at..at + 4].copy_from_slice(&v.to_le_bytes());
            parse_tfx(&b).unwrap_err().to_string()
        };
        assert!(with(0, 3.0f32.to_bits()).contains("version 3.0"));
        assert!(with(4, u32::MAX).contains("needs 274877906880 bytes"));
        assert!(with(8, 1).contains("needs two"));
        assert!(with(12, 12).contains("inside the header"));
        assert!(with(24, u32::MAX).contains("would start there"));
        assert!(with(164, f32::INFINITY.to_bits()).starts_with("strand 0, point 0"));
    }
}

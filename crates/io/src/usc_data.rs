//! USC HairSalon `.data`: strands i32; for each strand its points i32 and 3 f32 a point. Strands of one point
//! stand for "no hair here".

use crate::bytes::Cursor;
use crate::error::{FormatError, Parsed};
use crate::strands::{Radii, RawStrands};
use strandbench_types::StrandSet;

/// Parses a `.data` file.
///
/// # Errors
/// Truncation, a negative count, bytes left over, a number that is not finite: with byte offset and strand.
pub fn parse_usc_data(bytes: &[u8]) -> Parsed<RawStrands> {
    let mut c = Cursor::new(bytes);
    let strands = count(&mut c, "the number of strands")?;
    // Each strand has at least its own count.
    if u64::from(strands) * 4 > c.remaining() as u64 {
        return Err(FormatError::at_byte(
            0,
            format!("the header claims {strands} strands but only {} bytes follow", c.remaining()),
            "the file is truncated or not a .data file",
        ));
    }
    let mut counts = Vec::with_capacity(strands as usize);
    let mut points = Vec::new();
    for i in 0..strands {
        let what = format!("strand {i}");
        let n = count(&mut c, &what)?;
        c.points(u64::from(n), 3, &what, &mut points)?;
        counts.push(n);
    }
    if c.remaining() > 0 {
        return Err(FormatError::at_byte(
            c.pos(),
            format!("{} bytes follow the last strand", c.remaining()),
            "the number of strands is wrong or this is not a .data file",
        ));
    }
    RawStrands::new("USC HairSalon .data", points, counts.into_iter(), Radii::Unstated)
}

fn count(c: &mut Cursor<'_>, what: &str) -> Parsed<u32> {
    let at = c.pos();
    let n = c.u32(what)?;
    if n > i32::MAX as u32 {
        return Err(FormatError::at_byte(
            at,
            format!("{what} has the negative count {}", n as i32),
            "the file is damaged or not a .data file",
        ));
    }
    Ok(n)
}

/// The bytes of a `.data` file; radii have no place in it.
pub(crate) fn encode_usc_data(strands: &StrandSet) -> Vec<u8> {
    let mut out = Vec::with_capacity(4 + 4 * strands.len() + 12 * strands.points.len());
    out.extend_from_slice(&(strands.len() as u32).to_le_bytes());
    for strand in strands.iter() {
        out.extend_from_slice(&(strand.len() as u32).to_le_bytes());
        out.extend(strand.iter().flat_map(|p| p.to_array()).flat_map(f32::to_le_bytes));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> Vec<u8> {
        let mut b = 3i32.to_le_bytes().to_vec();
        for strand in [&[[0.0f32, 0.0, 0.0], [0.0, 1.0, 0.0]][..], &[[5.0, 5.0, 5.0]], &[[1.0, 2.0, 3.0]; 2]]
        {
            b.extend((strand.len() as i32).to_le_bytes());
            b.extend(strand.iter().flatten().flat_map(|v| v.to_le_bytes()));
        }
        b
    }

    #[test]
    fn reads_strands_of_one_point_too() {
        let raw = parse_usc_data(&sample()).unwrap();
        assert_eq!(raw.offsets, [0, 2, 3, 5]);
        assert_eq!(raw.points[4], glam::Vec3::new(1.0, 2.0, 3.0));
        let (set, report) = raw.into_world(&Default::default()).unwrap();
        assert_eq!((set.len(), report.zero_length_strands, report.repeated_points), (1, 2, 1));
    }

    #[test]
    fn every_truncation_and_every_lie_is_an_error() {
        let good = sample();
        for n in 0..good.len() {
            assert!(parse_usc_data(&good[..n]).is_err(), "{n} bytes");
        }
        let mut lie = good.clone();
        lie[..4].copy_from_slice(&u32::MAX.to_le_bytes());
        assert!(parse_usc_data(&lie).unwrap_err().fault.contains("negative"));
        lie[..4].copy_from_slice(&i32::MAX.to_le_bytes());
        assert!(parse_usc_data(&lie).unwrap_err().fault.contains("2147483647 strands"));
        let mut long = good.clone();
        long.push(0);
        assert!(parse_usc_data(&long).unwrap_err().fault.contains("1 bytes follow"));
        let mut nan = good;
        nan[8..12].copy_from_slice(&f32::NAN.to_le_bytes());
        assert_eq!(parse_usc_data(&nan).unwrap_err().place, "strand 0, point 0");
    }
}

//! Cem Yuksel's `.hair`, and the format without a magic that MonoHair and DeepMVSHair write under that ending.
//!
//! A `.hair` file is a header of 128 bytes (magic `HAIR`, strands u32, points u32, flags u32, default segments
//! u32, default thickness f32, default transparency f32, default colour 3 f32, 88 bytes of text) and the arrays
//! that the flags announce: segments a strand (1, u16), points (2, 3 f32), thickness (4, f32 a point),
//! transparency (8), colour (16). The format's text leaves "thickness" open; it is read and written as the
//! fibre's diameter in file units.

use crate::bytes::Cursor;
use crate::error::{FormatError, Parsed};
use crate::strands::{Radii, RawStrands};
use strandbench_types::StrandSet;

const HEADER: usize = 128;
const SEGMENTS: u32 = 1;
const POINTS: u32 = 2;
const THICKNESS: u32 = 4;
const TRANSPARENCY: u32 = 8;
const COLOUR: u32 = 16;
const INFO: &[u8] = b"strandbench: mm, +y up, face +z, root first; thickness is the fibre's diameter";

/// Parses a `.hair` file of Cem Yuksel's format.
///
/// # Errors
/// Wrong magic, truncation, unknown flags, no point array, counts that contradict each other, a number that
/// is not finite: with byte offset or strand.
pub fn parse_hair(bytes: &[u8]) -> Parsed<RawStrands> {
    let mut c = Cursor::new(bytes);
    let magic = c.take(1, 4, "the magic")?;
    if magic != b"HAIR" {
        return Err(FormatError::at_byte(
            0,
            format!("the magic is {:?}, not \"HAIR\"", String::from_utf8_lossy(magic)),
            "this is not Cem Yuksel's .hair format; convert the file",
        ));
    }
    let strands = c.u32("the header")?;
    let points = c.u32("the header")?;
    let flags = c.u32("the header")?;
    let default_segments = c.u32("the header")?;
    let default_thickness = c.f32("the header")?;
    c.take(1, HEADER - c.pos(), "the header")?;
    let known = SEGMENTS | POINTS | THICKNESS | TRANSPARENCY | COLOUR;
    if flags & !known != 0 {
        return Err(FormatError::at_byte(
            12,
            format!("flags {flags:#x} hold unknown bits"),
            "convert the file",
        ));
    }
    if flags & POINTS == 0 {
        return Err(FormatError::at_byte(
            12,
            format!("flags {flags:#x} announce no point array"),
            "export the file with points (flag 2)",
        ));
    }
    let counts = if flags & SEGMENTS != 0 {
        Counts::Each(c.u16s(u64::from(strands), "the segment array")?)
    } else {
        Counts::Same(u64::from(default_segments) + 1, strands)
    };
    let total = counts.total();
    if total != u128::from(points) {
        return Err(FormatError::at_byte(
            8,
            format!("the header claims {points} points but its {strands} strands have {total}"),
            "the header is wrong: export the file again",
        ));
    }
    let mut out = Vec::new();
    c.points(u64::from(points), 3, "the point array", &mut out)?;
    let radii = if flags & THICKNESS != 0 {
        let mut t = c.f32s(u64::from(points), "the thickness array")?;
        t.iter_mut().for_each(|t| *t *= 0.5);
        Radii::PerPoint(t)
    } else if default_thickness > 0.0 && default_thickness.is_finite() {
        Radii::Same(default_thickness * 0.5)
    } else {
        Radii::Unstated
    };
    // Transparency and colour are not kept, but a file that announces them must have them.
    for (flag, floats, what) in [(TRANSPARENCY, 1, "the transparency array"), (COLOUR, 3, "the colour array")]
    {
        if flags & flag != 0 {
            c.take(u64::from(points), 4 * floats, what)?;
        }
    }
    let trailing = c.remaining();
    let mut raw = RawStrands::new("Cem Yuksel .hair", out, counts.iter(), radii)?;
    if trailing > 0 {
        raw.notes.push(format!("{trailing} bytes after the last array were ignored"));
    }
    Ok(raw)
}

enum Counts {
    Each(Vec<u16>),
    /// Points a strand, strands.
    Same(u64, u32),
}

impl Counts {
    fn total(&self) -> u128 {
        match self {
            Counts::Each(s) => s.iter().map(|&n| u128::from(n) + 1).sum(),
            Counts::Same(each, strands) => u128::from(*each) * u128::from(*strands),
        }
    }

    fn iter(&self) -> Box<dyn Iterator<Item = u32> + '_> {
        match self {
            Counts::Each(s) => Box::new(s.iter().map(|&n| u32::from(n) + 1)),
            Counts::Same(each, strands) => Box::new((0..*strands).map(|_| *each as u32)),
        }
    }
}

/// Whether the size fits the format without a magic exactly.
pub(crate) fn looks_like_monohair(bytes: &[u8]) -> bool {
    monohair_counts(bytes).is_ok_and(|(c, counts)| {
        let points: u64 = counts.iter().map(|&n| u64::from(n)).sum();
        points > 0 && c.remaining() as u64 == points * 12
    })
}

fn monohair_counts(bytes: &[u8]) -> Parsed<(Cursor<'_>, Vec<u16>)> {
    let mut c = Cursor::new(bytes);
    let strands = c.u32("the header")?;
    c.u32("the header")?;
    let counts = c.u16s(u64::from(strands), "the array of point counts")?;
    Ok((c, counts))
}

/// Parses the format without a magic: strands u32, points u32, points of each strand u16, then 3 f32 a point.
///
/// # Errors
/// Truncation, counts that contradict each other, bytes left over, a number that is not finite.
pub fn parse_monohair(bytes: &[u8]) -> Parsed<RawStrands> {
    let (mut c, counts) = monohair_counts(bytes)?;
    let points: u64 = counts.iter().map(|&n| u64::from(n)).sum();
    let mut out = Vec::new();
    c.points(points, 3, "the point array", &mut out)?;
    if c.remaining() > 0 {
        return Err(FormatError::at_byte(
            c.pos(),
            format!("{} bytes follow the last point", c.remaining()),
            "the header is wrong or this is another format: convert the file",
        ));
    }
    let counts = counts.iter().map(|&n| u32::from(n));
    let mut raw = RawStrands::new("MonoHair .hair (no magic)", out, counts, Radii::Unstated)?;
    let claimed = u32::from_le_bytes([bytes[4], bytes[5], bytes[6], bytes[7]]);
    if u64::from(claimed) != points {
        raw.notes.push(format!("the header claims {claimed} points, the strands have {points}"));
    }
    Ok(raw)
}

/// The bytes of a `.hair` file with segments, points and thickness; points and radii survive bit for bit.
pub(crate) fn encode_hair(strands: &StrandSet) -> Parsed<Vec<u8>> {
    let points = strands.points.len();
    let mut out = Vec::with_capacity(HEADER + 2 * strands.len() + 16 * points);
    out.extend_from_slice(b"HAIR");
    let count = u32::try_from(points).expect("validated strands have under 2^32 points");
    for v in [strands.len() as u32, count, SEGMENTS | POINTS | THICKNESS, 0] {
        out.extend_from_slice(&v.to_le_bytes());
    }
    for v in [0.0f32, 0.0, 0.5, 0.5, 0.5] {
        out.extend_from_slice(&v.to_le_bytes());
    }
    out.extend_from_slice(INFO);
    out.resize(HEADER, 0);
    for (i, strand) in strands.iter().enumerate() {
        let segments = u16::try_from(strand.len() - 1).map_err(|_| {
            FormatError::at_strand(
                i,
                format!("{} points, but .hair can hold 65,536 a strand", strand.len()),
                "resample the strand or write .ply",
            )
        })?;
        out.extend_from_slice(&segments.to_le_bytes());
    }
    out.extend(strands.points.iter().flat_map(|p| p.to_array()).flat_map(f32::to_le_bytes));
    out.extend(strands.radii_mm.iter().flat_map(|r| (r * 2.0).to_le_bytes()));
    Ok(out)
}

#[cfg(test)]
mod tests;

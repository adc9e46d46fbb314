//! Optical flow: OpenEXR with validity and occlusion, and Middlebury's `.flo`.

use crate::atomic::atomic_write;
use crate::bytes::Cursor;
use crate::error::{FormatError, IoError, Parsed, Result};
use crate::exr::{MAX_SIDE_PX, pick, read_exr, write_exr_owned};
use crate::read::read_all;
use std::path::Path;
use strandbench_types::{FlowMap, FlowState, Plane};

/// Channels of a flow's OpenEXR file.
const CHANNELS: [&str; 4] = ["u", "v", "valid", "occluded"];

const REMEDY: &str = "write the flow again";

/// The float 202021.25, which reads `PIEH` in the file (Baker et al. 2011).
const FLO_MAGIC: &[u8; 4] = b"PIEH";
/// What the format calls unknown, and from which magnitude on.
const FLO_UNKNOWN: f32 = 1e10;
const FLO_KNOWN_BELOW: f32 = 1e9;

/// Writes a flow as OpenEXR, atomically: `u` and `v` (px, x right and y down; NaN where there is none), `valid` (1 where
/// the point projects into the image), `occluded` (1 where it does but is hidden there).
///
/// # Errors
/// If the planes differ in size or the file cannot be written.
pub fn write_flow(path: &Path, flow: &FlowMap) -> Result<()> {
    if flow.flow_px.size() != flow.state.size() {
        let (a, b) = (flow.flow_px.size(), flow.state.size());
        return Err(IoError::new(path, format!("not written: flow is {a:?} px, its state {b:?} px")));
    }
    let share = |yes: bool| f32::from(u8::from(yes));
    let planes = [
        flow.flow_px.map(|f| f[0]),
        flow.flow_px.map(|f| f[1]),
        flow.state.map(|s| share(s.is_valid())),
        flow.state.map(|s| share(*s == FlowState::Occluded)),
    ];
    write_exr_owned(path, CHANNELS.into_iter().zip(planes).collect())
}

/// Reads a flow that [`write_flow`] wrote, bit for bit.
///
/// # Errors
/// A missing channel; a pixel whose `valid` and `occluded` are not 0 or 1 or contradict each other or the flow.
pub fn read_flow(path: &Path) -> Result<FlowMap> {
    let [u, v, valid, occluded] = pick(path, read_exr(path)?, CHANNELS)?;
    let (w, h) = u.size();
    let state = (0..w * h).map(|i| {
        let here = [u.data[i], v.data[i]];
        let there = here.iter().all(|f| f.is_finite());
        match (valid.data[i], occluded.data[i]) {
            (0.0, 0.0) if there => Ok(FlowState::Outside),
            (0.0, 0.0) if here.iter().all(|f| f.is_nan()) => Ok(FlowState::Absent),
            (1.0, 0.0) if there => Ok(FlowState::Seen),
            (1.0, 1.0) if there => Ok(FlowState::Occluded),
            (valid, occluded) => {
                let at = format!("pixel ({}, {})", i % w, i / w);
                let fault =
                    format!("{at}: flow {here:?} with valid {valid} and occluded {occluded}; {REMEDY}");
                Err(IoError::new(path, fault))
            }
        }
    });
    let state = Plane::from_vec(w, h, state.collect::<Result<_>>()?);
    let data = u.data.into_iter().zip(v.data).map(|(u, v)| [u, v]).collect();
    Ok(FlowMap { flow_px: Plane::from_vec(w, h, data), state })
}

/// Writes a flow as Middlebury's `.flo`, atomically; what is absent is unknown there, and what is hidden or leaves the
/// image is not told from what is seen.
///
/// # Errors
/// If the image is empty or larger than 16,384 px a side, or the file cannot be written.
pub fn write_flo(path: &Path, flow: &FlowMap) -> Result<()> {
    let (w, h) = flow.flow_px.size();
    if w == 0 || h == 0 || w > MAX_SIDE_PX || h > MAX_SIDE_PX {
        return Err(IoError::new(path, format!("not written: size {w}x{h} is outside 1..{MAX_SIDE_PX}")));
    }
    atomic_write(path, |out| {
        out.write_all(FLO_MAGIC)?;
        out.write_all(&(w as u32).to_le_bytes())?;
        out.write_all(&(h as u32).to_le_bytes())?;
        for f in &flow.flow_px.data {
            for v in f {
                out.write_all(&if v.is_nan() { FLO_UNKNOWN } else { *v }.to_le_bytes())?;
            }
        }
        Ok(())
    })
}

/// Reads a Middlebury `.flo` file: flow in px, NaN where it is unknown.
///
/// # Errors
/// As [`parse_flo`], naming the file.
pub fn read_flo(path: &Path) -> Result<Plane<[f32; 2]>> {
    parse_flo(&read_all(path)?).map_err(|e| e.in_file(path))
}

/// Parses a Middlebury `.flo` file; see [`read_flo`].
///
/// # Errors
/// Wrong magic, a size outside 1..16,384 px, truncation, bytes left over.
pub fn parse_flo(bytes: &[u8]) -> Parsed<Plane<[f32; 2]>> {
    let mut c = Cursor::new(bytes);
    if c.take(1, 4, "the magic")? != FLO_MAGIC {
        return Err(FormatError::at_byte(0, "this is no .flo file", REMEDY));
    }
    let (w, h) = (c.u32("the header")? as usize, c.u32("the header")? as usize);
    if w == 0 || h == 0 || w > MAX_SIDE_PX || h > MAX_SIDE_PX {
        return Err(FormatError::at_byte(4, format!("size {w}x{h} is outside 1..{MAX_SIDE_PX}"), REMEDY));
    }
    let values = c.f32s((2 * w * h) as u64, "the flow")?;
    if c.remaining() > 0 {
        return Err(FormatError::at_byte(c.pos(), format!("{} bytes too many", c.remaining()), REMEDY));
    }
    let known = |f: &[f32; 2]| f.iter().all(|v| v.abs() < FLO_KNOWN_BELOW);
    let data = values.as_chunks().0.iter().map(|f| if known(f) { *f } else { [f32::NAN; 2] }).collect();
    Ok(Plane::from_vec(w, h, data))
}

#[cfg(test)]
mod tests;

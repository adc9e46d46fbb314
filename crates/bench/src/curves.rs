//! Hair as the text that Mitsuba reads curves from: a line a point (x y z radius), an empty line after a curve.

use crate::error::BenchError;
use glam::{Vec3, Vec4};
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;
use strandbench_types::StrandSet;

/// How strands become curves. The names are those of the files, too.
pub const LINEAR: &str = "linearcurve";
/// Cubic splines with the strands' points as control points; their ends are written three times, so that they are
/// reached. Corners are rounded.
pub const SPLINE: &str = "bsplinecurve";

/// The points of one curve in the order that a file has them.
fn points(curve: &[Vec4], kind: &str) -> Vec<Vec4> {
    let ends = if kind == SPLINE { 2 } else { 0 };
    let first = std::iter::repeat_n(curve[0], ends);
    let last = std::iter::repeat_n(curve[curve.len() - 1], ends);
    first.chain(curve.iter().copied()).chain(last).collect()
}

/// Writes the file named `kind` into `folder`, if it is not there.
///
/// # Errors
/// If it cannot be written.
pub fn write(strands: &StrandSet, kind: &str, folder: &Path) -> Result<(), BenchError> {
    let path = folder.join(kind);
    if path.exists() {
        return Ok(());
    }
    let put = || -> std::io::Result<()> {
        let mut out = BufWriter::new(File::create(&path)?);
        for strand in 0..strands.len() {
            let range = strands.range(strand);
            let with = |k: usize| strands.points[k].extend(strands.radii_mm[k]);
            let curve: Vec<Vec4> = range.map(with).collect();
            for p in points(&curve, kind) {
                // As many digits as say which float it is.
                let Vec3 { x, y, z } = p.truncate();
                writeln!(out, "{x} {y} {z} {}", p.w)?;
            }
            writeln!(out)?;
        }
        out.flush()
    };
    put().map_err(BenchError::file(&path))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hair;

    #[test]
    fn text_holds_the_same_floats_and_splines_reach_their_ends() {
        let strands = hair::wavy(3, 4, 1);
        let folder = tempfile::tempdir().unwrap();
        for (kind, more) in [(LINEAR, 0), (SPLINE, 2)] {
            write(&strands, kind, folder.path()).unwrap();
            let text = std::fs::read_to_string(folder.path().join(kind)).unwrap();
            let curves: Vec<&str> = text.split("\n\n").filter(|c| !c.is_empty()).collect();
            assert_eq!(curves.len(), 3);
            for (i, curve) in curves.iter().enumerate() {
                let read: Vec<Vec<f32>> =
                    curve.lines().map(|l| l.split(' ').map(|v| v.parse().unwrap()).collect()).collect();
                let own: Vec<Vec<f32>> = strands
                    .range(i)
                    .map(|k| [&strands.points[k].to_array()[..], &[strands.radii_mm[k]]].concat())
                    .collect();
                assert_eq!(read[more..read.len() - more], own);
                assert!(read[..more].iter().all(|p| *p == own[0]));
                assert!(read[read.len() - more..].iter().all(|p| *p == own[4]));
            }
        }
    }
}

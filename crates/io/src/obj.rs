//! Wavefront OBJ: positions with faces (meshes) or lines (strands). Vertex order is kept as in the file;
//! texture coordinates, normals, groups and materials are skipped.

use crate::error::{FormatError, Parsed};
use crate::strands::{Radii, RawStrands};
use glam::Vec3;
use std::io::Write as _;
use strandbench_types::{StrandSet, TriMesh};

const REMEDY: &str = "the file is damaged or not an OBJ: export it again";

/// What an OBJ holds of geometry: polygons and polylines as vertex runs.
#[derive(Default)]
struct Obj {
    points: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    line_indices: Vec<u32>,
    line_counts: Vec<u32>,
}

fn parse_obj(bytes: &[u8], faces: bool) -> Parsed<Obj> {
    let mut obj = Obj::default();
    let mut joined = Vec::new();
    for (i, line) in bytes.split(|&b| b == b'\n').enumerate() {
        let line = line.strip_suffix(b"\r").unwrap_or(line);
        if let Some(head) = line.strip_suffix(b"\\") {
            joined.extend_from_slice(head);
            joined.push(b' ');
            continue;
        }
        if joined.is_empty() {
            obj.line(line, i + 1, faces)?;
        } else {
            joined.extend_from_slice(line);
            obj.line(&std::mem::take(&mut joined), i + 1, faces)?;
        }
    }
    if !joined.is_empty() {
        return Err(FormatError::new("end of file", "the last line is continued by nothing", REMEDY));
    }
    Ok(obj)
}

impl Obj {
    fn line(&mut self, line: &[u8], number: usize, faces: bool) -> Parsed<()> {
        let bad = |fault: String| FormatError::new(format!("line {number}"), fault, REMEDY);
        let mut words = line.split(u8::is_ascii_whitespace).filter(|w| !w.is_empty());
        let text = |w: &[u8]| String::from_utf8_lossy(&w[..w.len().min(40)]).into_owned();
        match words.next() {
            Some(b"v") => {
                let mut p = [0.0f32; 3];
                for v in &mut p {
                    let w = words.next().ok_or_else(|| bad("a vertex needs three numbers".into()))?;
                    *v = std::str::from_utf8(w)
                        .ok()
                        .and_then(|t| t.parse().ok())
                        .ok_or_else(|| bad(format!("{:?} is not a number", text(w))))?;
                    if !v.is_finite() {
                        return Err(bad(format!("coordinate {:?} is not finite", text(w))));
                    }
                }
                if self.points.len() >= u32::MAX as usize {
                    return Err(bad("more than 2^32 vertices".into()));
                }
                self.points.push(Vec3::from_array(p));
            }
            Some(b"f") if faces => {
                let (mut first, mut last, mut corners) = (0, 0, 0);
                for w in words {
                    let v = self.index(w).ok_or_else(|| {
                        bad(format!("{:?} names none of the {} vertices so far", text(w), self.points.len()))
                    })?;
                    match corners {
                        0 => first = v,
                        1 => {}
                        _ => self.triangles.push([first, last, v]),
                    }
                    (last, corners) = (v, corners + 1);
                }
                if corners < 3 {
                    return Err(bad(format!("a face of {corners} corners; a face needs three")));
                }
            }
            Some(b"l") if !faces => {
                let begin = self.line_indices.len();
                for w in words {
                    let v = self.index(w).ok_or_else(|| {
                        bad(format!("{:?} names none of the {} vertices so far", text(w), self.points.len()))
                    })?;
                    self.line_indices.push(v);
                }
                self.line_counts.push((self.line_indices.len() - begin) as u32);
            }
            _ => {}
        }
        Ok(())
    }

    /// Position index of `7`, `7/1`, `7//3`, `-1`, ...: from 1, or from the end.
    fn index(&self, word: &[u8]) -> Option<u32> {
        let digits = word.split(|&b| b == b'/').next()?;
        let i: i64 = std::str::from_utf8(digits).ok()?.parse().ok()?;
        let n = self.points.len() as i64;
        let i = if i < 0 { n.checked_add(i)? } else { i - 1 };
        (0..n).contains(&i).then_some(i as u32)
    }
}

/// Parses a triangle mesh; polygons are fanned about their first corner.
///
/// # Errors
/// With the line's number: a vertex that is not three finite numbers, a face of fewer than three corners or
/// of a vertex not given before it.
pub fn parse_obj_mesh(bytes: &[u8]) -> Parsed<TriMesh> {
    let obj = parse_obj(bytes, true)?;
    Ok(TriMesh { vertices: obj.points, triangles: obj.triangles })
}

/// Parses strands from `l` elements, one a strand.
///
/// # Errors
/// As [`parse_obj_mesh`], and if there is no line element.
pub fn parse_obj_strands(bytes: &[u8]) -> Parsed<RawStrands> {
    let obj = parse_obj(bytes, false)?;
    if obj.line_counts.is_empty() {
        return Err(FormatError::new(
            "content",
            "there is no line element (l)",
            "export the strands as lines, or give a head mesh as such",
        ));
    }
    let points = obj.line_indices.iter().map(|&v| obj.points[v as usize]).collect();
    RawStrands::new("OBJ lines", points, obj.line_counts.into_iter(), Radii::Unstated)
}

/// The text of an OBJ with one `l` a strand; coordinates survive bit for bit, radii have no place in it.
pub(crate) fn encode_obj_strands(strands: &StrandSet) -> Vec<u8> {
    let mut out = b"# strandbench strands in mm, +y up, face +z, root first\n".to_vec();
    vertices(&mut out, &strands.points);
    for i in 0..strands.len() {
        out.push(b'l');
        for v in strands.range(i) {
            write!(out, " {}", v + 1).expect("a Vec takes all");
        }
        out.push(b'\n');
    }
    out
}

/// The text of an OBJ mesh; coordinates survive bit for bit.
pub(crate) fn encode_obj_mesh(mesh: &TriMesh) -> Vec<u8> {
    let mut out = b"# strandbench mesh in mm, +y up, face +z\n".to_vec();
    vertices(&mut out, &mesh.vertices);
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|i| u64::from(i) + 1);
        writeln!(out, "f {a} {b} {c}").expect("a Vec takes all");
    }
    out
}

pub(crate) fn vertices(out: &mut Vec<u8>, points: &[Vec3]) {
    for p in points {
        writeln!(out, "v {} {} {}", p.x, p.y, p.z).expect("a Vec takes all");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_of_every_spelling_are_fanned_in_order() {
        let text =
            b"# c\nmtllib \xff.mtl\nv 0 0 0\r\nv 1 0 0 0.5 0.5 0.5\nv 1 1 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\n\
            f 1/1/1 2//1 3/1 4\nf -4 -3 \\\n -1\nl 1 2\n";
        let m = parse_obj_mesh(text).unwrap();
        assert_eq!(m.vertices.len(), 4);
        assert_eq!(m.triangles, [[0, 1, 2], [0, 2, 3], [0, 1, 3]]);
        assert_eq!(parse_obj_strands(text).unwrap().offsets, [0, 2]);
    }

    #[test]
    fn faults_name_their_line() {
        for (text, line, fault) in [
            ("v 0 0\n", 1, "three numbers"),
            ("v 0 0 x\n", 1, "not a number"),
            ("\nv 0 0 nan\n", 2, "not finite"),
            ("v 0 0 1e999\n", 1, "not finite"),
            ("v 0 0 0\nf 1 1\n", 2, "2 corners"),
            ("v 0 0 0\nf 1 1 2\n", 2, "names none of the 1 vertices"),
            ("v 0 0 0\nf 1 1 0\n", 2, "names none"),
            ("v 0 0 0\nf 1 1 -2\n", 2, "names none"),
            ("v 0 0 0\nf 1 1 -9223372036854775808\n", 2, "names none"),
        ] {
            let e = parse_obj_mesh(text.as_bytes()).unwrap_err();
            assert_eq!(e.place, format!("line {line}"), "{text:?}");
            assert!(e.fault.contains(fault), "{e}");
        }
        assert!(parse_obj_mesh(b"v 0 0 0 \\").is_err());
        assert!(parse_obj_strands(b"v 0 0 0\n").unwrap_err().fault.contains("no line element"));
    }
}

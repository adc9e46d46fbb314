//! `hairs.ply`: a vertex for each strand's root, with its follicle, length, kind and density.

use crate::error::{FormatError, Parsed};
use crate::ply::{Element, parse_ply};
use crate::ply_strands::{positions, vertices};
use std::io::Write as _;
use strandbench_types::HairRoot;

const REMEDY: &str = "make the truth again";

/// The bytes of a binary little-endian PLY.
pub(crate) fn encode_hair_roots(roots: &[HairRoot]) -> Vec<u8> {
    let mut out = Vec::with_capacity(500 + 37 * roots.len());
    write!(
        out,
        "ply\nformat binary_little_endian 1.0\ncomment strandbench roots of strands in mm, +y up, face +z\n\
         element vertex {}\nproperty float x\nproperty float y\nproperty float z\nproperty uint triangle\n\
         property float b0\nproperty float b1\nproperty float b2\nproperty float length_mm\n\
         property uchar kind\nproperty float density_per_cm2\nend_header\n",
        roots.len()
    )
    .expect("a Vec takes all");
    for r in roots {
        out.extend(r.position_mm.to_array().into_iter().flat_map(f32::to_le_bytes));
        out.extend(r.triangle.to_le_bytes());
        out.extend(r.barycentric.into_iter().chain([r.length_mm]).flat_map(f32::to_le_bytes));
        out.push(r.kind);
        out.extend(r.density_per_cm2.to_le_bytes());
    }
    out
}

/// Parses `hairs.ply`, in the strands' order.
///
/// # Errors
/// A damaged file, a property that is missing, an index that is none.
pub fn parse_hair_roots(bytes: &[u8]) -> Parsed<Vec<HairRoot>> {
    let ply = parse_ply(bytes, |element, _| element == "vertex")?;
    let vertex = vertices(&ply)?;
    let places = positions(vertex)?;
    let [triangle, b0, b1, b2, length, kind, density] =
        columns(vertex, ["triangle", "b0", "b1", "b2", "length_mm", "kind", "density_per_cm2"])?;
    let index = |i: usize, name: &str, v: f64, most: f64| {
        if v >= 0.0 && v <= most && v.fract() == 0.0 {
            return Ok(v);
        }
        Err(FormatError::new(format!("root {i}"), format!("{name} is {v}"), REMEDY))
    };
    (0..places.len())
        .map(|i| {
            Ok(HairRoot {
                position_mm: places[i],
                triangle: index(i, "triangle", triangle[i], f64::from(u32::MAX))? as u32,
                barycentric: [b0[i] as f32, b1[i] as f32, b2[i] as f32],
                length_mm: length[i] as f32,
                kind: index(i, "kind", kind[i], 255.0)? as u8,
                density_per_cm2: density[i] as f32,
            })
        })
        .collect()
}

fn columns<'a, const N: usize>(vertex: &'a Element, names: [&str; N]) -> Parsed<[&'a [f64]; N]> {
    let mut out = [&[][..]; N];
    for (column, name) in out.iter_mut().zip(names) {
        *column = vertex.scalar(name).ok_or_else(|| {
            FormatError::new("header", format!("element vertex lacks the property {name}"), REMEDY)
        })?;
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_that_are_no_index_are_refused_whatever_their_type_in_the_file() {
        let text = |kind: &str, triangle: &str, row: &str| {
            format!(
                "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n\
                 property {triangle} triangle\nproperty float b0\nproperty float b1\nproperty float b2\n\
                 property float length_mm\nproperty {kind} kind\nproperty float density_per_cm2\nend_header\n{row}\n"
            )
        };
        let said = |kind: &str, triangle: &str, row: &str| {
            parse_hair_roots(text(kind, triangle, row).as_bytes()).map_err(|e| e.to_string())
        };
        assert_eq!(said("int", "int", "1 2 3 7 0.2 0.3 0.5 4 255 30").unwrap()[0].kind, 255);
        for (row, fault) in [
            ("1 2 3 7 0.2 0.3 0.5 4 256 30", "root 0: kind is 256"),
            ("1 2 3 7 0.2 0.3 0.5 4 -1 30", "root 0: kind is -1"),
            ("1 2 3 -7 0.2 0.3 0.5 4 1 30", "root 0: triangle is -7"),
        ] {
            assert!(said("int", "int", row).unwrap_err().contains(fault), "{row}");
        }
        let e = said("float", "double", "1 2 3 7.5 0.2 0.3 0.5 4 1 30").unwrap_err();
        assert!(e.contains("triangle is 7.5"), "{e}");
        let lacks = text("int", "int", "").replace("length_mm", "length");
        assert!(parse_hair_roots(lacks.as_bytes()).is_err());
    }
}

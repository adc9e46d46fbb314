//! Triangle meshes in PLY and OBJ.

use crate::atomic::atomic_write;
use crate::error::{FormatError, IoError, Parsed, Result};
use crate::obj::{encode_obj_mesh, parse_obj_mesh};
use crate::ply::parse_ply;
use crate::ply_strands::{positions, vertices};
use crate::read::{ending, read_all};
use std::io::Write as _;
use std::path::Path;
use strandbench_types::TriMesh;

const FACE_LISTS: &[&str] = &["vertex_indices", "vertex_index"];

/// Parses the mesh of a PLY; polygons are fanned about their first corner.
///
/// # Errors
/// A damaged file, a face of fewer than three corners, an index out of range, a vertex that is not finite.
pub fn parse_ply_mesh(bytes: &[u8]) -> Parsed<TriMesh> {
    let ply = parse_ply(bytes, |element, property| match element {
        "vertex" => matches!(property, "x" | "y" | "z"),
        e => e == "face" && FACE_LISTS.contains(&property),
    })?;
    let vertices = positions(vertices(&ply)?)?;
    let mut triangles = Vec::new();
    if let Some(face) = ply.element("face").filter(|f| f.count > 0) {
        let (offsets, values) = face.list(FACE_LISTS).ok_or_else(|| {
            FormatError::new(
                "header",
                "element face has no list vertex_indices",
                "export the mesh as polygons",
            )
        })?;
        for (i, w) in offsets.windows(2).enumerate() {
            let corners = &values[w[0] as usize..w[1] as usize];
            let bad = |fault: String| {
                Err(FormatError::new(format!("face {i}"), fault, "repair the mesh and export it again"))
            };
            if corners.len() < 3 {
                return bad(format!("{} corners; a face needs three", corners.len()));
            }
            let n = vertices.len() as f64;
            if let Some(v) = corners.iter().find(|&&v| !(v >= 0.0 && v < n && v.fract() == 0.0)) {
                return bad(format!("vertex {v} is not one of the {n} vertices"));
            }
            let at = |k: usize| corners[k] as u32;
            triangles.extend((2..corners.len()).map(|k| [at(0), at(k - 1), at(k)]));
        }
    }
    let mesh = TriMesh { vertices, triangles };
    mesh.validate().map_err(|e| FormatError::new("content", e, "repair the mesh and export it again"))?;
    Ok(mesh)
}

/// Reads a triangle mesh from `.ply` or `.obj` (polygons are fanned), untransformed and in the file's order.
///
/// # Errors
/// Names the file, the place and the remedy; a file without faces is an error.
pub fn read_mesh(path: &Path) -> Result<TriMesh> {
    let bytes = read_all(path)?;
    let mesh = match ending(path).as_str() {
        _ if bytes.starts_with(b"ply") => parse_ply_mesh(&bytes),
        "obj" => parse_obj_mesh(&bytes),
        _ => Err(FormatError::new("ending", "not a mesh format known here", "give a .ply or .obj")),
    }
    .map_err(|e| e.in_file(path))?;
    if mesh.triangles.is_empty() {
        return Err(IoError::new(path, "no faces: this is not a mesh; give one with triangles or polygons"));
    }
    Ok(mesh)
}

/// Writes a mesh as `.ply` (binary), `.obj` or `.usda` ([`crate::usd::write_mesh`]) by ending, atomically; vertices
/// survive bit for bit.
///
/// # Errors
/// If the mesh is not valid, the ending is none of them, or the file cannot be written.
pub fn write_mesh(path: &Path, mesh: &TriMesh) -> Result<()> {
    mesh.validate().map_err(|e| IoError::new(path, format!("not written: {e}; repair the mesh first")))?;
    let bytes = match ending(path).as_str() {
        "ply" => encode_ply_mesh(mesh),
        "obj" => encode_obj_mesh(mesh),
        "usda" => return crate::usd::write_mesh(path, mesh, None),
        other => {
            let fault = format!("cannot write a mesh as {other:?}; use .ply, .obj or .usda");
            return Err(IoError::new(path, fault));
        }
    };
    atomic_write(path, |w| w.write_all(&bytes))
}

fn encode_ply_mesh(mesh: &TriMesh) -> Vec<u8> {
    let mut out = Vec::with_capacity(300 + 12 * mesh.vertices.len() + 13 * mesh.triangles.len());
    write!(
        out,
        "ply\nformat binary_little_endian 1.0\ncomment strandbench mesh in mm, +y up, face +z\n\
         element vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        mesh.vertices.len(),
        mesh.triangles.len()
    )
    .expect("a Vec takes all");
    out.extend(mesh.vertices.iter().flat_map(|v| v.to_array()).flat_map(f32::to_le_bytes));
    for t in &mesh.triangles {
        out.push(3);
        out.extend(t.iter().flat_map(|i| i.to_le_bytes()));
    }
    out
}

#[cfg(test)]
mod tests;

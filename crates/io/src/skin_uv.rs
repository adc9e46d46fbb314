//! A skin with texture coordinates as Wavefront OBJ: the topology and layout that all frames of a sequence share.

use crate::atomic::atomic_write;
use crate::error::{FormatError, IoError, Parsed, Result};
use crate::obj::{parse_obj_mesh, vertices};
use crate::read::read_all;
use glam::Vec2;
use std::io::Write as _;
use std::path::Path;
use strandbench_types::TriMesh;

const REMEDY: &str = "write the skin again";

/// A mesh with a place on a texture map for each corner of each triangle.
#[derive(Clone, Debug, PartialEq)]
pub struct UvMesh {
    /// Geometry, mm.
    pub mesh: TriMesh,
    /// Texture coordinates in 0..1, v upwards; a vertex on a seam has several.
    pub uvs: Vec<Vec2>,
    /// Texture coordinates of each triangle's corners, indexed as the mesh's triangles.
    pub uv_triangles: Vec<[u32; 3]>,
}

impl UvMesh {
    /// Says what is wrong with the mesh or its layout, if anything is.
    pub fn validate(&self) -> std::result::Result<(), String> {
        self.mesh.validate()?;
        let (t, u, n) = (self.mesh.triangles.len(), self.uv_triangles.len(), self.uvs.len());
        if t != u {
            return Err(format!("{t} triangles have {u} triples of texture coordinates"));
        }
        if let Some(i) = self.uvs.iter().position(|c| !c.to_array().iter().all(|v| (0.0..=1.0).contains(v))) {
            return Err(format!("texture coordinate {i} is {}, outside 0..1", self.uvs[i]));
        }
        if let Some(i) = self.uv_triangles.iter().position(|t| t.iter().any(|&k| k as usize >= n)) {
            return Err(format!("triangle {i} names a texture coordinate beyond the {n} there are"));
        }
        Ok(())
    }
}

/// Writes a skin as `.obj` with `v`, `vt` and `f v/vt`, atomically; numbers survive bit for bit.
///
/// # Errors
/// If the mesh is not valid, a texture coordinate lies outside 0..1, or the file cannot be written.
pub fn write_uv_mesh(path: &Path, skin: &UvMesh) -> Result<()> {
    skin.validate().map_err(|e| IoError::new(path, format!("not written: {e}; repair the mesh first")))?;
    let mut out = b"# strandbench skin in mm, +y up, face +z\n".to_vec();
    vertices(&mut out, &skin.mesh.vertices);
    for c in &skin.uvs {
        writeln!(out, "vt {} {}", c.x, c.y).expect("a Vec takes all");
    }
    for (t, u) in skin.mesh.triangles.iter().zip(&skin.uv_triangles) {
        out.push(b'f');
        for (v, c) in t.iter().zip(u) {
            write!(out, " {}/{}", u64::from(*v) + 1, u64::from(*c) + 1).expect("a Vec takes all");
        }
        out.push(b'\n');
    }
    atomic_write(path, |w| w.write_all(&out))
}

/// Reads a skin that [`write_uv_mesh`] wrote, or another `.obj` of triangles with texture coordinates.
///
/// # Errors
/// As [`parse_uv_mesh`], naming the file.
pub fn read_uv_mesh(path: &Path) -> Result<UvMesh> {
    parse_uv_mesh(&read_all(path)?).map_err(|e| e.in_file(path))
}

/// Parses a skin; see [`read_uv_mesh`].
///
/// # Errors
/// With the line: what is no OBJ mesh, a face that is no triangle or has a corner without texture coordinate, a
/// coordinate outside 0..1 or not given before.
pub fn parse_uv_mesh(bytes: &[u8]) -> Parsed<UvMesh> {
    let mesh = parse_obj_mesh(bytes)?;
    let (mut uvs, mut uv_triangles) = (Vec::<Vec2>::new(), Vec::new());
    for (i, line) in bytes.split(|&b| b == b'\n').enumerate() {
        let bad = |fault: String| FormatError::new(format!("line {}", i + 1), fault, REMEDY);
        let mut words = line.split(u8::is_ascii_whitespace).filter(|w| !w.is_empty());
        match words.next() {
            Some(b"vt") => {
                let number = |w: Option<&[u8]>| std::str::from_utf8(w?).ok()?.parse::<f32>().ok();
                let c = [number(words.next()), number(words.next())];
                let [Some(x), Some(y)] = c else { return Err(bad("vt needs two numbers".into())) };
                if !(0.0..=1.0).contains(&x) || !(0.0..=1.0).contains(&y) {
                    return Err(bad(format!("texture coordinate ({x}, {y}) lies outside 0..1")));
                }
                uvs.push(Vec2::new(x, y));
            }
            Some(b"f") => {
                let corner = |w: &[u8]| -> Option<u32> {
                    let digits = w.split(|&b| b == b'/').nth(1)?;
                    let k: u32 = std::str::from_utf8(digits).ok()?.parse().ok()?;
                    (1..=uvs.len() as u32).contains(&k).then(|| k - 1)
                };
                let corners: Option<Vec<u32>> = words.map(corner).collect();
                let Some([a, b, c]) = corners.as_deref() else {
                    let known = uvs.len();
                    return Err(bad(format!(
                        "a face that is no triangle of corners v/vt with the {known} texture coordinates so far"
                    )));
                };
                uv_triangles.push([*a, *b, *c]);
            }
            _ => {}
        }
    }
    let skin = UvMesh { mesh, uvs, uv_triangles };
    skin.validate().map_err(|e| FormatError::new("content", e, REMEDY))?;
    Ok(skin)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    fn skin() -> UvMesh {
        UvMesh {
            mesh: TriMesh {
                vertices: vec![Vec3::ZERO, Vec3::X * 0.1, Vec3::new(1e-7, 2.0, -3.5), Vec3::Z],
                triangles: vec![[0, 1, 2], [2, 1, 3]],
            },
            uvs: vec![Vec2::ZERO, Vec2::new(0.3, 0.1), Vec2::ONE, Vec2::new(0.7, 1.0 / 3.0), Vec2::X],
            uv_triangles: vec![[0, 1, 2], [4, 3, 2]],
        }
    }

    #[test]
    fn a_skin_comes_back_bit_for_bit() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("skin.obj");
        write_uv_mesh(&path, &skin()).unwrap();
        assert_eq!(read_uv_mesh(&path).unwrap(), skin());
        assert_eq!(crate::read_mesh(&path).unwrap(), skin().mesh, "any reader of meshes takes it");
    }

    #[test]
    fn faults_name_their_line() {
        let three = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\n";
        for (rest, line, fault) in [
            ("vt 0\n", "line 5", "two numbers"),
            ("vt 0 nan\n", "line 5", "outside 0..1"),
            ("vt 0 1.01\n", "line 5", "outside 0..1"),
            ("vt 0 0\nf 1/1 2/1 3/2\n", "line 6", "1 texture coordinates so far"),
            ("vt 0 0\nf 1/1 2/1 3/0\n", "line 6", "no triangle"),
            ("vt 0 0\nf 1/1 2/1 3\n", "line 6", "no triangle"),
            ("vt 0 0\nf 1/1 2/1 3/1 4/1\n", "line 6", "no triangle"),
            ("vt 0 0\nf 1/1 2/1 9/1\n", "line 6", "names none of the 4"),
        ] {
            let e = parse_uv_mesh(format!("{three}{rest}").as_bytes()).unwrap_err();
            assert_eq!(e.place, line, "{rest:?}: {e}");
            assert!(e.fault.contains(fault), "{e}");
        }
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("skin.obj");
        let mut bad = skin();
        bad.uvs[1].x = -0.01;
        assert!(write_uv_mesh(&path, &bad).unwrap_err().problem.contains("outside 0..1"));
        let mut bad = skin();
        bad.uv_triangles.pop();
        assert!(write_uv_mesh(&path, &bad).unwrap_err().problem.contains("2 triangles have 1 triples"));
        assert!(!path.exists());
    }
}

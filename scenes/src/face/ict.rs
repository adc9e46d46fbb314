//! Faces of ICT-FaceKit's light model, from its folder of OBJ files.

use super::FaceError;
use glam::Vec3;
use std::path::Path;
use strandbench_io::read_mesh;
use strandbench_types::TriMesh;

/// The model's unit is a centimetre.
const MM: f32 = 10.0;

const NEUTRAL: &str = "generic_neutral_mesh.obj";

/// Shapes over one topology: a neutral face, and what identities and expressions add to it.
#[derive(Clone, Debug, PartialEq)]
pub struct IctFace {
    /// The neutral face, mm, polygons fanned, vertices in the file's order.
    pub neutral: TriMesh,
    /// Displacements (mm) of every vertex by name, in the order asked for.
    pub shapes: Vec<(String, Vec<Vec3>)>,
}

impl IctFace {
    /// Reads the neutral face and the named shapes (`identity000`, `jawOpen`, ...) of a folder that holds an OBJ for
    /// each, as `FaceXModel` does.
    ///
    /// # Errors
    /// [`FaceError::File`] with the file's name: a shape is missing, has another topology than the neutral face, or a
    /// coordinate that is not finite.
    pub fn read(folder: &Path, names: &[&str]) -> Result<IctFace, FaceError> {
        let path = |name: &str| folder.join(name);
        let fault = |name: &str, problem: String| FaceError::File { path: path(name), problem };
        let read = |name: &str| -> Result<TriMesh, FaceError> {
            if !path(name).is_file() {
                let remedy = "missing; fetch the whole folder FaceXModel of ICT-FaceKit";
                return Err(fault(name, remedy.into()));
            }
            let mut mesh = read_mesh(&path(name)).map_err(|e| fault(name, e.problem))?;
            mesh.vertices.iter_mut().for_each(|p| *p *= MM);
            Ok(mesh)
        };
        let neutral = read(NEUTRAL)?;
        let mut shapes = Vec::with_capacity(names.len());
        for name in names {
            let file = format!("{name}.obj");
            let shape = read(&file)?;
            if shape.vertices.len() != neutral.vertices.len() || shape.triangles != neutral.triangles {
                let problem = format!(
                    "{} vertices and {} triangles are not the topology of {NEUTRAL} ({} and {}); take both from one \
                     release",
                    shape.vertices.len(),
                    shape.triangles.len(),
                    neutral.vertices.len(),
                    neutral.triangles.len()
                );
                return Err(fault(&file, problem));
            }
            let deltas = shape.vertices.iter().zip(&neutral.vertices).map(|(a, b)| *a - *b).collect();
            shapes.push(((*name).to_owned(), deltas));
        }
        Ok(IctFace { neutral, shapes })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0.5\nf 1 2 3 4\n";

    #[test]
    fn a_folder_is_read_in_millimetres_and_faults_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
        let fault = |names: &[&str]| IctFace::read(folder.path(), names).unwrap_err().to_string();
        assert!(fault(&[]).contains("generic_neutral_mesh.obj: missing"));
        write(NEUTRAL, SQUARE);
        write("jawOpen.obj", &SQUARE.replace("1 1 0", "1 1.5 0"));
        let face = IctFace::read(folder.path(), &["jawOpen"]).unwrap();
        assert_eq!(face.neutral.vertices[3], Vec3::new(0.0, 10.0, 5.0));
        assert_eq!(face.shapes[0].1, [Vec3::ZERO, Vec3::ZERO, Vec3::new(0.0, 5.0, 0.0), Vec3::ZERO]);
        assert!(fault(&["jawOpen", "jawLeft"]).contains("jawLeft.obj: missing"));
        write("jawLeft.obj", &SQUARE.replace("f 1 2 3 4", "f 1 2 4 3"));
        assert!(fault(&["jawLeft"]).contains("jawLeft.obj: 4 vertices and 2 triangles are not the topology"));
        write("jawLeft.obj", &SQUARE.replace("1 1 0", "1 nan 0"));
        let text = fault(&["jawLeft"]);
        assert!(text.contains("jawLeft.obj") && text.contains("not finite"), "{text}");
        write("jawLeft.obj", &SQUARE[..20]);
        assert!(fault(&["jawLeft"]).contains("jawLeft.obj"));
    }

    #[test]
    fn the_published_folder_is_a_face() {
        let Some(data) = std::env::var_os("STRANDBENCH_DATA") else {
            println!("ignored, no data: set STRANDBENCH_DATA");
            return;
        };
        let folder = Path::new(&data).join("face/ict_facekit/FaceXModel");
        let face = IctFace::read(&folder, &["identity000", "jawOpen"]).unwrap();
        assert_eq!(face.neutral.vertices.len(), 26_719);
        let (low, high) = face.neutral.bounds().unwrap();
        assert!((200.0..500.0).contains(&(high.y - low.y)), "{low} {high}");
        let most = face.shapes[1].1.iter().map(|d| d.length()).fold(0.0, f32::max);
        assert!((10.0..60.0).contains(&most), "a jaw opens by {most} mm");
    }
}

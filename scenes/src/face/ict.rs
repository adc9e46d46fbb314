//! Faces of ICT-FaceKit's light model, from its folder of OBJ files.

use super::FaceError;
use glam::Vec3;
use std::path::Path;
use strandbench_io::{Npz, read_mesh};
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

    /// Reads the neutral face of a folder and all shapes of an archive beside it: `identity` and `expression`, floats of
    /// shape (shapes, vertices, 3) in centimetres that are added to the first vertices of the neutral face, with the
    /// lists `identity_names` and `expression_names`. Vertices beyond those of the archive (eyes, teeth), of which it
    /// knows no shapes, are left out, with their triangles.
    ///
    /// # Errors
    /// [`FaceError::File`] with the file's name: an array is missing, of another shape, not finite, or its face is not
    /// the folder's.
    pub fn read_archive(folder: &Path, archive: &Path) -> Result<IctFace, FaceError> {
        let mut neutral = IctFace::read(folder, &[])?.neutral;
        let vertices = neutral.vertices.len();
        let fault = |problem: String| FaceError::File { path: archive.to_owned(), problem };
        let io = |e: strandbench_io::IoError| FaceError::File { path: e.path.clone(), problem: e.problem };
        let npz = Npz::read(archive).map_err(io)?;
        let vectors = |name: &str| -> Result<(Vec<usize>, Vec<Vec3>), FaceError> {
            let (shape, values) = npz.floats(name).map_err(io)?;
            if shape.last() != Some(&3) {
                return Err(fault(format!("array {name} of shape {shape:?} holds no vectors (.., 3)")));
            }
            if let Some(i) = values.iter().position(|v| !v.is_finite()) {
                return Err(fault(format!("array {name}: value {i} is not finite; write it again")));
            }
            Ok((shape, values.as_chunks().0.iter().map(|v| Vec3::from_array(*v) * MM).collect()))
        };
        let (_, own) = vectors("neutral")?;
        // The files round to a millionth of a centimetre.
        let same =
            own.len() == vertices && own.iter().zip(&neutral.vertices).all(|(a, b)| a.distance(*b) < 1e-3);
        if !same {
            let problem = format!(
                "its neutral face of {} vertices is not that of {NEUTRAL} ({vertices}); take both from one release",
                own.len()
            );
            return Err(fault(problem));
        }
        let mut shapes: Vec<(String, Vec<Vec3>)> = Vec::new();
        for kind in ["identity", "expression"] {
            let names = npz.texts(&format!("{kind}_names")).map_err(io)?;
            let (shape, deltas) = vectors(kind)?;
            let [n, moved, 3] = shape[..] else {
                return Err(fault(format!("array {kind} of shape {shape:?} is not (shapes, vertices, 3)")));
            };
            let agreed = shapes.first().is_none_or(|s| s.1.len() == moved);
            if n != names.len() || moved == 0 || moved > vertices || !agreed {
                let problem = format!(
                    "array {kind} of shape {shape:?} does not fit {} names and {vertices} vertices",
                    names.len()
                );
                return Err(fault(problem));
            }
            shapes.extend(names.into_iter().zip(deltas.chunks_exact(moved).map(<[Vec3]>::to_vec)));
        }
        let kept = shapes.first().map_or(vertices, |s| s.1.len());
        neutral.vertices.truncate(kept);
        neutral.triangles.retain(|t| t.iter().all(|&v| (v as usize) < kept));
        Ok(IctFace { neutral, shapes })
    }

    /// The neutral face with some of the shapes added, by name and weight; expressions need weights in 0..1, identities
    /// about a standard normal number each.
    ///
    /// # Errors
    /// [`FaceError::Unknown`] for a shape that was not read.
    pub fn with<'a>(
        &self,
        weights: impl IntoIterator<Item = (&'a str, f32)>,
    ) -> Result<Vec<Vec3>, FaceError> {
        let mut out = self.neutral.vertices.clone();
        for (name, w) in weights {
            let Some((_, deltas)) = self.shapes.iter().find(|(n, _)| n == name) else {
                let known = self.shapes.iter().map(|s| s.0.as_str()).collect::<Vec<_>>().join(", ");
                return Err(FaceError::Unknown { name: name.to_owned(), known });
            };
            out.iter_mut().zip(deltas).for_each(|(p, d)| *p += *d * w);
        }
        Ok(out)
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

        let archive = folder.parent().unwrap().join("ict_facekit_light_deltas_f32.npz");
        let whole = IctFace::read_archive(&folder, &archive).unwrap();
        assert_eq!((whole.shapes.len(), whole.neutral.vertices.len()), (157, 11_248));
        for (name, deltas) in &face.shapes {
            let (_, packed) = whole.shapes.iter().find(|(n, _)| n == name).expect("a name of the release");
            let off = packed.iter().zip(deltas).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max);
            assert!(off < 1e-3, "{name}: {off} mm between archive and folder");
        }
        let open = whole.with([("jawOpen", 0.5)]).unwrap();
        let moved = open.iter().zip(&face.neutral.vertices).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max);
        assert!((moved / most - 0.5).abs() < 1e-3, "{moved} of {most}");
        assert!(whole.with([("jawShut", 1.0)]).unwrap_err().to_string().contains("jawOpen"));
    }

    #[test]
    fn an_archive_that_does_not_fit_is_named() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join(NEUTRAL), SQUARE).unwrap();
        let archive = folder.path().join("shapes.npz");
        let fault = || IctFace::read_archive(folder.path(), &archive).unwrap_err().to_string();
        assert!(fault().contains("shapes.npz"));
        std::fs::write(&archive, b"PK").unwrap();
        assert!(fault().contains("shapes.npz") && fault().contains("numpy.savez"), "{}", fault());
    }
}

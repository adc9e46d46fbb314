//! How a unitless file is placed in the world, and what an import reports.

use crate::error::{FormatError, Parsed};
use glam::{DMat3, DVec3, Vec3};
use strandbench_types::TriMesh;

/// How strands of a unitless file become millimetres in the world (+y up, face towards +z).
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ImportOptions {
    /// Millimetres per file unit.
    pub scale_mm: f64,
    /// Which axis of the file points up: `x`, `-x`, `y`, `-y`, `z`, `-z`.
    pub up: String,
    /// Which axis of the file the face looks along.
    pub forward: String,
    /// Fibre radius in mm for files that state none, or to replace the file's own.
    pub radius_mm: Option<f32>,
    /// Longest segment after smooth resampling, mm.
    pub max_segment_mm: f32,
    /// Points of every strand, for a `.ply` of bare points that does not say so itself (NeuralHaircut: 100).
    #[serde(default)]
    pub points_per_strand: Option<u32>,
}

impl Default for ImportOptions {
    fn default() -> ImportOptions {
        ImportOptions {
            scale_mm: 1.0,
            up: "y".into(),
            forward: "z".into(),
            radius_mm: Some(0.04),
            max_segment_mm: 5.0,
            points_per_strand: None,
        }
    }
}

/// Names that [`ImportOptions::preset`] knows.
pub const PRESETS: &[&str] = &["yuksel", "yuksel-woman", "usc", "neuralhaircut"];

impl ImportOptions {
    /// Scale and axes of a published collection, or `None` for a name not in [`PRESETS`].
    ///
    /// * `yuksel`: the `.hair` files of cemyuksel.com named after their style (straight.hair, ...): z up, face
    ///   towards +y (the nape's roots lie at -y), unitless; 2.5 mm a unit gives a head of human size.
    /// * `yuksel-woman`: the same author's `w*.hair` set and the head mesh that fits it: z up, face towards
    ///   +x, 2.5 mm a unit.
    /// * `usc`: USC HairSalon `.data`: metres, y up, face towards +z.
    /// * `neuralhaircut`: 100 points a strand, y up; its unit depends on the capture, so 1000 mm is a start only.
    pub fn preset(name: &str) -> Option<ImportOptions> {
        let base = ImportOptions::default();
        Some(match name {
            "yuksel" => ImportOptions { scale_mm: 2.5, up: "z".into(), forward: "y".into(), ..base },
            "yuksel-woman" => ImportOptions { scale_mm: 2.5, up: "z".into(), forward: "x".into(), ..base },
            "usc" => ImportOptions { scale_mm: 1000.0, ..base },
            "neuralhaircut" => ImportOptions { scale_mm: 1000.0, points_per_strand: Some(100), ..base },
            _ => return None,
        })
    }

    /// Checks every option and returns the world-from-file matrix (mm per file unit); its determinant is
    /// positive, so nothing is ever mirrored.
    ///
    /// # Errors
    /// Names the option at fault: an unknown axis, parallel axes, a scale, radius or segment that is not
    /// finite and positive.
    pub fn world_from_file(&self) -> Parsed<DMat3> {
        let option = |name: &str| format!("option {name}");
        if !(self.scale_mm.is_finite() && self.scale_mm > 0.0) {
            return Err(FormatError::new(
                option("scale_mm"),
                format!("{} is not finite and positive", self.scale_mm),
                "give the millimetres of one file unit",
            ));
        }
        for (name, value) in
            [("radius_mm", self.radius_mm.unwrap_or(1.0)), ("max_segment_mm", self.max_segment_mm)]
        {
            if !(value.is_finite() && value > 0.0) {
                return Err(FormatError::new(
                    option(name),
                    format!("{value} is not finite and positive"),
                    "give a length in mm",
                ));
            }
        }
        if self.points_per_strand.is_some_and(|n| n < 2) {
            return Err(FormatError::new(
                option("points_per_strand"),
                "a strand needs two points",
                "give 2 or more, or leave it out",
            ));
        }
        let up = axis("up", &self.up)?;
        let forward = axis("forward", &self.forward)?;
        if up.dot(forward) != 0.0 {
            return Err(FormatError::new(
                option("forward"),
                format!("{} is parallel to up = {}", self.forward, self.up),
                "name two different axes",
            ));
        }
        // World x is y cross z, so that the rows form a right-handed frame.
        let rows = DMat3::from_cols(up.cross(forward), up, forward).transpose();
        Ok(rows * self.scale_mm)
    }
}

fn axis(option: &str, text: &str) -> Parsed<DVec3> {
    Ok(match text {
        "x" | "+x" => DVec3::X,
        "-x" => DVec3::NEG_X,
        "y" | "+y" => DVec3::Y,
        "-y" => DVec3::NEG_Y,
        "z" | "+z" => DVec3::Z,
        "-z" => DVec3::NEG_Z,
        _ => {
            return Err(FormatError::new(
                format!("option {option}"),
                format!("{text:?} is not an axis"),
                "use x, -x, y, -y, z or -z",
            ));
        }
    })
}

/// Applies world-from-file in double precision.
pub(crate) fn place(m: &DMat3, p: Vec3) -> Vec3 {
    (*m * p.as_dvec3()).as_vec3()
}

/// The transform that [`crate::read_strands`] applies, for a mesh in the same file units.
///
/// # Errors
/// If an axis is unknown or the two are parallel, or a vertex is not finite in mm; the error names the option.
pub fn transform_mesh(mesh: &TriMesh, options: &ImportOptions) -> std::result::Result<TriMesh, String> {
    let m = options.world_from_file().map_err(|e| e.to_string())?;
    let vertices: Vec<Vec3> = mesh.vertices.iter().map(|&v| place(&m, v)).collect();
    if let Some(i) = vertices.iter().position(|v| !v.is_finite()) {
        return Err(format!("vertex {i}: not finite after scaling; check option scale_mm"));
    }
    Ok(TriMesh { vertices, triangles: mesh.triangles.clone() })
}

/// Counts of what an import dropped or changed; printed to the user.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ImportReport {
    /// Strands in the file.
    pub strands_in_file: usize,
    /// Points in the file.
    pub points_in_file: usize,
    /// Strands dropped because their length is zero, those of a single point among them.
    pub zero_length_strands: usize,
    /// Repeated points dropped.
    pub repeated_points: usize,
    /// Points after resampling.
    pub points_resampled: usize,
    /// Lowest and highest corner after scaling, mm.
    pub bounds_mm: [[f32; 3]; 2],
    /// File format recognised.
    #[serde(default)]
    pub format: String,
    /// Millimetres per file unit, as applied.
    #[serde(default)]
    pub scale_mm: f64,
    /// Where the fibre radius came from.
    #[serde(default)]
    pub radius: String,
    /// Whatever else the user should know.
    #[serde(default)]
    pub notes: Vec<String>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pair_of_axes_is_a_rotation_that_sends_up_to_y_and_forward_to_z() {
        let axes = ["x", "-x", "y", "-y", "z", "-z"];
        let mut pairs = 0;
        for up in axes {
            for forward in axes {
                let o = ImportOptions {
                    scale_mm: 2.5,
                    up: up.into(),
                    forward: forward.into(),
                    ..Default::default()
                };
                if up.trim_start_matches('-') == forward.trim_start_matches('-') {
                    assert!(o.world_from_file().unwrap_err().to_string().contains("parallel"));
                    continue;
                }
                let m = o.world_from_file().unwrap();
                assert_eq!(m.determinant(), 2.5f64.powi(3));
                assert_eq!(m * axis("up", up).unwrap(), DVec3::Y * 2.5);
                assert_eq!(m * axis("forward", forward).unwrap(), DVec3::Z * 2.5);
                pairs += 1;
            }
        }
        assert_eq!(pairs, 24);
    }

    #[test]
    fn bad_options_are_named() {
        let d = ImportOptions::default;
        let cases = [
            (ImportOptions { scale_mm: f64::NAN, ..d() }, "scale_mm"),
            (ImportOptions { scale_mm: -1.0, ..d() }, "scale_mm"),
            (ImportOptions { radius_mm: Some(0.0), ..d() }, "radius_mm"),
            (ImportOptions { max_segment_mm: f32::INFINITY, ..d() }, "max_segment_mm"),
            (ImportOptions { up: "w".into(), ..d() }, "up"),
            (ImportOptions { forward: String::new(), ..d() }, "forward"),
            (ImportOptions { points_per_strand: Some(1), ..d() }, "points_per_strand"),
        ];
        for (o, name) in cases {
            let e = o.world_from_file().unwrap_err();
            assert_eq!(e.place, format!("option {name}"), "{e}");
        }
    }

    #[test]
    fn presets_are_all_valid_and_serde_refuses_unknown_keys() {
        for name in PRESETS {
            ImportOptions::preset(name).unwrap().world_from_file().unwrap();
        }
        assert!(ImportOptions::preset("nobody").is_none());
        let text = r#"{"scale_mm":1.0,"up":"y","forward":"z","radius_mm":null,"max_segment_mm":2.0}"#;
        let o: ImportOptions = serde_json::from_str(text).unwrap();
        assert_eq!((o.radius_mm, o.points_per_strand), (None, None));
        assert!(serde_json::from_str::<ImportOptions>(&text.replace("\"up\"", "\"Up\"")).is_err());
    }
}

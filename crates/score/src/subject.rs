//! Whatever is scored, brought into one form.

use glam::DVec3;
use strandbench_types::{DepthMap, Estimate, TriMesh, Truth};

/// What stands for the envelope.
pub(crate) enum Surface {
    Absent,
    /// The estimate's mesh.
    Mesh(TriMesh),
    /// The subject's own depth map: its pixels for A2, the mesh between them for A4.
    Depth,
}

/// Maps over the reference view, row-major.
pub(crate) struct Subject {
    pub name: &'static str,
    /// Depth, mm; NaN where absent.
    pub depth: Vec<f32>,
    /// Line in the world, any length; zero where absent.
    pub axis: Vec<DVec3>,
    /// Line in the image, radians; NaN where absent.
    pub line: Vec<f64>,
    /// The filter's confidence in `line`; empty for a subject that has none.
    pub strength: Vec<f64>,
    pub surface: Surface,
}

/// The raw values of a map, NaN where absent.
fn raw(map: &DepthMap) -> Vec<f32> {
    map.raw().data.clone()
}

impl Subject {
    /// The estimate; what it does not say is absent everywhere.
    pub fn method(truth: &Truth, e: &Estimate) -> Subject {
        let pixels = truth.views[0].mask.data.len();
        let (mut line, mut strength) = (vec![f64::NAN; pixels], Vec::new());
        if let Some(o) = &e.orientation {
            strength = vec![0.0; pixels];
            for i in 0..pixels {
                let (re, im) = (f64::from(o.re.data[i]), f64::from(o.im.data[i]));
                strength[i] = re.hypot(im);
                if strength[i] > 0.0 {
                    line[i] = 0.5 * im.atan2(re);
                }
            }
        }
        Subject {
            name: "method",
            depth: e.depth.as_ref().map_or_else(|| vec![f32::NAN; pixels], raw),
            axis: e
                .orientation_3d
                .as_ref()
                .map_or_else(|| vec![DVec3::ZERO; pixels], |o| o.data.iter().map(|v| v.as_dvec3()).collect()),
            line,
            strength,
            surface: e.envelope.clone().map_or(Surface::Absent, Surface::Mesh),
        }
    }

    /// The truth as a submission.
    pub fn truth(truth: &Truth) -> Subject {
        let v = &truth.views[0];
        Subject {
            name: "truth",
            depth: raw(&v.depth_50),
            axis: v.orientation_3d.data.iter().map(|t| t.as_dvec3()).collect(),
            line: v.orientation_2d.data.iter().map(|&a| f64::from(a)).collect(),
            strength: Vec::new(),
            surface: Surface::Depth,
        }
    }
}

//! A face at one moment.

use super::{FaceError, FaceModel, Identity};
use crate::rotation;
use glam::{DMat3, DVec3, Vec3};
use strandbench_types::TriMesh;

/// Where the head turns about, in the neck below the skull, mm.
const PIVOT_MM: DVec3 = DVec3::new(0.0, -110.0, -10.0);

/// Expression and position of the head.
#[derive(Clone, Debug, PartialEq)]
pub struct FacePose {
    /// Weights in 0..1, in the order of [`FaceModel::expressions`].
    pub weights: Vec<f32>,
    /// The head's turn about the neck: axis times angle in radians.
    pub turn: DVec3,
    /// The head's shift against the shoulders, mm.
    pub shift_mm: DVec3,
}

/// A face's vertices at one moment. Vertex and triangle indices are the same for all faces and moments.
#[derive(Clone, Debug, PartialEq)]
pub struct PosedFace {
    /// Positions, mm, indexed by [`FaceModel::triangles`].
    pub vertices: Vec<Vec3>,
    /// Unit normals, area-weighted means of the triangles around.
    pub normals: Vec<Vec3>,
}

impl FaceModel {
    /// Weights of all expressions from those that are named; the others are 0.
    ///
    /// # Errors
    /// [`FaceError::Unknown`] for a name that the face does not have, [`FaceError::Weight`] for a weight that is not
    /// between 0 and 1.
    pub fn weights<'a>(
        &self,
        named: impl IntoIterator<Item = (&'a str, f32)>,
    ) -> Result<Vec<f32>, FaceError> {
        let mut out = vec![0.0; self.expressions().count()];
        for (name, weight) in named {
            let Some(i) = self.expressions().position(|n| n == name) else {
                let known = self.expressions().collect::<Vec<_>>().join(", ");
                return Err(FaceError::Unknown { name: name.to_owned(), known });
            };
            check_weight(name, weight)?;
            out[i] = weight;
        }
        Ok(out)
    }

    /// No expression, the head upright.
    pub fn neutral(&self) -> FacePose {
        let weights = vec![0.0; self.expressions().count()];
        FacePose { weights, turn: DVec3::ZERO, shift_mm: DVec3::ZERO }
    }

    /// This person in this pose.
    ///
    /// # Errors
    /// [`FaceError::Weight`] for a weight that is not between 0 and 1, [`FaceError::Value`] for a number of weights
    /// or control vertices that is not this face's, or a turn beyond half a revolution.
    pub fn pose(&self, identity: &Identity, pose: &FacePose) -> Result<PosedFace, FaceError> {
        let mut control = identity.control.clone();
        let exactly = |key, value: usize, wanted: usize| {
            let (value, wanted) = (value as f64, wanted as f64);
            if value == wanted {
                Ok(())
            } else {
                Err(FaceError::Value { key, value, low: wanted, high: wanted })
            }
        };
        exactly("control vertices", control.len(), self.control_count())?;
        exactly("weights", pose.weights.len(), self.expressions().count())?;
        let angle = pose.turn.length();
        if !(0.0..=std::f64::consts::PI).contains(&angle) {
            return Err(FaceError::Value { key: "turn", value: angle, low: 0.0, high: std::f64::consts::PI });
        }
        let shift = pose.shift_mm.length();
        if !(0.0..=1e3).contains(&shift) {
            return Err(FaceError::Value { key: "shift_mm", value: shift, low: 0.0, high: 1e3 });
        }
        for (target, &w) in self.expression_targets().zip(&pose.weights) {
            check_weight(&target.name, w)?;
            if w != 0.0 {
                for &(i, d) in &target.deltas {
                    control[i as usize] += d * w;
                }
            }
        }
        if angle != 0.0 || shift != 0.0 {
            let whole = rotation(pose.turn);
            for (p, &f) in control.iter_mut().zip(&self.follow) {
                let f = f64::from(f);
                let turn = match f {
                    0.0 => DMat3::IDENTITY,
                    1.0 => whole,
                    _ => rotation(pose.turn * f),
                };
                *p = (turn * (p.as_dvec3() - PIVOT_MM) + PIVOT_MM + pose.shift_mm * f).as_vec3();
            }
        }
        let mesh = TriMesh { vertices: self.refined(&control), triangles: self.triangles().to_vec() };
        Ok(PosedFace { normals: mesh.vertex_normals(), vertices: mesh.vertices })
    }
}

fn check_weight(name: &str, weight: f32) -> Result<(), FaceError> {
    if (0.0..=1.0).contains(&weight) {
        return Ok(());
    }
    Err(FaceError::Weight { name: name.to_owned(), weight })
}

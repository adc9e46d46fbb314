//! Linear models of shapes that share their vertices: mean, orthonormal modes, variances.

use faer::{Mat, Side};
use glam::{DVec3, Vec3};

/// Why there is no model.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PcaError {
    /// Fewer than two shapes are left.
    #[error("a linear model needs two shapes, {0} are left")]
    Few(usize),
    /// A shape has another number of vertices than the first.
    #[error("shape {shape} has {vertices} vertices, the first one has {wanted}")]
    Topology {
        /// Index of the shape.
        shape: usize,
        /// Its vertices.
        vertices: usize,
        /// Those of the first shape, or of the model.
        wanted: usize,
    },
    /// A coordinate is not finite.
    #[error("shape {shape}, vertex {vertex}: a coordinate is not finite")]
    NotFinite {
        /// Index of the shape.
        shape: usize,
        /// The vertex.
        vertex: usize,
    },
    /// The shape to leave out is none.
    #[error("shape {index} cannot be left out of {shapes}")]
    LeftOut {
        /// The index asked for.
        index: usize,
        /// The shapes there are.
        shapes: usize,
    },
    /// The decomposition did not converge.
    #[error("the eigenvalues of {0} shapes did not converge")]
    Diverged(usize),
}

/// Principal components of a set of shapes (mm), from the Gram matrix of the centred shapes: cheap where vertices are
/// many and shapes few.
#[derive(Clone, Debug, PartialEq)]
pub struct Pca {
    /// Mean shape, mm.
    pub mean: Vec<Vec3>,
    /// Orthonormal modes, indexed `[mode][vertex]`, largest variance first.
    pub modes: Vec<Vec<Vec3>>,
    /// Variance along each mode, mm²: sums of squares by the number of shapes less one.
    pub variances: Vec<f64>,
}

/// Modes whose standard deviation is below this share of the first one's are rounding.
const RANK: f64 = 1e-6;

fn dot(a: &[Vec3], b: &[Vec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.as_dvec3().dot(b.as_dvec3())).sum()
}

fn check(shape: &[Vec3], index: usize, wanted: usize) -> Result<(), PcaError> {
    if shape.len() != wanted {
        return Err(PcaError::Topology { shape: index, vertices: shape.len(), wanted });
    }
    match shape.iter().position(|p| !p.is_finite()) {
        Some(vertex) => Err(PcaError::NotFinite { shape: index, vertex }),
        None => Ok(()),
    }
}

impl Pca {
    /// The model of all shapes but one, so that no subject is in its own model; of all where none is left out. Equal
    /// shapes give equal bits on one machine; the decomposition chooses its instructions by the processor.
    ///
    /// # Errors
    /// [`PcaError`]: fewer than two shapes, other vertices, numbers not finite.
    pub fn fit(shapes: &[Vec<Vec3>], left_out: Option<usize>) -> Result<Pca, PcaError> {
        if let Some(index) = left_out.filter(|&i| i >= shapes.len()) {
            return Err(PcaError::LeftOut { index, shapes: shapes.len() });
        }
        let vertices = shapes.first().map_or(0, Vec::len);
        for (i, s) in shapes.iter().enumerate() {
            check(s, i, vertices)?;
        }
        let kept: Vec<&Vec<Vec3>> =
            shapes.iter().enumerate().filter(|(i, _)| Some(*i) != left_out).map(|(_, s)| s).collect();
        let n = kept.len();
        if n < 2 {
            return Err(PcaError::Few(n));
        }
        let mean: Vec<DVec3> =
            (0..vertices).map(|v| kept.iter().map(|s| s[v].as_dvec3()).sum::<DVec3>() / n as f64).collect();
        let centred: Vec<Vec<DVec3>> =
            kept.iter().map(|s| s.iter().zip(&mean).map(|(p, m)| p.as_dvec3() - *m).collect()).collect();
        let gram = Mat::from_fn(n, n, |i, j| {
            let (i, j) = (i.min(j), i.max(j));
            let products = centred[i].iter().zip(&centred[j]).map(|(a, b)| a.dot(*b));
            products.sum::<f64>() / (n - 1) as f64
        });
        let eigen = gram.self_adjoint_eigen(Side::Lower).map_err(|_| PcaError::Diverged(n))?;
        let (values, vectors) = (eigen.S().column_vector(), eigen.U());
        let largest = values[n - 1].max(0.0);
        // n shapes about their mean span n - 1 directions: the smallest value is rounding.
        let (mut modes, mut variances) = (Vec::new(), Vec::new());
        for k in (1..n).rev().filter(|&k| values[k] > largest * RANK * RANK && values[k] > 0.0) {
            let mut mode = vec![DVec3::ZERO; vertices];
            for (i, shape) in centred.iter().enumerate() {
                let w = vectors[(i, k)];
                mode.iter_mut().zip(shape).for_each(|(m, p)| *m += *p * w);
            }
            // Against rounding of weak modes: the part along the stronger ones is taken away, then the length.
            for done in &modes {
                let done: &Vec<Vec3> = done;
                let along: f64 = mode.iter().zip(done).map(|(a, b)| a.dot(b.as_dvec3())).sum();
                mode.iter_mut().zip(done).for_each(|(m, d)| *m -= d.as_dvec3() * along);
            }
            let length = mode.iter().map(|m| m.length_squared()).sum::<f64>().sqrt();
            modes.push(mode.iter().map(|m| (*m / length).as_vec3()).collect());
            variances.push(values[k]);
        }
        Ok(Pca { mean: mean.iter().map(|m| m.as_vec3()).collect(), modes, variances })
    }

    /// Coordinates of a shape along the modes, mm.
    ///
    /// # Errors
    /// [`PcaError`] for other vertices or numbers not finite.
    pub fn project(&self, shape: &[Vec3]) -> Result<Vec<f64>, PcaError> {
        check(shape, 0, self.mean.len())?;
        let centred: Vec<Vec3> = shape.iter().zip(&self.mean).map(|(p, m)| *p - *m).collect();
        Ok(self.modes.iter().map(|m| dot(m, &centred)).collect())
    }

    /// The shape of these coordinates; modes beyond them are left out.
    pub fn reconstruct(&self, coordinates: &[f64]) -> Vec<Vec3> {
        let mut out: Vec<DVec3> = self.mean.iter().map(|m| m.as_dvec3()).collect();
        for (c, mode) in coordinates.iter().zip(&self.modes) {
            out.iter_mut().zip(mode).for_each(|(p, m)| *p += m.as_dvec3() * *c);
        }
        out.iter().map(|p| p.as_vec3()).collect()
    }

    /// Root mean square distance (mm) of a shape's vertices from the nearest shape that the model has.
    ///
    /// # Errors
    /// As [`Pca::project`].
    pub fn error_mm(&self, shape: &[Vec3]) -> Result<f64, PcaError> {
        let near = self.reconstruct(&self.project(shape)?);
        let sum: f64 = shape.iter().zip(&near).map(|(a, b)| f64::from(a.distance_squared(*b))).sum();
        Ok((sum / shape.len().max(1) as f64).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use strandbench_rng::Rng;

    fn shapes(n: u64) -> Vec<Vec<Vec3>> {
        let place = |s: u64, v: u64| {
            let mut r = Rng::keyed(&[s, v]);
            Vec3::new(r.range(-5.0, 5.0), r.range(-5.0, 5.0), r.range(-5.0, 5.0)) + Vec3::splat(v as f32)
        };
        (0..n).map(|s| (0..80).map(|v| place(s, v)).collect()).collect()
    }

    #[test]
    fn modes_are_orthonormal_and_variances_add_up() {
        let all = shapes(9);
        let model = Pca::fit(&all, None).unwrap();
        assert_eq!(model.modes.len(), 8, "nine shapes span eight directions");
        for (i, a) in model.modes.iter().enumerate() {
            for (j, b) in model.modes.iter().enumerate() {
                let want = f64::from(u8::from(i == j));
                // 240 products of floats, whose rounding errors of 6e-8 add up at random.
                assert!((dot(a, b) - want).abs() < 1e-6, "{i} {j}: {}", dot(a, b));
            }
        }
        let total: f64 = (all.iter())
            .map(|s| {
                s.iter().zip(&model.mean).map(|(p, m)| (*p - *m).as_dvec3().length_squared()).sum::<f64>()
            })
            .sum();
        let sum: f64 = model.variances.iter().sum();
        assert!((sum / (total / 8.0) - 1.0).abs() < 1e-6, "{sum} for {}", total / 8.0);
        assert!(model.variances.windows(2).all(|w| w[0] >= w[1]));
    }

    #[test]
    fn a_shape_left_out_is_truly_out() {
        let all = shapes(9);
        let inside = Pca::fit(&all, None).unwrap();
        let outside = Pca::fit(&all, Some(4)).unwrap();
        assert_eq!(outside.modes.len(), 7);
        // Positions reach 90: half a unit of a float there is 4e-6.
        assert!(inside.error_mm(&all[4]).unwrap() < 4e-5);
        assert!(outside.error_mm(&all[4]).unwrap() > 1.0);
        assert!(outside.error_mm(&all[5]).unwrap() < 4e-5);
        let mut other = all.clone();
        other[4] = shapes(10).pop().unwrap();
        assert_eq!(Pca::fit(&other, Some(4)).unwrap(), outside, "what is left out has no part in it");
    }

    #[test]
    fn bad_shapes_are_named() {
        let mut all = shapes(3);
        assert_eq!(Pca::fit(&all[..1], None), Err(PcaError::Few(1)));
        assert_eq!(Pca::fit(&all[..2], Some(0)), Err(PcaError::Few(1)));
        assert_eq!(Pca::fit(&all, Some(3)), Err(PcaError::LeftOut { index: 3, shapes: 3 }));
        all[2][7].y = f32::NAN;
        assert_eq!(Pca::fit(&all, None), Err(PcaError::NotFinite { shape: 2, vertex: 7 }));
        all[2].pop();
        assert_eq!(Pca::fit(&all, None), Err(PcaError::Topology { shape: 2, vertices: 79, wanted: 80 }));
        assert!(Pca::fit(&shapes(3), None).unwrap().project(&all[2]).is_err());
    }
}

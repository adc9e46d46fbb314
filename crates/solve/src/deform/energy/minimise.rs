//! Steps towards the least energy.

use super::{Aim, Deformer, Descent, N, Weights};
use crate::sparse::SparseError;
use glam::{DMat3, DVec3};

const FIRST_DAMPING: f64 = 1e-9;
const LAST_DAMPING: f64 = 1e6;
/// Share of the energy that rounding of its thousands of terms can hide.
const ROUNDING: f64 = 1e-12;

impl Deformer {
    /// Levenberg-Marquardt steps towards fixed aims: at most `steps` systems accepted, fewer once the energy falls
    /// by less than `tolerance` of itself.
    ///
    /// # Errors
    /// If the system stays singular under damping: numbers that are not finite.
    pub fn minimise(
        &mut self,
        aims: &[Option<Aim>],
        w: &Weights,
        steps: usize,
        tolerance: f64,
    ) -> Result<Descent, SparseError> {
        let before = self.energy(aims, w);
        let mut result = Descent { before, after: before, steps: 0 };
        let mut damping = FIRST_DAMPING;
        for _ in 0..steps {
            self.linearise(aims, w);
            let diagonal: Vec<usize> =
                (0..self.gradient.len()).map(|i| self.solver.column_starts()[i]).collect();
            let largest = diagonal.iter().fold(0.0f64, |m, &d| m.max(self.values[d]));
            let undamped: Vec<f64> = diagonal.iter().map(|&d| self.values[d]).collect();
            let state = (self.graph.linear.clone(), self.graph.offset.clone());
            let mut accepted = None;
            while damping < LAST_DAMPING {
                for (&d, &v) in diagonal.iter().zip(&undamped) {
                    self.values[d] = v + damping * (v + largest * 1e-6);
                }
                let mut step: Vec<f64> = self.gradient.iter().map(|g| -g).collect();
                let solved = self.solver.solve(&self.values, &mut step);
                result.steps += 1;
                if solved.is_ok() {
                    // What the linear model promises; below rounding there is nothing left to gain.
                    let promised: f64 = -step.iter().zip(&self.gradient).map(|(d, g)| d * g).sum::<f64>();
                    if promised <= ROUNDING * result.after {
                        return Ok(result);
                    }
                    self.step(&step);
                    let now = self.energy(aims, w);
                    if now <= result.after {
                        accepted = Some(now);
                        damping = (damping * 0.1).max(FIRST_DAMPING);
                        break;
                    }
                    (self.graph.linear, self.graph.offset) = state.clone();
                } else if damping * 10.0 >= LAST_DAMPING {
                    solved?;
                }
                damping *= 10.0;
            }
            let Some(now) = accepted else { break };
            let gain = result.after - now;
            result.after = now;
            if gain <= tolerance * now {
                break;
            }
        }
        Ok(result)
    }

    fn step(&mut self, delta: &[f64]) {
        for (i, d) in delta.chunks_exact(N).enumerate() {
            let column = |c: usize| DVec3::new(d[3 * c], d[3 * c + 1], d[3 * c + 2]);
            self.graph.linear[i] += DMat3::from_cols(column(0), column(1), column(2));
            self.graph.offset[i] += column(3);
        }
    }
}

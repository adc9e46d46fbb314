//! Sparse Cholesky factorisation of symmetric positive definite matrices whose pattern is used many times.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::linalg::cholesky::{
    LltRef, SymbolicCholesky, SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side};

/// Why a sparse system was not solved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum SparseError {
    /// A pivot is not positive.
    #[error(
        "the matrix of {unknowns} unknowns is not positive definite: unknowns that nothing holds, or numbers that are not finite"
    )]
    NotPositiveDefinite {
        /// Rows of the matrix.
        unknowns: usize,
    },
    /// The factor does not fit in memory.
    #[error(
        "factorising a matrix of {unknowns} unknowns takes more memory than there is; use fewer unknowns"
    )]
    Memory {
        /// Rows of the matrix.
        unknowns: usize,
    },
}

/// A symmetric matrix's lower triangle, column by column with rows ascending, the diagonal first; its fill-reducing
/// order and symbolic factor. Works on one thread, so that results do not depend on their number.
pub struct Cholesky {
    column_starts: Vec<usize>,
    rows: Vec<usize>,
    symbolic: SymbolicCholesky<usize>,
    factor: Vec<f64>,
    workspace: MemBuffer,
}

impl Cholesky {
    /// Analyses a pattern. `column_starts` has one entry more than there are columns.
    ///
    /// # Errors
    /// If memory does not suffice.
    ///
    /// # Panics
    /// If the pattern is not of the form that the type describes.
    pub fn new(column_starts: Vec<usize>, rows: Vec<usize>) -> Result<Cholesky, SparseError> {
        let n = column_starts.len() - 1;
        for c in 0..n {
            let column = &rows[column_starts[c]..column_starts[c + 1]];
            assert_eq!(column.first(), Some(&c), "column {c} begins with its diagonal");
        }
        let memory = SparseError::Memory { unknowns: n };
        let pattern = SymbolicSparseColMatRef::new_checked(n, n, &column_starts, None, &rows);
        let symbolic =
            factorize_symbolic_cholesky(pattern, Side::Lower, SymmetricOrdering::Amd, Default::default())
                .map_err(|_| memory)?;
        let scratch = symbolic
            .factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default())
            .or(symbolic.solve_in_place_scratch::<f64>(1, Par::Seq));
        let workspace = MemBuffer::try_new(scratch).map_err(|_| memory)?;
        let mut factor = Vec::new();
        factor.try_reserve_exact(symbolic.len_val()).map_err(|_| memory)?;
        factor.resize(symbolic.len_val(), 0.0);
        Ok(Cholesky { column_starts, rows, symbolic, factor, workspace })
    }

    /// Number of unknowns.
    pub fn unknowns(&self) -> usize {
        self.column_starts.len() - 1
    }

    /// Start of each column's values, and their number as the last entry.
    pub fn column_starts(&self) -> &[usize] {
        &self.column_starts
    }

    /// Row of each value.
    pub fn rows(&self) -> &[usize] {
        &self.rows
    }

    /// Factorises the matrix of these values (in the pattern's order) and replaces `rhs` by the solution.
    ///
    /// # Errors
    /// If a pivot is not positive; `rhs` is then unchanged.
    pub fn solve(&mut self, values: &[f64], rhs: &mut [f64]) -> Result<(), SparseError> {
        let n = self.unknowns();
        assert_eq!((values.len(), rhs.len()), (self.rows.len(), n), "values and right side fit the pattern");
        let not_definite = SparseError::NotPositiveDefinite { unknowns: n };
        if values.iter().chain(rhs.iter()).any(|v| !v.is_finite()) {
            return Err(not_definite);
        }
        let pattern = SymbolicSparseColMatRef::new_checked(n, n, &self.column_starts, None, &self.rows);
        let matrix = SparseColMatRef::new(pattern, values);
        let stack = MemStack::new(&mut self.workspace);
        let factor: LltRef<'_, usize, f64> = self
            .symbolic
            .factorize_numeric_llt(
                &mut self.factor,
                matrix,
                Side::Lower,
                Default::default(),
                Par::Seq,
                stack,
                Default::default(),
            )
            .map_err(|_| not_definite)?;
        let stack = MemStack::new(&mut self.workspace);
        factor.solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(rhs, n, 1),
            Par::Seq,
            stack,
        );
        Ok(())
    }
}

impl std::fmt::Debug for Cholesky {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Cholesky")
            .field("unknowns", &self.unknowns())
            .field("entries", &self.rows.len())
            .field("factor_entries", &self.factor.len())
            .finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solves_a_mesh_laplacian_again_and_again_and_refuses_an_indefinite_one() {
        // A 30x30 grid's Laplacian plus a diagonal; the product with a known vector is the right side.
        let (w, h) = (30, 30);
        let (mut starts, mut rows) = (vec![0], Vec::new());
        for i in 0..w * h {
            rows.push(i);
            if i % w + 1 < w {
                rows.push(i + 1);
            }
            if i / w + 1 < h {
                rows.push(i + w);
            }
            starts.push(rows.len());
        }
        let mut solver = Cholesky::new(starts.clone(), rows.clone()).unwrap();
        for shift in [0.01, 3.0] {
            let x: Vec<f64> = (0..w * h).map(|i| ((i * 37) % 101) as f64 - 50.0).collect();
            let mut values = vec![-1.0; rows.len()];
            let mut b = vec![0.0; w * h];
            for c in 0..w * h {
                values[starts[c]] = 4.0 + shift;
                b[c] += (4.0 + shift) * x[c];
                for k in starts[c] + 1..starts[c + 1] {
                    b[rows[k]] -= x[c];
                    b[c] -= x[rows[k]];
                }
            }
            let error = |got: &[f64]| got.iter().zip(&x).fold(0.0f64, |m, (a, b)| m.max((a - b).abs()));
            let before = b.clone();
            solver.solve(&values, &mut b).unwrap();
            // The condition number is below 8 / (shift + 0.02) < 300, the values below 50.
            assert!(error(&b) < 300.0 * 50.0 * f64::EPSILON, "{}", error(&b));
            values[starts[7]] = -1.0;
            let mut again = before.clone();
            let e = solver.solve(&values, &mut again).unwrap_err();
            assert!(e.to_string().contains("900") && again == before, "{e}");
            values[starts[7]] = f64::NAN;
            assert!(solver.solve(&values, &mut again).is_err());
        }
    }
}

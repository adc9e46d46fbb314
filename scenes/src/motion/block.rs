//! Symmetric positive definite block-tridiagonal systems with blocks of six, in linear time.

pub(super) type Block = [[f64; 6]; 6];
pub(super) type Six = [f64; 6];

/// A system and its factors; kept between solves so that nothing is allocated anew.
#[derive(Default)]
pub(super) struct Chain {
    /// Diagonal blocks; the lower triangles become Cholesky factors.
    pub diagonal: Vec<Block>,
    /// Blocks (j, j + 1); become L_j^-1 E_j.
    pub upper: Vec<Block>,
    /// Right-hand sides; become the solution.
    pub rhs: Vec<Six>,
}

impl Chain {
    /// Makes room for `n` blocks; their contents are to be set.
    pub fn resize(&mut self, n: usize) {
        self.diagonal.resize(n, [[0.0; 6]; 6]);
        self.upper.resize(n, [[0.0; 6]; 6]);
        self.rhs.resize(n, [0.0; 6]);
    }

    /// Solves by block Cholesky factorisation; the solution is in `rhs`. A pivot that rounding has made
    /// non-positive gives a zero row, not a NaN.
    pub fn solve(&mut self) {
        let n = self.rhs.len();
        for j in 0..n {
            if j > 0 {
                let (y, z) = (&self.upper[j - 1], self.rhs[j - 1]);
                let d = &mut self.diagonal[j];
                for row in 0..6 {
                    for column in 0..=row {
                        let mut sum = 0.0;
                        for k in 0..6 {
                            sum += y[k][row] * y[k][column];
                        }
                        d[row][column] -= sum;
                    }
                }
                let b = &mut self.rhs[j];
                for row in 0..6 {
                    let mut sum = 0.0;
                    for k in 0..6 {
                        sum += y[k][row] * z[k];
                    }
                    b[row] -= sum;
                }
            }
            factor(&mut self.diagonal[j]);
            let l = &self.diagonal[j];
            forward(l, &mut self.rhs[j]);
            if j + 1 < n {
                forward_block(l, &mut self.upper[j]);
            }
        }
        for j in (0..n).rev() {
            if j + 1 < n {
                let next = self.rhs[j + 1];
                let y = &self.upper[j];
                for row in 0..6 {
                    let mut sum = 0.0;
                    for k in 0..6 {
                        sum += y[row][k] * next[k];
                    }
                    self.rhs[j][row] -= sum;
                }
            }
            backward(&self.diagonal[j], &mut self.rhs[j]);
        }
    }
}

/// Lower Cholesky factor with the diagonal's reciprocals in its place.
fn factor(m: &mut Block) {
    for j in 0..6 {
        let mut d = m[j][j];
        for k in 0..j {
            d -= m[j][k] * m[j][k];
        }
        let r = if d > 0.0 { 1.0 / d.sqrt() } else { 0.0 };
        m[j][j] = r;
        for i in j + 1..6 {
            let mut s = m[i][j];
            for k in 0..j {
                s -= m[i][k] * m[j][k];
            }
            m[i][j] = s * r;
        }
    }
}

fn forward(l: &Block, b: &mut Six) {
    for i in 0..6 {
        let mut s = b[i];
        for k in 0..i {
            s -= l[i][k] * b[k];
        }
        b[i] = s * l[i][i];
    }
}

fn forward_block(l: &Block, e: &mut Block) {
    for i in 0..6 {
        let mut row = e[i];
        for k in 0..i {
            let (f, above) = (l[i][k], e[k]);
            for c in 0..6 {
                row[c] -= f * above[c];
            }
        }
        for c in 0..6 {
            e[i][c] = row[c] * l[i][i];
        }
    }
}

fn backward(l: &Block, b: &mut Six) {
    for i in (0..6).rev() {
        let mut s = b[i];
        for k in i + 1..6 {
            s -= l[k][i] * b[k];
        }
        b[i] = s * l[i][i];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use strandbench_rng::Rng;

    /// A random J Jᵀ + I with the chain's sparsity, its solution against the product with the matrix.
    #[test]
    fn a_chain_is_solved_to_rounding() {
        let n = 9;
        let mut r = Rng::keyed(&[4]);
        let mut random = || -> Block { std::array::from_fn(|_| std::array::from_fn(|_| r.f64() - 0.5)) };
        let own: Vec<Block> = (0..n).map(|_| random()).collect();
        let next: Vec<Block> = (0..n).map(|_| random()).collect();
        let product = |a: &Block, b: &Block| -> Block {
            std::array::from_fn(|i| std::array::from_fn(|j| (0..6).map(|k| a[i][k] * b[j][k]).sum()))
        };
        // Row j of the Jacobian has `own[j]` at body j and `next[j]` at body j + 1.
        let mut chain = Chain::default();
        chain.resize(n);
        for j in 0..n {
            let (a, b) = (product(&own[j], &own[j]), product(&next[j], &next[j]));
            for i in 0..6 {
                for k in 0..6 {
                    chain.diagonal[j][i][k] = a[i][k] + b[i][k] + if i == k { 1.0 } else { 0.0 };
                }
            }
            if j + 1 < n {
                chain.upper[j] = product(&next[j], &own[j + 1]);
            }
            chain.rhs[j] = std::array::from_fn(|k| (j * 6 + k) as f64 * 0.1 - 2.0);
        }
        let (d, e, b) = (chain.diagonal.clone(), chain.upper.clone(), chain.rhs.clone());
        chain.solve();
        let x = &chain.rhs;
        for j in 0..n {
            for i in 0..6 {
                let mut got: f64 = (0..6).map(|k| d[j][i][k] * x[j][k]).sum();
                if j + 1 < n {
                    got += (0..6).map(|k| e[j][i][k] * x[j + 1][k]).sum::<f64>();
                }
                if j > 0 {
                    got += (0..6).map(|k| e[j - 1][k][i] * x[j - 1][k]).sum::<f64>();
                }
                // Condition below 100, 54 unknowns of size below 10.
                assert!((got - b[j][i]).abs() < 1e-11, "block {j} row {i}: {got} for {}", b[j][i]);
            }
        }
    }
}

//! Evidence of a linear model under Gaussian priors, from inner products alone.
//!
//! ```text
//! y = X theta + e,  e ~ N(0, 1/beta),  theta_k ~ N(0, s_k^2),  D = diag(s),  A = 1 + beta D G D,  G = X'X,  b = X'y
//! ln Z = -beta/2 y'y - 1/2 ln det A + 1/2 beta^2 b'D A^-1 D b + const        E[theta] = beta D A^-1 D b
//! ```
//! `beta < 1` tempers the likelihood: a model of a flight is never right to the last bit, and the error of a wrong one does
//! not average away like noise.

use nalgebra::{Cholesky, DMatrix, DVector};

/// Tempering of the likelihood.
pub(crate) const BETA: f64 = 0.3;

/// Inner products of whitened columns and of a whitened residual.
#[derive(Debug, Clone)]
pub(crate) struct Gram {
    pub(crate) g: DMatrix<f64>,
    pub(crate) b: DVector<f64>,
    pub(crate) yy: f64,
}

/// What a model says of its parameters.
pub(crate) struct Posterior {
    /// Logarithm of the evidence up to a constant of the data, nats.
    pub(crate) log_evidence: f64,
    pub(crate) mean: DVector<f64>,
    factor: Cholesky<f64, nalgebra::Dyn>,
    sd: DVector<f64>,
}

/// Inner product over as many rows as both have: a column without rows is one of zeros.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    if a.is_empty() || b.is_empty() {
        return 0.0;
    }
    // Four sums side by side let the compiler use wide registers; their order is fixed.
    let mut sums = [0.0; 8];
    let (a8, b8) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest: f64 = a8.remainder().iter().zip(b8.remainder()).map(|(x, y)| x * y).sum();
    for (x, y) in a8.zip(b8) {
        for i in 0..8 {
            sums[i] += x[i] * y[i];
        }
    }
    sums.iter().sum::<f64>() + rest
}

impl Gram {
    pub(crate) fn new(columns: &[Vec<f64>], y: &[f64]) -> Self {
        let n = columns.len();
        let mut g = DMatrix::zeros(n, n);
        for i in 0..n {
            for j in 0..=i {
                let x = dot(&columns[i], &columns[j]);
                g[(i, j)] = x;
                g[(j, i)] = x;
            }
        }
        let b = DVector::from_iterator(n, columns.iter().map(|c| dot(c, y)));
        Self { g, b, yy: dot(y, y) }
    }

    /// The posterior under prior deviations; a deviation of 0 leaves a parameter out.
    pub(crate) fn posterior(&self, sd: &[f64], beta: f64) -> Option<Posterior> {
        let n = sd.len();
        let sd = DVector::from_column_slice(sd);
        let mut a = DMatrix::identity(n, n);
        for i in 0..n {
            for j in 0..n {
                a[(i, j)] += beta * sd[i] * self.g[(i, j)] * sd[j];
            }
        }
        let factor = a.cholesky()?;
        let scaled = sd.component_mul(&self.b) * beta;
        let solved = factor.solve(&scaled);
        let log_det: f64 = factor.l_dirty().diagonal().iter().map(|x| x.ln()).sum::<f64>() * 2.0;
        Some(Posterior {
            log_evidence: -0.5 * beta * self.yy - 0.5 * log_det + 0.5 * scaled.dot(&solved),
            mean: sd.component_mul(&solved),
            factor,
            sd,
        })
    }
}

impl Posterior {
    /// Posterior variance of one parameter: `s_i^2 |L^-1 e_i|^2` where `A = L L'`.
    pub(crate) fn variance(&self, i: usize) -> f64 {
        let mut column = DVector::zeros(self.sd.len());
        column[i] = 1.0;
        // The factor of a positive definite matrix has no zero on its diagonal.
        self.factor.l_dirty().solve_lower_triangular_unchecked_mut(&mut column);
        self.sd[i] * self.sd[i] * column.norm_squared()
    }
}

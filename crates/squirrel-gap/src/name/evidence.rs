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

/// Rows that are taken at a time, so that a piece of every column stays in the cache.
const PIECE: usize = 512;
/// Columns and rows that are multiplied side by side.
const WIDE: usize = 4;

/// Inner products of a column with others; a column without rows is one of zeros.
pub(crate) fn products(column: &[f64], others: &[&[f64]]) -> Vec<f64> {
    let mut out = vec![0.0; others.len()];
    for start in (0..column.len()).step_by(PIECE) {
        add_products(&mut out, column, others, start);
    }
    out
}

/// Adds the part of one piece of the rows.
fn add_products(out: &mut [f64], column: &[f64], others: &[&[f64]], start: usize) {
    let piece = |x: &'_ [f64]| -> std::ops::Range<usize> { start.min(x.len())..(start + PIECE).min(x.len()) };
    let a = &column[piece(column)];
    for (out, others) in out.chunks_mut(WIDE).zip(others.chunks(WIDE)) {
        // What is missing of the last few, or has no rows, is multiplied by its own column and forgotten.
        let mut b = [a; WIDE];
        for (b, other) in b.iter_mut().zip(others).filter(|(_, other)| !other.is_empty()) {
            *b = &other[piece(other)];
        }
        for ((out, other), x) in out.iter_mut().zip(others).zip(side_by_side(a, b)) {
            if !other.is_empty() {
                *out += x;
            }
        }
    }
}

/// Inner products of one series with four; the order of the sums is fixed.
fn side_by_side(a: &[f64], b: [&[f64]; WIDE]) -> [f64; WIDE] {
    let mut sums = [[0.0; WIDE]; WIDE];
    let whole = a.len() / WIDE * WIDE;
    let b = b.map(|b| &b[..a.len()]);
    for row in (0..whole).step_by(WIDE) {
        for (sums, b) in sums.iter_mut().zip(b) {
            for lane in 0..WIDE {
                sums[lane] += a[row + lane] * b[row + lane];
            }
        }
    }
    let mut out = sums.map(|lanes| lanes.iter().sum());
    for (out, b) in out.iter_mut().zip(b) {
        *out += a[whole..].iter().zip(&b[whole..]).map(|(a, b)| a * b).sum::<f64>();
    }
    out
}

impl Gram {
    pub(crate) fn new(columns: &[Vec<f64>], y: &[f64]) -> Self {
        let columns: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
        let n = columns.len();
        let mut lower: Vec<Vec<f64>> = (0..n).map(|i| vec![0.0; i + 1]).collect();
        for start in (0..y.len()).step_by(PIECE) {
            for (i, (row, column)) in lower.iter_mut().zip(&columns).enumerate() {
                if !column.is_empty() {
                    add_products(row, column, &columns[..=i], start);
                }
            }
        }
        let g = DMatrix::from_fn(n, n, |i, j| lower[i.max(j)][i.min(j)]);
        Self { g, b: DVector::from_vec(products(y, &columns)), yy: products(y, &[y])[0] }
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

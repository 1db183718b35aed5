//! Evidence of a linear model under Gaussian priors, from inner products alone.
//!
//! ```text
//! y = X theta + e,  e ~ N(0, 1/beta),  theta_k ~ N(0, s_k^2),  D = diag(s),  A = 1 + beta D G D,  G = X'X,  b = X'y
//! ln Z = -beta/2 y'y - 1/2 ln det A + 1/2 beta^2 b'D A^-1 D b + const        E[theta] = beta D A^-1 D b
//! ```
//! `beta < 1` tempers the likelihood: a model of a flight is never right to the last bit, and the error of a wrong one does
//! not average away like noise.

use nalgebra::{Cholesky, DMatrix, DVector};
use squirrel_sim::batch::simd::{BLOCK, Kernel, Lanes, Path, Paths};

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
/// Columns that one column is multiplied with side by side.
const WIDE: usize = 4;

/// Inner products of columns with others, a row each; a column without rows is one of zeros.
pub(crate) fn products(columns: &[&[f64]], others: &[&[f64]]) -> DMatrix<f64> {
    let out = DMatrix::zeros(columns.len(), others.len());
    f64::run(Path::best(), Products { columns, others, lower: false, out })
}

/// Inner products on the registers of the processor. The order of the sums is that of [`BLOCK`] on all of them.
struct Products<'a> {
    columns: &'a [&'a [f64]],
    others: &'a [&'a [f64]],
    /// The two are the same, and what is above the diagonal is not asked for.
    lower: bool,
    out: DMatrix<f64>,
}

impl Kernel<f64> for Products<'_> {
    type Output = DMatrix<f64>;

    #[inline(always)]
    fn run<L: Lanes<Weight = f64>>(self) -> DMatrix<f64> {
        let Self { columns, others, lower, mut out } = self;
        let rows = columns.iter().map(|column| column.len()).max().unwrap_or_default();
        for start in (0..rows).step_by(PIECE) {
            let piece = start..(start + PIECE).min(rows);
            for (i, column) in columns.iter().enumerate().filter(|(_, column)| !column.is_empty()) {
                let a = &column[piece.clone()];
                let end = if lower { i + 1 } else { others.len() };
                for first in (0..end).step_by(WIDE) {
                    // What is missing of the last few, or has no rows, is multiplied by its own column and forgotten.
                    let of = |j: usize| others[..end].get(first + j).filter(|other| !other.is_empty());
                    let b = [0, 1, 2, 3].map(|j| of(j).map_or(a, |other| &other[piece.clone()]));
                    for (j, sum) in side_by_side::<L>(a, b).into_iter().enumerate() {
                        if of(j).is_some() {
                            out[(i, first + j)] += sum;
                        }
                    }
                }
            }
        }
        out
    }
}

/// Inner products of one series with four.
#[inline(always)]
fn side_by_side<L: Lanes<Weight = f64>>(a: &[f64], b: [&[f64]; WIDE]) -> [f64; WIDE] {
    // A register holds fewer numbers than a block of some path has; each has its own sum.
    let registers = BLOCK / L::WIDTH;
    let mut sums = [[L::zero(); BLOCK]; WIDE];
    let whole = a.len() / BLOCK * BLOCK;
    let b = b.map(|b| &b[..a.len()]);
    for row in (0..whole).step_by(BLOCK) {
        for register in 0..registers {
            let at = row + register * L::WIDTH;
            let x = L::load(&a[at..]);
            for (sums, b) in sums.iter_mut().zip(b) {
                sums[register] = sums[register] + x * L::load(&b[at..]);
            }
        }
    }
    let mut out = [0.0; WIDE];
    for ((out, sums), b) in out.iter_mut().zip(sums).zip(b) {
        let mut lanes = [0.0; BLOCK];
        for (lanes, sum) in lanes.chunks_exact_mut(L::WIDTH).zip(sums) {
            sum.store(lanes);
        }
        *out =
            lanes.iter().sum::<f64>() + a[whole..].iter().zip(&b[whole..]).map(|(a, b)| a * b).sum::<f64>();
    }
    out
}

/// Inner products of columns with each other.
pub(crate) fn inner(columns: &[&[f64]]) -> DMatrix<f64> {
    let n = columns.len();
    let out = DMatrix::zeros(n, n);
    let mut g = f64::run(Path::best(), Products { columns, others: columns, lower: true, out });
    g.fill_upper_triangle_with_lower_triangle();
    g
}

impl Gram {
    pub(crate) fn new(columns: &[Vec<f64>], y: &[f64]) -> Self {
        let columns: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
        let with_y = products(&[y], &[columns.as_slice(), &[y]].concat());
        let (b, yy) = (with_y.columns(0, columns.len()).transpose(), with_y[(0, columns.len())]);
        Self { g: inner(&columns), b: DVector::from_column_slice(b.as_slice()), yy }
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

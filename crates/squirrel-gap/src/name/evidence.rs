//! Evidence of a linear model under Gaussian priors, from inner products alone.
//!
//! ```text
//! y = X theta + e,  e ~ N(0, 1/beta),  theta_k ~ N(0, s_k^2),  D = diag(s),  A = 1 + beta D G D,  G = X'X,  b = X'y
//! ln Z = -beta/2 y'y - 1/2 ln det A + 1/2 beta^2 b'D A^-1 D b + const        E[theta] = beta D A^-1 D b
//! ```
//! `beta < 1` tempers the likelihood: a model of a flight is never right to the last bit, and the
//! error of a wrong one does not average away like noise.

use super::column::Column;
use super::factor::Factor;
use nalgebra::{DMatrix, DVector};
use squirrel_sim::simd::{BLOCK, Kernel, Path, Paths, Register};
use std::borrow::Cow;

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
    factor: Factor,
    sd: DVector<f64>,
    beta: f64,
    /// Where in the factor each parameter is; one that is left out is not.
    places: Vec<Option<usize>>,
}

/// Rows that are taken at a time, so that a piece of every column stays in the cache.
const PIECE: usize = 512;
/// Columns that one column is multiplied with side by side.
const WIDE: usize = 4;

/// Inner products of columns with others, a row each; a column without rows is one of zeros.
pub(crate) fn products(columns: &[&Column], others: &[&Column]) -> DMatrix<f64> {
    let out = DMatrix::zeros(columns.len(), others.len());
    f64::run(Path::best(), Products { columns, others, lower: false, out })
}

/// Inner products on the registers of the processor. The order of the sums is that of [`BLOCK`] on
/// all of them.
struct Products<'a> {
    columns: &'a [&'a Column],
    others: &'a [&'a Column],
    /// The two are the same, and what is above the diagonal is not asked for.
    lower: bool,
    out: DMatrix<f64>,
}

impl Kernel<f64> for Products<'_> {
    type Output = DMatrix<f64>;

    #[inline(always)]
    fn run<L: Register<Element = f64>>(self) -> DMatrix<f64> {
        let Self { columns, others, lower, mut out } = self;
        let rows = columns.iter().map(|column| column.rows()).max().unwrap_or_default();
        // A column of one flight is zero in all others, and zeros add nothing.
        for start in (0..rows).step_by(PIECE) {
            let piece = start..(start + PIECE).min(rows);
            let acts = |column: &Column| {
                let span = column.span();
                span.start < piece.end && piece.start < span.end
            };
            let acting: Vec<usize> = (0..others.len()).filter(|j| acts(others[*j])).collect();
            let theirs: Vec<Cow<'_, [f64]>> =
                acting.iter().map(|j| others[*j].piece(piece.clone())).collect();
            for (i, column) in columns.iter().enumerate().filter(|(_, column)| acts(column)) {
                let own = column.piece(piece.clone());
                let a = &*own;
                let end = if lower { acting.partition_point(|j| *j <= i) } else { acting.len() };
                for (some, b) in acting[..end].chunks(WIDE).zip(theirs.chunks(WIDE)) {
                    // What is missing of the last few is multiplied by its own column and
                    // forgotten.
                    let b = [0, 1, 2, 3].map(|j| b.get(j).map_or(a, |b| &**b));
                    for (j, sum) in some.iter().zip(side_by_side::<L>(a, b)) {
                        out[(i, *j)] += sum;
                    }
                }
            }
        }
        out
    }
}

/// Inner products of one series with four.
#[inline(always)]
fn side_by_side<L: Register<Element = f64>>(a: &[f64], b: [&[f64]; WIDE]) -> [f64; WIDE] {
    // A register holds fewer numbers than a block of some path has; each has its own sum.
    let registers = BLOCK / L::WIDTH;
    let mut sums = [[L::of(0.0); BLOCK]; WIDE];
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
        *out = lanes.iter().sum::<f64>()
            + a[whole..].iter().zip(&b[whole..]).map(|(a, b)| a * b).sum::<f64>();
    }
    out
}

/// Inner products of columns with each other.
pub(crate) fn inner(columns: &[&Column]) -> DMatrix<f64> {
    let n = columns.len();
    let out = DMatrix::zeros(n, n);
    let mut g = f64::run(Path::best(), Products { columns, others: columns, lower: true, out });
    g.fill_upper_triangle_with_lower_triangle();
    g
}

impl Gram {
    pub(crate) fn new(columns: &[Column], y: &Column) -> Self {
        let columns: Vec<&Column> = columns.iter().collect();
        let with_y = products(&[y], &[columns.as_slice(), &[y]].concat());
        let (b, yy) = (with_y.columns(0, columns.len()).transpose(), with_y[(0, columns.len())]);
        Self { g: inner(&columns), b: DVector::from_column_slice(b.as_slice()), yy }
    }

    /// The posterior under prior deviations; a deviation of 0 leaves a parameter out.
    pub(crate) fn posterior(&self, sd: &[f64], beta: f64) -> Option<Posterior> {
        let sd = DVector::from_column_slice(sd);
        // The last first: what is of one flight alone begins a block of the factor, and what all
        // share stands below the blocks.
        let order: Vec<usize> = (0..sd.len()).rev().filter(|i| sd[*i] != 0.0).collect();
        let mut places = vec![None; sd.len()];
        for (place, i) in order.iter().enumerate() {
            places[*i] = Some(place);
        }
        let factor = Factor::new(order.len(), |row, column| {
            let (i, j) = (order[row], order[column]);
            f64::from(u8::from(i == j)) + beta * sd[i] * self.g[(i, j)] * sd[j]
        })?;
        let scaled =
            DVector::from_iterator(order.len(), order.iter().map(|i| sd[*i] * self.b[*i] * beta));
        let solved = factor.solve(&scaled);
        let mut mean = DVector::zeros(sd.len());
        for (i, x) in order.iter().zip(solved.iter()) {
            mean[*i] = sd[*i] * x;
        }
        Some(Posterior {
            log_evidence: -0.5 * beta * self.yy - 0.5 * factor.log_determinant()
                + 0.5 * scaled.dot(&solved),
            mean,
            factor,
            sd,
            beta,
            places,
        })
    }
}

impl Posterior {
    /// What the same priors make of another measurement: `E[theta] = beta D A^-1 D b`.
    ///
    /// * `b` - its inner products with the columns
    pub(crate) fn mean_of(&self, b: &DVector<f64>) -> DVector<f64> {
        let mut scaled = DVector::zeros(self.places.iter().flatten().count());
        let held = self.places.iter().enumerate().filter_map(|(i, place)| Some((i, (*place)?)));
        for (i, place) in held.clone() {
            scaled[place] = self.sd[i] * b[i] * self.beta;
        }
        let solved = self.factor.solve(&scaled);
        let mut mean = DVector::zeros(self.sd.len());
        for (i, place) in held {
            mean[i] = self.sd[i] * solved[place];
        }
        mean
    }

    /// What of the log evidence no measurement changes: `-1/2 ln det A`, nats.
    pub(crate) fn log_volume(&self) -> f64 {
        -0.5 * self.factor.log_determinant()
    }

    /// Posterior variance of one parameter: `s_i^2 |L^-1 e_i|^2` where `A = L L'`.
    pub(crate) fn variance(&self, i: usize) -> f64 {
        self.places[i]
            .map_or(0.0, |place| self.sd[i] * self.sd[i] * self.factor.inverse_diagonal(place))
    }
}

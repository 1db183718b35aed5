//! Cholesky factor of a matrix of blocks: the numbers of one flight are coupled with its own and
//! with what all flights share.
//!
//! `A = L L'`. A row of `L` is zero until the first number that is not zero in the same row of `A`,
//! so that with the flights' numbers first only their blocks and what is shared are computed: time
//! goes with the number of flights, not with its cube.

use nalgebra::DVector;

/// Sums that run side by side.
const LANES: usize = 8;

/// The factor of a positive definite matrix.
pub(crate) struct Factor {
    /// `L`, row after row.
    rows: Vec<f64>,
    /// First number of each row that is not zero.
    first: Vec<usize>,
}

impl Factor {
    /// Factor of a matrix of which `a(row, column)` is below or on the diagonal; `None` where it is
    /// not positive definite.
    pub(crate) fn new(n: usize, a: impl Fn(usize, usize) -> f64) -> Option<Self> {
        let mut rows = vec![0.0; n * n];
        let mut first = Vec::with_capacity(n);
        for i in 0..n {
            let start = (0..i).find(|j| a(i, *j) != 0.0).unwrap_or(i);
            first.push(start);
            let (done, rest) = rows.split_at_mut(i * n);
            let own = &mut rest[..n];
            for j in start..i {
                let from = start.max(first[j]);
                let other = &done[j * n..(j + 1) * n];
                own[j] = (a(i, j) - dot(&own[from..j], &other[from..j])) / other[j];
            }
            let left = a(i, i) - dot(&own[start..i], &own[start..i]);
            if !(left > 0.0 && left.is_finite()) {
                return None;
            }
            own[i] = left.sqrt();
        }
        Some(Self { rows, first })
    }

    fn row(&self, i: usize) -> &[f64] {
        let n = self.first.len();
        &self.rows[i * n..(i + 1) * n]
    }

    /// `ln det A`.
    pub(crate) fn log_determinant(&self) -> f64 {
        2.0 * (0..self.first.len()).map(|i| self.row(i)[i].ln()).sum::<f64>()
    }

    /// `A^-1 b`.
    pub(crate) fn solve(&self, b: &DVector<f64>) -> DVector<f64> {
        let mut x = b.clone();
        self.forward(0, x.as_mut_slice());
        for i in (0..x.len()).rev() {
            let (row, start) = (self.row(i), self.first[i]);
            x[i] /= row[i];
            let own = x[i];
            for (x, l) in x.as_mut_slice()[start..i].iter_mut().zip(&row[start..i]) {
                *x -= l * own;
            }
        }
        x
    }

    /// A number on the diagonal of `A^-1`, that is `|L^-1 e_i|^2`.
    pub(crate) fn inverse_diagonal(&self, i: usize) -> f64 {
        let mut x = vec![0.0; self.first.len()];
        x[i] = 1.0;
        self.forward(i, &mut x);
        dot(&x[i..], &x[i..])
    }

    /// `L^-1 x`, where `x` is zero up to a place.
    fn forward(&self, from: usize, x: &mut [f64]) {
        for i in from..x.len() {
            let (row, start) = (self.row(i), self.first[i].max(from));
            x[i] =
                (x[i] - if start < i { dot(&row[start..i], &x[start..i]) } else { 0.0 }) / row[i];
        }
    }
}

/// Inner product, in sums that run side by side.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let (a, b) = (a.chunks_exact(LANES), b.chunks_exact(LANES));
    let rest: f64 = a.remainder().iter().zip(b.remainder()).map(|(a, b)| a * b).sum();
    let mut sums = [0.0; LANES];
    for (a, b) in a.zip(b) {
        for (sum, (a, b)) in sums.iter_mut().zip(a.iter().zip(b)) {
            *sum += a * b;
        }
    }
    sums.iter().sum::<f64>() + rest
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DMatrix;

    /// Three blocks of two and two shared numbers: as a dense factor has it, and zero where no
    /// block is.
    #[test]
    fn blocks_are_factored_as_the_whole() {
        let n = 8;
        let root = DMatrix::from_fn(n, n, |i, j| {
            if i < 6 && i / 2 != j / 2 { 0.0 } else { ((3 * i + 5 * j) % 7) as f64 - 2.5 }
        });
        let a = &root * root.transpose() + DMatrix::identity(n, n);
        let factor = Factor::new(n, |i, j| a[(i, j)]).unwrap();
        assert_eq!(factor.first, [0, 0, 2, 2, 4, 4, 0, 0]);
        let dense = a.clone().cholesky().unwrap();
        let b = DVector::from_fn(n, |i, _| i as f64 - 3.0);
        assert!((factor.solve(&b) - dense.solve(&b)).amax() < 1e-12);
        assert!((factor.log_determinant() - a.determinant().ln()).abs() < 1e-12);
        let inverse = dense.inverse();
        assert!((0..n).all(|i| (factor.inverse_diagonal(i) - inverse[(i, i)]).abs() < 1e-12));
        assert!(Factor::new(n, |i, j| -a[(i, j)]).is_none());
    }
}

//! Intervals that stay honest when the residual is not white: a sandwich over blocks of 5 s.
//!
//! ```text
//! A = beta G + D^-2     Var(theta) = A^-1 (beta^2 sum_blocks g g' + D^-2) A^-1     g = X_block' e_block
//! ```

use super::evidence::BETA;
use super::linear::Linear;
use super::refine::Scored;
use crate::predictor::Predictor;
use nalgebra::{DMatrix, DVector};
use std::collections::BTreeMap;

/// Length of a block, s.
const BLOCK_S: f64 = 5.0;

/// Standard deviations of the free numbers of a set, in its order.
pub(super) fn deviations(predictor: &Predictor, linear: &Linear, set: &Scored) -> Vec<f64> {
    let k = set.free.len();
    let columns = set.columns(linear);
    let live: Vec<usize> = (0..columns.len()).filter(|i| set.prior[*i] > 0.0).collect();
    let mut left = set.y.clone();
    for &i in &live {
        let x = set.posterior.mean[i];
        for (value, c) in left.iter_mut().zip(columns[i]) {
            *value -= c * x;
        }
    }
    let mut blocks: BTreeMap<(usize, i64), DVector<f64>> = BTreeMap::new();
    for (row, (flight, time_s, _)) in linear.whitener.places(&predictor.segments).into_iter().enumerate() {
        let block = (flight, (time_s / BLOCK_S).floor() as i64);
        let sum = blocks.entry(block).or_insert_with(|| DVector::zeros(live.len()));
        for (slot, &i) in live.iter().enumerate() {
            sum[slot] += columns[i].get(row).map_or(0.0, |c| c * left[row]);
        }
    }
    let n = live.len();
    let mut bread = DMatrix::zeros(n, n);
    let mut meat = DMatrix::zeros(n, n);
    for (a, &i) in live.iter().enumerate() {
        for (b, &j) in live.iter().enumerate() {
            bread[(a, b)] = BETA * set.gram.g[(i, j)];
        }
        let precision = 1.0 / (set.prior[i] * set.prior[i]);
        bread[(a, a)] += precision;
        meat[(a, a)] += precision;
    }
    for g in blocks.values() {
        meat += g * g.transpose() * (BETA * BETA);
    }
    let Some(inverse) = bread.cholesky().map(|c| c.inverse()) else { return vec![f64::INFINITY; k] };
    let covariance = &inverse * meat * &inverse;
    (0..k)
        .map(|i| live.iter().position(|j| *j == i).map_or(f64::INFINITY, |at| covariance[(at, at)].sqrt()))
        .collect()
}

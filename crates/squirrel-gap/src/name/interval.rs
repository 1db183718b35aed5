//! Intervals that stay honest when the residual is not white: a sandwich over blocks of 5 s.
//!
//! ```text
//! A = beta G + D^-2     Var(theta) = A^-1 (beta^2 M + D^-2) A^-1     M = sum_blocks g g'     g = X_block' e_block
//! ```
//! Where few blocks show a number, the fit has made their sums small, and `M = G`, that of white
//! noise, is the larger one: the wider of the two is taken. To it comes what no flight tells: how
//! far the number that an effect adds to is off by itself, and how true the model is.

use super::evidence::BETA;
use super::linear::Linear;
use super::refine::Scored;
use super::search::Search;
use crate::predictor::Predictor;
use nalgebra::{DMatrix, DVector};
use std::collections::BTreeMap;

/// Length of a block, s.
const BLOCK_S: f64 = 5.0;
/// Part of its value to which a number can be known: a model of a flight is no truer.
const MODEL: f64 = 0.005;

/// Standard deviations of the free numbers of a set, in its order.
pub(super) fn deviations(search: &Search<'_>, linear: &Linear, set: &Scored) -> Vec<f64> {
    let mut all = of_flights(search.predictor, linear, set);
    for (sd, (member, slot)) in all.iter_mut().zip(&set.free) {
        let member = &set.members[*member];
        *sd = sd.hypot(search.catalogue.spread(member, *slot)).hypot(MODEL * member.values[*slot]);
    }
    all
}

/// What the flights tell of them.
fn of_flights(predictor: &Predictor, linear: &Linear, set: &Scored) -> Vec<f64> {
    let k = set.free.len();
    let columns = set.columns(linear);
    let live: Vec<usize> = (0..columns.len()).filter(|i| set.prior[*i] > 0.0).collect();
    let mut left = set.y.piece(0..set.y.rows()).into_owned();
    for &i in &live {
        columns[i].take_scaled_from(&mut left, set.posterior.mean[i]);
    }
    let places = linear.whitener.places(&predictor.segments);
    let block_of = |row: usize| {
        let (flight, time_s, _) = places[row];
        (flight, (time_s / BLOCK_S).floor() as i64)
    };
    let mut blocks: BTreeMap<(usize, i64), DVector<f64>> = BTreeMap::new();
    for row in 0..places.len() {
        blocks.entry(block_of(row)).or_insert_with(|| DVector::zeros(live.len()));
    }
    for (slot, &i) in live.iter().enumerate() {
        for (row, c) in columns[i].kept() {
            if let Some(sum) = blocks.get_mut(&block_of(row)) {
                sum[slot] += c * left[row];
            }
        }
    }
    let n = live.len();
    let gram = DMatrix::from_fn(n, n, |a, b| set.gram.g[(live[a], live[b])]);
    let precision =
        DMatrix::from_diagonal(&DVector::from_fn(n, |a, _| set.prior[live[a]].powi(-2)));
    let sums = blocks.values().fold(DMatrix::zeros(n, n), |sums, g| sums + g * g.transpose());
    let bread = BETA * &gram + &precision;
    let Some(inverse) = bread.cholesky().map(|c| c.inverse()) else {
        return vec![f64::INFINITY; k];
    };
    let [blocks, white] =
        [sums, gram].map(|meat| &inverse * (BETA * BETA * meat + &precision) * &inverse);
    let wider = |at: usize| blocks[(at, at)].max(white[(at, at)]).sqrt();
    (0..k).map(|i| live.iter().position(|j| *j == i).map_or(f64::INFINITY, wider)).collect()
}

//! Whether a leftover is what gusts would leave: without a pattern, along every axis, about normal,
//! and at each moment as large as gusts are then. Spread wings feel many times the gust that folded
//! ones do, so that sizes are those of many draws.

use super::features::THROTTLE;
use super::{Leftover, floor, means, rms};
use crate::predictor::Predictor;

/// Draws of the gusts.
const GUST_DRAWS: usize = 40;
/// Blocks on each side that size is averaged over: a second and a half in all.
const NEIGHBOURS: usize = 2;
/// Part of the variance that a family may predict of gusts by chance, and throttle, by which the
/// autopilot answers them.
const GUST_SHARE_MAX: f64 = 0.45;
const ANSWER_SHARE_MAX: f64 = 0.6;
const PLACE_SHARE_MAX: f64 = 0.2;
/// Gusts of 40 s have 0.54 to 0.70 of their power along one axis.
const ONE_WAY_MAX: f64 = 0.85;
/// Gusts are about normal; what acts at one place or time comes in bursts.
const GUST_KURTOSIS_MAX: f64 = 7.0;

impl Leftover {
    /// Whether a family predicts so much of it, or it comes in such bursts, that it cannot be
    /// gusts.
    pub(crate) fn is_predicted(&self) -> bool {
        let beyond_chance = |(name, share): &(&str, f64)| {
            *share > if *name == THROTTLE { ANSWER_SHARE_MAX } else { GUST_SHARE_MAX }
        };
        self.families.iter().any(beyond_chance)
            || self.place_share > PLACE_SHARE_MAX
            || self.one_way > ONE_WAY_MAX
            || self.kurtosis > GUST_KURTOSIS_MAX
    }
}

/// What gusts leave, often enough for their size at each moment.
///
/// * arguments as of [`noise`](super::noise)
pub(crate) fn gusts(
    predictor: &Predictor,
    wind_columns: &[Vec<f64>; 3],
    sigma_m_s: f64,
) -> Vec<Vec<f64>> {
    floor::draws(predictor, wind_columns, sigma_m_s, GUST_DRAWS)
}

/// How large draws are at each block of one channel: the rms of a block and its neighbours over all
/// of them.
pub(super) fn sizes(predictor: &Predictor, draws: &[Vec<f64>], channel: usize) -> Vec<f64> {
    let all: Vec<Vec<f64>> = draws.iter().map(|draw| means(predictor, draw, channel)).collect();
    let n = all.first().map_or(0, Vec::len);
    (0..n)
        .map(|block| {
            let around = block.saturating_sub(NEIGHBOURS)..(block + NEIGHBOURS + 1).min(n);
            let sum: f64 = all.iter().flat_map(|m| &m[around.clone()]).map(|x| x * x).sum();
            (sum / (all.len() * around.len()) as f64).sqrt().max(f64::MIN_POSITIVE)
        })
        .collect()
}

/// Rms of the half of `y` at the smaller sizes, over what is allowed where the rms size is that one;
/// 0 where there is nothing.
pub(super) fn quiet_half(y: &[f64], sizes: &[f64], allowed: impl Fn(f64) -> f64) -> f64 {
    let mut both: Vec<(f64, f64)> = sizes.iter().copied().zip(y.iter().copied()).collect();
    both.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (sizes, y): (Vec<f64>, Vec<f64>) = both[..both.len() / 2].iter().copied().unzip();
    if y.is_empty() { 0.0 } else { rms(&y) / allowed(rms(&sizes)) }
}

/// Fourth moment over the square of the second: 3 for a normal distribution.
pub(super) fn kurtosis(y: &[f64]) -> f64 {
    let n = y.len().max(1) as f64;
    let mean = y.iter().sum::<f64>() / n;
    let moment = |power: i32| y.iter().map(|y| (y - mean).powi(power)).sum::<f64>() / n;
    moment(4) / moment(2).powi(2).max(f64::MIN_POSITIVE)
}

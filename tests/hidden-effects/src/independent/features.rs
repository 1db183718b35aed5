//! What random formulas look at: motion and commands, each over what is usual in a rich flight.

use super::unknown::Motion;
use crate::draw::Draw;

/// Velocity through the air (3), rates (3), throttle, height.
pub const FEATURES: usize = 8;

/// Usual sizes: m/s, rad/s, share of top speed, m.
const USUAL: [f64; FEATURES] = [4.0, 4.0, 2.0, 1.5, 1.5, 0.8, 0.06, 1.5];
/// Height of most manoeuvres, m.
const HEIGHT_M: f64 = 3.0;

pub(super) fn of(motion: &Motion<'_>) -> [f64; FEATURES] {
    let (v, w) = (motion.air_body, motion.state.omega);
    let throttle = motion.throttle - motion.hover_throttle;
    let height = -motion.state.position.z - HEIGHT_M;
    let plain = [v.x, v.y, v.z, w.x, w.y, w.z, throttle, height];
    std::array::from_fn(|i| plain[i] / USUAL[i])
}

pub(super) fn dot(weights: &[f64; FEATURES], features: &[f64; FEATURES]) -> f64 {
    weights.iter().zip(features).map(|(w, x)| w * x).sum()
}

/// Weights of such a length, in any direction.
pub(crate) fn weights(length: f64, draw: &mut Draw) -> [f64; FEATURES] {
    let plain: [f64; FEATURES] = std::array::from_fn(|_| draw.normal(1.0));
    let norm = plain.iter().map(|x| x * x).sum::<f64>().sqrt();
    plain.map(|x| length * x / norm)
}

//! Dryden gusts of strength one, as two stages of one lag driven by noise.
//!
//! Along the flight `sqrt(2) / (1 + T s)`; across it `(1 + sqrt(3) T s) / (1 + T s)^2`, which is
//! `sqrt(3)` of the first stage and `1 - sqrt(3)` of the second.

use squirrel_core::nalgebra::Vector3;

/// Over a step; the first stage keeps the variance 1/2, which makes that of the gusts 1.
///
/// * `keep` - part that stays
/// * `noise` - a standard normal number
pub(super) fn advance([first, second]: [&mut f64; 2], keep: f64, noise: f64) {
    let before = *first;
    *first = *first * keep + noise * ((1.0 - keep * keep) * 0.5).sqrt();
    *second = *second * keep + (before + *first) * (0.5 * (1.0 - keep));
}

/// A gust along the flight.
pub(super) fn along(first: f64) -> f64 {
    first * std::f64::consts::SQRT_2
}

/// Gusts across the flight.
pub(super) fn across(first: &Vector3<f64>, second: &Vector3<f64>) -> Vector3<f64> {
    let root3 = 3.0_f64.sqrt();
    second * (1.0 - root3) + first * root3
}

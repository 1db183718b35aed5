//! A gyroscope whose bias runs off within a flight: what it says beyond the attitude's rate grows
//! or falls along a line.
//!
//! Means over blocks keep single attitudes and what goes with the rates out of it; how they scatter
//! about the line says how well it is known.

use super::Found;
use super::flight::Flight;
use nalgebra::Vector3;
use std::collections::BTreeMap;

/// Length of a block, s, and the fewest of them.
const BLOCK_S: f64 = 2.0;
const BLOCKS_MIN: usize = 6;
/// What no unit that is warm does within a flight, rad/s: a degree and a half per second.
const RUNS_OFF_RAD_S: f64 = 0.026;
/// Standard deviations of the line that it must be beyond.
const SURE: f64 = 6.0;

pub(super) fn bias(flight: &Flight) -> Found {
    if !flight.has_attitude() || !flight.has_gyroscope() {
        return None;
    }
    let (time_s, pairs) = flight.rates(&|q| q);
    let (gyro, attitude) = pairs.split();
    let beyond: Vec<Vector3<f64>> = gyro.iter().zip(&attitude).map(|(g, a)| g - a).collect();
    if beyond.len() != time_s.len() {
        return None;
    }
    let runs = |axis: usize| runs_off(&time_s, &beyond.iter().map(|b| b[axis]).collect::<Vec<_>>());
    let (by_rad_s, axis) = (0..3)
        .filter_map(|axis| Some((runs(axis)?, axis)))
        .max_by(|a, b| a.0.abs().total_cmp(&b.0.abs()))?;
    let axis = ["x", "y", "z"][axis];
    let words = format!(
        "runs off by {by_rad_s:+.3} rad/s about {axis} against the attitude within the flight; let the unit warm up, or subtract the bias that a filter estimates"
    );
    Some(("imu.omega_body_rad_s", words))
}

/// By how much a series rises or falls from its beginning to its end, if it clearly does.
fn runs_off(time_s: &[f64], values: &[f64]) -> Option<f64> {
    let start_s = *time_s.first()?;
    let mut blocks: BTreeMap<i64, (f64, f64, f64)> = BTreeMap::new();
    for (t, x) in time_s.iter().zip(values) {
        let (n, time, sum) = blocks.entry(((t - start_s) / BLOCK_S) as i64).or_default();
        (*n, *time, *sum) = (*n + 1.0, *time + t, *sum + x);
    }
    let points: Vec<(f64, f64)> =
        blocks.values().map(|(n, time, sum)| (time / n, sum / n)).collect();
    let n = points.len() as f64;
    if points.len() < BLOCKS_MIN {
        return None;
    }
    let mean = |of: &dyn Fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / n;
    let (t, x) = (mean(&|p| p.0), mean(&|p| p.1));
    let square: f64 = points.iter().map(|p| (p.0 - t).powi(2)).sum();
    let slope = points.iter().map(|p| (p.0 - t) * (p.1 - x)).sum::<f64>() / square;
    let left: f64 = points.iter().map(|p| (p.1 - x - slope * (p.0 - t)).powi(2)).sum();
    let sd = (left / (n - 2.0) / square).sqrt();
    let by = slope * (points[points.len() - 1].0 - points[0].0);
    (by.abs() > RUNS_OFF_RAD_S && slope.abs() > SURE * sd).then_some(by)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A bias with a drift, noise of attitudes that comes and goes, and what a scale of 5 % makes
    /// of the rates.
    fn series(drift_rad_s2: f64) -> (Vec<f64>, Vec<f64>) {
        (0..400)
            .map(|k| {
                let t = 0.1 * f64::from(k);
                let noise = 0.05 * ((0.618_034 * f64::from(k)).fract() - 0.5);
                (t, 0.02 + drift_rad_s2 * t + noise + 0.05 * (4.0 * t).sin())
            })
            .unzip()
    }

    #[test]
    fn a_drift_is_told_and_a_bias_with_noise_and_scale_is_not() {
        let by = |drift| {
            let (t, x) = series(drift);
            runs_off(&t, &x)
        };
        assert_eq!(by(0.0), None);
        assert_eq!(by(3e-4), None, "as much as a warm unit may");
        for drift in [1e-3, -3e-3] {
            assert!(
                (by(drift).unwrap() / (38.0 * drift) - 1.0).abs() < 0.1,
                "{drift}: {:?}",
                by(drift)
            );
        }
        assert_eq!(runs_off(&[0.0, 0.1], &[0.0, 1.0]), None, "too short");
    }
}

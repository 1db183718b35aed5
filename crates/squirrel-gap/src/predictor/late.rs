//! Gyroscope and accelerometer that read late: an autopilot logs both behind low-pass filters.
//!
//! ```text
//! y(t) = x(t - d)      d: of a filter of second order (Butterworth) with its corner at f, sqrt(2) / (2 pi f)
//! ```
//! That is 5.6 ms at 40 Hz and 2.8 ms at 80 Hz. Below the corner of the residual's own filter it
//! takes a few thousandths of the amplitude, and delays every moment by a part of a rotor's lag. No
//! log says how late its sensors are, and an attitude beside them may be as late, or later: the
//! comparison of the gyroscope with it says nothing of that.

use nalgebra::{Vector3, Vector6};

/// Gyroscope, accelerometer: how late each is, s.
pub(crate) type LateS = [f64; 2];
pub(crate) const GYROSCOPE: usize = 0;
pub(crate) const ACCELEROMETER: usize = 1;
/// How a page calls them.
pub(crate) const LATE: [&str; 2] = ["gyroscope.delay_s", "accelerometer.delay_s"];

/// A series on a grid some samples after one of its own, held beyond the end.
pub(super) fn later(series: &[Vector3<f64>], k: usize, samples: f64) -> Vector3<f64> {
    if samples == 0.0 {
        return series[k];
    }
    let last = series.len() - 1;
    let at = (k as f64 + samples).clamp(0.0, last as f64);
    let i = at as usize;
    series[i] + (series[(i + 1).min(last)] - series[i]) * (at - i as f64)
}

/// What a model says of force and angular acceleration, as late as the sensors: by the third-degree
/// polynomial through four answers, which keeps all that the filter passes.
///
/// * `step_s` - from one answer to the next
pub(super) fn delayed(model: Vec<Vector6<f64>>, late_s: LateS, step_s: f64) -> Vec<Vector6<f64>> {
    if late_s == [0.0; 2] || model.len() < 4 {
        return model;
    }
    let mut out = model.clone();
    for (row, late_s) in [(3, late_s[GYROSCOPE]), (0, late_s[ACCELEROMETER])] {
        for (k, shown) in out.iter_mut().enumerate() {
            let at = (k as f64 - late_s / step_s).clamp(0.0, (model.len() - 1) as f64);
            let first = (at as usize).saturating_sub(1).min(model.len() - 4);
            let near = model[first..first + 4].iter().enumerate();
            let value: Vector3<f64> = near
                .map(|(i, answer)| answer.fixed_rows::<3>(row) * weight(i, at - first as f64))
                .sum();
            shown.fixed_rows_mut::<3>(row).copy_from(&value);
        }
    }
    out
}

/// Weight of one of four points, at 0 to 3, in the polynomial through them (Lagrange).
fn weight(i: usize, at: f64) -> f64 {
    let others = (0..4).filter(|j| *j != i);
    others.map(|j| (at - j as f64) / (i as f64 - j as f64)).product()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// At the rate at which a model is asked, waves up to the corner of the residual's filter come
    /// out as late as they should, those of force by their own time, and none weaker by more than a
    /// hundredth.
    #[test]
    fn a_wave_is_late_by_the_delay_of_its_sensor() {
        let step_s = 1.0 / 140.0;
        let wave = |hz: f64, t: f64| (TAU * hz * t).sin();
        for hz in [1.0, 4.0, 8.0, 12.0] {
            let all: Vec<_> =
                (0..140).map(|k| Vector6::repeat(wave(hz, f64::from(k) * step_s))).collect();
            for late_s in [[0.0056, 0.0075], [0.0028, 0.0], [-0.002, 0.011]] {
                let shown = delayed(all.clone(), late_s, step_s);
                for (k, x) in shown.iter().enumerate().skip(4).take(130) {
                    let due = late_s.map(|late_s| wave(hz, k as f64 * step_s - late_s));
                    let off = (x[3] - due[GYROSCOPE]).abs().max((x[0] - due[ACCELEROMETER]).abs());
                    assert!(off < 0.01, "{hz} Hz, {late_s:?}: {off}");
                }
            }
        }
    }

    #[test]
    fn what_was_true_is_read_a_delay_later() {
        let series: Vec<_> = (0..10).map(|k| Vector3::repeat(f64::from(k))).collect();
        assert_eq!(later(&series, 3, 0.0).x, 3.0);
        assert_eq!(later(&series, 3, 1.25).x, 4.25);
        assert_eq!(later(&series, 9, 1.25).x, 9.0);
        assert_eq!(later(&series, 0, -1.25).x, 0.0);
    }
}

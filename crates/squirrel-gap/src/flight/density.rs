//! Noise of an inertial sensor whose log is behind a low-pass: what passes the residual's filter is
//! as large as it was, and what differences of samples show is not.
//!
//! ```text
//! sigma = sqrt(P(14 .. 24 Hz) rate / 2)      P: density, median over windows and bins / ln 2
//! ```
//! Where the density at the end of the band is less than three quarters of that at a quarter of the
//! rate, the log is filtered; the noise is then that just above what rotors can do, as if it were
//! white. Medians keep lines that propellers shake, and motion of short duration, out of it (Welch,
//! 1967; the median of an exponential distribution is its mean times ln 2).

use super::series::Series;
use nalgebra::Vector3;
use std::f64::consts::{LN_2, TAU};
use std::ops::Range;

/// Length of a window, s: one over the distance of bins, Hz.
const WINDOW_S: f64 = 1.0;
/// Above what rotors can do, Hz, and two bands in parts of the rate.
const ABOVE_HZ: Range<f64> = 14.0..24.0;
const MIDDLE: Range<f64> = 0.2..0.28;
const END: Range<f64> = 0.4..0.48;
/// A log with fewer samples a second has no room for these bands, Hz.
const RATE_MIN_HZ: f64 = 120.0;
/// Windows that are enough for a median; of more, every so many is read.
const WINDOWS: usize = 600;
/// Part of the density that is left at the end of a log that is filtered, at most.
const FALLS_TO: f64 = 0.75;

/// White noise, one standard deviation of a sample, that is as large as the sensor's where it passes
/// the residual's filter.
///
/// * `series` - three numbers a sample
pub(super) fn passed_deviation(series: &Series) -> Vector3<f64> {
    let white = series.white_deviation();
    let rate_hz = 1.0 / series.median_period_s();
    if !(RATE_MIN_HZ..).contains(&rate_hz) {
        return white;
    }
    let rows: Vec<Vector3<f64>> =
        series.samples().map(|(_, row)| Vector3::from_column_slice(row)).collect();
    let density = |band: Range<f64>| density(&rows, rate_hz, band);
    let (middle, end) = (
        density(MIDDLE.start * rate_hz..MIDDLE.end * rate_hz),
        density(END.start * rate_hz..END.end * rate_hz),
    );
    let Some((middle, end)) = middle.zip(end) else { return white };
    if (0..3).all(|axis| end[axis] >= FALLS_TO * middle[axis]) {
        return white;
    }
    let Some(above) = density(ABOVE_HZ) else { return white };
    Vector3::from_fn(|axis, _| {
        let filtered = end[axis] < FALLS_TO * middle[axis];
        let passed = if filtered { (above[axis] * rate_hz * 0.5).sqrt() } else { 0.0 };
        passed.max(white[axis])
    })
}

/// Density in a band, squares per Hz; `None` without a whole window.
fn density(rows: &[Vector3<f64>], rate_hz: f64, band_hz: Range<f64>) -> Option<Vector3<f64>> {
    let length = (WINDOW_S * rate_hz).round() as usize;
    let hann = |k: usize| 0.5 - 0.5 * (TAU * (k as f64 + 0.5) / length as f64).cos();
    let scale = 2.0 / (rate_hz * (0..length).map(|k| hann(k).powi(2)).sum::<f64>());
    let bins = (band_hz.start * WINDOW_S).ceil() as usize..=(band_hz.end * WINDOW_S) as usize;
    let every = (rows.len() / length / WINDOWS).max(1);
    let windows: Vec<_> = rows
        .chunks_exact(length)
        .step_by(every)
        .map(|window| (window, window.iter().sum::<Vector3<f64>>() / length as f64))
        .collect();
    let mut powers: [Vec<f64>; 3] = Default::default();
    for bin in bins {
        let wave: Vec<[f64; 2]> = (0..length)
            .map(|k| {
                let (sin, cos) = (TAU * bin as f64 * k as f64 / length as f64).sin_cos();
                [hann(k) * cos, hann(k) * sin]
            })
            .collect();
        for (window, mean) in &windows {
            let (mut re, mut im) = (Vector3::zeros(), Vector3::zeros());
            for (x, [cos, sin]) in window.iter().zip(&wave) {
                re += (x - mean) * *cos;
                im += (x - mean) * *sin;
            }
            let power = (re.component_mul(&re) + im.component_mul(&im)) * scale;
            for (all, power) in powers.iter_mut().zip(power.iter()) {
                all.push(*power);
            }
        }
    }
    let median = |mut all: Vec<f64>| {
        let middle = all.len() / 2;
        (!all.is_empty()).then(|| *all.select_nth_unstable_by(middle, f64::total_cmp).1 / LN_2)
    };
    let [x, y, z] = powers.map(median);
    Some(Vector3::new(x?, y?, z?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::Pcg64Mcg;
    use std::f64::consts::SQRT_2;

    const NOISE: f64 = 0.003;

    /// Two minutes of a lively flight through white noise, behind a filter of second order
    /// (Butterworth) or none.
    fn log(rate_hz: f64, corner_hz: Option<f64>) -> Series {
        let mut rng = Pcg64Mcg::seed_from_u64(7);
        let w = corner_hz.map_or(0.0, |corner_hz| (0.5 * TAU * corner_hz / rate_hz).tan());
        let scale = 1.0 + SQRT_2 * w + w * w;
        let (b, a1, a2) =
            (w * w / scale, 2.0 * (w * w - 1.0) / scale, (1.0 - SQRT_2 * w + w * w) / scale);
        let (mut x, mut y) = ([Vector3::zeros(); 2], [Vector3::zeros(); 2]);
        let (mut time_s, mut values) = (Vec::new(), Vec::new());
        for k in 0..(120.0 * rate_hz) as usize {
            let t = k as f64 / rate_hz;
            let noise: Vector3<f64> = Vector3::from_fn(|_, _| StandardNormal.sample(&mut rng));
            let moved = (TAU * 0.7 * t).sin() + 0.3 * (TAU * 4.0 * t).sin();
            let now = Vector3::repeat(moved) + noise * NOISE;
            let read = match corner_hz {
                Some(_) => (now + x[0] * 2.0 + x[1]) * b - y[0] * a1 - y[1] * a2,
                None => now,
            };
            (x, y) = ([now, x[0]], [read, y[0]]);
            time_s.push(t);
            values.extend_from_slice(read.as_slice());
        }
        Series::computed("imu.omega_body_rad_s", 3, (time_s, values)).unwrap()
    }

    #[test]
    fn noise_behind_a_filter_is_as_large_as_before_where_it_passes() {
        for (rate_hz, corner_hz) in
            [(200.0, 40.0), (250.0, 30.0), (250.0, 80.0), (500.0, 80.0), (1000.0, 98.0)]
        {
            let series = log(rate_hz, Some(corner_hz));
            let (passed, shown) = (passed_deviation(&series), series.white_deviation());
            for axis in 0..3 {
                let [passed, shown] = [passed, shown].map(|noise| noise[axis] / NOISE);
                assert!((0.85..1.1).contains(&passed), "{rate_hz}, {corner_hz} Hz: {passed}");
                assert!(shown < 0.8, "{rate_hz}, {corner_hz} Hz: {shown}");
            }
        }
    }

    #[test]
    fn noise_without_a_filter_is_that_of_differences() {
        for rate_hz in [100.0, 200.0, 300.0, 1000.0] {
            let series = log(rate_hz, None);
            assert_eq!(passed_deviation(&series), series.white_deviation(), "{rate_hz}");
        }
    }
}

//! The low-pass that measurement and model share: a zero-phase FIR, and the derivative that goes
//! with it.
//!
//! ```text
//! h = floor(2.4 rate / f_c + 1/2)                                      half length: 2 h + 1 taps
//! b_i = (0.54 + 0.46 cos(pi i / h)) sin(2 pi f_c i / rate) / (pi i)    i = -h .. h;  b_0 = 2 f_c / rate
//! y_k = sum_i b_i x_(k+i) / sum_i b_i                                  f_c = 12 Hz, lower where a log has no IMU
//! x'_k = (x_(k-2) - 8 x_(k-1) + 8 x_(k+1) - x_(k+2)) / (12 T)          T = 1 / rate
//! ```
//! 12 Hz keeps what rotors and wings can do and drops what propellers shake. A Hamming window of
//! 0.4 s passes 8 Hz whole and nothing above 16 Hz. The five-point difference reads 1 % low at 12
//! Hz on a 100 Hz log; three points would read 9 % low and favour the model of a sluggish vehicle.
//! Both are linear and the same at all times, so that their order, and whether measurement and
//! model pass apart or as their difference, does not matter.

use nalgebra::SVector;
use std::f64::consts::{PI, TAU};

/// Corner (-6 dB), Hz, of logs with an IMU, and the highest of all.
pub(crate) const CUTOFF_HZ: f64 = 12.0;
/// Half the length of the filter in periods of its corner: 0.2 s at 12 Hz.
const HALF_LENGTH_PERIODS: f64 = 2.4;

/// Samples on each side of a derivative that it looks at.
pub(crate) const DERIVATIVE_REACH: usize = 2;

/// Lowest rate at which a model is asked: what aliases from above it has come through a lag of
/// rotors and this filter.
const MODEL_RATE_HZ: f64 = 140.0;

/// The filter of a signal of which every sample, or one of `stride`, is known.
#[derive(Debug, Clone)]
pub(crate) struct LowPass {
    /// The taps at the full rate, from the middle outwards.
    taps: Vec<f64>,
    /// By how far an answer lies behind a known sample: how many known samples before that one
    /// count, and all their weights.
    phases: Vec<(usize, Vec<f64>)>,
}

impl LowPass {
    pub(crate) fn new(rate_hz: f64, cutoff_hz: f64) -> Self {
        let half = (HALF_LENGTH_PERIODS * rate_hz / cutoff_hz + 0.5).floor();
        let tap = |i: usize| {
            let i = i as f64;
            let sinc = if i == 0.0 {
                2.0 * cutoff_hz / rate_hz
            } else {
                (TAU * cutoff_hz * i / rate_hz).sin() / (PI * i)
            };
            sinc * (0.54 + 0.46 * (PI * i / half).cos())
        };
        Self { taps: (0..=half as usize).map(tap).collect(), phases: Vec::new() }.thinned(1)
    }

    /// The same filter for a signal of which one sample of `stride` is known.
    pub(crate) fn thinned(&self, stride: usize) -> Self {
        let reach = self.reach();
        let phases = (0..stride).map(|phase| {
            let before = (reach - phase) / stride;
            let after = (reach + phase) / stride;
            let weights: Vec<f64> = (0..=before + after)
                .map(|i| self.taps[(i * stride).abs_diff(before * stride + phase)])
                .collect();
            let sum: f64 = weights.iter().sum();
            (before, weights.iter().map(|weight| weight / sum).collect())
        });
        Self { taps: self.taps.clone(), phases: phases.collect() }
    }

    /// Samples at the full rate that the filter costs at each end.
    pub(crate) fn reach(&self) -> usize {
        self.taps.len() - 1
    }

    /// One filtered sample of `every`, both at the full rate, the first at sample `first`, which
    /// must be [`Self::reach`] from the beginning.
    pub(crate) fn apply<const N: usize>(
        &self,
        known: &[SVector<f64, N>],
        first: usize,
        every: usize,
    ) -> Vec<SVector<f64, N>> {
        let stride = self.phases.len();
        (first..)
            .step_by(every)
            .map_while(|k| {
                let (before, weights) = &self.phases[k % stride];
                let start = k / stride - before;
                let near = known.get(start..start + weights.len())?;
                Some(
                    near.iter()
                        .zip(weights)
                        .fold(SVector::zeros(), |sum, (x, weight)| sum + x * *weight),
                )
            })
            .collect()
    }
}

/// How many samples apart a model is asked whose answer is filtered.
pub(crate) fn model_stride(period_s: f64) -> usize {
    // The slack keeps a rate that is a multiple, whatever the rounding of its period.
    ((1.0 / (period_s * MODEL_RATE_HZ) + 1e-6) as usize).max(1)
}

/// Five-point derivative of `x` at sample `k`, per second; `k` must be [`DERIVATIVE_REACH`] away
/// from the ends.
pub(crate) fn derivative<V>(x: impl Fn(usize) -> V, k: usize, period_s: f64) -> V
where
    V: std::ops::Sub<Output = V> + std::ops::Add<Output = V> + std::ops::Mul<f64, Output = V>,
{
    ((x(k + 1) - x(k - 1)) * 8.0 + (x(k - 2) - x(k + 2))) * (1.0 / (12.0 * period_s))
}

/// Five-point second derivative of `x` at sample `k`, per second squared; as [`derivative`].
pub(crate) fn second_derivative<V>(x: impl Fn(usize) -> V, k: usize, period_s: f64) -> V
where
    V: std::ops::Sub<Output = V> + std::ops::Add<Output = V> + std::ops::Mul<f64, Output = V>,
{
    ((x(k + 1) + x(k - 1)) * 16.0 - (x(k - 2) + x(k + 2)) - x(k) * 30.0)
        * (1.0 / (12.0 * period_s * period_s))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector6;

    /// Gain at a frequency, from the response to a cosine about the middle sample.
    fn gain(rate_hz: f64, frequency_hz: f64) -> f64 {
        let filter = LowPass::new(rate_hz, CUTOFF_HZ);
        let n = filter.reach();
        let wave = |k: usize| (TAU * frequency_hz * (k as f64 - n as f64) / rate_hz).cos();
        let x: Vec<_> = (0..=2 * n).map(|k| Vector6::repeat(wave(k))).collect();
        let y = filter.apply(&x, n, 1);
        assert_eq!(y.len(), 1, "one sample has no edge");
        y[0][3]
    }

    #[test]
    fn taps_scale_with_the_rate() {
        for rate_hz in [50.0, 100.0, 300.0, 333.3, 1000.0] {
            assert!((gain(rate_hz, 0.0) - 1.0).abs() < 1e-12, "a constant stays");
            assert!((gain(rate_hz, 6.0) - 1.0).abs() < 0.01, "{rate_hz}");
            assert!((gain(rate_hz, CUTOFF_HZ) - 0.5).abs() < 0.01, "{rate_hz}");
            assert!(gain(rate_hz, 18.0).abs() < 0.01, "{rate_hz}");
        }
        assert_eq!(LowPass::new(300.0, CUTOFF_HZ).reach(), 60);
        assert_eq!(LowPass::new(100.0, CUTOFF_HZ).reach(), 20);
    }

    #[test]
    fn a_series_shorter_than_the_filter_gives_nothing() {
        assert!(LowPass::new(100.0, CUTOFF_HZ).apply(&[Vector6::zeros(); 40], 20, 1).is_empty());
        assert!(LowPass::new(100.0, CUTOFF_HZ).apply::<6>(&[], 20, 1).is_empty());
    }

    #[test]
    fn a_thinned_model_passes_what_the_measurement_passes() {
        let of = |rate_hz: f64| model_stride(1.0 / rate_hz);
        assert_eq!([50.0, 100.0, 280.0, 300.0, 333.3, 1000.0].map(of), [1, 1, 2, 2, 2, 7]);
        // An answer every 10 samples lies on known ones, one every 11 between them, too.
        for (rate_hz, stride, every) in [(300.0, 2, 10), (1000.0 / 3.0, 2, 11), (1000.0, 7, 33)] {
            let filter = LowPass::new(rate_hz, CUTOFF_HZ);
            let reach = filter.reach();
            for (frequency_hz, off) in
                [(0.0, 1e-12), (2.0, 1e-3), (6.0, 1e-3), (12.0, 2e-3), (20.0, 2e-3), (60.0, 2e-3)]
            {
                let full: Vec<_> = (0..4 * reach)
                    .map(|k| Vector6::repeat((TAU * frequency_hz * k as f64 / rate_hz).cos()))
                    .collect();
                let thin: Vec<_> = full.iter().step_by(stride).copied().collect();
                let few = filter.thinned(stride).apply(&thin, reach + 1, every);
                let all = filter.apply(&full, reach + 1, every);
                assert!(few.len() >= 2 * reach / every - 1, "{rate_hz} Hz: {}", few.len());
                for (a, b) in all.iter().zip(&few) {
                    assert!(
                        (a - b).amax() < off,
                        "{frequency_hz} of {rate_hz} Hz: {} and {}",
                        a[0],
                        b[0]
                    );
                }
            }
        }
    }

    #[test]
    fn the_derivative_reads_one_percent_low_at_the_corner() {
        let rate_hz = 100.0;
        let w = TAU * CUTOFF_HZ;
        let slope = derivative(|k| (w * (k as f64 - 2.0) / rate_hz).sin(), 2, 1.0 / rate_hz);
        assert!((0.985..0.995).contains(&(slope / w)), "{}", slope / w);
        let bend = second_derivative(|k| (w * (k as f64 - 2.0) / rate_hz).cos(), 2, 1.0 / rate_hz);
        assert!((0.995..1.0).contains(&(-bend / (w * w))), "{}", bend / (w * w));
    }

    #[test]
    fn a_lower_corner_is_as_sharp_over_a_longer_time() {
        let filter = LowPass::new(100.0, 4.0);
        assert_eq!(filter.reach(), 60);
        for (frequency_hz, gain, off) in
            [(0.0, 1.0, 1e-12), (2.0, 1.0, 0.01), (4.0, 0.5, 0.01), (6.0, 0.0, 0.01)]
        {
            let x: Vec<_> = (0..=120)
                .map(|k| {
                    Vector6::repeat((TAU * frequency_hz * (f64::from(k) - 60.0) / 100.0).cos())
                })
                .collect();
            let y = filter.apply(&x, 60, 1)[0][0];
            assert!((y - gain).abs() < off, "{frequency_hz} Hz: {y}");
        }
    }
}

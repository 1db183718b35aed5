//! Specific force and angular rates of a log that has no IMU: position or velocity, and attitude,
//! differentiated.
//!
//! ```text
//! f = LP[R^T (p'' - g)]      or R^T (v' - g)        w = LP[2 q* q']        primes are five-point differences
//! f_c: least over F of  sum_(f <= F) N(f) + sum_(f > F) (P(f) - N(f))     P  spectrum of p'', measured (Welch, 1967)
//! N(f) = 2 T s^2 (2 pi f)^(2 n)                                           n  derivatives, s  white noise of a sample
//! ```
//! A smoother is a low-pass, and one that is not told of to the model makes each quick motion a
//! force that the model lacks. So the low-pass is the workflow's own, with a lower corner, and what
//! the model predicts passes the same one. The corner has the least mean square error: below it a
//! spectrum holds more motion than noise, above it more noise. The noise is that of the log's third
//! differences, and it goes with the answer: drawn anew, it passes the same differences and filter.

use super::filter::{CUTOFF_HZ, DERIVATIVE_REACH, LowPass, derivative, second_derivative};
use super::series::{Series, Span, common};
use crate::GapError;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use rand::Rng;
use rand_distr::{Distribution, StandardNormal};
use squirrel_core::math::GRAVITY_M_S2;
use std::f64::consts::TAU;

/// Slowest source that is differentiated, Hz.
const RATE_MIN_HZ: f64 = 9.0;
/// Samples to a period of the corner, at least.
const SAMPLES_PER_PERIOD: f64 = 8.0;
/// Lowest corner, Hz: below it nothing is left of a flight.
const CUTOFF_MIN_HZ: f64 = 1.0;
/// Steps in which a corner is looked for, Hz, and length of a window, s.
const STEP_HZ: f64 = 0.5;
const WINDOW_S: f64 = 4.0;
/// A position that carries this part of the band that a velocity carries is preferred: velocities
/// are smoothed positions.
const POSITION_SHARE: f64 = 0.5;

/// What accelerations, linear or angular, come from when nothing measures them.
#[derive(Debug, Clone)]
pub(crate) struct Differences {
    /// What is differentiated, how often, and how far its samples are apart, s.
    pub(crate) channel: &'static str,
    order: i32,
    period_s: f64,
    /// White noise of a sample, one standard deviation.
    pub(crate) white: Vector3<f64>,
    /// Highest frequency at which there is more motion than noise, Hz.
    pub(crate) cutoff_hz: f64,
}

impl Differences {
    /// * `white` - noise of a sample of the series, of the size of its derivatives' unit
    /// * `runs` - the series on an even grid
    fn new(
        series: &Series,
        order: i32,
        period_s: f64,
        white: Vector3<f64>,
        runs: &[Vec<Vector3<f64>>],
    ) -> Self {
        let mut own =
            Self { channel: series.channel, order, period_s, white, cutoff_hz: CUTOFF_HZ };
        let highest_hz = CUTOFF_HZ.min(1.0 / (SAMPLES_PER_PERIOD * period_s));
        let accelerations: Vec<Vec<Vector3<f64>>> = runs.iter().map(|run| own.raw(run)).collect();
        own.cutoff_hz = corner_hz(&accelerations, period_s, highest_hz, |f| own.noise_power(f));
        own
    }

    /// Distance of the samples that are differentiated, s.
    pub(crate) fn period_s(&self) -> f64 {
        self.period_s
    }

    /// White noise of attitudes about the pitch axis, rad, that at the corner is as large as that
    /// of an acceleration over gravity.
    ///
    /// * `period_s` - of the attitudes
    pub(crate) fn leaning(&self, period_s: f64) -> Vector3<f64> {
        let power = self.noise_power(self.cutoff_hz) / 3.0;
        Vector3::new(0.0, (power / (2.0 * period_s)).sqrt() / GRAVITY_M_S2, 0.0)
    }

    /// More noise of a sample, one standard deviation.
    pub(crate) fn add_noise(&mut self, more: &Vector3<f64>) {
        self.white = self.white.zip_map(more, f64::hypot);
    }

    /// Power of the noise of an acceleration, all axes, per Hz.
    fn noise_power(&self, frequency_hz: f64) -> f64 {
        let gain = (TAU * frequency_hz).powi(2 * self.order);
        2.0 * self.period_s * self.white.norm_squared() * gain
    }

    /// Deviation of the noise that a low-pass leaves of an acceleration, of one axis.
    pub(crate) fn passed(&self, cutoff_hz: f64) -> f64 {
        let n = 2 * self.order + 1;
        (self.noise_power(1.0) * cutoff_hz.powi(n) / f64::from(n) / 3.0).sqrt()
    }

    /// Deviation of the noise that a low-pass leaves of the sum over accelerations: of rates, from
    /// attitudes.
    pub(crate) fn passed_rate(&self, cutoff_hz: f64) -> f64 {
        let n = 2 * self.order - 1;
        (self.noise_power(1.0) / TAU.powi(2) * cutoff_hz.powi(n) / f64::from(n) / 3.0).sqrt()
    }

    /// Accelerations at all samples but [`DERIVATIVE_REACH`] at each end.
    fn raw(&self, x: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
        (DERIVATIVE_REACH..x.len().saturating_sub(DERIVATIVE_REACH))
            .map(|k| match self.order {
                1 => derivative(|k| x[k], k, self.period_s),
                _ => second_derivative(|k| x[k], k, self.period_s),
            })
            .collect()
    }

    /// What noise leaves of accelerations behind the low-pass, at even times.
    ///
    /// * `lean` - noise of a vector that joins behind the differences, one standard deviation of a
    ///   sample
    pub(crate) fn noise(
        &self,
        cutoff_hz: f64,
        lean: Vector3<f64>,
        step_s: f64,
        count: usize,
        rng: &mut impl Rng,
    ) -> Vec<Vector3<f64>> {
        let filter = LowPass::new(1.0 / self.period_s, cutoff_hz);
        let reach = filter.reach() + DERIVATIVE_REACH;
        let n = (count as f64 * step_s / self.period_s) as usize + 2 + 2 * reach;
        let mut draw = |sd: &Vector3<f64>| -> Vector3<f64> {
            sd.component_mul(&Vector3::from_fn(|_, _| StandardNormal.sample(rng)))
        };
        let white: Vec<Vector3<f64>> = (0..n).map(|_| draw(&self.white)).collect();
        let raw: Vec<Vector3<f64>> =
            self.raw(&white).into_iter().map(|a| a + draw(&lean)).collect();
        let smooth = filter.apply(&raw, filter.reach(), 1);
        let at =
            |i: usize| smooth[((i as f64 * step_s / self.period_s) as usize).min(smooth.len() - 1)];
        (0..count).map(at).collect()
    }
}

/// Corner with the least mean square error, from the spectrum of what is filtered.
fn corner_hz(
    runs: &[Vec<Vector3<f64>>],
    period_s: f64,
    highest_hz: f64,
    noise_power: impl Fn(f64) -> f64,
) -> f64 {
    let longest = runs.iter().map(Vec::len).max().unwrap_or_default();
    let length = ((WINDOW_S / period_s).round() as usize).min(longest).max(1);
    let bins = (highest_hz / STEP_HZ).floor() as usize;
    // Windows of Hann, half over each other.
    let hann = |k: usize| 0.5 - 0.5 * (TAU * (k as f64 + 0.5) / length as f64).cos();
    let scale = 2.0 * period_s / (0..length).map(|k| hann(k).powi(2)).sum::<f64>();
    let mut power = vec![0.0; bins];
    let mut windows = 0.0;
    for run in runs {
        for start in (0..run.len().saturating_sub(length - 1)).step_by((length / 2).max(1)) {
            let window = &run[start..start + length];
            let mean = window.iter().sum::<Vector3<f64>>() / length as f64;
            for (bin, power) in power.iter_mut().enumerate() {
                let turn = TAU * (bin + 1) as f64 * STEP_HZ * period_s;
                let (mut re, mut im) = (Vector3::zeros(), Vector3::zeros());
                for (k, x) in window.iter().enumerate() {
                    let (sin, cos) = (turn * k as f64).sin_cos();
                    let x = (x - mean) * hann(k);
                    re += x * cos;
                    im += x * sin;
                }
                *power += scale * (re.norm_squared() + im.norm_squared());
            }
            windows += 1.0;
        }
    }
    let (mut won, mut most, mut best_hz) = (0.0, 0.0, CUTOFF_MIN_HZ);
    for (bin, power) in power.iter().enumerate() {
        let frequency_hz = (bin + 1) as f64 * STEP_HZ;
        won += power / f64::max(windows, 1.0) - 2.0 * noise_power(frequency_hz);
        // Without any noise there is no corner.
        if won >= most {
            (most, best_hz) = (won, frequency_hz);
        }
    }
    best_hz.max(CUTOFF_MIN_HZ).min(highest_hz)
}

/// The noise of attitudes, rad, one standard deviation of a sample about the body's axes.
pub(crate) fn attitude_white(attitude: &Series) -> Vector3<f64> {
    let at = |row: &[f64]| {
        UnitQuaternion::new_normalize(Quaternion::new(row[0], row[1], row[2], row[3]))
    };
    let rows: Vec<UnitQuaternion<f64>> = attitude.samples().map(|(_, row)| at(row)).collect();
    // Third differences of small turns: about the second of four samples they add.
    let (mut square, mut n) = (Vector3::zeros(), 0.0_f64);
    for w in rows.windows(4) {
        let from = |i: usize| (w[1].inverse() * w[i]).scaled_axis();
        let d = from(3) - from(2) * 3.0 - from(0);
        square += d.component_mul(&d);
        n += 1.0;
    }
    (square / (20.0 * n.max(1.0))).map(f64::sqrt)
}

/// What accelerations can be had from, of the log's position and velocity; `None` without either.
///
/// # Errors
/// [`GapError::Rate`]: the only source is too slow.
pub(crate) fn force_source(
    flight: &str,
    position: Option<&Series>,
    velocity: Option<&Series>,
) -> Result<Option<Differences>, GapError> {
    let of = |series: &Series, order| {
        let period_s = series.median_period_s();
        let runs: Vec<_> =
            series.spans().iter().map(|span| evenly(series, *span, period_s)).collect();
        Differences::new(series, order, period_s, series.white_deviation(), &runs)
    };
    let fast = |series: &&Series| 1.0 / series.median_period_s() >= RATE_MIN_HZ;
    let sources =
        (position.filter(fast).map(|p| of(p, 2)), velocity.filter(fast).map(|v| of(v, 1)));
    Ok(match sources {
        (Some(position), Some(velocity)) => {
            let enough = position.cutoff_hz >= POSITION_SHARE * velocity.cutoff_hz;
            Some(if enough { position } else { velocity })
        }
        (None, None) => {
            if let Some(slow) = position.or(velocity) {
                let (flight, channel) = (flight.to_owned(), slow.channel);
                let rate_hz = 1.0 / slow.median_period_s();
                return Err(GapError::Rate { flight, channel, rate_hz, least_hz: RATE_MIN_HZ });
            }
            None
        }
        (position, velocity) => position.or(velocity),
    })
}

/// What angular accelerations can be had from.
///
/// # Errors
/// [`GapError::Rate`]: attitudes are too far apart.
pub(crate) fn rate_source(flight: &str, attitude: &Series) -> Result<Differences, GapError> {
    let period_s = attitude.median_period_s();
    if 1.0 / period_s < RATE_MIN_HZ {
        let (flight, channel, rate_hz) = (flight.to_owned(), attitude.channel, 1.0 / period_s);
        return Err(GapError::Rate { flight, channel, rate_hz, least_hz: RATE_MIN_HZ });
    }
    // The turn since the first sample, summed up: its second difference is the angular acceleration
    // but for how axes turn.
    let turned: Vec<Vec<Vector3<f64>>> = attitude
        .spans()
        .iter()
        .map(|span| {
            let q = evenly_turned(attitude, *span, period_s);
            let mut sum = Vector3::zeros();
            let steps = q.windows(2).map(|w| (w[0].inverse() * w[1]).scaled_axis());
            steps
                .map(|step| {
                    sum += step;
                    sum
                })
                .collect()
        })
        .collect();
    Ok(Differences::new(attitude, 2, period_s, attitude_white(attitude), &turned))
}

/// Specific force, m/s^2, body frame, behind the low-pass.
pub(crate) fn specific_force(
    from: &Differences,
    series: &Series,
    attitude: &Series,
    cutoff_hz: f64,
) -> (Vec<f64>, Vec<f64>) {
    let gravity = Vector3::new(0.0, 0.0, GRAVITY_M_S2);
    smoothed(from.period_s, cutoff_hz, &common(&series.spans(), &attitude.spans()), |span| {
        let rotations = evenly_turned(attitude, span, from.period_s);
        let accelerations = from.raw(&evenly(series, span, from.period_s));
        let turned = accelerations.iter().zip(&rotations[DERIVATIVE_REACH..]);
        turned.map(|(a, q)| q.inverse_transform_vector(&(a - gravity))).collect()
    })
}

/// Accelerations in the world, m/s^2, behind a low-pass.
pub(crate) fn accelerations(
    from: &Differences,
    series: &Series,
    cutoff_hz: f64,
) -> (Vec<f64>, Vec<f64>) {
    let raw = |span| from.raw(&evenly(series, span, from.period_s));
    smoothed(from.period_s, cutoff_hz, &series.spans(), raw)
}

/// Angular rates, rad/s, body frame, behind the low-pass.
pub(crate) fn rates(from: &Differences, attitude: &Series, cutoff_hz: f64) -> (Vec<f64>, Vec<f64>) {
    smoothed(from.period_s, cutoff_hz, &attitude.spans(), |span| {
        let q: Vec<Quaternion<f64>> = evenly_turned(attitude, span, from.period_s)
            .into_iter()
            .map(UnitQuaternion::into_inner)
            .collect();
        (DERIVATIVE_REACH..q.len().saturating_sub(DERIVATIVE_REACH))
            .map(|k| (q[k].conjugate() * derivative(|k| q[k], k, from.period_s)).imag() * 2.0)
            .collect()
    })
}

/// Velocity from position, m/s, NED, behind the low-pass.
pub(crate) fn velocity(position: &Series, cutoff_hz: f64) -> (Vec<f64>, Vec<f64>) {
    let period_s = position.median_period_s();
    smoothed(period_s, cutoff_hz, &position.spans(), |span| {
        let p = evenly(position, span, period_s);
        let inner = DERIVATIVE_REACH..p.len().saturating_sub(DERIVATIVE_REACH);
        inner.map(|k| derivative(|k| p[k], k, period_s)).collect()
    })
}

/// Times and numbers of what spans give, behind the low-pass, without the edges that it costs.
///
/// * `raw` - of a span: all even samples but [`DERIVATIVE_REACH`] at each end
fn smoothed(
    period_s: f64,
    cutoff_hz: f64,
    spans: &[Span],
    raw: impl Fn(Span) -> Vec<Vector3<f64>>,
) -> (Vec<f64>, Vec<f64>) {
    let filter = LowPass::new(1.0 / period_s, cutoff_hz);
    let (mut time_s, mut values) = (Vec::new(), Vec::new());
    for span in spans {
        let first = filter.reach() + DERIVATIVE_REACH;
        for (k, row) in filter.apply(&raw(*span), filter.reach(), 1).iter().enumerate() {
            time_s.push(span.0 + (first + k) as f64 * period_s);
            values.extend_from_slice(row.as_slice());
        }
    }
    (time_s, values)
}

/// How many even samples a span holds.
fn count(span: Span, period_s: f64) -> usize {
    // The slack keeps a last sample that rounding has put behind the end.
    ((span.1 - span.0) / period_s + 1e-6) as usize + 1
}

fn evenly(series: &Series, span: Span, period_s: f64) -> Vec<Vector3<f64>> {
    (0..count(span, period_s))
        .map(|k| series.cubic(span.0 + k as f64 * period_s))
        .map(|x: [f64; 3]| x.into())
        .collect()
}

fn evenly_turned(attitude: &Series, span: Span, period_s: f64) -> Vec<UnitQuaternion<f64>> {
    let mut before = Quaternion::identity();
    (0..count(span, period_s))
        .map(|k| {
            let [w, x, y, z] = attitude.cubic_turned(span.0 + k as f64 * period_s);
            let q = Quaternion::new(w, x, y, z);
            // One sign throughout, for what is differentiated.
            before = if q.dot(&before) < 0.0 { -q } else { q };
            UnitQuaternion::new_normalize(before)
        })
        .collect()
}

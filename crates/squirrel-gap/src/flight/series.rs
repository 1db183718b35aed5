//! One channel of a log as a series that can be asked at any time, and the time spans in which it
//! can.
//!
//! Samples with a number that is not finite are left out. A channel exists between two of its
//! samples that are at most five of its median periods apart; beyond, a line between them would be
//! invention.

use crate::GapError;
use nalgebra::{Quaternion, Vector3};
use squirrel_log::{FlightLog, clock_jump};

/// Longest distance of two samples that still belong together, in median periods.
const GAP_PERIODS: f64 = 5.0;

/// Longest flight, s: eleven days.
const FLIGHT_MAX_S: f64 = 1e6;
/// Highest rate of a channel, Hz: filters reach over as many samples as there are in a time.
const RATE_MAX_HZ: f64 = 1e5;

/// First and last time, s.
pub(crate) type Span = (f64, f64);

pub(crate) struct Series {
    pub(crate) channel: &'static str,
    width: usize,
    time_s: Vec<f64>,
    values: Vec<f64>,
}

impl Series {
    /// The usable samples of a channel; `None` if the log lacks it.
    ///
    /// # Errors
    /// Shape, length or times that cannot be, a clock that jumps or stands, or fewer than two usable samples.
    pub(crate) fn read(
        flight: &str,
        log: &FlightLog,
        channel: &'static str,
        width: usize,
    ) -> Result<Option<Self>, GapError> {
        let Some((time_s, found)) = log.channel(channel) else { return Ok(None) };
        let flight = || flight.to_owned();
        if found.width != width {
            return Err(GapError::Width {
                flight: flight(),
                channel,
                found: found.width,
                needed: width,
            });
        }
        if found.values.len() != time_s.len() * width {
            let (found, needed) = (found.values.len(), time_s.len() * width);
            return Err(GapError::Length { flight: flight(), channel, found, needed });
        }
        let runs_forward =
            |i: usize| time_s[i].is_finite() && (i == 0 || time_s[i] > time_s[i - 1]);
        if let Some(index) = (0..time_s.len()).find(|&i| !runs_forward(i)) {
            return Err(GapError::Time { flight: flight(), channel, index, time_s: time_s[index] });
        }
        for index in 1..time_s.len() {
            let since_first_s = time_s[index] - time_s[0];
            let problem = clock_jump(time_s[index - 1], time_s[index]).or_else(|| {
                (since_first_s > FLIGHT_MAX_S).then(|| {
                    format!(
                        "is {since_first_s:.1} s after the first sample, at most {FLIGHT_MAX_S:e}"
                    )
                })
            });
            let Some(problem) = problem else { continue };
            let (flight, time_s) = (flight(), time_s[index]);
            return Err(GapError::Jump { flight, channel, index, time_s, problem });
        }
        let mut series = Self { channel, width, time_s: Vec::new(), values: Vec::new() };
        for (t, row) in time_s.iter().zip(found.values.chunks_exact(width)) {
            if row.iter().all(|x| x.is_finite()) {
                series.time_s.push(*t);
                series.values.extend_from_slice(row);
            }
        }
        if series.time_s.len() < 2 {
            return Err(GapError::Empty { flight: flight(), channel, samples: time_s.len() });
        }
        let rate_hz = 1.0 / series.median_period_s();
        if rate_hz > RATE_MAX_HZ {
            let (flight, most_hz) = (flight(), RATE_MAX_HZ);
            return Err(GapError::Fast { flight, channel, rate_hz, most_hz });
        }
        Ok(Some(series))
    }

    /// A channel that is computed from others, at times in order; `None` with fewer than two
    /// samples.
    pub(crate) fn computed(
        channel: &'static str,
        width: usize,
        (time_s, values): (Vec<f64>, Vec<f64>),
    ) -> Option<Self> {
        (time_s.len() >= 2).then_some(Self { channel, width, time_s, values })
    }

    /// As [`Self::read`], for a channel that must be there.
    ///
    /// # Errors
    /// As [`Self::read`], or the channel is missing.
    pub(crate) fn need(
        flight: &str,
        log: &FlightLog,
        channel: &'static str,
        width: usize,
    ) -> Result<Self, GapError> {
        Self::read(flight, log, channel, width)?
            .ok_or_else(|| GapError::Missing { flight: flight.to_owned(), channel })
    }

    /// Refuses samples that are no rotation.
    ///
    /// # Errors
    /// [`GapError::Rotation`] with the first norm that is not 1 within 5 %.
    pub(crate) fn check_rotations(&self, flight: &str) -> Result<(), GapError> {
        for (time_s, q) in self.time_s.iter().zip(self.values.chunks_exact(self.width)) {
            let norm = q.iter().map(|x| x * x).sum::<f64>().sqrt();
            if !(0.95..=1.05).contains(&norm) {
                let (flight, channel) = (flight.to_owned(), self.channel);
                return Err(GapError::Rotation { flight, channel, time_s: *time_s, norm });
            }
        }
        Ok(())
    }

    /// Median distance of its samples, s.
    pub(crate) fn median_period_s(&self) -> f64 {
        let mut steps: Vec<f64> = self.time_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
        steps.sort_unstable_by(f64::total_cmp);
        let middle = steps.len() / 2;
        if steps.len() % 2 == 1 { steps[middle] } else { 0.5 * (steps[middle - 1] + steps[middle]) }
    }

    /// The times in which the channel exists.
    pub(crate) fn spans(&self) -> Vec<Span> {
        let longest_s = GAP_PERIODS * self.median_period_s();
        let mut spans: Vec<Span> = Vec::new();
        for &t in &self.time_s {
            match spans.last_mut() {
                Some(span) if t - span.1 <= longest_s => span.1 = t,
                _ => spans.push((t, t)),
            }
        }
        spans
    }

    /// Time and numbers of each sample.
    pub(crate) fn samples(&self) -> impl Iterator<Item = (f64, &[f64])> {
        self.time_s.iter().copied().zip(self.values.chunks_exact(self.width))
    }

    /// Deviation of the white part of three numbers a sample: that of the third difference, which
    /// motion hardly enters.
    pub(crate) fn white_deviation(&self) -> Vector3<f64> {
        let at = |i| Vector3::from_column_slice(self.row(i));
        let n = self.time_s.len().saturating_sub(3);
        let sum: Vector3<f64> = (0..n)
            .map(|i| at(i + 3) - at(i + 2) * 3.0 + at(i + 1) * 3.0 - at(i))
            .map(|d| d.component_mul(&d))
            .sum();
        // 1 + 9 + 9 + 1
        (sum / (20 * n.max(1)) as f64).map(f64::sqrt)
    }

    /// The number that all samples have, if it is one.
    pub(crate) fn only_number(&self) -> Option<f64> {
        let first = self.values[0];
        self.values.iter().all(|x| *x == first).then_some(first)
    }

    /// From the first sample to the last, s.
    pub(crate) fn duration_s(&self) -> f64 {
        self.time_s[self.time_s.len() - 1] - self.time_s[0]
    }

    /// Time of the first sample, s.
    pub(crate) fn start_s(&self) -> f64 {
        self.time_s[0]
    }

    /// The samples about `t`, and how far `t` is from the first to the second, 0 to 1; the end
    /// sample twice beyond the ends.
    fn about(&self, t: f64) -> (&[f64], &[f64], f64) {
        let after = self.time_s.partition_point(|&x| x <= t);
        let (i, j) = (after.saturating_sub(1), after.min(self.time_s.len() - 1));
        let step = self.time_s[j] - self.time_s[i];
        let share = if step > 0.0 { (t - self.time_s[i]) / step } else { 0.0 };
        (self.row(i), self.row(j), share)
    }

    fn row(&self, i: usize) -> &[f64] {
        &self.values[i * self.width..(i + 1) * self.width]
    }

    /// The last sample at or before `t`; the first one before all.
    pub(crate) fn held(&self, t: f64) -> &[f64] {
        self.row(self.time_s.partition_point(|&x| x <= t).saturating_sub(1))
    }

    /// A number on the line between the samples about `t`.
    pub(crate) fn number(&self, t: f64) -> f64 {
        let (a, b, share) = self.about(t);
        a[0] + (b[0] - a[0]) * share
    }

    /// An angle between the samples about `t` by the shorter way, rad.
    pub(crate) fn angle(&self, t: f64) -> f64 {
        let (a, b, share) = self.about(t);
        let turn = b[0] - a[0];
        a[0] + share * turn.sin().atan2(turn.cos())
    }

    /// A vector on the line between the samples about `t`.
    pub(crate) fn vector(&self, t: f64) -> Vector3<f64> {
        let (a, b, share) = self.about(t);
        let [a, b] = [a, b].map(Vector3::from_column_slice);
        a + (b - a) * share
    }

    /// A vector on the cubic through the four samples about `t` (Lagrange), for what is
    /// differentiated.
    pub(crate) fn cubic<const N: usize>(&self, t: f64) -> [f64; N] {
        self.through_four(t, |_, _| 1.0)
    }

    /// As [`Self::cubic`] for rotations, each with the sign that is nearer to the first; not of
    /// unit length.
    pub(crate) fn cubic_turned(&self, t: f64) -> [f64; 4] {
        self.through_four(t, |first, row| {
            let dot: f64 = first.iter().zip(row).map(|(a, b)| a * b).sum();
            1.0_f64.copysign(dot)
        })
    }

    fn through_four<const N: usize>(
        &self,
        t: f64,
        sign: impl Fn(&[f64], &[f64]) -> f64,
    ) -> [f64; N] {
        let n = self.time_s.len();
        let first =
            self.time_s.partition_point(|&x| x <= t).saturating_sub(2).min(n.saturating_sub(4));
        let four = first..(first + 4).min(n);
        let mut sum = [0.0; N];
        for i in four.clone() {
            let at = |j: usize| (t - self.time_s[j]) / (self.time_s[i] - self.time_s[j]);
            let weight: f64 = four.clone().filter(|j| *j != i).map(at).product();
            let weight = weight * sign(self.row(first), self.row(i));
            for (sum, x) in sum.iter_mut().zip(self.row(i)) {
                *sum += weight * x;
            }
        }
        sum
    }

    /// A rotation between the samples about `t`, given and wanted as `[w, x, y, z]`.
    pub(crate) fn rotation(&self, t: f64) -> Quaternion<f64> {
        let (a, b, share) = self.about(t);
        let [a, b] = [a, b].map(|q| Quaternion::new(q[0], q[1], q[2], q[3]));
        between(a, b, share)
    }
}

/// Normalised interpolation of two rotations by the shorter way.
pub(crate) fn between(a: Quaternion<f64>, b: Quaternion<f64>, share: f64) -> Quaternion<f64> {
    let b = if a.dot(&b) < 0.0 { -b } else { b };
    let q = a + (b - a) * share;
    // At worst the two are a half turn apart, so that this is not 0.
    q * (1.0 / q.norm())
}

/// The times that lie in a span of each list; both in order.
pub(crate) fn common(a: &[Span], b: &[Span]) -> Vec<Span> {
    let mut all = Vec::new();
    let (mut i, mut j) = (0, 0);
    while i < a.len() && j < b.len() {
        let span = (a[i].0.max(b[j].0), a[i].1.min(b[j].1));
        if span.0 < span.1 {
            all.push(span);
        }
        if a[i].1 < b[j].1 { i += 1 } else { j += 1 }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    fn series(time_s: &[f64], values: &[f64]) -> Series {
        let mut log = FlightLog::default();
        for (t, value) in time_s.iter().zip(values) {
            log.source_mut("battery").push(*t, &[("voltage_v", &[*value])]);
        }
        Series::need("f", &log, "battery.voltage_v", 1).unwrap()
    }

    #[test]
    fn a_series_is_a_line_between_samples_and_held_beyond_its_ends() {
        let s = series(&[1.0, 2.0, 4.0], &[10.0, 20.0, 0.0]);
        assert_eq!(
            [0.0, 1.0, 1.5, 2.0, 3.0, 4.0, 9.0].map(|t| s.number(t)),
            [10.0, 10.0, 15.0, 20.0, 10.0, 0.0, 0.0]
        );
        assert_eq!([0.0, 1.9, 2.0, 9.0].map(|t| s.held(t)[0]), [10.0, 10.0, 20.0, 0.0]);
    }

    #[test]
    fn a_cubic_goes_through_uneven_samples() {
        let cube = |t: f64| 1.0 - 2.0 * t + 0.5 * t.powi(3);
        let time_s = [0.0, 1.1, 1.9, 3.0, 4.2, 5.0];
        let s = series(&time_s, &time_s.map(cube));
        for t in [0.0, 0.4, 1.9, 2.5, 3.3, 4.9, 5.0] {
            assert!((s.cubic::<1>(t)[0] - cube(t)).abs() < 1e-12, "{t}");
        }
    }

    #[test]
    fn five_periods_without_a_sample_are_a_gap_and_so_are_nans() {
        let mut time_s: Vec<f64> = (0..20).map(f64::from).collect();
        let mut values = vec![1.0; 20];
        assert_eq!(series(&time_s, &values).spans(), [(0.0, 19.0)]);
        values[5..9].fill(f64::NAN);
        assert_eq!(
            series(&time_s, &values).spans(),
            [(0.0, 19.0)],
            "five periods from sample to sample"
        );
        values[9] = f64::NAN;
        assert_eq!(series(&time_s, &values).spans(), [(0.0, 4.0), (10.0, 19.0)]);
        for t in &mut time_s[15..] {
            *t += 100.0;
        }
        assert_eq!(series(&time_s, &values).spans(), [(0.0, 4.0), (10.0, 14.0), (115.0, 119.0)]);
    }

    #[test]
    fn common_spans_are_the_intersection() {
        let a = [(0.0, 10.0), (20.0, 30.0)];
        assert_eq!(
            common(&a, &[(5.0, 22.0), (23.0, 24.0)]),
            [(5.0, 10.0), (20.0, 22.0), (23.0, 24.0)]
        );
        assert_eq!(common(&a, &[(10.0, 20.0)]), []);
    }

    #[test]
    fn rotations_go_the_shorter_way() {
        let q = Quaternion::new(0.8, 0.6, 0.0, 0.0);
        let middle = between(q, -Quaternion::new(0.8, -0.6, 0.0, 0.0), 0.5);
        assert!((middle - Quaternion::identity()).norm() < 1e-15);
        assert_eq!(between(q, q, 0.3).norm(), 1.0);
    }
}

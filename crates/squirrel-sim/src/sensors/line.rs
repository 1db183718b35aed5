//! What all sensors share: a line of samples with rate and latency, random streams, and errors that
//! several sensors have.

use super::parameters::Timing;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal, StandardUniform};
use rand_pcg::Pcg64Mcg;
use squirrel_core::nalgebra::Vector3;
use std::collections::VecDeque;

/// Random streams of a flight's sensors. A number never changes its meaning: old seeds fly old
/// flights.
#[derive(Debug, Clone, Copy)]
pub(super) enum Stream {
    Imu = 1,
    Attitude = 2,
    Gnss = 3,
    Baro = 4,
    // 5 and from 16 on: sensors that the flight code does not hear (`logged`).
    Imu2 = 6,
    ImuErrors = 7,
    Imu2Errors = 8,
    GnssWander = 9,
    GnssOutliers = 10,
    GnssDropouts = 11,
    BaroDrift = 12,
    Magnetometer = 13,
    Iron = 14,
    Vibration = 15,
}

impl Stream {
    /// * `seed` - of the flight; a sensor with its own seed does not look at it
    pub(super) fn start(self, timing: &Timing, seed: u64) -> Pcg64Mcg {
        let apart = apart(self as u64);
        Pcg64Mcg::seed_from_u64(match (timing.seed, self) {
            (Some(own), Self::Imu | Self::Attitude | Self::Gnss | Self::Baro) => own,
            (Some(own), _) => own.wrapping_add(apart),
            (None, _) => seed.wrapping_add(apart),
        })
    }
}

/// Streams are apart by a large odd number; the seeding itself mixes the bits.
fn apart(stream: u64) -> u64 {
    stream.wrapping_mul(0x9E37_79B9_7F4A_7C15)
}

/// Another stream that begins where this one is, for a copy of the sensors whose noise is to be
/// another.
pub(super) fn fork(rng: &mut Pcg64Mcg) {
    let bits: u64 = StandardUniform.sample(rng);
    *rng = Pcg64Mcg::seed_from_u64(bits ^ 0xD1B5_4A32_D192_ED03);
}

pub(super) fn noise(rng: &mut Pcg64Mcg, sd: f64) -> Vector3<f64> {
    Vector3::from_fn(|_, _| { let x: f64 = StandardNormal.sample(rng); x } * sd)
}

/// From 0 to below 1.
pub(super) fn uniform(rng: &mut Pcg64Mcg) -> f64 {
    StandardUniform.sample(rng)
}

/// What a converter with steps of this size gives; 0: no steps.
pub(super) fn quantised(x: f64, resolution: f64) -> f64 {
    if resolution > 0.0 { (x / resolution).round() * resolution } else { x }
}

/// Time between samples.
#[derive(Debug, Clone, Default)]
pub(super) struct Stopwatch(Option<u64>);

impl Stopwatch {
    /// Since the last call, s; 0 at the first.
    pub(super) fn lap_s(&mut self, time_us: u64) -> f64 {
        let last = self.0.replace(time_us).unwrap_or(time_us);
        time_us.saturating_sub(last) as f64 * 1e-6
    }
}

/// Samples on their way, with the time at which they arrive.
#[derive(Debug, Clone)]
pub(super) struct Line<S> {
    timing: Timing,
    pub(super) rng: Pcg64Mcg,
    taken: u64,
    waiting: VecDeque<(u64, S)>,
}

impl<S> Line<S> {
    pub(super) fn new(timing: Timing, seed: u64, stream: Stream) -> Self {
        Self { timing, rng: stream.start(&timing, seed), taken: 0, waiting: VecDeque::new() }
    }

    /// Of a sensor that has one stream, by its number.
    pub(super) fn numbered(timing: Timing, seed: u64, stream: u64) -> Self {
        let seed = timing.seed.unwrap_or(seed.wrapping_add(apart(stream)));
        Self { timing, rng: Pcg64Mcg::seed_from_u64(seed), taken: 0, waiting: VecDeque::new() }
    }

    /// Takes a sample if one is due, and returns the newest that has arrived. A sensor may have
    /// nothing to say when it is due.
    pub(super) fn poll(
        &mut self,
        time_us: u64,
        sample: impl FnOnce(&mut Pcg64Mcg) -> Option<S>,
    ) -> Option<S> {
        let due = (self.taken as f64 * 1e6 / self.timing.rate_hz).floor() as u64;
        if time_us >= due {
            let late = (self.timing.latency_s * 1e6).round() as u64;
            if let Some(value) = sample(&mut self.rng) {
                self.waiting.push_back((time_us.saturating_add(late), value));
            }
            // Periods shorter than the polling interval do not pile up.
            self.taken =
                (self.taken + 1).max((time_us as f64 * 1e-6 * self.timing.rate_hz) as u64 + 1);
        }
        let mut newest = None;
        while self.waiting.front().is_some_and(|(arrival, _)| *arrival <= time_us) {
            newest = self.waiting.pop_front().map(|(_, value)| value);
        }
        newest
    }
}

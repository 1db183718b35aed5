//! Channels that repeat old values: forward-filled to a higher rate than they were measured at, or
//! stuck for a while.
//!
//! Noise changes the last digit of every sample of an inertial unit, an attitude or a fix; what
//! repeats to the bit was not measured again.

use super::Found;
use crate::flight::series::Span;
use squirrel_log::FlightLog;

/// Part of the samples that must differ from the one before.
const FRESH_MIN: f64 = 0.5;
/// Samples that say something about a rate.
const SAMPLES_MIN: usize = 40;
/// Commands are held by what they drive: slow is what misses the motion itself, Hz, and the rate is
/// not the stamps'.
const COMMAND_HZ: f64 = 25.0;
const COMMAND_FRESH: f64 = 0.25;

/// Channels with the longest time, s, and the number of samples for which one may repeat a value in
/// flight.
const CHANNELS: [(&str, f64, usize); 5] = [
    ("imu.specific_force_body_m_s2", 0.4, 20),
    ("imu.omega_body_rad_s", 0.4, 20),
    ("attitude.q_ned_from_body_wxyz", 0.4, 20),
    ("gnss.velocity_ned_m_s", 1.5, 8),
    ("gnss.position_ned_m", 1.5, 8),
];

/// The first channel that repeats itself in the spans of a flight.
pub(super) fn held(log: &FlightLog, spans: &[Span]) -> Found {
    for (channel, longest_s, longest) in CHANNELS {
        let Some(repeats) = Repeats::of(log, channel, spans) else { continue };
        if repeats.fresh() < FRESH_MIN {
            return Some((channel, repeats.words()));
        }
        let (from_s, until_s, samples) = repeats.run;
        if until_s - from_s > longest_s && samples > longest {
            let words = format!(
                "repeats one value from {from_s:.2} to {until_s:.2} s; cut that part out with `keep`, or give the channel `repeats = \"forward_filled\"`"
            );
            return Some((channel, words));
        }
    }
    let channel = "rotor.command";
    let repeats = Repeats::of(log, channel, spans)?;
    let slow = repeats.fresh() < COMMAND_FRESH && repeats.fresh() * repeats.rate_hz() < COMMAND_HZ;
    slow.then(|| (channel, repeats.words()))
}

/// How often a channel says something new.
pub(super) struct Repeats {
    samples: usize,
    changes: usize,
    time_s: f64,
    /// Longest time without a change: first and last time, s, and samples.
    pub(super) run: (f64, f64, usize),
}

impl Repeats {
    /// Of a channel with enough samples to say something.
    fn of(log: &FlightLog, name: &str, spans: &[Span]) -> Option<Self> {
        Self::counted(log, name, spans).filter(|found| found.samples >= SAMPLES_MIN)
    }

    pub(super) fn counted(log: &FlightLog, name: &str, spans: &[Span]) -> Option<Self> {
        let (time_s, channel) = log.channel(name)?;
        let mut found = Self { samples: 0, changes: 0, time_s: 0.0, run: (0.0, 0.0, 0) };
        for (from_s, until_s) in spans {
            let first = time_s.partition_point(|t| t < from_s);
            let last = time_s.partition_point(|t| t <= until_s);
            let mut began = first;
            for i in first + 1..last {
                found.samples += 1;
                found.time_s += time_s[i] - time_s[i - 1];
                if channel.row(i) != channel.row(i - 1) {
                    found.changes += 1;
                    began = i;
                } else if time_s[i] - time_s[began] > found.run.1 - found.run.0 {
                    found.run = (time_s[began], time_s[i], i - began);
                }
            }
        }
        Some(found)
    }

    /// Part of the samples that differ from the one before.
    pub(super) fn fresh(&self) -> f64 {
        self.changes as f64 / self.samples as f64
    }

    fn rate_hz(&self) -> f64 {
        self.samples as f64 / self.time_s
    }

    fn words(&self) -> String {
        format!(
            "is stamped at {:.0} Hz and changes at {:.1} Hz: old values are held; give the channel `repeats = \"forward_filled\"`",
            self.rate_hz(),
            self.rate_hz() * self.fresh()
        )
    }
}

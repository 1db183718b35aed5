//! Flight logs: what a flight looks like in memory and in an MCAP file.
//!
//! A [`FlightLog`] is a set of sources (`imu`, `gnss`, `control.inner`, ...), each with its own time axis, each with
//! named channels (`imu.omega_body_rad_s`). Sources run at their own rate; a log may lack any of them.

use std::collections::BTreeMap;

/// One channel of a source: `width` numbers a sample, row after row.
#[derive(Debug, Clone, PartialEq)]
pub struct Channel {
    /// Numbers per sample, at least 1.
    pub width: usize,
    /// `time_s.len() * width` numbers, sample-major. NaN marks a sample that the source did not give.
    pub values: Vec<f64>,
}

/// One source of a flight: a time axis and the channels that share it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Source {
    /// Time of each sample, s, strictly increasing.
    pub time_s: Vec<f64>,
    /// Channels by their short name (`omega_body_rad_s`).
    pub channels: BTreeMap<String, Channel>,
}

/// A flight in memory.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FlightLog {
    /// Free text that describes the flight: `vehicle_toml`, `arm`, `scenario_toml`, `seed`, `version`, `git`.
    pub metadata: BTreeMap<String, String>,
    /// Sources by name (`imu`, `control.inner`).
    pub sources: BTreeMap<String, Source>,
}

impl Channel {
    /// Sample `i` as a slice of `width` numbers.
    ///
    /// # Panics
    /// If `i` is past the last sample.
    pub fn row(&self, i: usize) -> &[f64] {
        &self.values[i * self.width..(i + 1) * self.width]
    }
}

impl FlightLog {
    /// The time axis and the channel of a full name such as `imu.omega_body_rad_s`; `None` if the log lacks it.
    pub fn channel(&self, name: &str) -> Option<(&[f64], &Channel)> {
        let (source, channel) = name.rsplit_once('.')?;
        let source = self.sources.get(source)?;
        Some((&source.time_s, source.channels.get(channel)?))
    }
}

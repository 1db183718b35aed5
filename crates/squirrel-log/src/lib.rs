//! Flight logs: what a flight looks like in memory and in an MCAP file.
//!
//! A [`FlightLog`] is a set of sources (`imu`, `gnss`, `control.inner`, ...), each with its own
//! time axis, each with named channels (`imu.omega_body_rad_s`). Sources run at their own rate; a
//! log may lack any of them.
//!
//! In the file each source is a topic whose messages are described by a protobuf schema in the
//! file, so that Foxglove and the MCAP libraries of other languages read it without squirrel.
//!
//! - [`flight_code`] records what the flight code was given and what it answered, and rebuilds its
//!   frames from a log.
//! - [`import`] makes a log of foreign files, by a map or by what an autopilot writes.
//! - [`files`] writes whatever is written, whole or not at all, and tells which paths are one file.
//!
//! ```
//! # let folder = std::env::temp_dir();
//! # let path = folder.join(format!("squirrel-log-doctest-{}.mcap", std::process::id()));
//! use squirrel_log::FlightLog;
//!
//! let mut log = FlightLog::default();
//! let imu = log.source_mut("imu");
//! imu.push(0.00, &[("omega_body_rad_s", &[0.0, 0.0, 0.1])]);
//! imu.push(0.01, &[("omega_body_rad_s", &[0.0, 0.0, 0.2])]);
//! log.write(&path)?;
//!
//! let again = FlightLog::read(&path)?;
//! let (time_s, omega) = again.channel("imu.omega_body_rad_s").expect("was written");
//! assert_eq!((time_s[1], omega.row(1)), (0.01, &[0.0, 0.0, 0.2][..]));
//! # std::fs::remove_file(&path).expect("was there");
//! # Ok::<(), squirrel_log::LogError>(())
//! ```

pub mod files;
pub mod flight_code;
pub mod import;
pub mod toml_text;

mod check;
mod container;
mod envelope;
mod error;
mod foxglove;
mod message;
mod pieces;
mod read;
mod schema;
mod write;

use std::collections::BTreeMap;

pub use check::clock_jump;
pub use error::LogError;
pub use pieces::{LogReader, LogWriter};
pub use read::Recovery;

/// Name of the MCAP metadata record that holds [`FlightLog::metadata`].
const METADATA_NAME: &str = "squirrel";

/// What the header of a file says of who wrote it: in one of these the metadata have a checksum.
const LIBRARY: &str = "squirrel 2";
/// Key in that record of the CRC32 over all other entries: what of a file that was cut has no other
/// checksum.
const METADATA_CRC: &str = "metadata_crc32";

/// CRC32 over keys and values of the metadata, with the length of each.
fn metadata_crc32(metadata: &BTreeMap<String, String>) -> String {
    let mut hasher = crc32fast::Hasher::new();
    for text in metadata.iter().flat_map(|(key, value)| [key, value]) {
        hasher.update(&(text.len() as u64).to_le_bytes());
        hasher.update(text.as_bytes());
    }
    format!("{:08x}", hasher.finalize())
}

/// One channel of a source: `width` numbers a sample, row after row.
#[derive(Debug, Clone, PartialEq)]
pub struct Channel {
    /// Numbers per sample, at least 1.
    pub width: usize,
    /// `time_s.len() * width` numbers, sample-major. NaN marks a sample that the source did not
    /// give.
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
    /// Free text that describes the flight: `vehicle_toml`, `parnn_weights_hex`, `arm`,
    /// `scenario_toml`, `seed`, `version`, `git`.
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
    /// The time axis and the channel of a full name such as `imu.omega_body_rad_s`; `None` if the
    /// log lacks it.
    pub fn channel(&self, name: &str) -> Option<(&[f64], &Channel)> {
        let (source, channel) = name.rsplit_once('.')?;
        let source = self.sources.get(source)?;
        Some((&source.time_s, source.channels.get(channel)?))
    }

    /// The source of that name, made empty if the log lacks it.
    pub fn source_mut(&mut self, name: &str) -> &mut Source {
        self.sources.entry(name.to_owned()).or_default()
    }
}

impl FlightLog {
    /// Appends the samples of a later piece of the same flight.
    pub fn append(&mut self, piece: Self) {
        for (name, piece) in piece.sources {
            match self.sources.get_mut(&name) {
                Some(source) if !source.time_s.is_empty() => source.append(&piece),
                _ => drop(self.sources.insert(name, piece)),
            }
        }
    }

    /// Takes out what is before a time, s; what is left has the same channels.
    #[must_use]
    pub fn split_before(&mut self, time_s: f64) -> Self {
        let split = |(name, source): (&String, &mut Source)| {
            let samples = source.time_s.partition_point(|sample_s| *sample_s < time_s);
            (samples > 0).then(|| (name.clone(), source.take(samples)))
        };
        let sources = self.sources.iter_mut().filter_map(split).collect();
        Self { metadata: BTreeMap::new(), sources }
    }
}

impl Source {
    /// Takes out the first samples.
    ///
    /// # Panics
    /// If there are fewer.
    #[must_use]
    pub fn take(&mut self, samples: usize) -> Self {
        let front = |values: &mut Vec<f64>, count| values.drain(..count).collect::<Vec<_>>();
        let channels = self.channels.iter_mut().map(|(name, channel)| {
            let width = channel.width;
            let values = front(&mut channel.values, samples * width);
            (name.clone(), Channel { width, values })
        });
        let channels = channels.collect();
        Self { time_s: front(&mut self.time_s, samples), channels }
    }

    /// A copy of the samples from one on.
    ///
    /// # Panics
    /// If there are fewer.
    #[must_use]
    pub fn from_sample(&self, first: usize) -> Self {
        let channels = self.channels.iter().map(|(name, channel)| {
            let values = channel.values[first * channel.width..].to_vec();
            (name.clone(), Channel { width: channel.width, values })
        });
        Self { time_s: self.time_s[first..].to_vec(), channels: channels.collect() }
    }

    /// Appends the samples of a later piece of the same source. A channel that one of the two lacks
    /// has NaN there.
    fn append(&mut self, piece: &Self) {
        let (before, after) = (self.time_s.len(), piece.time_s.len());
        self.time_s.extend_from_slice(&piece.time_s);
        for (name, channel) in &piece.channels {
            let own = self.channels.entry(name.clone()).or_insert_with(|| {
                let values = vec![f64::NAN; before * channel.width];
                Channel { width: channel.width, values }
            });
            own.values.extend_from_slice(&channel.values);
        }
        for channel in self.channels.values_mut() {
            channel.values.resize((before + after) * channel.width, f64::NAN);
        }
    }

    /// Appends one sample: its time, s, and a row of every channel. The first sample makes the
    /// channels.
    ///
    /// # Panics
    /// If a later sample has other channels or widths than the first, or a row is empty: the caller
    /// builds the rows, so that is a mistake in the program. Times are checked when the log is
    /// written.
    pub fn push(&mut self, time_s: f64, rows: &[(&str, &[f64])]) {
        if self.time_s.is_empty() {
            let channel = |&(name, row): &(&str, &[f64])| {
                (name.to_owned(), Channel { width: row.len(), values: Vec::new() })
            };
            self.channels = rows.iter().map(channel).collect();
        }
        assert_eq!(
            rows.len(),
            self.channels.len(),
            "a sample has every channel of its source once"
        );
        for &(name, row) in rows {
            let Some(channel) = self.channels.get_mut(name) else {
                panic!("`{name}` is not in the first sample")
            };
            assert!(
                !row.is_empty() && row.len() == channel.width,
                "`{name}` has {} numbers, in the first sample {}",
                row.len(),
                channel.width
            );
            channel.values.extend_from_slice(row);
        }
        self.time_s.push(time_s);
    }
}

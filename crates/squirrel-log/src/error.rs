//! What can be wrong with a flight log: one line each, which starts with the file name as the
//! caller gave it.

use crate::files::TooLarge;
use std::io;

/// A flight log that cannot be written or read.
#[derive(Debug, thiserror::Error)]
pub enum LogError {
    /// The operating system refused (no such file, no right, disk full).
    #[error("{file}: {error}")]
    Io {
        /// File as given.
        file: String,
        /// What the operating system said.
        #[source]
        error: io::Error,
    },
    /// A file of no bytes.
    #[error("{file}: the file is empty")]
    Empty {
        /// File as given.
        file: String,
    },
    /// Neither the beginning nor the end of the file is that of an MCAP file.
    #[error("{file}: not an MCAP file; `squirrel import` reads other logs")]
    NotMcap {
        /// File as given.
        file: String,
    },
    /// A whole MCAP file that squirrel did not write.
    #[error("{file}: not a flight log of squirrel: {why}; `squirrel import` reads other logs")]
    Foreign {
        /// File as given.
        file: String,
        /// What it has or lacks.
        why: String,
    },
    /// What comes out of the file is larger than may be.
    #[error("{file}: {error}")]
    TooLarge {
        /// File as given.
        file: String,
        /// What it may be.
        #[source]
        error: TooLarge,
    },
    /// Bytes have changed since the file was written.
    #[error("{file}: corrupt: {what}")]
    Corrupt {
        /// File as given.
        file: String,
        /// The place, and the CRC32 or length that does not fit.
        what: String,
    },
    /// The end of the file is missing, its beginning is good.
    #[error(
        "{file}: truncated at byte {bytes_total}: {duration_s:.3} s of flight ({messages} messages) are whole; \
         recover them with `squirrel import --recover`"
    )]
    Truncated {
        /// File as given.
        file: String,
        /// Length of the file, bytes.
        bytes_total: u64,
        /// From the first to the last sample that [`FlightLog::recover`](super::FlightLog::recover)
        /// would give, s.
        duration_s: f64,
        /// Samples of all sources that it would give.
        messages: u64,
    },
    /// The end of the file is missing, and what is left has not even the metadata of the flight.
    #[error("{file}: truncated at byte {bytes_total}: nothing of the flight is whole")]
    NothingWhole {
        /// File as given.
        file: String,
        /// Length of the file, bytes.
        bytes_total: u64,
    },
    /// A value was changed after its CRC32 was taken.
    #[error("{file}: {channel} at {time_s:.6} s: value does not match its CRC32")]
    ValueCrc {
        /// File as given.
        file: String,
        /// Full name of the channel (`imu.omega_body_rad_s`).
        channel: String,
        /// Time of the sample, s.
        time_s: f64,
    },
    /// A sample has more or fewer numbers than the samples before it.
    #[error("{file}: {channel} at {time_s:.6} s: {found} numbers, before it {width} a sample")]
    RowWidth {
        /// File as given.
        file: String,
        /// Full name of the channel.
        channel: String,
        /// Time of the sample, s.
        time_s: f64,
        /// Numbers per sample so far.
        width: usize,
        /// Numbers in this sample.
        found: usize,
    },
    /// A time that a log cannot have.
    #[error("{file}: {source_name}: time_s[{index}] = {time_s}: {why}")]
    Time {
        /// File as given.
        file: String,
        /// Name of the source (`imu`).
        source_name: String,
        /// Index of the sample.
        index: usize,
        /// Its time, s.
        time_s: f64,
        /// Which rule it breaks.
        why: String,
    },
    /// A channel whose number of values does not fit its time axis.
    #[error("{file}: {channel}: {values} values for {samples} samples of width {width}")]
    Length {
        /// File as given.
        file: String,
        /// Full name of the channel.
        channel: String,
        /// Values that the channel has.
        values: usize,
        /// Samples of its source.
        samples: usize,
        /// Numbers per sample; must be at least 1.
        width: usize,
    },
    /// A name that cannot be a topic or a field.
    #[error("{file}: `{name}` cannot be the name of a {kind}: {why}")]
    Name {
        /// File as given.
        file: String,
        /// The name.
        name: String,
        /// `source` or `channel`.
        kind: &'static str,
        /// Which rule it breaks.
        why: &'static str,
    },
    /// More channels than field numbers.
    #[error("{file}: {source_name}: {channels} channels, a source holds at most {most}")]
    TooManyChannels {
        /// File as given.
        file: String,
        /// Name of the source.
        source_name: String,
        /// Channels that it has.
        channels: usize,
        /// Channels that it could have.
        most: usize,
    },
    /// The metadata `obstacles_json` is not a list of obstacles.
    #[error("{file}: metadata `obstacles_json`: {error} (need [[north_m, east_m, radius_m], ...])")]
    Obstacles {
        /// File as given.
        file: String,
        /// What the JSON reader said.
        #[source]
        error: serde_json::Error,
    },
}

//! Why a gap cannot be measured.

/// What is wrong with a set of flights; one line that names the flight, the channel and the value.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GapError {
    /// Nothing to look at.
    #[error("flights: none given, at least one is needed")]
    NoFlights,
    /// Two flights have one name, so that a result could mean either.
    #[error("{flight}: two flights have this name")]
    SameName {
        /// The name.
        flight: String,
    },
    /// The plant cannot be stepped with these numbers.
    #[error("{vehicle}: {problem}")]
    Vehicle {
        /// Name of the vehicle.
        vehicle: String,
        /// `field = value: reason`.
        problem: String,
    },
    /// A number of the vehicle whose tolerance naming needs.
    #[error("{vehicle}: {field} = {value}: has no sd; naming needs to know how far it may be off")]
    Tolerance {
        /// Name of the vehicle.
        vehicle: String,
        /// The field.
        field: String,
        /// Its value.
        value: f64,
    },
    /// No flight of a baseline is left.
    #[error("baseline: no flight is left: {words}")]
    Baseline {
        /// What is wrong with the first.
        words: String,
    },
    /// A channel without which there is no residual.
    #[error("{flight}: {channel}: missing; the residual needs it")]
    Missing {
        /// Name of the flight.
        flight: String,
        /// Full name of the channel.
        channel: &'static str,
    },
    /// A channel without which there is no residual, and all that it could be had from.
    #[error("{flight}: {channel}: missing; the residual needs it, or {instead}")]
    Neither {
        /// Name of the flight.
        flight: String,
        /// Full name of the channel.
        channel: &'static str,
        /// What would do instead.
        instead: &'static str,
    },
    /// A channel of another shape than its name promises.
    #[error("{flight}: {channel}: has {found} numbers a sample, must have {needed}")]
    Width {
        /// Name of the flight.
        flight: String,
        /// Full name of the channel.
        channel: &'static str,
        /// Numbers a sample in the log.
        found: usize,
        /// Numbers a sample that the channel must have.
        needed: usize,
    },
    /// The log is of another vehicle.
    #[error("{flight}: rotor.command: has {log} rotors, the vehicle {vehicle} has {rotors}")]
    Rotors {
        /// Name of the flight.
        flight: String,
        /// Rotors in the log.
        log: usize,
        /// Name of the vehicle.
        vehicle: String,
        /// Rotors of the vehicle.
        rotors: usize,
    },
    /// A channel whose numbers do not fit its time axis.
    #[error("{flight}: {channel}: has {found} numbers, its time axis asks for {needed}")]
    Length {
        /// Name of the flight.
        flight: String,
        /// Full name of the channel.
        channel: &'static str,
        /// Numbers in the channel.
        found: usize,
        /// Samples times numbers a sample.
        needed: usize,
    },
    /// A time axis that does not run forwards.
    #[error(
        "{flight}: {channel}: time_s[{index}] = {time_s}: must be finite and later than the sample before"
    )]
    Time {
        /// Name of the flight.
        flight: String,
        /// Full name of the channel.
        channel: &'static str,
        /// Sample, from 0.
        index: usize,
        /// Its time, s.
        time_s: f64,
    },
    /// A clock that jumps: what is between would be invention, and costs time and memory.
    #[error(
        "{flight}: {channel}: time_s[{index}] = {time_s}: {problem}; the clock has jumped, or the file holds more than a flight"
    )]
    Jump {
        /// Name of the flight.
        flight: String,
        /// Full name of the channel.
        channel: &'static str,
        /// Sample, from 0.
        index: usize,
        /// Its time, s.
        time_s: f64,
        /// How far from which other it is.
        problem: String,
    },
    /// Samples closer than any sensor's: the clock stands still, or its unit is wrong.
    #[error("{flight}: {channel}: its rate is {rate_hz:e} Hz, must be at most {most_hz:e} Hz")]
    Fast {
        /// Name of the flight.
        flight: String,
        /// Full name of the channel.
        channel: &'static str,
        /// Rate of the log, Hz.
        rate_hz: f64,
        /// Highest rate, Hz.
        most_hz: f64,
    },
    /// An attitude that is no rotation.
    #[error("{flight}: {channel}: norm {norm} at {time_s:.3} s, must be 1 within 5 %")]
    Rotation {
        /// Name of the flight.
        flight: String,
        /// Full name of the channel.
        channel: &'static str,
        /// Time in the flight, s.
        time_s: f64,
        /// Norm of the quaternion.
        norm: f64,
    },
    /// A channel that is there and holds nothing.
    #[error(
        "{flight}: {channel}: none of its {samples} samples has usable numbers, at least 2 are needed"
    )]
    Empty {
        /// Name of the flight.
        flight: String,
        /// Full name of the channel.
        channel: &'static str,
        /// Samples in the log.
        samples: usize,
    },
    /// A rate that cannot carry the pass band.
    #[error("{flight}: {channel}: its rate is {rate_hz:.3} Hz, must be at least {least_hz} Hz")]
    Rate {
        /// Name of the flight.
        flight: String,
        /// Full name of the channel.
        channel: &'static str,
        /// Rate of the log, Hz.
        rate_hz: f64,
        /// Smallest rate, Hz.
        least_hz: f64,
    },
    /// Less than a second in which all channels exist and the filter has no edge.
    #[error(
        "{flight}: {channel}: leaves {usable_s:.3} s of usable flight, at least {least_s} s are needed{cut}"
    )]
    TooShort {
        /// Name of the flight.
        flight: String,
        /// The channel that leaves so little.
        channel: &'static str,
        /// Usable time, s.
        usable_s: f64,
        /// Smallest usable time, s.
        least_s: f64,
        /// How gaps cut it, behind a semicolon; nothing if they do not.
        cut: String,
    },
    /// Numbers of the flights or of the vehicle that are too large for the linear algebra.
    #[error(
        "flights: their residual under some hypothesis is not finite; `squirrel gap find` shows where it is large"
    )]
    NotFinite,
    /// A residual that nothing can be computed with.
    #[error(
        "{flight}: {channel}: the residual at {time_s:.3} s is {value:e}, must be finite and below {most:e}"
    )]
    TooLarge {
        /// Name of the flight.
        flight: String,
        /// Channel of the residual.
        channel: &'static str,
        /// Time in the flight, s.
        time_s: f64,
        /// The residual, N or N m.
        value: f64,
        /// Largest residual, N or N m.
        most: f64,
    },
}

impl GapError {
    /// The channel of one flight whose samples are to blame, so that the others can go on without
    /// it. A log that lacks a channel, or is of another vehicle, is a mistake of whoever gave it,
    /// and stays an error.
    pub(crate) fn channel(&self) -> Option<&'static str> {
        match self {
            Self::Time { channel, .. }
            | Self::Jump { channel, .. }
            | Self::Fast { channel, .. }
            | Self::Rotation { channel, .. }
            | Self::Rate { channel, .. }
            | Self::TooShort { channel, .. } => Some(channel),
            _ => None,
        }
    }
}

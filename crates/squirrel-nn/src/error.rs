//! Why a network cannot be trained, saved or loaded.

use squirrel_sim::weights::WeightsError;

/// What is wrong; one line that names the file or flight, the field and the value.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum NnError {
    /// A flight log lacks a channel that labels are made of.
    #[error("{flight}: {channel}: missing; {needed_for}")]
    Channel {
        /// The flight.
        flight: String,
        /// Name of the channel.
        channel: &'static str,
        /// What it is needed for.
        needed_for: &'static str,
    },
    /// A channel that cannot be what its name says.
    #[error("{flight}: {channel}: {problem}")]
    Samples {
        /// The flight.
        flight: String,
        /// Name of the channel.
        channel: &'static str,
        /// What is wrong.
        problem: String,
    },
    /// A flight in which the wings are never spread for a window.
    #[error(
        "{flight}: wing.command: never above {spread} on both sides for {window_s} s in the air; nothing to learn from"
    )]
    Folded {
        /// The flight.
        flight: String,
        /// Command of a spread wing.
        spread: f64,
        /// Length of a window, s.
        window_s: f64,
    },
    /// A vehicle without wings, or one that the plant refuses.
    #[error("{vehicle}: {problem}")]
    Vehicle {
        /// Name of the vehicle.
        vehicle: String,
        /// What is wrong.
        problem: String,
    },
    /// A file of weights.
    #[error(transparent)]
    Weights(#[from] WeightsError),
    /// A window that nothing can be learned from.
    #[error("{flight}: window {window}: {field} = {value:?}: {reason}")]
    Window {
        /// Name of the flight.
        flight: String,
        /// Place of the window in the flight, from 0.
        window: usize,
        /// The field.
        field: &'static str,
        /// Its numbers.
        value: Vec<f32>,
        /// Why not.
        reason: &'static str,
    },
    /// Two flights have one name, so that a split by flight could mean either.
    #[error("{flight}: two flights have this name")]
    SameName {
        /// The name.
        flight: String,
    },
    /// A flight that is asked for and not there.
    #[error("{flight}: no flight has this name")]
    NoFlight {
        /// The name.
        flight: String,
    },
    /// Nothing to learn from or to judge by.
    #[error("{set}: has no windows, at least one is needed")]
    Empty {
        /// Which set.
        set: &'static str,
    },
    /// A setting out of range.
    #[error("{field} = {value}: {reason}")]
    Setting {
        /// Name of the setting.
        field: &'static str,
        /// Its value.
        value: String,
        /// What it must be.
        reason: &'static str,
    },
    /// Training left what numbers can hold.
    #[error("{model}: loss = {loss} in epoch {epoch}: training diverged; a smaller rate may help")]
    Diverged {
        /// Name of the model.
        model: &'static str,
        /// Epoch, from 1.
        epoch: usize,
        /// Mean squared error, N^2.
        loss: f64,
    },
}

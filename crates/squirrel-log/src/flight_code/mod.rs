//! What the flight code was given and what it answered, as channels of a log; and the way back to
//! its sensor frames.
//!
//! Inputs are `f32` and stored as `f64`, so that a log holds their exact bits: the flight code
//! flies the same again on them.

mod inputs;
mod outputs;

pub use inputs::{Frames, INPUT_SOURCES, InputError, Inputs, frames};
pub use outputs::{Moved, record_output, record_reference};

use squirrel_core::nalgebra::Vector3;

/// Version of the log's content.
pub const FORMAT: &str = "1";

/// Source of what the flight code believes.
pub const ESTIMATE: &str = "estimate";
/// Source of the wind as the flight code estimates it.
pub const WIND: &str = "estimate.wind";
/// Source of what an offboard computer follows, where that is not the mission.
pub const FOLLOWED: &str = "offboard.reference";
fn wide(v: &Vector3<f32>) -> [f64; 3] {
    [f64::from(v.x), f64::from(v.y), f64::from(v.z)]
}

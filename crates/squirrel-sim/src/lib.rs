//! The simulator of squirrel: plant, world, sensors, flight log and import.
pub mod log;
#[cfg(feature = "rapier")]
pub mod world;

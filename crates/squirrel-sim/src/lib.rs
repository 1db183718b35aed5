//! The simulator of squirrel: plant, world, sensors, the flight in closed loop, batches of
//! vehicles.
//!
//! - [`flight`] closes the loop: [`plant`] (and [`world`] near contact) moves, [`sensors`] measure,
//!   the flight code of `squirrel-core` commands, the log records. [`replay`] runs the flight code
//!   again on a log's inputs.
//! - [`vehicle_file`], [`weights`] and [`scenario`] read what to fly; [`arm`] says who flies;
//!   [`faults`] breaks sensors in recorded frames; [`track`] is a plan to follow.
//! - [`batch`] flies thousands of vehicles at once on wide registers, [`task`] makes environments
//!   of it in which policies learn.

pub mod arm;
pub mod batch;
pub mod estimator;
pub mod faults;
pub mod flight;
pub mod plant;
mod quantity;
pub mod replay;
pub mod scenario;
pub mod sensors;
pub mod setting;
mod tape;
pub mod task;
pub mod track;
pub mod vehicle_file;
pub mod weights;
#[cfg(feature = "rapier")]
pub mod world;

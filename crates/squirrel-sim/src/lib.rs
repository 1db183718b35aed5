//! The simulator of squirrel: plant, world, sensors, the flight in closed loop.
//!
//! - [`flight`] closes the loop: [`plant`] (and [`world`] near contact) moves, [`sensors`] measure,
//!   the flight code of `squirrel-core` commands, the log records. [`replay`] runs the flight code
//!   again on a log's inputs.
//! - [`vehicle_file`], [`weights`] and [`scenario`] read what to fly; [`arm`] says who flies;
//!   [`faults`] breaks sensors in recorded frames; [`track`] is a plan to follow.
//! - [`simd`] asks the processor for its registers, on which `squirrel-batch` flies thousands of
//!   vehicles at once, with the numbers that [`tape`] writes and reads.
//!
//! ```
//! use squirrel_sim::arm::Arm;
//! use squirrel_sim::flight::{Flight, Integrator, Setup};
//! use squirrel_sim::scenario::Scenario;
//! use squirrel_sim::vehicle_file::VehicleFile;
//!
//! let setup = Setup {
//!     vehicle: VehicleFile::squirrel(),
//!     arm: Arm::TwccPlus,
//!     scenario: Scenario { seed: 1, ..Scenario::find("hover")? },
//!     integrator: Integrator::Rk4,
//! };
//! let Flight { metrics, log } = setup.fly(true, |_| {})?;
//! assert!(metrics.rmse_m < 1.0 && log.is_some());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod arm;
pub mod estimator;
pub mod faults;
pub mod flight;
pub mod plant;
mod quantity;
pub mod replay;
pub mod scenario;
pub mod sensors;
pub mod setting;
pub mod simd;
pub mod tape;
pub mod track;
pub mod vehicle_file;
pub mod weights;
#[cfg(feature = "rapier")]
pub mod world;

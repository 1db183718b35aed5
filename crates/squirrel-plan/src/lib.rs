//! What wings make reachable, and trajectories that use it.
//!
//! World NED, body FRD, SI and radians, f64. Everything here is deterministic, reads no clock and
//! prints nothing.
//!
//! ```
//! use squirrel_core::frames::In;
//! use squirrel_core::nalgebra::Vector3;
//! use squirrel_plan::reach::{Question, Reach, Tilt};
//! use squirrel_plan::wing::{WingForce, WingModel};
//! use squirrel_sim::vehicle_file::VehicleFile;
//!
//! // Upwards at 7 m/s, with thrust of 1.1 weights: what do wings add?
//! let file = VehicleFile::squirrel();
//! let vehicle = file.vehicle.parameters();
//! let reach = Reach::new(&Question {
//!     mass_kg: vehicle.mass_kg,
//!     thrust_max_n: 1.1 * file.vehicle.weight_n(),
//!     tilt: Tilt::named("box", vehicle.limits.tilt_max_rad, 0.0)?,
//!     velocity: In::new(Vector3::new(7.0, 0.0, 0.0)),
//!     wing: WingForce::of(&file, WingModel::Flat)?,
//! })?;
//! let up = In::new(Vector3::new(0.0, 0.0, -1.0));
//! assert!(reach.support(up).value_m_s2 > 1.7 * reach.folded(up).value_m_s2);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![forbid(unsafe_code)]
#![cfg_attr(test, allow(clippy::unwrap_used, reason = "tests"))]

pub mod air;
pub mod pilot;
pub mod reach;
pub mod trajectory;
pub mod wing;

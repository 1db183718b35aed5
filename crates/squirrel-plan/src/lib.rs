//! What wings make reachable, and trajectories that use it.
//!
//! World NED, body FRD, SI and radians, f64. Everything here is deterministic, reads no clock and
//! prints nothing.
#![forbid(unsafe_code)]
#![cfg_attr(test, allow(clippy::unwrap_used, reason = "tests"))]

pub mod air;
pub mod pilot;
pub mod reach;
pub mod trajectory;
pub mod wing;

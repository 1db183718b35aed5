//! The flight code on a real part, an STM32H747: everything around it that needs no hardware.
//!
//! ```text
//! IMU, GNSS, baro -> sensors (what is new; at rest, where a flight would begin) -> core's step, 300 Hz -> outputs
//!                                  arming, 10 Hz -> which of the outputs are let through
//!                                  log <- setup, frames, hash of the outputs
//! ```
//! What needs hardware is in the image (`main.rs`, `board.rs`), and thin. **Nobody has flown it**:
//! it is built and sized, these modules are tested on the host, and that is all that is known of
//! it.

#![cfg_attr(not(test), no_std)]
#![forbid(unsafe_code)]

pub mod arming;
pub mod flight;
pub mod gnss;
pub mod log;
pub mod outputs;
pub mod sensors;
pub mod setup;

//! The tests of batches and of environments over them. One binary: what they share is compiled and
//! linked once.
#![allow(clippy::unwrap_used, reason = "tests")]

mod autopilot;
mod errors;
mod identity;
mod lanes;
mod memory;
mod pool;
mod support;
mod tasks;
mod vehicle;

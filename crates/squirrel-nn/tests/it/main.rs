//! The tests of learned models. One binary: what they share is compiled and linked once.
#![allow(clippy::unwrap_used, reason = "tests")]

mod attack;
mod files;
mod flight;
mod labels;
mod support;
mod training;

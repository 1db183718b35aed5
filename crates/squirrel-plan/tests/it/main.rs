//! The tests of reach and plans. One binary: what they share is compiled and linked once.
#![allow(clippy::unwrap_used, reason = "tests")]

mod avoidance;
mod outcomes;
mod reach;
mod reach_holds;
mod support;
mod tasks;
mod wind;

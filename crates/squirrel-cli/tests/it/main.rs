//! The tests of the command line. One binary: what they share is compiled and linked once.
#![allow(clippy::unwrap_used, reason = "tests")]

mod crash;
mod crowd;
mod disk;
mod export_vectors;
mod gap;
mod overwrite;
mod parts;
mod plan;
mod program;
mod reach;
mod said;
mod support;
mod terminal;
mod train;
mod vehicle;
mod view;

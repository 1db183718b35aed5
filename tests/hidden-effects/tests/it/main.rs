//! The tests of the blind bench. One binary: what they share is compiled and linked once.
#![allow(clippy::unwrap_used, reason = "tests")]

mod bench;
mod flights;
mod gusts;
mod identify_then_fly;
mod misfit;
mod seen_by_find;
mod squirrel_made;
mod twins;

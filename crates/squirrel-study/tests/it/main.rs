//! The tests of the experiments. One binary: what they share is compiled and linked once.
#![allow(clippy::unwrap_used, reason = "tests")]

mod attack;
mod claims;
mod dispersion;
mod faults;
mod filters;
mod pages;
mod parts;
mod planning;
mod real_filters;
mod recorded;
mod statistics;
mod table2;
mod thrust;
mod until;

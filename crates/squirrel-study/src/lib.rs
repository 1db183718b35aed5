//! The experiments: arms against each other on paired seeds, with intervals.
//!
//! - [`thrust`]: what wings are worth as a function of the effective thrust-to-weight ratio.
//! - [`table2`]: how well models of the wing force predict flights that they have not seen (the paper's Table II).
//! - [`wing_flights`]: random flights with spread wings, to learn from and to be judged by.
//! - [`filters`]: how far estimators of attitude are off, with a calibrated gyro and without.
//! - [`in_loop`]: flights on estimates beside flights on the truth, over suites of sensors.
//! - [`faults`]: what becomes of flights in which one thing fails.
//! - [`journal`]: trials on disk, so that a study that was stopped goes on.
//! - [`pages`]: the studies of controllers as HTML files, with the figures that the paper shows.
//! - [`statistics`]: means, and intervals by a paired bootstrap.

pub mod campaign;
pub mod faults;
pub mod filters;
pub mod forest;
pub mod in_loop;
pub mod journal;
pub mod merge;
pub mod pages;
pub mod statistics;
pub mod steering;
pub mod table2;
pub mod table3;
pub mod thrust;
pub mod tracking;
pub mod wing_flights;

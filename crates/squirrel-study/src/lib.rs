//! The experiments: arms against each other on paired seeds, with intervals.
//!
//! - [`forest`]: who comes through the paper's forest, and who owes it to wings.
//! - [`steering`]: the paper's figure of steering angles and speeds, in its own mode and on the independent plant.
//! - [`table3`]: the paper's real flights, with the error as its log has it.
//! - [`thrust`]: what wings are worth as a function of the effective thrust-to-weight ratio, and where a battery brings it.
//! - [`campaign`], [`tracking`]: what these have in common: flights of every arm under every condition on paired seeds.
//! - [`planning`]: what wings buy where both plan: avoidance tasks, planned and flown.
//! - [`table2`]: how well models of the wing force predict flights that they have not seen (the paper's Table II).
//! - [`wing_flights`]: random flights with spread wings, to learn from and to be judged by.
//! - [`filters`]: how far estimators of attitude are off, with a calibrated gyro and without.
//! - [`in_loop`]: flights on estimates beside flights on the truth, over suites of sensors.
//! - [`faults`]: what becomes of flights in which one thing fails.
//! - [`paper`]: what follows from the paper's own numbers without a flight.
//! - [`pages`]: the studies of controllers as HTML files, with the figures that the paper shows.
//! - [`journal`], [`merge`]: trials on disk, so that a study that was stopped goes on, and parts of one are put together.
//! - [`statistics`]: means, shares, and intervals.

pub mod campaign;
pub mod faults;
pub mod filters;
pub mod forest;
pub mod in_loop;
pub mod journal;
pub mod merge;
pub mod pages;
pub mod paper;
pub mod planning;
pub mod statistics;
pub mod steering;
pub mod table2;
pub mod table3;
pub mod thrust;
pub mod tracking;
pub mod wing_flights;

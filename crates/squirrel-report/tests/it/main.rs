//! The tests of charts and reports.
#![allow(clippy::unwrap_used, reason = "tests")]

mod chart;
mod chart_kinds;
mod flight;
mod support;
mod view;

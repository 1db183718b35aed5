//! The tests of charts and reports.

mod chart;
mod chart_kinds;
mod flight;
mod support;

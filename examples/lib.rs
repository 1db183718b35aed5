//! A course in flights and studies, one lesson a file, each a program and a test:
//! `cargo run --release -p squirrel-examples --example NAME`.
//!
//! | lesson | NAME | teaches |
//! |---|---|---|
//! | 1 | `hover` | a flight, its metrics, its log |
//! | 2 | `wings_or_not` | the manoeuvre in which a drone without wings sinks |
//! | 3 | `the_flight_code_alone` | the stack as one function, stepped by hand, frozen and thawed |
//! | 4 | `measured_honestly` | paired seeds, wings that are not there, intervals |
//! | 5 | `study_thrust` | what wings are worth as thrust gets scarce |
//! | 6 | `study_steering` | angles and speeds, on a plant that agrees with the controller and on one that does not |
//! | 7 | `study_table3` | the paper's real flights, and how much thrust they must have had |
//! | 8 | `study_forest` | who comes through trunks, and who owes it to wings |
//! | 9 | `study_table2` | models of the wing force on flights that they have not seen |
//! | 10 | `study_filters` | how far estimators are off, and what that costs in flight |
//! | 11 | `study_faults` | what becomes of flights in which one thing fails |
//! | 12 | `the_drone_that_sank` | naming what a model lacks |
//! | 13 | `what_wings_reach` | which accelerations wings add, and where that is worth something |
//! | 14 | `a_plan_with_wings` | what wings buy where both plan ahead, planned and flown |
//!
//! Lessons 5 to 11 are the studies of `squirrel study` with fewer flights. Here is what lessons
//! share.

use squirrel_study::statistics::Estimate;

/// What a lesson may fail with.
pub type Outcome<T> = Result<T, Box<dyn std::error::Error>>;

/// A share with its 95 % interval, in percent.
pub fn percent(Estimate { value, low, high }: Estimate) -> String {
    let [value, low, high] = [value, low, high].map(|share| 100.0 * share);
    format!("{value:+.1} % ({low:+.1} to {high:+.1})")
}

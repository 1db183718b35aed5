//! The tests of all lessons in one program, which is compiled and linked once.
#![allow(dead_code, reason = "a lesson's `main` is not called here")]

#[path = "a_plan_with_wings.rs"]
mod a_plan_with_wings;
#[path = "hover.rs"]
mod hover;
#[path = "measured_honestly.rs"]
mod measured_honestly;
#[path = "study_faults.rs"]
mod study_faults;
#[path = "study_filters.rs"]
mod study_filters;
#[path = "study_forest.rs"]
mod study_forest;
#[path = "study_steering.rs"]
mod study_steering;
#[path = "study_table2.rs"]
mod study_table2;
#[path = "study_table3.rs"]
mod study_table3;
#[path = "study_thrust.rs"]
mod study_thrust;
#[path = "the_drone_that_sank.rs"]
mod the_drone_that_sank;
#[path = "the_flight_code_alone.rs"]
mod the_flight_code_alone;
#[path = "what_wings_reach.rs"]
mod what_wings_reach;
#[path = "wings_or_not.rs"]
mod wings_or_not;

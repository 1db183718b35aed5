//! The gap workflow: where simulation and measurement disagree, which missing effect explains it,
//! and what adding it is worth on flights that were not used to find it.
//!
//! - [`check()`] tells what flights are worth: which of them contradict themselves and what to change
//!   in their import map, and from which size on they show each effect.
//! - [`find`](mod@find) measures the disagreement: residual force and moment of flights against a
//!   vehicle.
//! - [`diagnose()`] names what is missing and proves it on held-out flights in open loop.
//! - [`add()`] writes the vehicle file with it; [`closed_loop()`] flies held-out flights again with
//!   both.
//! - [`Workflow`] is all of that in a row, with a report.
//!
//! The physics is that of the simulator; nothing of it is written here again.

mod add;
mod baseline;
mod check;
mod checked;
mod closed_loop;
mod compatibility;
mod decide;
mod diagnose;
mod diagnosis;
mod error;
pub mod find;
mod fitted;
mod flight;
mod leftover;
mod name;
mod number;
mod picture;
mod predictor;
mod proof;
pub mod report;
mod shrink;
mod verdict;
mod words;
mod workflow;

pub use add::{add, add_effect, difference, fit, patched};
pub use baseline::Baseline;
pub use check::{check, check_since};
pub use checked::{ChannelCheck, Check, Choice, EffectCheck, FlightCheck, NumberCheck, Shows};
pub use closed_loop::{ClosedLoop, closed_loop};
pub use compatibility::contradictions;
pub use diagnose::{diagnose, diagnose_since, diagnose_with};
pub use diagnosis::{Covered, Diagnosis};
pub use error::GapError;
pub use find::{Finding, find};
pub use number::significant;
pub use picture::{first_screen, picture};
pub use verdict::{
    Alternative, Gap, Kind, Left, Moved, NamedEffect, RotorHealth, SetAside, Since, Value, Verdict,
    nothing_to_add,
};
pub use workflow::{Flights, Patched, Workflow};

/// The sources of a flight log that the workflow looks at.
pub const SOURCES: [&str; 7] = ["attitude", "baro", "battery", "gnss", "imu", "rotor", "wing"];

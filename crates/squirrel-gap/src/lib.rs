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
//!
//! ```
//! use squirrel_gap::{Kind, diagnose};
//! use squirrel_sim::arm::Arm;
//! use squirrel_sim::flight::{Integrator, Setup};
//! use squirrel_sim::scenario::Scenario;
//! use squirrel_sim::vehicle_file::{SQUIRREL_TOML, VehicleFile};
//!
//! // The machine has a battery that sags, and its file does not say so.
//! let file = VehicleFile::squirrel();
//! let text = format!("{SQUIRREL_TOML}\n[effects.battery_sag]\nvoltage_exponent = 0.9\n");
//! let machine = VehicleFile::parse(&text, "machine")?;
//! let mut flights = Vec::new();
//! for seed in [1, 2] {
//!     let scenario = Scenario { seed, ..Scenario::find("excite_rich")? };
//!     let setup = Setup { vehicle: machine.clone(), arm: Arm::Pc, scenario, integrator: Integrator::Rk4 };
//!     flights.push((format!("f{seed}"), setup.fly(true, |_| {})?.log.expect("was asked for")));
//! }
//!
//! let verdict = diagnose(&file, &flights, &[], &|_| {})?.verdict;
//! assert_eq!((verdict.verdict, verdict.effects[0].name), (Kind::Named, "battery_sag"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

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
pub use diagnose::{diagnose, diagnose_since};
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

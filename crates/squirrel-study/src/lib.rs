//! The experiments: arms against each other on paired seeds, with intervals.
//!
//! [`STUDIES`] are all of them, each a module that says what is asked, how it is flown
//! ([`campaign`], [`journal`]) and what is shown of it ([`sheet`], [`pages`]); [`study`] is what
//! they have to say.
//!
//! ```
//! use squirrel_sim::arm::Arm;
//! use squirrel_sim::vehicle_file::VehicleFile;
//! use squirrel_study::campaign::Plan;
//! use squirrel_study::journal::Keep;
//! use squirrel_study::thrust;
//!
//! // One trial of two arms; with `Keep::default()` nothing is kept on disk.
//! let plan = Plan::calm(VehicleFile::squirrel(), vec![Arm::TwccPlus, Arm::PcPlus], 1, 1);
//! let study = thrust::run(&plan, &Keep::default())?.expect("is no part of a study");
//! assert!(study.points.iter().any(|point| point.thrust_to_weight == 1.2));
//! # Ok::<(), squirrel_sim::flight::FlightError>(())
//! ```

pub mod campaign;
pub mod dispersion;
pub mod faults;
pub mod filters;
pub mod forest;
pub mod in_loop;
pub mod journal;
pub mod merge;
pub mod pages;
pub mod paper;
pub mod planning;
pub mod rivals;
pub mod sheet;
pub mod statistics;
pub mod steering;
pub mod study;
pub mod table2;
pub mod table3;
pub mod thrust;
pub mod tracking;
pub mod until;
pub mod wind;
pub mod wing_flights;

/// All studies, by name.
pub static STUDIES: &[study::Study] = &[
    dispersion::STUDY,
    faults::STUDY,
    filters::STUDY,
    forest::STUDY,
    planning::STUDY,
    rivals::STUDY,
    steering::STUDY,
    table2::STUDY,
    table3::STUDY,
    thrust::STUDY,
    wind::STUDY,
];

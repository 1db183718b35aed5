//! The experiments: arms against each other on paired seeds, with intervals.
//!
//! [`STUDIES`] are all of them, each a module that says what is asked, how it is flown
//! ([`campaign`], [`journal`]) and what is shown of it ([`sheet`], [`pages`]); [`study`] is what
//! they have to say.

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

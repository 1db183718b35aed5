//! The blind bench of the gap workflow: draws vehicles and hidden effects, flies them, asks the
//! command line what is hidden, and opens the answers.
//!
//! A case is a vehicle file with tolerances, two training flights and a held-out one; a
//! [`recorder`] says what of a flight is written down. Half of the cases are flown by squirrel
//! ([`squirrel_made`]), half by [`independent`], without any of squirrel's dynamics, so that a
//! mistake in the simulator does not hide itself from the diagnosis.

pub mod airframe;
pub mod bench;
pub mod case;
pub mod catalogue;
pub mod draw;
pub mod further;
pub mod independent;
pub mod outside;
pub mod overstate;
pub mod poor;
pub mod recorder;
pub mod set;
pub mod squirrel_made;

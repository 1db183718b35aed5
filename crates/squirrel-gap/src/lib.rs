//! The gap workflow: where simulation and measurement disagree, which missing effect explains it, and what adding it is
//! worth on flights that were not used to find it.
//!
//! - [`find`](mod@find) measures the disagreement: residual force and moment of flights against a vehicle.
//! - [`report`] shows what was found: one HTML file for the eye.
//!
//! The physics is that of the simulator; nothing of it is written here again.

mod error;
pub mod find;
pub mod report;

pub use error::GapError;
pub use find::{Finding, find};

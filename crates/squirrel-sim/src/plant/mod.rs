//! The plant: what the simulated vehicle does, independent of what its controller believes.

mod fast_math;
mod membrane;

pub use membrane::{Membrane, MembraneParameters, MembraneState};

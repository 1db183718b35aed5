//! Effects whose equation stands in a file of its own, with what the bench draws of them.
//!
//! Written from publications, as all of this generator, and not from the core's files: what is
//! wrong there must not be wrong here, too.

pub(crate) mod angular_damping;
pub(crate) mod flapping_moment;

use crate::catalogue::HiddenEffect;
use nalgebra::Vector3;

/// What the equations look at; what another one needs is added here and in `physics.rs`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sight {
    /// Velocity through the air, body axes, m/s.
    pub(crate) air_body: Vector3<f64>,
    /// Rates, body axes, rad/s.
    pub(crate) omega: Vector3<f64>,
}

/// Force, N, and moment, N m, body axes, of an effect.
pub(crate) type Equation = fn(&HiddenEffect, &Sight) -> [Vector3<f64>; 2];

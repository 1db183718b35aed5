//! Control: from a reference to rotor commands.
//!
//! Outer loop, 10 Hz ([`twcc`]): [`position`] (the paper's PC) asks for angles and thrust, [`wing_force`] estimates what
//! spread wings would do, [`woeg`] says whether that would help, [`wiic`] takes over where the angles are at their limit. Or
//! [`plus`], which chooses angles, thrust and wings together. Or [`follow`], outside of the step, on a plan.
//! Inner loop, 300 Hz: [`command_filter`] smooths the 10 Hz steps, [`backstepping`] turns attitude error into torque,
//! [`mixer`] turns thrust and torque into rotor thrusts, by the rule in [`mix`].

pub mod backstepping;
pub mod command_filter;
pub mod follow;
pub mod mix;
pub mod mixer;
pub mod plus;
pub mod position;
pub mod twcc;
pub mod wiic;
pub mod wing_force;
pub mod woeg;

use crate::frames::{In, Ned};

/// What to follow at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reference {
    /// Position, m.
    pub position: In<Ned, f32>,
    /// Velocity, m/s.
    pub velocity: In<Ned, f32>,
    /// Acceleration, m/s^2.
    pub acceleration: In<Ned, f32>,
    /// Heading, rad, clockwise from north.
    pub yaw_rad: f32,
}

/// Roll, pitch and collective thrust that the outer loop asks of the inner loop.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct AttitudeThrust {
    /// Roll, rad.
    pub roll_rad: f32,
    /// Pitch, rad.
    pub pitch_rad: f32,
    /// Collective thrust, N.
    pub thrust_n: f32,
}

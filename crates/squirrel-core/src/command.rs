//! What is asked of a vehicle: where to go, how to stand, how hard to push. Guidance and policies
//! say it, control does it.

use crate::frames::{In, Ned};
use crate::math::wrap_angle;
use nalgebra::Vector3;

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

/// Roll, pitch and yaw reference with its derivatives.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct EulerReference {
    /// Roll, pitch, yaw, rad.
    pub angle: Vector3<f32>,
    /// First derivative, rad/s.
    pub rate: Vector3<f32>,
    /// Second derivative, rad/s^2.
    pub acceleration: Vector3<f32>,
}

impl EulerReference {
    /// The sum of two references; angles are wrapped.
    #[must_use]
    pub fn plus(&self, other: &Self) -> Self {
        Self {
            angle: (self.angle + other.angle).map(wrap_angle),
            rate: self.rate + other.rate,
            acceleration: self.acceleration + other.acceleration,
        }
    }
}

/// What to fly: the outer loop's command, from outside of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PilotCommand {
    /// Attitude and thrust.
    pub attitude: AttitudeThrust,
    /// Both wings, 0 folded to 1 spread.
    pub wing: f32,
}

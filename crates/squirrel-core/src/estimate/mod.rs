//! Attitude, velocity and position from noisy sensors.
//!
//! One trait, [`Estimator`], and the filters that a vehicle may choose from:
//!
//! | filter | state | aided by |
//! |---|---|---|
//! | [`rkf`] | direction of gravity; the paper's (section II.C), with multiple, single or no fading | accelerometer |
//! | [`mahony`] | attitude, gyro bias | accelerometer where it weighs 1 g |
//! | [`mekf`] | attitude, gyro bias | accelerometer less the acceleration of satellite fixes, compass |
//! | [`eskf`] | position, velocity, attitude, both biases | satellite fixes that are late, barometer, compass; the default |
//!
//! [`altitude`] is the paper's height filter, for those that have none of their own; [`rest`] finds
//! the gyro's bias before take-off. [`voting`] makes one inertial measurement of two units',
//! [`navigator`] runs what was chosen and tells control, [`monitor`] sees whether rotors push as
//! told, and what else pushes. All are fixed in size, take bounded work a step, and stay finite for whatever is finite.
//! Which of them errs how much: docs/equations.md C.

pub mod altitude;
mod covariance;
pub mod eskf;
pub(crate) mod force_residual;
pub mod mahony;
pub mod mekf;
pub mod monitor;
pub mod navigator;
pub mod rest;
pub mod rkf;
pub mod voting;
pub mod wind;

use crate::frame::{Gnss, Imu};
use crate::frames::{Body, In, Ned, Rotation};
use crate::math::limit_norm;
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

/// What an estimator hears in one step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sensed {
    /// Since the step before, s; not negative.
    pub dt_s: f32,
    /// Inertial measurement, mean over the step.
    pub imu: Imu,
    /// A satellite fix that has just arrived.
    pub gnss: Option<Gnss>,
    /// Barometric altitude above the origin, m, up.
    pub altitude_m: Option<f32>,
    /// Direction of the earth's magnetic field, any length.
    pub magnetic: Option<In<Body, f32>>,
}

/// What an estimator believes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// Attitude.
    pub ned_from_body: Rotation<Ned, Body, f32>,
    /// Bias of the gyro, rad/s: to be taken off its readings.
    pub gyro_bias: In<Body, f32>,
    /// Position, m, and velocity, m/s, where the filter has them.
    pub motion: Option<(In<Ned, f32>, In<Ned, f32>)>,
}

/// A filter that hears sensors and believes something.
pub trait Estimator {
    /// Takes over a step's measurements. What is not finite must have been left out before.
    fn step(&mut self, sensed: &Sensed);

    /// What is believed now.
    fn estimate(&self) -> Estimate;
}

/// Longest step, s: what a longer one should have brought is lost anyway.
const STEP_MAX_S: f32 = 0.1;

/// Matrix of the cross product `v x`.
fn cross(v: &Vector3<f32>) -> Matrix3<f32> {
    Matrix3::new(0.0, -v.z, v.y, v.z, 0.0, -v.x, -v.y, v.x, 0.0)
}

/// An attitude turned about body axes by an angle, rad; by a radian if that is more, which no step
/// of a flight is.
///
/// Sine and cosine of half the angle by their series, which f32 cannot tell from the functions
/// below 1 rad.
fn turned(attitude: &UnitQuaternion<f32>, angle: &Vector3<f32>) -> UnitQuaternion<f32> {
    let angle = limit_norm(*angle, 1.0);
    let square = 0.25 * angle.norm_squared();
    let cosine = 1.0 - square * (0.5 - square * (1.0 / 24.0 - square * (1.0 / 720.0)));
    let sine = 0.5 * (1.0 - square * (1.0 / 6.0 - square * (1.0 / 120.0)));
    let turn = Quaternion::from_parts(cosine, angle * sine);
    unit(attitude.into_inner() * turn).unwrap_or(*attitude)
}

/// A quaternion of unit length; `None` where it has no direction.
fn unit(q: Quaternion<f32>) -> Option<UnitQuaternion<f32>> {
    UnitQuaternion::try_new(q, 1e-6)
}

/// Down, in the body frame.
fn down(attitude: &UnitQuaternion<f32>) -> Vector3<f32> {
    attitude.inverse_transform_vector(&Vector3::z())
}

/// An attitude with its inclination replaced and its heading kept as far as may be: the shortest
/// turn to another down.
///
/// * `target` - down in the body frame, a unit vector
fn levelled(attitude: &UnitQuaternion<f32>, target: &Vector3<f32>) -> UnitQuaternion<f32> {
    let now = down(attitude);
    // The turn takes `target` to `now`; its half angle by adding 1 to the cosine.
    let turn = Quaternion::from_parts(1.0 + target.dot(&now), target.cross(&now));
    match unit(turn) {
        Some(turn) => attitude * turn,
        None => *attitude,
    }
}

/// Yaw of the body over that of a compass, rad: what a compass says the heading errs by.
///
/// * `magnetic` - field in the body frame
fn heading_error(attitude: &UnitQuaternion<f32>, magnetic: &Vector3<f32>) -> Option<f32> {
    let field = attitude.transform_vector(magnetic);
    let flat = field.x * field.x + field.y * field.y;
    // Where the field has no horizontal part, a compass says nothing.
    (flat > 1e-3 * field.norm_squared()).then(|| libm::atan2f(field.y, field.x))
}

#[cfg(test)]
pub(crate) mod tests;

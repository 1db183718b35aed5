//! Inclination by Mahony's complementary filter, heard only where the accelerometer weighs one g.
//!
//! Source: Mahony, Hamel and Pflimlin, IEEE TAC 2008 (explicit complementary filter);
//! docs/equations.md C.2. With `y` the measured and `x` the believed direction of down,
//!
//! ```text
//! w = gyro - bias + k_p y x x,   bias' = -k_i y x x
//! ```
//! Differs: the gate. A multirotor that accelerates for seconds while it weighs one g still
//! misleads it.

use super::{Estimate, Estimator, STEP_MAX_S, Sensed, down, turned};
use crate::frames::{Body, In, Ned, Rotation};
use crate::math::{GRAVITY_M_S2, limit, lower};
use nalgebra::{UnitQuaternion, Vector3};

/// Largest gyro bias that is believed, rad/s.
const BIAS_MAX_RAD_S: f32 = 0.1;

/// Numbers of the filter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MahonyParameters {
    /// Gain, 1/s.
    pub proportional_per_s: f32,
    /// Gain on the bias, 1/s^2.
    pub integral_per_s2: f32,
    /// How far the specific force may be from 1 g, m/s^2.
    pub gate_m_s2: f32,
}

impl Default for MahonyParameters {
    fn default() -> Self {
        Self { proportional_per_s: 0.8, integral_per_s2: 0.03, gate_m_s2: 0.5 }
    }
}

/// The filter of one vehicle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mahony {
    parameters: MahonyParameters,
    attitude: UnitQuaternion<f32>,
    gyro_bias: Vector3<f32>,
}

impl Mahony {
    /// * `gyro_bias` - to begin with, rad/s
    pub fn new(
        parameters: MahonyParameters,
        start: Rotation<Ned, Body, f32>,
        gyro_bias: In<Body, f32>,
    ) -> Self {
        Self { parameters, attitude: start.quaternion, gyro_bias: gyro_bias.vector }
    }
}

impl Estimator for Mahony {
    fn step(&mut self, sensed: &Sensed) {
        let p = &self.parameters;
        let dt_s = lower(sensed.dt_s, STEP_MAX_S);
        let felt = -sensed.imu.specific_force.vector;
        let weight = felt.norm();
        let mut error = Vector3::zeros();
        if (weight - GRAVITY_M_S2 as f32).abs() < p.gate_m_s2 {
            error = (felt / weight).cross(&down(&self.attitude));
            let bias = self.gyro_bias - error * (p.integral_per_s2 * dt_s);
            self.gyro_bias = bias.map(|x| limit(x, -BIAS_MAX_RAD_S, BIAS_MAX_RAD_S));
        }
        let omega = sensed.imu.omega.vector - self.gyro_bias + error * p.proportional_per_s;
        self.attitude = turned(&self.attitude, &(omega * dt_s));
    }

    fn estimate(&self) -> Estimate {
        Estimate {
            ned_from_body: Rotation::new(self.attitude),
            gyro_bias: In::new(self.gyro_bias),
            motion: None,
        }
    }
}

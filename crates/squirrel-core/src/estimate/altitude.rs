//! Height and climb from the barometer and the accelerometer: the paper's altitude filter.
//!
//! Source: the paper, section II.C; docs/equations.md C.3. State: depth `z`, its rate `v`, and the
//! bias `b` of the vertical acceleration,
//!
//! ```text
//! z += v dt + (a - b) dt^2 / 2,   v += (a - b) dt,   a = (R f)_z + g
//! h = -z + noise of the barometer
//! ```

use crate::math::{lower, upper};
use nalgebra::{Matrix3, Vector3};

/// Numbers of the filter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AltitudeParameters {
    /// Of the vertical acceleration per sample, vibration included, m/s^2.
    pub accel_noise_m_s2: f32,
    /// Walk of its bias, m/s^2 per root second.
    pub bias_walk_m_s2_root_s: f32,
    /// Of the barometer per sample, m.
    pub baro_noise_m: f32,
}

impl Default for AltitudeParameters {
    fn default() -> Self {
        Self { accel_noise_m_s2: 0.5, bias_walk_m_s2_root_s: 0.02, baro_noise_m: 0.2 }
    }
}

/// The filter of one vehicle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AltitudeFilter {
    parameters: AltitudeParameters,
    state: Vector3<f32>,
    covariance: Matrix3<f32>,
}

impl AltitudeFilter {
    /// At rest at an altitude, m, up.
    pub fn new(parameters: AltitudeParameters, altitude_m: f32) -> Self {
        let covariance = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, 0.09));
        Self { parameters, state: Vector3::new(-altitude_m, 0.0, 0.0), covariance }
    }

    /// One step.
    ///
    /// * `acceleration_m_s2` - downwards, gravity included: `(R f)_z + g`
    /// * `altitude_m` - of the barometer, up, where it has just spoken
    pub fn step(&mut self, acceleration_m_s2: f32, altitude_m: Option<f32>, dt_s: f32) {
        let p = &self.parameters;
        let half = 0.5 * dt_s * dt_s;
        let transition = Matrix3::new(1.0, dt_s, -half, 0.0, 1.0, -dt_s, 0.0, 0.0, 1.0);
        let input = Vector3::new(half, dt_s, 0.0);
        self.state = transition * self.state + input * acceleration_m_s2;
        let shaken = input * p.accel_noise_m_s2;
        let mut covariance =
            transition * self.covariance * transition.transpose() + shaken * shaken.transpose();
        covariance[(2, 2)] += p.bias_walk_m_s2_root_s * p.bias_walk_m_s2_root_s * dt_s;
        if let Some(altitude_m) = altitude_m {
            let variance = p.baro_noise_m * p.baro_noise_m;
            let gain = covariance.column(0) / upper(covariance[(0, 0)] + variance, 1e-9);
            self.state += gain * (-altitude_m - self.state.x);
            let mut keep = Matrix3::identity();
            keep.set_column(0, &(Vector3::x() - gain));
            covariance = keep * covariance * keep.transpose() + gain * gain.transpose() * variance;
        }
        // What no barometer bounds stays a number.
        self.covariance = ((covariance + covariance.transpose()) * 0.5).map(|x| lower(x, 1e6));
    }

    /// Altitude above the origin, m, up.
    pub fn altitude_m(&self) -> f32 {
        -self.state.x
    }

    /// Climb, m/s, up.
    pub fn climb_m_s(&self) -> f32 {
        -self.state.y
    }

    /// Standard deviation of the altitude, m.
    pub fn altitude_deviation_m(&self) -> f32 {
        crate::math::sqrt(upper(self.covariance[(0, 0)], 0.0))
    }
}

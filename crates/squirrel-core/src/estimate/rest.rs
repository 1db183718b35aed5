//! Bias of the gyro, found while the vehicle stands still before take-off.
//!
//! A mean over a window in which neither the rate nor the specific force moves by more than noise does; what moves starts the window anew.

use crate::frames::{Body, In};
use crate::math::GRAVITY_M_S2;
use crate::stack::Imu;
use nalgebra::Vector3;

/// What counts as rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RestParameters {
    /// Samples of a window.
    pub samples: u32,
    /// Largest rate, rad/s: bias and noise of a sample, and no turning.
    pub rate_max_rad_s: f32,
    /// Largest difference of the specific force from the window's first, m/s^2.
    pub force_change_max_m_s2: f32,
}

impl Default for RestParameters {
    /// A second at 300 Hz.
    fn default() -> Self {
        Self { samples: 300, rate_max_rad_s: 0.06, force_change_max_m_s2: 2.0 }
    }
}

/// Listens to a gyro at rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RestCalibration {
    parameters: RestParameters,
    first: Option<Vector3<f32>>,
    sum: Vector3<f32>,
    count: u32,
    bias: Option<Vector3<f32>>,
}

impl RestCalibration {
    /// Nothing heard yet.
    pub fn new(parameters: RestParameters) -> Self {
        Self { parameters, first: None, sum: Vector3::zeros(), count: 0, bias: None }
    }

    /// Hears a sample; the bias, rad/s, of the last whole window at rest.
    pub fn hear(&mut self, imu: &Imu) -> Option<In<Body, f32>> {
        let p = &self.parameters;
        let force = imu.specific_force.vector;
        let first = *self.first.get_or_insert(force);
        let is_heavy = (force.norm() - GRAVITY_M_S2 as f32).abs() < p.force_change_max_m_s2;
        let is_still = imu.omega.vector.norm() < p.rate_max_rad_s
            && (force - first).norm() < p.force_change_max_m_s2
            && is_heavy;
        if is_still {
            self.sum += imu.omega.vector;
            self.count += 1;
        } else {
            (self.first, self.sum, self.count) = (None, Vector3::zeros(), 0);
        }
        if self.count >= p.samples && self.count > 0 {
            self.bias = Some(self.sum / self.count as f32);
            (self.first, self.sum, self.count) = (None, Vector3::zeros(), 0);
        }
        self.bias.map(In::new)
    }
}

//! Inclination by the robust Kalman filter with multiple tuning factors (RKF-MTF), the paper's
//! attitude estimator.
//!
//! Source: the paper, section II.C, after Candan and Soken, IEEE TIM 2021; docs/equations.md C.1.
//! The state is down in the body frame, `x`; what the accelerometer feels beside gravity is an
//! acceleration `a` that fades by `c` a step and whose innovation, per axis, is added to the
//! measurement's variance:
//!
//! ```text
//! x- = (I - dt [w]x) x,   P- = F P F' + sigma_g^2 dt^2 [x]x [x]x'
//! e = -f - c a - g x-,    S = diag(max(0, e_i^2 - g^2 P-_ii - sigma_a^2))
//! K = g P- (g^2 P- + S + sigma_a^2)^-1,   x = unit(x- + K e),   a = -f - g x
//! ```
//! It has no bias of its own and trusts the gyro wherever innovations of the accelerometer are
//! large, so an uncalibrated gyro drags it off: give it the bias that [`super::rest`] finds.
//! Differs from the source: specific force in FRD, Joseph's form, and heading is carried by the
//! gyro.

use super::{Estimate, Estimator, STEP_MAX_S, Sensed, cross, down, levelled, turned};
use crate::frames::{Body, In, Ned, Rotation};
use crate::math::{GRAVITY_M_S2, lower, upper};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

/// Samples of the accelerometer that the attitude at the start is the mean of. A filter that starts
/// wider lets the first manoeuvre pull it level.
const SAMPLES_AT_REST: f32 = 300.0;

/// How much a surprising acceleration is distrusted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fading {
    /// Not at all: the plain Kalman filter.
    None,
    /// By one factor for all axes (STF).
    Single,
    /// By a factor for each axis (MTF).
    Multiple,
}

/// Numbers of the filter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RkfParameters {
    /// Of the gyro per sample, rad/s.
    pub gyro_noise_rad_s: f32,
    /// Of the accelerometer per sample, m/s^2.
    pub accel_noise_m_s2: f32,
    /// Part of an external acceleration that is still there in the next step, 0 to 1.
    pub external_memory: f32,
    /// How large innovations are treated.
    pub fading: Fading,
}

impl Default for RkfParameters {
    fn default() -> Self {
        Self {
            gyro_noise_rad_s: 0.0045,
            accel_noise_m_s2: 0.25,
            external_memory: 0.1,
            fading: Fading::Multiple,
        }
    }
}

/// The filter of one vehicle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rkf {
    parameters: RkfParameters,
    attitude: UnitQuaternion<f32>,
    down: Vector3<f32>,
    covariance: Matrix3<f32>,
    external_m_s2: Vector3<f32>,
    gyro_bias: Vector3<f32>,
}

impl Rkf {
    /// * `start` - as a second at rest left it
    /// * `gyro_bias` - as it was calibrated, rad/s
    pub fn new(
        parameters: RkfParameters,
        start: Rotation<Ned, Body, f32>,
        gyro_bias: In<Body, f32>,
    ) -> Self {
        let sample = parameters.accel_noise_m_s2 / GRAVITY_M_S2 as f32;
        let start_variance = sample * sample / SAMPLES_AT_REST;
        Self {
            parameters,
            attitude: start.quaternion,
            down: down(&start.quaternion),
            covariance: Matrix3::from_diagonal_element(start_variance),
            external_m_s2: Vector3::zeros(),
            gyro_bias: gyro_bias.vector,
        }
    }

    /// What is added to the variance of each axis, (m/s^2)^2.
    fn distrust(&self, innovation: &Vector3<f32>, expected: &Matrix3<f32>) -> Vector3<f32> {
        match self.parameters.fading {
            Fading::None => Vector3::zeros(),
            Fading::Single => {
                Vector3::repeat(upper((innovation.norm_squared() - expected.trace()) / 3.0, 0.0))
            }
            Fading::Multiple => {
                (innovation.component_mul(innovation) - expected.diagonal()).map(|x| upper(x, 0.0))
            }
        }
    }
}

impl Estimator for Rkf {
    fn step(&mut self, sensed: &Sensed) {
        let p = &self.parameters;
        let g = GRAVITY_M_S2 as f32;
        let dt_s = lower(sensed.dt_s, STEP_MAX_S);
        let omega = sensed.imu.omega.vector - self.gyro_bias;
        let transition = Matrix3::identity() - cross(&omega) * dt_s;
        let skew = cross(&self.down) * (p.gyro_noise_rad_s * dt_s);
        let mut covariance =
            transition * self.covariance * transition.transpose() + skew * skew.transpose();
        let predicted = transition * self.down;

        let felt = -sensed.imu.specific_force.vector;
        let innovation = felt - self.external_m_s2 * p.external_memory - predicted * g;
        let noise = Matrix3::from_diagonal_element(p.accel_noise_m_s2 * p.accel_noise_m_s2);
        let expected = covariance * (g * g) + noise;
        let noise = noise + Matrix3::from_diagonal(&self.distrust(&innovation, &expected));
        let mut corrected = predicted;
        if let Some(inverse) = (covariance * (g * g) + noise).try_inverse() {
            let gain = covariance * inverse * g;
            corrected += gain * innovation;
            let keep = Matrix3::identity() - gain * g;
            covariance = keep * covariance * keep.transpose() + gain * noise * gain.transpose();
        }
        self.covariance = (covariance + covariance.transpose()) * 0.5;
        let attitude = turned(&self.attitude, &(omega * dt_s));
        self.down = corrected.try_normalize(1e-3).unwrap_or_else(|| down(&attitude));
        self.external_m_s2 = felt - self.down * g;
        self.attitude = levelled(&attitude, &self.down);
    }

    fn estimate(&self) -> Estimate {
        Estimate {
            ned_from_body: Rotation::new(self.attitude),
            gyro_bias: In::new(self.gyro_bias),
            motion: None,
        }
    }
}

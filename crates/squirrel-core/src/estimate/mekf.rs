//! Attitude and gyro bias by a multiplicative extended Kalman filter of six states.
//!
//! Source: Markley, JGCD 2003; docs/equations.md C.2. The error is a small turn `d` about body
//! axes, `q_true = q exp(d)`, and the bias's error. From one satellite fix to the next, the mean
//! specific force, turned into NED, is what the velocities have changed by, less gravity; without
//! fixes the accelerometer counts where it weighs one g:
//!
//! ```text
//! dv / T - g e3 = s - [s]x R d + noise,   s = mean of R f        between fixes
//! -f = h + [h]x d + noise,                h = R' g e3            without
//! ```
//! It does not know that fixes are late; [`super::eskf`] does.
//!
//! Updates in Joseph's form, axis by axis, and the turn is put into the quaternion after each step.

use super::{Estimate, Estimator, STEP_MAX_S, Sensed, cross, heading_error, turned};
use crate::frames::{Body, In, Ned, Rotation};
use crate::math::{GRAVITY_M_S2, lower};
use nalgebra::{Matrix6, RowVector6, UnitQuaternion, Vector3, Vector6};

/// Longest time between two fixes whose difference is an acceleration, s.
const FIX_GAP_MAX_S: f32 = 0.5;

/// Numbers of the filter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MekfParameters {
    /// Of the gyro per sample, rad/s.
    pub gyro_noise_rad_s: f32,
    /// Walk of the gyro's bias, rad/s per root second.
    pub bias_walk_rad_s_root_s: f32,
    /// Of the gyro's bias at the start, rad/s.
    pub bias_deviation_rad_s: f32,
    /// Of the acceleration between two fixes, m/s^2.
    pub fix_noise_m_s2: f32,
    /// What it may be off 1 g where there are no fixes, m/s^2.
    pub alone_noise_m_s2: f32,
    /// Gate without fixes, m/s^2.
    pub gate_m_s2: f32,
    /// Of the compass's heading, rad.
    pub heading_noise_rad: f32,
}

impl Default for MekfParameters {
    fn default() -> Self {
        Self {
            gyro_noise_rad_s: 0.0045,
            bias_walk_rad_s_root_s: 1e-4,
            bias_deviation_rad_s: 0.01,
            fix_noise_m_s2: 0.8,
            alone_noise_m_s2: 10.0,
            gate_m_s2: 0.5,
            heading_noise_rad: 0.05,
        }
    }
}

/// The last fix, and what has been felt since.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Fix {
    velocity: Vector3<f32>,
    ago_s: f32,
    /// Integral of the specific force in NED, m/s.
    felt: Vector3<f32>,
}

/// The filter of one vehicle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mekf {
    parameters: MekfParameters,
    attitude: UnitQuaternion<f32>,
    gyro_bias: Vector3<f32>,
    covariance: Matrix6<f32>,
    fix: Option<Fix>,
}

impl Mekf {
    /// * `gyro_bias` - to begin with, rad/s
    pub fn new(
        parameters: MekfParameters,
        start: Rotation<Ned, Body, f32>,
        gyro_bias: In<Body, f32>,
    ) -> Self {
        let (turn, bias) =
            (2.5e-3, parameters.bias_deviation_rad_s * parameters.bias_deviation_rad_s);
        Self {
            parameters,
            attitude: start.quaternion,
            gyro_bias: gyro_bias.vector,
            covariance: Matrix6::from_diagonal(&Vector6::new(turn, turn, turn, bias, bias, bias)),
            fix: None,
        }
    }

    /// One number that was measured; what the state should move by.
    fn update(&mut self, row: &RowVector6<f32>, residual: f32, variance: f32) -> Vector6<f32> {
        let cross_covariance = self.covariance * row.transpose();
        let gain = cross_covariance / ((row * cross_covariance).x + variance);
        let keep = Matrix6::identity() - gain * row;
        self.covariance =
            keep * self.covariance * keep.transpose() + gain * gain.transpose() * variance;
        gain * residual
    }
}

impl Estimator for Mekf {
    fn step(&mut self, sensed: &Sensed) {
        let p = self.parameters;
        let dt_s = lower(sensed.dt_s, STEP_MAX_S);
        let omega = sensed.imu.omega.vector - self.gyro_bias;
        self.attitude = turned(&self.attitude, &(omega * dt_s));
        let mut transition = Matrix6::identity();
        let turning = transition.fixed_view::<3, 3>(0, 0) - cross(&omega) * dt_s;
        transition.fixed_view_mut::<3, 3>(0, 0).copy_from(&turning);
        for i in 0..3 {
            transition[(i, i + 3)] = -dt_s;
        }
        self.covariance = transition * self.covariance * transition.transpose();
        let turn = p.gyro_noise_rad_s * dt_s;
        let walk = p.bias_walk_rad_s_root_s * p.bias_walk_rad_s_root_s * dt_s;
        for i in 0..3 {
            self.covariance[(i, i)] += turn * turn;
            self.covariance[(i + 3, i + 3)] += walk;
        }

        let force = sensed.imu.specific_force.vector;
        let g = GRAVITY_M_S2 as f32;
        if let Some(fix) = &mut self.fix {
            fix.ago_s += dt_s;
            fix.felt += self.attitude.transform_vector(&force) * dt_s;
        }
        self.fix = self.fix.filter(|fix| fix.ago_s < FIX_GAP_MAX_S);
        let mut correction = Vector6::zeros();
        let mut measured = None;
        if let (Some(fix), Some(gnss)) = (&self.fix, &sensed.gnss)
            && fix.ago_s > 0.0
        {
            let felt = fix.felt / fix.ago_s;
            let pulled =
                (gnss.velocity.vector - fix.velocity) / fix.ago_s - Vector3::new(0.0, 0.0, g);
            let slope = -cross(&felt) * self.attitude.to_rotation_matrix().into_inner();
            measured = Some((slope, pulled - felt, p.fix_noise_m_s2));
        }
        if let Some(gnss) = &sensed.gnss {
            self.fix =
                Some(Fix { velocity: gnss.velocity.vector, ago_s: 0.0, felt: Vector3::zeros() });
        }
        if self.fix.is_none() && (force.norm() - g).abs() < p.gate_m_s2 {
            let expected = super::down(&self.attitude) * g;
            measured = Some((cross(&expected), -force - expected, p.alone_noise_m_s2));
        }
        if let Some((slope, residual, noise)) = measured {
            for i in 0..3 {
                let row =
                    RowVector6::new(slope[(i, 0)], slope[(i, 1)], slope[(i, 2)], 0.0, 0.0, 0.0);
                let innovation = residual[i] - (row * correction).x;
                correction += self.update(&row, innovation, noise * noise);
            }
        }
        if let Some(error) = sensed.magnetic.and_then(|m| heading_error(&self.attitude, &m.vector))
        {
            let axis = super::down(&self.attitude);
            let row = RowVector6::new(axis.x, axis.y, axis.z, 0.0, 0.0, 0.0);
            let innovation = -error - (row * correction).x;
            correction += self.update(&row, innovation, p.heading_noise_rad * p.heading_noise_rad);
        }
        self.covariance = (self.covariance + self.covariance.transpose()) * 0.5;
        self.attitude =
            turned(&self.attitude, &Vector3::new(correction.x, correction.y, correction.z));
        self.gyro_bias += Vector3::new(correction.w, correction.a, correction.b);
    }

    fn estimate(&self) -> Estimate {
        Estimate {
            ned_from_body: Rotation::new(self.attitude),
            gyro_bias: In::new(self.gyro_bias),
            motion: None,
        }
    }
}

//! What the sensors say at one instant.

use super::Known;
use crate::frames::{Body, In, Ned, Rotation};
use crate::guidance::sensing::Obstacle;
use crate::math::all_finite;

/// Most obstacles that one frame carries: the nearest ones.
pub const MAX_OBSTACLES: usize = 4;
/// Measurements beyond these sizes are faults, not motion.
const RATE_MAX_RAD_S: f32 = 1e3;
const POSITION_MAX_M: f32 = 1e6;
const VELOCITY_MAX_M_S: f32 = 1e3;

/// One sample of an inertial measurement unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Imu {
    /// Angular rate, rad/s.
    pub omega: In<Body, f32>,
    /// Specific force, m/s^2; (0, 0, -g) at rest.
    pub specific_force: In<Body, f32>,
}

/// One satellite fix.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gnss {
    /// Position relative to the origin, m.
    pub position: In<Ned, f32>,
    /// Velocity, m/s.
    pub velocity: In<Ned, f32>,
}

/// New measurements since the last frame; `None` where a sensor gave none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SensorFrame {
    /// Time since the start of the mission, us.
    pub time_us: u64,
    /// Inertial measurement.
    pub imu: Option<Imu>,
    /// Attitude estimate.
    pub attitude: Option<Rotation<Ned, Body, f32>>,
    /// Satellite fix.
    pub gnss: Option<Gnss>,
    /// Barometric altitude above the origin, m, up.
    pub altitude_m: Option<f32>,
    /// Wing force as if spread, N, where something outside the flight code knows it.
    pub wing_force: Option<In<Ned, f32>>,
    obstacles: [Obstacle; MAX_OBSTACLES],
    obstacle_count: usize,
}

impl SensorFrame {
    /// A frame in which no sensor spoke.
    pub fn empty(time_us: u64) -> Self {
        Self {
            time_us,
            imu: None,
            attitude: None,
            gnss: None,
            altitude_m: None,
            wing_force: None,
            obstacles: [Obstacle { id: 0, north_m: 0.0, east_m: 0.0 }; MAX_OBSTACLES],
            obstacle_count: 0,
        }
    }

    /// Obstacles that may matter now.
    pub fn obstacles(&self) -> &[Obstacle] {
        self.obstacles.get(..self.obstacle_count).unwrap_or(&[])
    }

    /// Sets the obstacles; those beyond [`MAX_OBSTACLES`] are left out, so hand in the nearest first.
    pub fn set_obstacles(&mut self, obstacles: &[Obstacle]) {
        self.obstacle_count = 0;
        for (place, obstacle) in self.obstacles.iter_mut().zip(obstacles) {
            *place = *obstacle;
            self.obstacle_count += 1;
        }
    }

    /// Takes over what is valid; returns how many measurements were rejected.
    pub(super) fn merge_into(&self, known: &mut Known) -> u32 {
        let mut rejected = 0;
        let mut accept = |valid: bool| {
            rejected += u32::from(!valid);
            valid
        };
        if let Some(imu) = self.imu {
            let rate_ok = imu.omega.vector.iter().all(|x| x.abs() <= RATE_MAX_RAD_S);
            if accept(rate_ok && all_finite(&imu.specific_force.vector)) {
                known.imu = Some(imu);
            }
        }
        if let Some(attitude) = self.attitude {
            let norm = attitude.quaternion.norm_squared();
            if accept((norm - 1.0).abs() < 1e-3) {
                known.attitude = Some(attitude);
            }
        }
        if let Some(gnss) = self.gnss {
            let position_ok = gnss.position.vector.iter().all(|x| x.abs() <= POSITION_MAX_M);
            let velocity_ok = gnss.velocity.vector.iter().all(|x| x.abs() <= VELOCITY_MAX_M_S);
            if accept(position_ok && velocity_ok) {
                known.gnss = Some(gnss);
            }
        }
        if let Some(altitude) = self.altitude_m
            && accept(altitude.abs() <= POSITION_MAX_M)
        {
            known.altitude_m = Some(altitude);
        }
        if let Some(force) = self.wing_force
            && accept(all_finite(&force.vector))
        {
            known.wing_force = Some(force);
        }
        rejected
    }
}

//! What the sensors say at one instant.

use crate::command::PilotCommand;
use crate::frames::{Body, In, Ned, Rotation};
use crate::guidance::sensing::Obstacle;

/// Most obstacles that one frame carries: the nearest ones.
pub const MAX_OBSTACLES: usize = 4;
/// Measurements beyond these sizes are faults, not motion.
const RATE_MAX_RAD_S: f32 = 1e3;
const FORCE_MAX_M_S2: f32 = 1e4;
pub(crate) const POSITION_MAX_M: f32 = 1e6;
const VELOCITY_MAX_M_S: f32 = 1e3;
const FIELD_MAX_UT: f32 = 1e4;
const VOLTAGE_MAX_V: f32 = 1e3;

/// One sample of an inertial measurement unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Imu {
    /// Angular rate, rad/s.
    pub omega: In<Body, f32>,
    /// Specific force, m/s^2; (0, 0, -g) at rest.
    pub specific_force: In<Body, f32>,
}

impl Imu {
    pub(crate) fn is_reading(&self) -> bool {
        self.omega.vector.iter().all(|x| x.abs() <= RATE_MAX_RAD_S)
            && self.specific_force.vector.iter().all(|x| x.abs() <= FORCE_MAX_M_S2)
    }
}

impl Gnss {
    pub(crate) fn is_reading(&self) -> bool {
        self.position.vector.iter().all(|x| x.abs() <= POSITION_MAX_M)
            && self.velocity.vector.iter().all(|x| x.abs() <= VELOCITY_MAX_M_S)
    }
}

/// Whether a battery can have this voltage, V.
pub(crate) fn is_voltage(battery_v: f32) -> bool {
    battery_v > 0.0 && battery_v <= VOLTAGE_MAX_V
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
    /// Of the second inertial unit, where there is one.
    pub imu_2: Option<Imu>,
    /// Attitude, where something outside the flight code estimates it.
    pub attitude: Option<Rotation<Ned, Body, f32>>,
    /// Satellite fix.
    pub gnss: Option<Gnss>,
    /// Barometric altitude above the origin, m, up.
    pub altitude_m: Option<f32>,
    /// Magnetic field of the earth, and what of the vehicle's own a compass cannot tell from it,
    /// uT.
    pub magnetic: Option<In<Body, f32>>,
    /// Voltage of the battery under load, V.
    pub battery_v: Option<f32>,
    /// Wing force as if spread, N, where something outside the flight code knows it.
    pub wing_force: Option<In<Ned, f32>>,
    /// What to fly instead of the outer loop's command.
    pub command: Option<PilotCommand>,
    obstacles: [Obstacle; MAX_OBSTACLES],
    obstacle_count: usize,
}

impl SensorFrame {
    /// A frame in which no sensor spoke.
    pub fn empty(time_us: u64) -> Self {
        Self {
            time_us,
            imu: None,
            imu_2: None,
            attitude: None,
            gnss: None,
            altitude_m: None,
            magnetic: None,
            battery_v: None,
            wing_force: None,
            command: None,
            obstacles: [Obstacle { id: 0, north_m: 0.0, east_m: 0.0 }; MAX_OBSTACLES],
            obstacle_count: 0,
        }
    }

    /// Obstacles that may matter now.
    pub fn obstacles(&self) -> &[Obstacle] {
        self.obstacles.get(..self.obstacle_count).unwrap_or(&[])
    }

    /// Sets the obstacles; those beyond [`MAX_OBSTACLES`] are left out, so hand in the nearest
    /// first.
    pub fn set_obstacles(&mut self, obstacles: &[Obstacle]) {
        self.obstacle_count = 0;
        for (place, obstacle) in self.obstacles.iter_mut().zip(obstacles) {
            *place = *obstacle;
            self.obstacle_count += 1;
        }
    }

    /// Takes out what is not finite, or larger than any flight, of what estimators hear; how many
    /// readings that were.
    pub(crate) fn drop_what_is_no_reading(&mut self) -> u32 {
        let mut dropped = 0;
        let mut accept = |valid: bool| {
            dropped += u32::from(!valid);
            valid
        };
        self.imu = self.imu.filter(|imu| accept(imu.is_reading()));
        self.imu_2 = self.imu_2.filter(|imu| accept(imu.is_reading()));
        self.gnss = self.gnss.filter(|gnss| accept(gnss.is_reading()));
        self.altitude_m =
            self.altitude_m.filter(|altitude| accept(altitude.abs() <= POSITION_MAX_M));
        self.magnetic = self
            .magnetic
            .filter(|field| accept(field.vector.norm_squared() <= FIELD_MAX_UT * FIELD_MAX_UT));
        dropped
    }

    /// What control hears where nothing was estimated.
    pub(crate) fn without_motion(self) -> Self {
        Self { attitude: None, gnss: None, altitude_m: None, ..self }
    }
}

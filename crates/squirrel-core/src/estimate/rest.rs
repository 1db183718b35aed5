//! What a vehicle finds out while it stands still before take-off: bias of the gyro, attitude.
//!
//! A mean over a window in which neither the rate nor the specific force moves by more than noise
//! does; what moves starts the window anew.

use super::navigator::Start;
use super::voting::Voter;
use super::{heading_error, levelled};
use crate::frame::Imu;
use crate::frame::SensorFrame;
use crate::frames::Rotation;
use crate::frames::{Body, In, Ned};
use crate::math::GRAVITY_M_S2;
use nalgebra::{UnitQuaternion, Vector3};

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
    /// The last sample was not at rest.
    moved: bool,
}

impl RestCalibration {
    /// Nothing heard yet.
    pub fn new(parameters: RestParameters) -> Self {
        Self { parameters, first: None, sum: Vector3::zeros(), count: 0, bias: None, moved: false }
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
        self.moved = !is_still;
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

/// Listens to all sensors before take-off: units vote, and what moves starts the second at rest
/// anew.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Preflight {
    voter: Voter,
    calibration: RestCalibration,
    gyro_bias: Option<In<Body, f32>>,
    force: Mean,
    field: Mean,
    fix: Mean,
    altitude: Mean,
    last_us: Option<u64>,
}

/// A mean over all samples, from [`Self::SAMPLES`] on one that forgets.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Mean {
    value: Option<Vector3<f32>>,
    count: u16,
}

impl Mean {
    const SAMPLES: u16 = 300;

    fn hear(&mut self, now: &Vector3<f32>) {
        self.count = (self.count + 1).min(Self::SAMPLES);
        let before = self.value.unwrap_or(*now);
        self.value = Some(before + (now - before) / f32::from(self.count));
    }
}

impl Default for Preflight {
    fn default() -> Self {
        Self {
            voter: Voter::default(),
            // A cheap gyro may be off by 8 deg/s, and the window a little shorter than a second.
            calibration: RestCalibration::new(RestParameters {
                samples: 290,
                rate_max_rad_s: 0.15,
                ..RestParameters::default()
            }),
            gyro_bias: None,
            force: Mean::default(),
            field: Mean::default(),
            fix: Mean::default(),
            altitude: Mean::default(),
            last_us: None,
        }
    }
}

impl Preflight {
    /// Hears a frame; what is not finite, or larger than any flight, is left out.
    pub fn hear(&mut self, frame: &SensorFrame) {
        let mut frame = *frame;
        frame.drop_what_is_no_reading();
        let elapsed_us =
            self.last_us.map_or(0, |last| frame.time_us.saturating_sub(last).min(100_000));
        self.last_us = Some(frame.time_us);
        if let Some(imu) = self.voter.vote([frame.imu, frame.imu_2], elapsed_us as u32) {
            self.gyro_bias = self.calibration.hear(&imu).or(self.gyro_bias);
            if self.calibration.moved {
                // What was heard before is of another place.
                *self = Self { voter: self.voter, last_us: self.last_us, ..Self::default() };
                return;
            }
            self.force.hear(&imu.specific_force.vector);
        }
        if let Some(field) = frame.magnetic {
            self.field.hear(&field.vector);
        }
        if let Some(fix) = frame.gnss {
            self.fix.hear(&fix.position.vector);
        }
        if let Some(altitude_m) = frame.altitude_m {
            self.altitude.hear(&Vector3::repeat(altitude_m));
        }
    }

    /// Where the flight begins; `None` before a second at rest. Without a compass it looks north.
    ///
    /// * `position` - of the vehicle in the mission's frame, m
    pub fn start(&self, position: In<Ned, f32>) -> Option<Start> {
        let down = (-self.force.value?).try_normalize(1e-3)?;
        let level = levelled(&UnitQuaternion::identity(), &down);
        let yaw_rad = self
            .field
            .value
            .and_then(|field| heading_error(&level, &field))
            .map_or(0.0, |error| -error);
        let heading = Rotation::<Ned, Ned, f32>::from_euler(0.0, 0.0, yaw_rad).quaternion;
        Some(Start {
            ned_from_body: Rotation::new(heading * level),
            gyro_bias: self.gyro_bias?,
            position,
            fix_offset: In::new(
                self.fix.value.map_or(Vector3::zeros(), |fix| fix - position.vector),
            ),
            altitude_offset_m: self
                .altitude
                .value
                .map_or(0.0, |altitude| altitude.z + position.vector.z),
        })
    }
}

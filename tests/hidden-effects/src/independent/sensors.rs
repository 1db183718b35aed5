//! From what happened to what was logged: rates, noise, slow errors, late and skewed clocks.
//!
//! The sizes are those measured in flights of the class: white noise of the inertial unit, attitude
//! and receiver errors that wander, a barometer with an offset.

use super::air::Process;
use super::extras::Extras;
use super::{IMU_HZ, Order, Truth};
use crate::airframe::SensorErrors;
use crate::draw::Draw;
use crate::recorder::TRUTH;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use squirrel_log::{FlightLog, Source};

/// White noise, one standard deviation a sample.
pub mod white {
    /// Gyroscope, rad/s.
    pub const GYRO_RAD_S: f64 = 0.02;
    /// Accelerometer, m/s^2.
    pub const ACCEL_M_S2: f64 = 0.25;
    /// Receiver velocity, north, east, down, m/s.
    pub const GNSS_VELOCITY_M_S: [f64; 3] = [0.045, 0.045, 0.075];
    /// Receiver position, m.
    pub const GNSS_POSITION_M: f64 = 0.02;
    /// Barometer, m.
    pub const BARO_M: f64 = 0.1;
    /// Voltage, V.
    pub const VOLTAGE_V: f64 = 0.02;
    /// Current, A.
    pub const CURRENT_A: f64 = 0.2;
}

/// Wandering errors: standard deviation and correlation time, s.
const TILT_RAD: f64 = 0.0044;
const HEADING_RAD: f64 = 0.0084;
const ATTITUDE_S: f64 = 5.0;
const GNSS_M: f64 = 0.5;
const GNSS_S: f64 = 20.0;
const BARO_M: f64 = 0.12;
const BARO_S: f64 = 30.0;

const GNSS_PERIOD: usize = 30;
const SLOW_PERIOD: usize = 6;

/// What the gyroscope and the attitude estimate say; the autopilot hears them too.
#[derive(Debug, Clone)]
pub(super) struct Inertial {
    errors: SensorErrors,
    heading_rad: f64,
    noise: f64,
    wander: Process,
    draw: Draw,
}

impl Inertial {
    pub(super) fn new(errors: SensorErrors, heading_rad: f64, noise: f64, mut draw: Draw) -> Self {
        let wander = Process::new(&mut draw);
        Self { errors, heading_rad, noise, wander, draw }
    }

    /// Measured rate and attitude.
    pub(super) fn step(
        &mut self,
        omega: Vector3<f64>,
        attitude: Quaternion<f64>,
    ) -> (Vector3<f64>, UnitQuaternion<f64>) {
        let white = Vector3::from(self.draw.normal3(self.noise * white::GYRO_RAD_S));
        let wander = self.wander.step(1.0 / IMU_HZ, ATTITUDE_S, &mut self.draw);
        let tilt =
            UnitQuaternion::from_scaled_axis(TILT_RAD * Vector3::new(wander.x, wander.y, 0.0));
        let heading = self.errors.heading_rad + self.heading_rad + HEADING_RAD * wander.z;
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), heading);
        (
            omega + self.errors.gyro_bias_rad_s + white,
            turn * tilt * UnitQuaternion::new_normalize(attitude),
        )
    }
}

/// The log of a flight.
pub(super) fn log(
    order: &Order<'_>,
    truth: &[Truth],
    extras: &Extras,
    mut draw: Draw,
) -> FlightLog {
    let (mut log, noise) = (FlightLog::default(), order.noise);
    let ticks = (order.duration_s() * IMU_HZ) as usize;
    inertial(&mut log, &truth[..ticks], extras, &order.errors, noise, &mut draw);
    commands(&mut log, truth, ticks, extras.skew);
    receiver(&mut log, &truth[..ticks], extras.gnss_latency_s, noise, &mut draw);
    let mut wander = Process::new(&mut draw);
    let offset = draw.normal(0.1);
    let (mut baro, mut battery) = (Source::default(), Source::default());
    for (k, now) in truth[..ticks].iter().enumerate().step_by(SLOW_PERIOD) {
        let slow = BARO_M * wander.step(SLOW_PERIOD as f64 / IMU_HZ, BARO_S, &mut draw).x;
        let altitude = -now.position.z + offset + slow + draw.normal(noise * white::BARO_M);
        baro.push(time_s(k), &[("altitude_m", &[altitude])]);
        let voltage = now.voltage_v + draw.normal(noise * white::VOLTAGE_V);
        let current = now.current_a + draw.normal(noise * white::CURRENT_A);
        battery.push(time_s(k), &[("voltage_v", &[voltage]), ("current_a", &[current])]);
    }
    log.sources.insert(TRUTH.to_owned(), happened(&truth[..ticks]));
    log.sources.insert("baro".to_owned(), baro);
    log.sources.insert("battery".to_owned(), battery);
    log
}

/// What no recorder knows.
fn happened(truth: &[Truth]) -> Source {
    let mut source = Source::default();
    for (k, now) in truth.iter().enumerate() {
        let q = now.attitude;
        let rows: [(&str, &[f64]); 3] = [
            ("position_ned_m", now.position.as_slice()),
            ("velocity_ned_m_s", now.velocity.as_slice()),
            ("q_ned_from_body_wxyz", &[q.w, q.i, q.j, q.k]),
        ];
        source.push(time_s(k), &rows);
    }
    source
}

fn time_s(tick: usize) -> f64 {
    tick as f64 / IMU_HZ
}

fn inertial(
    log: &mut FlightLog,
    truth: &[Truth],
    extras: &Extras,
    errors: &SensorErrors,
    noise: f64,
    draw: &mut Draw,
) {
    let (mut imu, mut attitude) = (Source::default(), Source::default());
    for (k, now) in truth.iter().enumerate() {
        // Half of a drifting bias at the start, one and a half at the end: its mean is the stated
        // bias.
        let share = extras.accel_bias_start
            + 2.0 * (1.0 - extras.accel_bias_start) * time_s(k) / time_s(truth.len());
        let white = Vector3::from(draw.normal3(noise * white::ACCEL_M_S2));
        let force = now.specific_force + errors.accel_bias_m_s2 + share * extras.accel_bias + white;
        let rows: [(&str, &[f64]); 2] = [
            ("omega_body_rad_s", now.gyro.as_slice()),
            ("specific_force_body_m_s2", force.as_slice()),
        ];
        imu.push(time_s(k), &rows);
        let q = now.attitude_measured;
        attitude.push(time_s(k), &[("q_ned_from_body_wxyz", &[q.w, q.i, q.j, q.k])]);
    }
    log.sources.insert("imu".to_owned(), imu);
    log.sources.insert("attitude".to_owned(), attitude);
}

/// Commands on the inertial unit's clock; a skewed recorder writes what was in force at `t` under
/// `t (1 + skew)`.
fn commands(log: &mut FlightLog, truth: &[Truth], ticks: usize, skew: f64) {
    let (mut rotor, mut wing) = (Source::default(), Source::default());
    for k in 0..ticks {
        let real = (k as f64 / (1.0 + skew) + 1e-9) as usize;
        let now = &truth[real.min(truth.len() - 1)];
        rotor.push(time_s(k), &[("command", &now.rotor)]);
        wing.push(time_s(k), &[("command", now.wing.as_slice())]);
    }
    log.sources.insert("rotor".to_owned(), rotor);
    log.sources.insert("wing".to_owned(), wing);
}

fn receiver(log: &mut FlightLog, truth: &[Truth], latency_s: f64, noise: f64, draw: &mut Draw) {
    let mut wander = Process::new(draw);
    let mut gnss = Source::default();
    for k in (GNSS_PERIOD..truth.len()).step_by(GNSS_PERIOD) {
        let at = (k as f64 - latency_s * IMU_HZ).max(0.0);
        let (before, share) = (at as usize, at.fract());
        let (a, b) = (&truth[before], &truth[(before + 1).min(truth.len() - 1)]);
        let slow = GNSS_M * wander.step(GNSS_PERIOD as f64 / IMU_HZ, GNSS_S, draw);
        let position = a.position.lerp(&b.position, share)
            + slow
            + Vector3::from(draw.normal3(noise * white::GNSS_POSITION_M));
        let white = Vector3::from(draw.normal3(noise))
            .component_mul(&Vector3::from(white::GNSS_VELOCITY_M_S));
        let velocity = a.velocity.lerp(&b.velocity, share) + white;
        let rows: [(&str, &[f64]); 2] =
            [("position_ned_m", position.as_slice()), ("velocity_ned_m_s", velocity.as_slice())];
        gnss.push(time_s(k), &rows);
    }
    log.sources.insert("gnss".to_owned(), gnss);
}

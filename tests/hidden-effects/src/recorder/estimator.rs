//! An autopilot's filter: attitude that takes the accelerometer for the vertical, and late, smooth
//! velocity.
//!
//! A complementary filter with time constant `T` pulls its vertical towards the specific force.
//! While the vehicle accelerates by `a`, that leans by `a / g`, so that the tilt error is
//! `k LP_T[z x a] / g` in NED; `k`, the trust in the accelerometer, follows from the size of the
//! error.

use super::{rotation, vector, wxyz};
use crate::airframe::GRAVITY_M_S2;
use crate::draw::Draw;
use nalgebra::{UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};
use squirrel_log::{FlightLog, Source};

/// Sizes of what it gets wrong.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Estimator {
    /// Tilt error, root mean square over a flight, rad.
    pub tilt_rad: f64,
    /// Time constant of the filter, s.
    pub time_constant_s: f64,
    /// Heading error, root mean square, rad.
    pub heading_rad: f64,
}

/// By how much velocity and position are late, s.
pub(super) const DELAY_S: f64 = 0.05;
/// Two equal lags one after the other are late by their sum.
const LAG_S: f64 = 0.5 * DELAY_S;
/// Rate of the velocity and position estimates.
const RATE_HZ: f64 = 50.0;
/// Rate at which the filter itself runs.
const FILTER_HZ: f64 = 500.0;
/// Errors that wander: standard deviation and correlation time, s.
const VELOCITY_M_S: (f64, f64) = (0.03, 0.5);
const POSITION_M: (f64, f64) = (0.3, 20.0);
const HEADING_S: f64 = 15.0;
/// Part of the heading's mean square that stays the same over a flight.
const HEADING_CONSTANT: f64 = 0.6;

impl Estimator {
    pub(crate) fn draw(draw: &mut Draw) -> Self {
        Self {
            tilt_rad: draw.uniform(0.5, 1.5).to_radians(),
            time_constant_s: draw.uniform(1.0, 3.0),
            heading_rad: 2.0_f64.to_radians(),
        }
    }

    pub(super) fn record(&self, log: &mut FlightLog, latency_s: f64, mut draw: Draw) {
        self.attitude(log, &mut draw);
        if let Some(truth) = log.sources.get(super::TRUTH) {
            let estimate = motion(truth, latency_s, &mut draw);
            log.sources.insert("gnss".to_owned(), estimate);
        }
    }

    fn attitude(&self, log: &mut FlightLog, draw: &mut Draw) {
        let (Some(imu), Some(measured)) = (log.sources.get("imu"), log.sources.get("attitude"))
        else {
            return;
        };
        let Some(channel) = measured.channels.get("q_ned_from_body_wxyz") else { return };
        let attitudes: Vec<_> = (0..measured.time_s.len())
            .map(|k| (measured.time_s[k], rotation(channel.row(k))))
            .collect();
        let mut leaning = Vec::with_capacity(attitudes.len());
        let (mut lean, mut before) = (Vector3::zeros(), None);
        for (time_s, q) in &attitudes {
            let felt = vector(imu, "specific_force_body_m_s2", *time_s);
            let acceleration = q * felt + Vector3::new(0.0, 0.0, GRAVITY_M_S2);
            let apparent = Vector3::z().cross(&acceleration) / GRAVITY_M_S2;
            let passed_s = before.map_or(0.0, |before: f64| time_s - before);
            lean += (apparent - lean) * (1.0 - (-passed_s / self.time_constant_s).exp());
            before = Some(*time_s);
            leaning.push(lean);
        }
        let mean_square =
            leaning.iter().map(Vector3::norm_squared).sum::<f64>() / leaning.len().max(1) as f64;
        let trust = self.tilt_rad / mean_square.sqrt().max(f64::MIN_POSITIVE);
        let constant = draw.sign() * self.heading_rad * HEADING_CONSTANT.sqrt();
        let period_s = attitudes.last().map_or(0.0, |last| last.0) / attitudes.len().max(1) as f64;
        let mut wander =
            Wander::new(self.heading_rad * (1.0 - HEADING_CONSTANT).sqrt(), HEADING_S, draw);
        let mut source = Source::default();
        for ((time_s, q), lean) in attitudes.iter().zip(&leaning) {
            let heading = constant + wander.step(period_s, draw).x;
            let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), heading);
            let estimate = turn * UnitQuaternion::from_scaled_axis(trust * lean) * q;
            source.push(*time_s, &[("q_ned_from_body_wxyz", &wxyz(&estimate))]);
        }
        log.sources.insert("attitude".to_owned(), source);
    }
}

/// Velocity and position behind two lags.
fn motion(truth: &Source, latency_s: f64, draw: &mut Draw) -> Source {
    let mut estimate = Source::default();
    let end_s = truth.time_s.last().copied().unwrap_or(0.0);
    let start = |channel| vector(truth, channel, 0.0);
    let mut velocity = [start("velocity_ned_m_s"); 2];
    let mut position = [start("position_ned_m"); 2];
    let mut off_velocity = Wander::new(VELOCITY_M_S.0, VELOCITY_M_S.1, draw);
    let mut off_position = Wander::new(POSITION_M.0, POSITION_M.1, draw);
    let every = (FILTER_HZ / RATE_HZ) as usize;
    // A sampled lag is late by (1 - gain) / gain of its periods.
    let gain = 1.0 / (1.0 + FILTER_HZ * LAG_S);
    for k in 0..(end_s * FILTER_HZ) as usize {
        let time_s = k as f64 / FILTER_HZ;
        let follow = |lags: &mut [Vector3<f64>; 2], channel| {
            lags[0] += (vector(truth, channel, time_s - latency_s) - lags[0]) * gain;
            lags[1] += (lags[0] - lags[1]) * gain;
        };
        follow(&mut velocity, "velocity_ned_m_s");
        follow(&mut position, "position_ned_m");
        if k % every == 0 {
            let velocity = velocity[1] + off_velocity.step(1.0 / RATE_HZ, draw);
            let position = position[1] + off_position.step(1.0 / RATE_HZ, draw);
            let rows: [(&str, &[f64]); 2] = [
                ("position_ned_m", position.as_slice()),
                ("velocity_ned_m_s", velocity.as_slice()),
            ];
            estimate.push(time_s, &rows);
        }
    }
    estimate
}

/// A first-order process on three axes.
struct Wander {
    sd: f64,
    time_constant_s: f64,
    now: Vector3<f64>,
}

impl Wander {
    fn new(sd: f64, time_constant_s: f64, draw: &mut Draw) -> Self {
        Self { sd, time_constant_s, now: Vector3::from(draw.normal3(sd)) }
    }
    fn step(&mut self, dt_s: f64, draw: &mut Draw) -> Vector3<f64> {
        let keep = (-dt_s / self.time_constant_s).exp();
        self.now =
            self.now * keep + Vector3::from(draw.normal3(self.sd * (1.0 - keep * keep).sqrt()));
        self.now
    }
}

/// By how much an attitude leans from another, and by how much it is turned about the vertical,
/// rad.
#[cfg(test)]
pub(super) fn tilt_and_heading(log: &FlightLog, true_attitude: &Source, time_s: f64) -> (f64, f64) {
    let estimate = super::attitude(&log.sources["attitude"], "q_ned_from_body_wxyz", time_s);
    let truth = super::attitude(true_attitude, "q_ned_from_body_wxyz", time_s);
    let error = (estimate * truth.inverse()).scaled_axis();
    (error.xy().norm(), error.z)
}

//! What writes the log down. Flights come with the sensors' readings and the truth; a recorder
//! turns them into what people have: the readings as they are, an autopilot's estimates, a motion
//! capture's poses, or readings of sensors that err. The truth itself never leaves.

mod capture;
mod estimator;
mod fault;

pub use capture::Capture;
pub use estimator::Estimator;
pub use fault::SensorFault;

use crate::draw::Draw;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};
use squirrel_log::{FlightLog, Source};

/// What is written down.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(tag = "recorder", rename_all = "snake_case")]
pub enum Recorder {
    /// The sensors' readings as they are.
    #[default]
    Board,
    /// Attitude and velocity of an autopilot's filter.
    Estimator(Estimator),
    /// Poses of a motion capture, and no inertial unit.
    Capture(Capture),
    /// Readings of which one errs.
    Faulty(SensorFault),
}

/// The source of a flight that holds the truth: `position_ned_m`, `velocity_ned_m_s`,
/// `q_ned_from_body_wxyz`.
pub(crate) const TRUTH: &str = "truth";

impl Recorder {
    /// The log of a flight.
    ///
    /// * `latency_s` - by which the velocity of this vehicle is late already
    pub(crate) fn record(&self, mut log: FlightLog, latency_s: f64, draw: Draw) -> FlightLog {
        match self {
            Self::Board => {}
            Self::Estimator(filter) => filter.record(&mut log, latency_s, draw),
            Self::Capture(capture) => capture.record(&mut log, draw),
            Self::Faulty(fault) => fault.record(&mut log),
        }
        log.sources.remove(TRUTH);
        log
    }
}

/// A channel at a time, on a line between its samples; held beyond its ends.
fn at<const N: usize>(source: &Source, channel: &str, time_s: f64) -> [f64; N] {
    let Some(channel) = source.channels.get(channel) else { return [0.0; N] };
    let after = source.time_s.partition_point(|t| *t <= time_s).clamp(1, source.time_s.len() - 1);
    let (t0, t1) = (source.time_s[after - 1], source.time_s[after]);
    let share = ((time_s - t0) / (t1 - t0)).clamp(0.0, 1.0);
    let (a, b) = (channel.row(after - 1), channel.row(after));
    std::array::from_fn(|i| a[i] + share * (b[i] - a[i]))
}

fn vector(source: &Source, channel: &str, time_s: f64) -> Vector3<f64> {
    Vector3::from(at::<3>(source, channel, time_s))
}

/// Neighbouring attitudes of a flight are close: a line between them, made a rotation again, is the
/// way between them.
fn attitude(source: &Source, channel: &str, time_s: f64) -> UnitQuaternion<f64> {
    rotation(&at::<4>(source, channel, time_s))
}

fn rotation(wxyz: &[f64]) -> UnitQuaternion<f64> {
    UnitQuaternion::new_normalize(Quaternion::new(wxyz[0], wxyz[1], wxyz[2], wxyz[3]))
}

fn wxyz(q: &UnitQuaternion<f64>) -> [f64; 4] {
    [q.w, q.i, q.j, q.k]
}

#[cfg(test)]
mod tests;

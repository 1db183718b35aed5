//! Sensors and clocks that err in the log alone: the vehicle flies on good ones.

use super::{at, rotation, wxyz};
use crate::draw::Draw;
use nalgebra::{UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};
use squirrel_log::{Channel, FlightLog, Source};

/// One kind with its sizes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum SensorFault {
    /// The gyroscope reads `1 + s` times the rate, axis by axis.
    GyroScale {
        /// `s`
        scale_fraction: [f64; 3],
    },
    /// The accelerometer, likewise.
    AccelScale {
        /// `s`
        scale_fraction: [f64; 3],
    },
    /// The heading leans with the battery's current.
    CompassCurrent {
        /// By so much.
        heading_rad_per_a: f64,
    },
    /// The clock that stamps commands jumps forward (or back).
    ClockStep {
        /// By so much, s.
        step_s: f64,
        /// At this time, s.
        at_s: f64,
    },
    /// The gyroscope's bias grows from nothing, as in a unit that warms up. No catalogue has a name
    /// for it.
    GyroDrift {
        /// By so much in a second, rad/s^2.
        drift_rad_s2: [f64; 3],
    },
}

impl SensorFault {
    /// How many kinds there are.
    pub const KINDS: usize = 5;

    /// A kind by its number, 0 to [`Self::KINDS`].
    pub(crate) fn draw(kind: usize, draw: &mut Draw) -> Self {
        let mut three =
            |low: f64, high: f64| std::array::from_fn(|_| draw.sign() * draw.uniform(low, high));
        match kind % Self::KINDS {
            0 => Self::GyroScale { scale_fraction: three(0.02, 0.06) },
            1 => Self::AccelScale { scale_fraction: three(0.01, 0.04) },
            // 6 to 15 degrees at the 8 A or so of hover.
            2 => Self::CompassCurrent {
                heading_rad_per_a: draw.sign() * draw.uniform(6.0, 15.0).to_radians() / 8.0,
            },
            3 => Self::ClockStep {
                step_s: draw.sign() * draw.uniform(0.02, 0.1),
                at_s: draw.uniform(10.0, 30.0),
            },
            _ => Self::GyroDrift { drift_rad_s2: three(1e-3, 3e-3) },
        }
    }

    /// The name that the catalogue has for it, if it has one.
    pub fn name(&self) -> Option<&'static str> {
        match self {
            Self::GyroScale { .. } => Some("gyro_scale"),
            Self::AccelScale { .. } => Some("accel_scale"),
            Self::CompassCurrent { .. } => Some("compass_current"),
            Self::ClockStep { .. } => Some("clock_step"),
            Self::GyroDrift { .. } => None,
        }
    }

    pub(super) fn record(&self, log: &mut FlightLog) {
        let scale =
            |fraction: [f64; 3]| move |_: f64, axis: usize, x: f64| x * (1.0 + fraction[axis]);
        match *self {
            Self::GyroScale { scale_fraction } => {
                each(log, "omega_body_rad_s", scale(scale_fraction));
            }
            Self::AccelScale { scale_fraction } => {
                each(log, "specific_force_body_m_s2", scale(scale_fraction));
            }
            Self::GyroDrift { drift_rad_s2 } => {
                each(log, "omega_body_rad_s", |time_s, axis, x| x + time_s * drift_rad_s2[axis]);
            }
            Self::CompassCurrent { heading_rad_per_a } => lean(log, heading_rad_per_a),
            Self::ClockStep { step_s, at_s } => {
                for name in ["rotor", "wing"] {
                    if let Some(source) = log.sources.get_mut(name) {
                        *source = stepped(source, step_s, at_s);
                    }
                }
            }
        }
    }
}

/// Changes a channel of the inertial unit: time, axis, what it was.
fn each(log: &mut FlightLog, channel: &str, change: impl Fn(f64, usize, f64) -> f64) {
    let Some(imu) = log.sources.get_mut("imu") else { return };
    let Some(channel) = imu.channels.get_mut(channel) else { return };
    for (row, time_s) in channel.values.chunks_mut(3).zip(&imu.time_s) {
        for (axis, x) in row.iter_mut().enumerate() {
            *x = change(*time_s, axis, *x);
        }
    }
}

/// The heading of each attitude leans by the current at its time.
fn lean(log: &mut FlightLog, heading_rad_per_a: f64) {
    let Some(battery) = log.sources.get("battery").cloned() else { return };
    let Some(attitude) = log.sources.get_mut("attitude") else { return };
    let Some(channel) = attitude.channels.get_mut("q_ned_from_body_wxyz") else { return };
    for (row, time_s) in channel.values.chunks_mut(4).zip(&attitude.time_s) {
        let [current_a] = at::<1>(&battery, "current_a", *time_s);
        let turn =
            UnitQuaternion::from_axis_angle(&Vector3::z_axis(), heading_rad_per_a * current_a);
        row.copy_from_slice(&wxyz(&(turn * rotation(row))));
    }
}

/// What a clock writes that jumps: from `at_s` on, what was in force at `t` stands under
/// `t + step_s`. The samples keep their regular stamps, so that these do not give it away; over a
/// gap the last command is held.
fn stepped(source: &Source, step_s: f64, at_s: f64) -> Source {
    let taken = |t: &f64| {
        let real_s = if *t < at_s {
            *t
        } else if *t < at_s + step_s {
            at_s
        } else {
            t - step_s
        };
        source.time_s.partition_point(|stamp| *stamp <= real_s + 1e-9).saturating_sub(1)
    };
    let channels = source.channels.iter().map(|(name, channel)| {
        let values = source.time_s.iter().flat_map(|t| channel.row(taken(t)).to_vec()).collect();
        (name.clone(), Channel { width: channel.width, values })
    });
    Source { time_s: source.time_s.clone(), channels: channels.collect() }
}

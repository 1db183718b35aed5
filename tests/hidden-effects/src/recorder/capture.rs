//! Motion capture beside what the autopilot commands: position and attitude at 100 Hz, commands,
//! voltage.

use super::{TRUTH, attitude, vector, wxyz};
use crate::draw::Draw;
use nalgebra::{UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};
use squirrel_log::{FlightLog, Source};

/// Noise of the poses, and whether somebody has taken differences already.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Capture {
    /// Position, one standard deviation an axis, m.
    pub position_m: f64,
    /// Attitude, likewise, rad.
    pub attitude_rad: f64,
    /// Whether the log has velocity, from central differences of the positions.
    pub has_velocity: bool,
}

/// Rate of the poses.
const RATE_HZ: f64 = 100.0;

impl Capture {
    pub(crate) fn draw(draw: &mut Draw) -> Self {
        Self {
            position_m: draw.uniform(5e-4, 1e-3),
            attitude_rad: draw.uniform(0.1, 0.2).to_radians(),
            has_velocity: draw.sign() > 0.0,
        }
    }

    pub(super) fn record(&self, log: &mut FlightLog, mut draw: Draw) {
        let Some(truth) = log.sources.get(TRUTH) else { return };
        let end_s = truth.time_s.last().copied().unwrap_or(0.0);
        let poses: Vec<_> = (0..(end_s * RATE_HZ) as usize)
            .map(|k| {
                let time_s = k as f64 / RATE_HZ;
                let position = vector(truth, "position_ned_m", time_s);
                let noise = Vector3::from(draw.normal3(self.attitude_rad));
                let turned = attitude(truth, "q_ned_from_body_wxyz", time_s)
                    * UnitQuaternion::from_scaled_axis(noise);
                (time_s, position + Vector3::from(draw.normal3(self.position_m)), turned)
            })
            .collect();
        let (mut place, mut attitude) = (Source::default(), Source::default());
        // The first and the last pose have no difference on both sides.
        for three in poses.windows(3) {
            let (time_s, position, turned) = three[1];
            let velocity = (three[2].1 - three[0].1) * (0.5 * RATE_HZ);
            let rows: [(&str, &[f64]); 2] = [
                ("position_ned_m", position.as_slice()),
                ("velocity_ned_m_s", velocity.as_slice()),
            ];
            place.push(time_s, &rows[..=usize::from(self.has_velocity)]);
            attitude.push(time_s, &[("q_ned_from_body_wxyz", &wxyz(&turned))]);
        }
        log.sources.retain(|name, _| matches!(name.as_str(), "rotor" | "wing" | "battery"));
        if let Some(battery) = log.sources.get_mut("battery") {
            battery.channels.remove("current_a");
        }
        log.sources.insert("gnss".to_owned(), place);
        log.sources.insert("attitude".to_owned(), attitude);
    }
}

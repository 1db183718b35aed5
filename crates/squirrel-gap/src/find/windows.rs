//! Where the residual is: windows of one second, channel by channel, the worst first.

use crate::flight::recording::Recording;
use super::residual::Residual;
use super::{CHANNELS, Place};
use nalgebra::{Vector3, Vector6};
use squirrel_core::vehicle::Vehicle;
use std::fmt::Write;

/// Places to report.
const PLACES: usize = 20;
/// Length of a window, s. Windows start at whole seconds of the flight's time.
const WINDOW_S: f64 = 1.0;

/// One window of one flight: squared residual and sums of the operating condition.
#[derive(Debug, Clone)]
struct Window {
    flight: String,
    t0_s: f64,
    samples: f64,
    squared: Vector6<f64>,
    speed_m_s: Option<f64>,
    climb_m_s: Option<f64>,
    tilt_rad: Option<f64>,
    throttle: f64,
    deployment: Option<f64>,
    voltage_v: Option<f64>,
}

/// The windows of all flights, in order of flight and time.
#[derive(Debug, Default)]
pub(super) struct Windows(Vec<Window>);

impl Windows {
    /// Adds one sample of a flight; those of a flight must come together and in time order.
    pub(super) fn add(&mut self, vehicle: &Vehicle<f64>, recording: &Recording, residual: &Residual) {
        let time_s = residual.sample.time_s;
        let t0_s = (time_s / WINDOW_S).floor() * WINDOW_S;
        if self.0.last().is_none_or(|w| w.t0_s != t0_s || w.flight != recording.flight) {
            let zero = |is_logged: bool| is_logged.then_some(0.0);
            let has_velocity = recording.velocity_ned(time_s).is_some();
            self.0.push(Window {
                flight: recording.flight.to_owned(),
                t0_s,
                samples: 0.0,
                squared: Vector6::zeros(),
                speed_m_s: zero(has_velocity),
                climb_m_s: zero(has_velocity),
                tilt_rad: zero(recording.has_attitude()),
                throttle: 0.0,
                deployment: zero(recording.has_wing()),
                voltage_v: zero(recording.has_voltage()),
            });
        }
        let Some(w) = self.0.last_mut() else { return };
        let add = |sum: &mut Option<f64>, x: f64| *sum = sum.map(|sum| sum + x);
        let velocity_ned = recording.velocity_ned(time_s).unwrap_or_default();
        let down_body = residual.sample.body.ned_from_body() * squirrel_core::frames::In::new(Vector3::z());
        w.samples += 1.0;
        w.squared += residual.value.component_mul(&residual.value);
        add(&mut w.speed_m_s, velocity_ned.norm());
        add(&mut w.climb_m_s, -velocity_ned.z);
        add(&mut w.tilt_rad, down_body.vector.z.clamp(-1.0, 1.0).acos());
        add(&mut w.deployment, 0.5 * residual.deployment.iter().sum::<f64>());
        add(&mut w.voltage_v, residual.sample.voltage_v);
        w.throttle += throttle(vehicle, recording, time_s);
    }

    /// The places where the residual of a channel is furthest above that channel's average.
    pub(super) fn worst(&self) -> Vec<Place> {
        let total: Vector6<f64> = self.0.iter().map(|w| w.squared).sum();
        // A channel without any residual is nowhere worse than elsewhere.
        let channels = (0..CHANNELS.len()).filter(|&channel| total[channel] > 0.0);
        let mut all: Vec<(f64, &Window, usize)> = channels
            .flat_map(|channel| self.0.iter().map(move |w| (w.squared[channel] / total[channel], w, channel)))
            .collect();
        // The number of windows is one for all channels, so shares rank as shares times windows. The sort is stable:
        // equals keep the order of channel, flight and time; time goes first.
        all.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.t0_s.total_cmp(&b.1.t0_s)));
        let place = |(share, w, channel): (f64, &Window, usize)| Place {
            flight: w.flight.clone(),
            t0_s: w.t0_s,
            t1_s: w.t0_s + WINDOW_S,
            channel: CHANNELS[channel],
            condition: w.condition(),
            share,
        };
        all.into_iter().take(PLACES).map(place).collect()
    }
}

/// Mean commanded rotor speed over top speed.
fn throttle(vehicle: &Vehicle<f64>, recording: &Recording, time_s: f64) -> f64 {
    let p = vehicle.parameters();
    let command = recording.rotor_command(time_s);
    let speed: f64 = command[..p.rotor_count].iter().map(|u| p.propulsion.target_speed_rad_s(*u)).sum();
    speed / (p.rotor_count as f64 * p.propulsion.speed_max_rad_s)
}

impl Window {
    /// Means over the window of what is logged: `speed 1.2 m/s, climb 0.0 m/s, tilt 4 deg, throttle 0.71, 3.55 V`.
    fn condition(&self) -> String {
        let mut text = String::new();
        let mut part = |before: &str, sum: Option<f64>, digits: i32, after: &str| {
            if let Some(sum) = sum {
                let comma = if text.is_empty() { "" } else { ", " };
                let unit = 10_f64.powi(digits);
                // Adding zero turns -0.0 into 0.0.
                let rounded = (sum / self.samples * unit).round() / unit + 0.0;
                let _ = write!(text, "{comma}{before}{rounded:.*}{after}", digits as usize);
            }
        };
        part("speed ", self.speed_m_s, 1, " m/s");
        part("climb ", self.climb_m_s, 1, " m/s");
        part("tilt ", self.tilt_rad.map(f64::to_degrees), 0, " deg");
        part("throttle ", Some(self.throttle), 2, "");
        part("wings ", self.deployment, 2, "");
        part("", self.voltage_v, 2, " V");
        text
    }
}

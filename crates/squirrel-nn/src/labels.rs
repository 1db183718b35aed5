//! Windows from a flight log: what the air did to the spread wings, by the accelerometer
//! (docs/equations.md T21).
//!
//! ```text
//! f_a = m f_measured - m f_model      body frame, N; the model is the vehicle without wings
//! ```
//! In the body frame the label needs no attitude: an error of the thrust model lies along the
//! normal. The model is the simulator's plant, led along the measured motion under the logged
//! commands, so that thrust, drag and whatever effects the vehicle file has are taken off as they
//! would fly. Features come every 0.1 s from measured velocity and attitude; a label is the mean
//! over the 0.1 s about its time.

use crate::error::NnError;
use crate::windows::Window;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use squirrel_core::dynamics::State;
use squirrel_core::frames::In;
use squirrel_core::rnn::parnn::{INPUTS, WINDOW, features};
use squirrel_core::vehicle::MAX_ROTORS;
use squirrel_log::{Channel, FlightLog, clock_jump};
use squirrel_sim::plant::{Plant, WingPlant};
use squirrel_sim::vehicle_file::VehicleFile;

/// Time between rows of a window, s.
const STEP_S: f64 = 0.1;
/// Command from which a wing is spread.
const SPREAD: f64 = 0.99;
/// Time after which a servo has followed its command, s.
const SETTLED_S: f64 = 0.5;
/// Time between two samples of the force from which on nothing is known there, s.
const UNKNOWN_S: f64 = 1.0;
/// A led plant needs a step only to be checked.
const LED_STEP_S: f64 = 1e-9;

/// Every window of a flight whose wings are spread at its end.
///
/// * `vehicle` - the one that flew; its wings are what is learned
///
/// # Errors
/// [`NnError::Channel`] names the channel that the log lacks, [`NnError::Samples`] one that cannot
/// be, [`NnError::Folded`] a flight with nothing to learn from.
pub fn windows(
    vehicle: &VehicleFile,
    flight: &str,
    log: &FlightLog,
) -> Result<Vec<Window>, NnError> {
    let refused = |problem: String| NnError::Vehicle { vehicle: vehicle.name.clone(), problem };
    if vehicle.wing == WingPlant::None {
        return Err(refused("has no wings to learn about".to_owned()));
    }
    let plant = Plant::new(vehicle.vehicle, vehicle.effects, WingPlant::None, None, LED_STEP_S)
        .map_err(refused)?;
    let rotors = vehicle.vehicle.rotors().len();
    let need = |channel, width, needed_for| Line::need(flight, log, channel, width, needed_for);
    let force = need("imu.specific_force_body_m_s2", 3, "the force is measured by it")?;
    let omega = need("imu.omega_body_rad_s", 3, "rotation is measured by it")?;
    let attitude =
        need("attitude.q_ned_from_body_wxyz", 4, "velocity is turned into the body frame by it")?;
    let velocity = need("gnss.velocity_ned_m_s", 3, "the air meets the wings with it")?;
    let rotor = need("rotor.command", rotors, "thrust is taken off by it")?;
    let wing =
        need("wing.command", 2, "wings must be spread where something is learned about them")?;
    let voltage = Line::read(flight, log, "battery.voltage_v", 1)?;
    let truth = Line::read(flight, log, "truth.wing_force_body_n", 3)?;
    let reference_v = vehicle.vehicle.parameters().propulsion.reference_voltage_v;
    let mass_kg = plant.vehicle().parameters().mass_kg;

    let body_at = |t: f64| State {
        velocity: In::new(velocity.vector(t)),
        attitude: attitude.rotation(t).into_inner(),
        omega: In::new(omega.vector(t)),
        ..State::at_rest()
    };
    // The plant runs from sample to sample of the accelerometer; what it leaves there is the force
    // of the wings.
    let mut wings = Vec::with_capacity(force.time_s.len());
    let mut state = plant.initial_state(body_at(force.time_s[0]), 1.0);
    for (k, &t) in force.time_s.iter().enumerate() {
        let until = force.time_s.get(k + 1).copied().unwrap_or(t);
        let mut command = [0.0; MAX_ROTORS];
        command[..rotors].copy_from_slice(rotor.held(t));
        let volt = voltage.as_ref().map_or(reference_v, |line| line.held(t)[0]);
        if k == 0 {
            // Rotors start settled.
            plant.lead(&mut state, &body_at(t), &command, [0.0; 2], volt, 1.0);
            state.time_s = 0.0;
        }
        let led = plant.lead(&mut state, &body_at(t), &command, [0.0; 2], volt, until - t);
        wings.push((force.vector(t) - led.specific_force.vector) * mass_kg);
    }
    let mean = |line: &dyn Fn(usize) -> Vector3<f64>, time_s: &[f64], t: f64| {
        let from = time_s.partition_point(|s| *s < t - 0.5 * STEP_S);
        let until = time_s.partition_point(|s| *s < t + 0.5 * STEP_S);
        (until > from)
            .then(|| (from..until).map(line).sum::<Vector3<f64>>() / (until - from) as f64)
    };

    let lines = [&force, &omega, &attitude, &velocity, &rotor, &wing];
    let start =
        lines.iter().map(|line| line.time_s[0]).fold(f64::NEG_INFINITY, f64::max) + 0.5 * STEP_S;
    let end = lines[..4]
        .iter()
        .map(|line| line.time_s[line.time_s.len() - 1])
        .fold(f64::INFINITY, f64::min);
    let steps = ((end - 0.5 * STEP_S - start) / STEP_S).floor().max(0.0) as usize;
    // As many as there are samples for, however long a clock says that the flight was.
    let mut rows: Vec<[f32; INPUTS]> = Vec::new();
    let mut all = Vec::new();
    let mut spread_since: Option<f64> = None;
    let mut next = 0;
    while next <= steps {
        let step = next;
        next += 1;
        let t = start + step as f64 * STEP_S;
        if let Some(known_s) = force.unknown_until(t) {
            // A window goes over nothing unknown.
            next = next.max(((known_s - start) / STEP_S).ceil() as usize);
            (rows, spread_since) = (Vec::new(), None);
            continue;
        }
        let q = attitude.rotation(t);
        let body = (q.inverse() * velocity.vector(t)).cast::<f32>();
        rows.push(features(In::new(body)));
        let is_spread = wing.held(t).iter().all(|side| *side >= SPREAD);
        spread_since = is_spread.then(|| spread_since.unwrap_or(t));
        let settled = spread_since.is_some_and(|since| t - since >= SETTLED_S);
        let Some(first) = rows.len().checked_sub(WINDOW).filter(|_| settled) else { continue };
        let Some(label) = mean(&|k| wings[k], &force.time_s, t) else { continue };
        let mut window = [[0.0; INPUTS]; WINDOW];
        window.copy_from_slice(&rows[first..]);
        let known = truth.as_ref().and_then(|line| mean(&|k| line.row3(k), &line.time_s, t));
        all.push(Window {
            rows: window,
            velocity_body_m_s: body.into(),
            q_ned_from_body_wxyz: [q.w, q.i, q.j, q.k].map(|x| x as f32),
            label_body_n: label.cast::<f32>().into(),
            truth_body_n: known.map(|force| force.cast::<f32>().into()),
        });
    }
    if all.is_empty() {
        return Err(NnError::Folded {
            flight: flight.to_owned(),
            spread: SPREAD,
            window_s: STEP_S * WINDOW as f64,
        });
    }
    Ok(all)
}

/// Area of the flat plate that models correct: of both wings, m^2; 0 for a vehicle without any.
pub fn plate_area_m2(vehicle: &VehicleFile) -> f32 {
    vehicle.vehicle.parameters().wing.map_or(0.0, |wing| 2.0 * wing.area_per_side_m2) as f32
}

/// A channel that can be asked at any time.
struct Line {
    time_s: Vec<f64>,
    values: Channel,
}

impl Line {
    fn need(
        flight: &str,
        log: &FlightLog,
        channel: &'static str,
        width: usize,
        needed_for: &'static str,
    ) -> Result<Self, NnError> {
        let missing = || NnError::Channel { flight: flight.to_owned(), channel, needed_for };
        Self::read(flight, log, channel, width)?.ok_or_else(missing)
    }

    /// `None` where the log lacks the channel.
    fn read(
        flight: &str,
        log: &FlightLog,
        channel: &'static str,
        width: usize,
    ) -> Result<Option<Self>, NnError> {
        let Some((time_s, values)) = log.channel(channel) else { return Ok(None) };
        let refuse =
            |problem: String| Err(NnError::Samples { flight: flight.to_owned(), channel, problem });
        if values.width != width {
            return refuse(format!("has {} numbers a sample, must have {width}", values.width));
        }
        if time_s.len() < 2 || values.values.len() != time_s.len() * width {
            return refuse(format!("{} samples, must have two or more", time_s.len()));
        }
        if let Some(i) = (1..time_s.len()).find(|i| !(time_s[*i] > time_s[i - 1])) {
            return refuse(format!("time {} s after {} s, must rise", time_s[i], time_s[i - 1]));
        }
        let jump = |i: usize| clock_jump(time_s[i - 1], time_s[i]).map(|problem| (i, problem));
        if let Some((i, problem)) = (1..time_s.len()).find_map(jump) {
            return refuse(format!("time_s[{i}] = {}: {problem}; the clock has jumped", time_s[i]));
        }
        if let Some(i) = values.values.iter().position(|x| !x.is_finite()) {
            return refuse(format!(
                "{} at {} s, must be finite",
                values.values[i],
                time_s[i / width]
            ));
        }
        Ok(Some(Self { time_s: time_s.to_vec(), values: values.clone() }))
    }

    /// The last sample before a time, the first before all.
    fn before(&self, t: f64) -> usize {
        self.time_s.partition_point(|s| *s <= t + 1e-9).saturating_sub(1)
    }
    /// Where the samples go on, if a time is between two that are far apart.
    fn unknown_until(&self, t: f64) -> Option<f64> {
        let (i, j, _) = self.about(t);
        (self.time_s[j] - self.time_s[i] > UNKNOWN_S).then(|| self.time_s[j])
    }
    fn held(&self, t: f64) -> &[f64] {
        self.values.row(self.before(t))
    }
    fn row3(&self, i: usize) -> Vector3<f64> {
        Vector3::from_column_slice(self.values.row(i))
    }
    /// The samples about a time, and the share of the way between them; held beyond the ends.
    fn about(&self, t: f64) -> (usize, usize, f64) {
        let i = self.before(t);
        let j = (i + 1).min(self.time_s.len() - 1);
        let span = self.time_s[j] - self.time_s[i];
        (i, j, if span > 0.0 { ((t - self.time_s[i]) / span).clamp(0.0, 1.0) } else { 0.0 })
    }
    fn vector(&self, t: f64) -> Vector3<f64> {
        let (i, j, share) = self.about(t);
        self.row3(i).lerp(&self.row3(j), share)
    }
    fn rotation(&self, t: f64) -> UnitQuaternion<f64> {
        let (i, j, share) = self.about(t);
        let q = |k: usize| {
            let [w, x, y, z] = self.values.row(k) else { return UnitQuaternion::identity() };
            UnitQuaternion::new_normalize(Quaternion::new(*w, *x, *y, *z))
        };
        let (a, b) = (q(i), q(j));
        a.try_slerp(&b, share, 1e-9).unwrap_or(a)
    }
}

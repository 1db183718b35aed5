//! Every term of a step of the flight code, recorded.

use super::{ESTIMATE, WIND, wide};
use crate::FlightLog;
use squirrel_core::control::Reference;
use squirrel_core::control::wing_force::ParnnTerms;
use squirrel_core::rnn::parnn::Estimate;
use squirrel_core::stack::StackOutput;
use squirrel_core::stack::failsafe::Failsafe;

/// What rotors and wings really did.
#[derive(Debug, Clone, Copy)]
pub struct Moved<'a> {
    /// Speed of each rotor, rad/s.
    pub rotor_speed_rad_s: &'a [f64],
    /// Deployment of the left and of the right wing, 0 folded, 1 spread.
    pub deployment: [f64; 2],
}

/// Records every term of one step of the flight code.
///
/// * `command_stamp` - what the clock of the commands shows at `t`, s
/// * `moved` - what rotors and wings really did, where a plant flew
pub fn record_output(
    log: &mut FlightLog,
    t: f64,
    command_stamp: f64,
    output: &StackOutput,
    rotors: usize,
    moved: Option<Moved<'_>>,
) {
    let command = output.rotor_command.map(f64::from);
    let wing_command = output.wing_command.map(f64::from);
    let mut rotor: Vec<(&str, &[f64])> = vec![("command", &command[..rotors])];
    let mut wing: Vec<(&str, &[f64])> = vec![("command", &wing_command)];
    if let Some(moved) = &moved {
        rotor.push(("speed_rad_s", moved.rotor_speed_rad_s));
        wing.push(("deployment", &moved.deployment));
    }
    for (name, rows) in [("rotor", rotor), ("wing", wing)] {
        let source = log.source_mut(name);
        // Times of a log increase: what a clock that has jumped back stamps again is not written.
        if source.time_s.last().is_none_or(|last| *last < command_stamp) {
            source.push(command_stamp, &rows);
        }
    }
    record_reference(log, "reference", t, &output.reference);
    record_estimate(log, t, output);
    // A source of its own, so that a flight without a fault has the log that it always had.
    if output.failsafe != Failsafe::default() {
        let Failsafe { mode, reason } = output.failsafe;
        let rows: &[(&str, &[f64])] =
            &[("mode", &[f64::from(mode as u8)]), ("reason", &[f64::from(reason as u8)])];
        log.source_mut("control.failsafe").push(t, rows);
    }
    if let Some(outer) = &output.outer {
        if let Some(terms) = &outer.parnn {
            record_parnn(log, t, terms);
        }
        let p = &outer.position;
        let angles = |roll: f32, pitch: f32| [f64::from(roll), f64::from(pitch)];
        log.source_mut("control.outer").push(
            t,
            &[
                ("position_error_ned_m", &wide(&p.position_error.vector)),
                ("velocity_desired_ned_m_s", &wide(&p.velocity_desired.vector)),
                ("velocity_error_slope_ned_m_s2", &wide(&p.velocity_error_slope)),
                ("velocity_error_ned_m_s", &wide(&p.velocity_error.vector)),
                ("velocity_error_integral_ned_m", &wide(&p.integral)),
                ("acceleration_demand_ned_m_s2", &wide(&p.acceleration_demand.vector)),
                ("acceleration_command_ned_m_s2", &wide(&p.acceleration.vector)),
                ("request_roll_pitch_rad", &angles(p.request.roll_rad, p.request.pitch_rad)),
                ("request_thrust_n", &[f64::from(p.request.thrust_n)]),
                ("wing_force_ned_n", &wide(&outer.wing_force.vector)),
                ("angle_of_attack_rad", &[f64::from(outer.angle_of_attack_rad)]),
                ("helpful_force_n", &[f64::from(outer.wing.helpful_n)]),
                ("flag", &[f64::from(u8::from(outer.wing.flag))]),
                ("mode", &[f64::from(outer.mode as u8)]),
                ("reason", &[f64::from(outer.reason as u8)]),
                (
                    "roll_pitch_command_rad",
                    &angles(outer.command.roll_rad, outer.command.pitch_rad),
                ),
                ("thrust_command_n", &[f64::from(outer.command.thrust_n)]),
                ("clamped", &[f64::from(u8::from(outer.clamped))]),
            ],
        );
    }
    if let Some(excitation) = output.inner.as_ref().and_then(|inner| inner.excitation) {
        log.source_mut("control.excitation").push(
            t,
            &[
                ("angle_rad", &wide(&excitation.attitude.angle)),
                ("rate_rad_s", &wide(&excitation.attitude.rate)),
                ("acceleration_rad_s2", &wide(&excitation.attitude.acceleration)),
                ("thrust_share", &[f64::from(excitation.thrust_share)]),
            ],
        );
    }
    if let Some(inner) = &output.inner {
        let thrusts = inner.mixer.rotor_thrust_n.map(f64::from);
        log.source_mut("control.inner").push(
            t,
            &[
                ("filter_angle_rad", &wide(&inner.filter.angle)),
                ("filter_rate_rad_s", &wide(&inner.filter.rate)),
                ("filter_acceleration_rad_s2", &wide(&inner.filter.acceleration)),
                ("thrust_demand_n", &[f64::from(inner.demand.thrust_n)]),
                ("angle_error_rad", &wide(&inner.attitude.angle_error)),
                ("rate_error_rad_s", &wide(&inner.attitude.rate_error)),
                ("integral_rad_s", &wide(&inner.attitude.integral)),
                ("gyroscopic_torque_n_m", &wide(&inner.attitude.gyroscopic_n_m)),
                ("torque_n_m", &wide(&inner.attitude.torque_n_m)),
                ("thrust_n", &[f64::from(inner.mixer.achieved.thrust_n)]),
                ("achieved_torque_n_m", &wide(&inner.mixer.achieved.torque_n_m)),
                ("roll_pitch_share", &[f64::from(inner.mixer.roll_pitch_share)]),
                ("saturated", &[f64::from(u8::from(inner.mixer.saturated))]),
                ("rotor_thrust_n", &thrusts[..rotors]),
            ],
        );
    }
}

/// Records what is followed, under the name of a source.
pub fn record_reference(log: &mut FlightLog, source: &str, t: f64, r: &Reference) {
    log.source_mut(source).push(
        t,
        &[
            ("position_ned_m", &wide(&r.position.vector)),
            ("velocity_ned_m_s", &wide(&r.velocity.vector)),
            ("acceleration_ned_m_s2", &wide(&r.acceleration.vector)),
            ("yaw_rad", &[f64::from(r.yaw_rad)]),
        ],
    );
}

/// What is believed, and what is not as it should be.
fn record_estimate(log: &mut FlightLog, t: f64, output: &StackOutput) {
    log.source_mut("control.status").push(
        t,
        &[("rejected", &[f64::from(output.rejected)]), ("health", &[f64::from(output.health.0)])],
    );
    if let Some(wind) = &output.wind {
        log.source_mut(WIND).push(
            t,
            &[
                ("velocity_ned_m_s", &wide(&wind.velocity.vector)),
                ("deviation_m_s", &[f64::from(wind.deviation_m_s)]),
            ],
        );
    }
    if let Some(terms) = &output.navigation {
        let attitude = terms.ned_from_body.wxyz().map(f64::from);
        log.source_mut(ESTIMATE).push(
            t,
            &[
                ("q_ned_from_body_wxyz", &attitude),
                ("position_ned_m", &wide(&terms.position.vector)),
                ("velocity_ned_m_s", &wide(&terms.velocity.vector)),
                ("gyro_bias_body_rad_s", &wide(&terms.gyro_bias.vector)),
            ],
        );
        // For who reads a log as that of any autopilot.
        log.source_mut("attitude").push(t, &[("q_ned_from_body_wxyz", &attitude)]);
    }
}

/// What the network said, also where the flat plate stood in for it; NaN before its window was
/// full.
fn record_parnn(log: &mut FlightLog, t: f64, terms: &ParnnTerms) {
    let said =
        |of: fn(&Estimate) -> f32| terms.estimate.as_ref().map_or(f64::NAN, |e| f64::from(of(e)));
    let force =
        [said(|e| e.force.vector.x), said(|e| e.force.vector.y), said(|e| e.force.vector.z)];
    log.source_mut("control.parnn").push(
        t,
        &[
            ("guard", &[f64::from(terms.guard as u8)]),
            ("alpha_w_rad", &[said(|e| e.correction.alpha_w_rad)]),
            ("gamma", &[said(|e| e.correction.gamma)]),
            ("alpha_est_rad", &[said(|e| e.alpha_est_rad)]),
            ("force_body_n", &force),
        ],
    );
}

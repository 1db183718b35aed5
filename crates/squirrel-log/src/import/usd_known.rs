//! A map of a Crazyflie's micro-SD log by the names of its variables: the firmware's log groups
//! mean the same whoever chose among them.
//!
//! Positions, velocities and accelerations of `stateEstimate` are in a world with z up, whose x is
//! called north here: `nwu`. Roll is right side down; pitch is of the firmware's older frame and
//! positive with the nose up; yaw is nose left. Motors as on the board: 1 front right, 2 back
//! right, 3 back left, 4 front left.

use std::fmt::Write;
use std::path::Path;

use super::error::ImportError;
use super::map::ImportMap;
use super::usd_format::Header;
use crate::files;

const DEGREE: &str = "scale = 0.017453292519943295";
const GRAVITY: &str = "scale = 9.80665";
/// Of the 16 bits of a motor.
const FULL: &str = "rotors = [1, 2, 3, 4], scale = 1.5259021896696422e-5";
const NWU: &str = "world = \"nwu\"";
const FLU: &str = "body = \"flu\"";
const QUATERNION: &str =
    "order = \"wxyz\", direction = \"world_from_body\", world = \"nwu\", body = \"flu\"";

/// Channel, the variables of it, and the rest of its line: the first of a channel that is there is
/// taken.
const KNOWN: [(&str, &[&str], &[&str]); 17] = [
    ("imu.omega_body_rad_s", &["gyro.x", "gyro.y", "gyro.z"], &[FLU, DEGREE]),
    ("imu.specific_force_body_m_s2", &["acc.x", "acc.y", "acc.z"], &[FLU, GRAVITY]),
    (
        "imu.acceleration_ned_m_s2",
        &["stateEstimate.ax", "stateEstimate.ay", "stateEstimate.az"],
        &[NWU, GRAVITY],
    ),
    (
        "attitude.q_ned_from_body_wxyz",
        &["stateEstimate.qw", "stateEstimate.qx", "stateEstimate.qy", "stateEstimate.qz"],
        &[QUATERNION],
    ),
    ("attitude.roll_rad", &["stateEstimate.roll"], &[DEGREE]),
    ("attitude.pitch_rad", &["stateEstimate.pitch"], &[DEGREE]),
    ("attitude.yaw_rad", &["stateEstimate.yaw"], &["scale = -0.017453292519943295"]),
    ("gnss.position_ned_m", &["stateEstimate.x", "stateEstimate.y", "stateEstimate.z"], &[NWU]),
    (
        "gnss.velocity_ned_m_s",
        &["stateEstimate.vx", "stateEstimate.vy", "stateEstimate.vz"],
        &[NWU],
    ),
    ("rotor.command", &PWM, &[FULL]),
    ("rotor.command", &["pwm.m1", "pwm.m2", "pwm.m3", "pwm.m4"], &[FULL]),
    ("rotor.command", &MOTOR, &[FULL]),
    ("control.rotor_thrust_request", &MOTOR, &[FULL]),
    (
        "rotor.speed_rad_s",
        &["rpm.m1", "rpm.m2", "rpm.m3", "rpm.m4"],
        &["rotors = [1, 2, 3, 4], scale = 0.10471975511965977"],
    ),
    ("battery.voltage_v", &["pm.vbatMV"], &["scale = 0.001"]),
    ("battery.voltage_v", &["pm.vbat"], &[]),
    ("baro.altitude_m", &["baro.asl"], &[]),
];
const PWM: [&str; 4] = ["pwm.m1_pwm", "pwm.m2_pwm", "pwm.m3_pwm", "pwm.m4_pwm"];
const MOTOR: [&str; 4] = ["motor.m1", "motor.m2", "motor.m3", "motor.m4"];
/// Events that are looked at: each is a pass over the header.
const EVENTS_MAX: usize = 64;
/// Above the floor, where legs push, m.
const FLOOR_M: f64 = 0.3;

/// The map of a micro-SD log, and what was chosen, a line each.
///
/// # Errors
/// The file cannot be read, or contradicts its format; it has none of the variables.
pub(super) fn map_of_usd(path: &Path) -> Result<(ImportMap, Vec<String>), ImportError> {
    let file = path.display().to_string();
    let damaged = |problem: String| ImportError::Damaged { file: file.clone(), problem };
    let bytes =
        files::read(path).map_err(|source| ImportError::Read { file: file.clone(), source })?;
    let events = Header::read(&bytes, "").map_err(damaged)?.events;
    let mut best: (Vec<String>, String) = Default::default();
    for event in events.values().take(EVENTS_MAX) {
        let header = Header::read(&bytes, &event.name).map_err(damaged)?;
        let names: Vec<&str> = header.columns.iter().map(|column| column.name.as_str()).collect();
        let lines = lines(&names);
        // Of two events that say as much the first by id.
        if lines.len() > best.0.len() {
            best = (lines, event.name.clone());
        }
    }
    let (lines, event) = best;
    if lines.is_empty() {
        let names: Vec<&str> = KNOWN.iter().flat_map(|(_, columns, _)| *columns).copied().collect();
        return Err(damaged(format!(
            "no event has variables of a known name ({}): say what they are with --map",
            names.join(", ")
        )));
    }
    let mut notes = vec![format!("of the variables of the event `{event}`, by their names")];
    let mut text = String::from("# Of the names of the log's variables.\n");
    if lines.iter().any(|line| line.contains("stateEstimate.z\"")) {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "keep = \"stateEstimate.z > {FLOOR_M}\"");
        notes.push(format!("kept: what is flown above {FLOOR_M} m, for on the floor legs push"));
    }
    let topic = toml::Value::String(event);
    let _ = write!(
        text,
        "[[source]]\ntopic = {topic}\ntime = {{ column = \"timestamp\", unit = \"us\" }}\n[source.channels]\n{}\n",
        lines.join("\n")
    );
    Ok((ImportMap::parse(&text, &format!("the map of {file}"))?, notes))
}

/// The lines of the channels that an event has.
fn lines(names: &[&str]) -> Vec<String> {
    let mut lines: Vec<(&str, String)> = Vec::new();
    let has = |columns: &[&str]| columns.iter().all(|column| names.contains(column));
    for (channel, columns, rest) in KNOWN {
        let taken = |name: &str| lines.iter().any(|(other, _)| *other == name);
        // Angles are for logs without a quaternion, acceleration is for those without its sensor.
        let better = match channel {
            "attitude.roll_rad" | "attitude.pitch_rad" | "attitude.yaw_rad" => {
                taken("attitude.q_ned_from_body_wxyz")
            }
            "imu.acceleration_ned_m_s2" => taken("imu.specific_force_body_m_s2"),
            "control.rotor_thrust_request" => !has(&PWM),
            _ => false,
        };
        if has(columns) && !taken(channel) && !better {
            let parts = [&[&*format!("columns = {columns:?}")], rest].concat().join(", ");
            lines.push((channel, format!("\"{channel}\" = {{ {parts} }}")));
        }
    }
    lines.into_iter().map(|(_, line)| line).collect()
}

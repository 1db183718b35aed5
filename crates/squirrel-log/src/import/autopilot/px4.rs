//! What the topics of a PX4 log (1.10 to now) mean.

use std::f64::consts::TAU;

use super::super::rows::Records;
use super::super::ulog_file::UlogLog;
use super::collect::{Collected, Topic, same, scaled};

const GAUSS_UT: f64 = 100.0;
const RPM_RAD_S: f64 = TAU / 60.0;
/// When it was measured, or when it was published.
const CLOCK: [(&str, f64); 2] = [("timestamp_sample", 1.0), ("timestamp", 1.0)];
/// Functions of outputs from 1.13 on: motor 1 to 12.
const FUNCTION_MOTOR_1: f64 = 101.0;
const MOTORS_MAX: usize = 12;

/// Adds what the log has; `notes` gets what was chosen.
pub(super) fn collect(
    bytes: &[u8],
    log: &UlogLog,
    collected: &mut Collected,
    notes: &mut Vec<String>,
) {
    let mut take = |name: &str, add: &mut dyn FnMut(&Topic) -> bool| {
        let Some((layout, messages)) = log.messages(name, 0) else { return false };
        let records = messages.iter().map(|message| &bytes[message.clone()]).collect();
        let rows = Records { columns: &layout.columns, records };
        let Some(topic) = Topic::new(name, &rows, &CLOCK) else { return false };
        if topic.dropped > 0 {
            notes.push(dropped(&topic));
        }
        add(&topic)
    };
    // The two of them are filtered and on their own clocks; sensor_combined is one message.
    let count = |name: &str| log.messages(name, 0).map_or(0, |(_, messages)| messages.len());
    let fast = count("vehicle_angular_velocity").min(count("vehicle_acceleration"));
    if fast > 0 && fast >= count("sensor_combined") {
        take("vehicle_angular_velocity", &mut |topic| {
            let xyz = ["xyz[0]", "xyz[1]", "xyz[2]"];
            collected.add("imu.omega_body_rad_s", topic, &xyz, "rad/s, FRD", same)
        });
        take("vehicle_acceleration", &mut |topic| {
            let xyz = ["xyz[0]", "xyz[1]", "xyz[2]"];
            collected.add("imu.specific_force_body_m_s2", topic, &xyz, "m/s2, FRD", same)
        });
    } else {
        take("sensor_combined", &mut |topic| {
            let gyro = ["gyro_rad[0]", "gyro_rad[1]", "gyro_rad[2]"];
            let force = ["accelerometer_m_s2[0]", "accelerometer_m_s2[1]", "accelerometer_m_s2[2]"];
            let added = collected.add("imu.omega_body_rad_s", topic, &gyro, "rad/s, FRD", same);
            let name = "imu.specific_force_body_m_s2";
            collected.add(name, topic, &force, "m/s2, FRD", same) || added
        });
    }
    take("vehicle_attitude", &mut |topic| {
        let q = ["q[0]", "q[1]", "q[2]", "q[3]"];
        let origin = "w x y z, NED from FRD";
        collected.add("attitude.q_ned_from_body_wxyz", topic, &q, origin, same)
    });
    take("vehicle_local_position", &mut |topic| local_position(topic, collected));
    take("vehicle_local_position_groundtruth", &mut |topic| {
        let (position, velocity) = (["x", "y", "z"], ["vx", "vy", "vz"]);
        let added = collected.add("truth.position_ned_m", topic, &position, "m, NED", same);
        collected.add("truth.velocity_ned_m_s", topic, &velocity, "m/s, NED", same) || added
    });
    take("vehicle_air_data", &mut |topic| {
        collected.add("baro.altitude_m", topic, &["baro_alt_meter"], "m, up", same)
    });
    take("vehicle_magnetometer", &mut |topic| {
        let field = ["magnetometer_ga[0]", "magnetometer_ga[1]", "magnetometer_ga[2]"];
        let name = "magnetometer.field_body_ut";
        collected.add(name, topic, &field, "gauss, FRD", scaled(GAUSS_UT))
    });
    take("battery_status", &mut |topic| {
        // A battery that is not there is at 0 V, a current that is not measured is -1 A.
        let known = |row: &[f64], sample: &mut Vec<f64>| {
            sample.push(if row[0] > 0.0 { row[0] } else { f64::NAN });
        };
        let added = collected.add("battery.voltage_v", topic, &["voltage_v"], "V", known);
        let known = |row: &[f64], sample: &mut Vec<f64>| {
            sample.push(if row[0] >= 0.0 { row[0] } else { f64::NAN });
        };
        collected.add("battery.current_a", topic, &["current_a"], "A", known) || added
    });
    let mut said = Vec::new();
    let direct = take("actuator_motors", &mut |topic| motors(topic, collected));
    if !direct {
        take("actuator_outputs", &mut |topic| outputs(topic, log, collected, &mut said));
    }
    let rotors = rotor_count(log);
    take("esc_status", &mut |topic| {
        let count = (topic.columns(&["esc_count"]))
            .and_then(|count| count[0].iter().copied().find(|&n| n > 0.0))
            .map_or(rotors.unwrap_or(0), |count| count as usize);
        let names: Vec<String> = (0..count).map(|i| format!("esc[{i}].esc_rpm")).collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let (name, origin) = ("rotor.speed_rad_s", "rpm");
        !names.is_empty() && collected.add(name, topic, &names, origin, scaled(RPM_RAD_S))
    });
    notes.append(&mut said);
    let (dropouts, milliseconds) = log.dropouts;
    if dropouts > 0 {
        let lost_s = milliseconds as f64 / 1e3;
        notes.push(format!("the logger could not write {dropouts} times, {lost_s:.3} s in all"));
    }
}

pub(super) fn dropped(topic: &Topic) -> String {
    format!(
        "{}: {} messages left out, whose time repeats or runs backwards",
        topic.name, topic.dropped
    )
}

fn local_position(topic: &Topic, collected: &mut Collected) -> bool {
    // Numbers that the filter does not vouch for are none.
    let vouched = |row: &[f64], sample: &mut Vec<f64>| {
        let flags = [row[3], row[3], row[4]];
        sample
            .extend(row.iter().zip(flags).map(|(&x, flag)| if flag > 0.0 { x } else { f64::NAN }));
    };
    let position = ["x", "y", "z", "xy_valid", "z_valid"];
    let velocity = ["vx", "vy", "vz", "v_xy_valid", "v_z_valid"];
    let (name, origin) = ("gnss.position_ned_m", "m, NED; the filter's estimate, no raw fix");
    let added = collected.add(name, topic, &position, origin, vouched);
    let (name, origin) = ("gnss.velocity_ned_m_s", "m/s, NED; the filter's estimate, no raw fix");
    collected.add(name, topic, &velocity, origin, vouched) || added
}

/// How many rotors the parameters say, as far as they do.
fn rotor_count(log: &UlogLog) -> Option<usize> {
    let parameter = |name: &str| log.parameters.get(name).copied();
    let by_type = match parameter("MAV_TYPE")? as i64 {
        2 => Some(4),
        13 => Some(6),
        14 => Some(8),
        15 => Some(3),
        _ => None,
    };
    let told = parameter("CA_ROTOR_COUNT").filter(|&n| n > 0.0).map(|n| n as usize);
    told.or(by_type).filter(|&n| n <= MOTORS_MAX)
}

/// `actuator_motors`: what the allocation asks of each motor, NaN where there is none.
fn motors(topic: &Topic, collected: &mut Collected) -> bool {
    let names: Vec<String> = (0..MOTORS_MAX).map(|i| format!("control[{i}]")).collect();
    let used = |name: &&str| {
        topic.columns(&[name]).is_some_and(|column| column[0].iter().any(|x| x.is_finite()))
    };
    let names: Vec<&str> = names.iter().map(String::as_str).take_while(used).collect();
    let origin = "thrust asked of each motor, 0 to 1, in the order of CA_ROTOR";
    !names.is_empty() && collected.add("rotor.command", topic, &names, origin, same)
}

/// `actuator_outputs`: what leaves the pins, motors among them.
fn outputs(
    topic: &Topic,
    log: &UlogLog,
    collected: &mut Collected,
    notes: &mut Vec<String>,
) -> bool {
    let parameter = |name: String| log.parameters.get(&name).copied();
    // From 1.13 on the parameters say which output is which motor.
    let channel = |motor: usize| {
        let function = FUNCTION_MOTOR_1 + motor as f64;
        (1..=16).find(|n| parameter(format!("PWM_MAIN_FUNC{n}")) == Some(function))
    };
    let told: Vec<usize> = (0..MOTORS_MAX).map_while(channel).collect();
    let used =
        topic.columns(&["noutputs"]).map_or(0.0, |n| n[0].iter().copied().fold(0.0, f64::max));
    let channels = if told.is_empty() {
        let count = rotor_count(log).unwrap_or((used as usize).min(4));
        notes.push(match rotor_count(log) {
            Some(_) => format!("rotor.command: the first {count} outputs, for the vehicle has {count} rotors"),
            None => format!(
                "rotor.command: the first {count} outputs: no parameter of the log (MAV_TYPE, CA_ROTOR_COUNT, \
                 PWM_MAIN_FUNC) says which outputs are motors"
            ),
        });
        (1..=count).collect()
    } else {
        told
    };
    let names: Vec<String> = channels.iter().map(|n| format!("output[{}]", n - 1)).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let limits = |n: &usize| {
        let of = |kind: &str, default: f64| {
            let own = parameter(format!("PWM_MAIN_{kind}{n}"));
            let all = || parameter(format!("PWM_MAIN_{kind}")).or(parameter(format!("PWM_{kind}")));
            own.or_else(all).filter(|&us| us > 0.0).unwrap_or(default)
        };
        (of("MIN", 1000.0), of("MAX", 2000.0))
    };
    let limits: Vec<(f64, f64)> = channels.iter().map(limits).collect();
    if limits.iter().any(|(low, high)| low >= high) {
        notes.push("rotor.command: left out, PWM_MIN is not below PWM_MAX".to_owned());
        return false;
    }
    let origin = "pulses, us; from PWM_MIN = 0 to PWM_MAX = 1";
    let fraction = |row: &[f64], sample: &mut Vec<f64>| {
        let held =
            |(us, (low, high)): (&f64, &(f64, f64))| ((us - low) / (high - low)).clamp(0.0, 1.0);
        sample.extend(row.iter().zip(&limits).map(held));
    };
    !names.is_empty() && collected.add("rotor.command", topic, &names, origin, fraction)
}

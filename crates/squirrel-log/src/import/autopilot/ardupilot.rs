//! What the messages of an ArduPilot log mean (Copter; the same names in Plane and Rover).
//!
//! Body FRD and world NED as here. `RCOU` are pulses in us, `IMU` rad/s and m/s2 (specific force),
//! `ATT` angles in degrees, `XKF1` position and velocity of the filter relative to its origin.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::rc::Rc;

use super::super::ardupilot_file::BinLog;
use super::super::rows::Rows;
use super::collect::{Collected, Topic, q_of_angles, same, scaled};
use super::px4::dropped;

const DEG: f64 = TAU / 360.0;
const RPM_RAD_S: f64 = TAU / 60.0;
const MILLIGAUSS_UT: f64 = 0.1;
const CLOCK: [(&str, f64); 2] = [("TimeUS", 1.0), ("TimeMS", 1e3)];
/// `SERVOn_FUNCTION` of motor 1; eight in a row, motors 9 to 12 from 82 on.
const FUNCTION_MOTOR_1: usize = 33;
const FUNCTION_MOTOR_9: usize = 82;
const MOTORS_MAX: usize = 12;
const OUTPUTS_MAX: usize = 32;
/// How far the filter's quaternion may be from the angles of `ATT`, rad.
const ATTITUDES_APART_MAX_RAD: f64 = 5.0 * DEG;

/// The log and what it says of itself.
pub(super) struct Log<'a> {
    pub(super) bytes: &'a [u8],
    pub(super) messages: &'a BinLog,
    pub(super) parameters: &'a BTreeMap<String, f64>,
}

impl Log<'_> {
    fn with<T>(&self, name: &str, instance: u8, add: impl FnOnce(&Topic) -> T) -> Option<T> {
        let rows = self.messages.message(name)?.records(self.bytes, instance);
        Some(add(&Topic::new(name, &rows, &CLOCK)?))
    }

    fn count(&self, name: &str) -> usize {
        self.messages.message(name).map_or(0, |message| message.records(self.bytes, 0).len())
    }
}

/// Adds what the log has; `notes` gets what was chosen.
pub(super) fn collect(log: &Log, collected: &mut Collected, notes: &mut Vec<String>) {
    let mut take = |names: &[&str], add: &mut dyn FnMut(&Topic) -> bool| {
        let found = names.iter().find(|name| log.count(name) > 0);
        found.and_then(|name| {
            log.with(name, 0, |topic| {
                if topic.dropped > 0 {
                    notes.push(dropped(topic));
                }
                add(topic)
            })
        })
    };
    // GYR and ACC are every sample of the sensor, IMU their mean at a lower rate.
    let fast = log.count("GYR") > log.count("IMU");
    take(if fast { &["GYR"] } else { &["IMU"] }, &mut |topic| {
        let omega = ["GyrX", "GyrY", "GyrZ"];
        collected.add("imu.omega_body_rad_s", topic, &omega, "rad/s, FRD", same)
    });
    take(if fast && log.count("ACC") > 0 { &["ACC"] } else { &["IMU"] }, &mut |topic| {
        let force = ["AccX", "AccY", "AccZ"];
        collected.add("imu.specific_force_body_m_s2", topic, &force, "m/s2, FRD", same)
    });
    take(&["RATE"], &mut |topic| {
        let (name, asked) = ("reference.omega_body_rad_s", ["RDes", "PDes", "YDes"]);
        collected.add(name, topic, &asked, "deg/s, FRD", scaled(DEG))
    });
    take(&["XKF1", "NKF1"], &mut |topic| {
        let (position, velocity) = (["PN", "PE", "PD"], ["VN", "VE", "VD"]);
        let (name, origin) = ("gnss.position_ned_m", "m, NED; the filter's estimate, no raw fix");
        let added = collected.add(name, topic, &position, origin, same);
        let (name, origin) =
            ("gnss.velocity_ned_m_s", "m/s, NED; the filter's estimate, no raw fix");
        collected.add(name, topic, &velocity, origin, same) || added
    });
    take(&["BARO"], &mut |topic| collected.add("baro.altitude_m", topic, &["Alt"], "m, up", same));
    take(&["MAG"], &mut |topic| {
        let (name, field) = ("magnetometer.field_body_ut", ["MagX", "MagY", "MagZ"]);
        collected.add(name, topic, &field, "mGauss, FRD", scaled(MILLIGAUSS_UT))
    });
    take(&["BAT", "CURR"], &mut |topic| {
        let added = collected.add("battery.voltage_v", topic, &["Volt"], "V", same);
        collected.add("battery.current_a", topic, &["Curr"], "A", same) || added
    });
    attitude(log, collected, notes);
    let channels = motors(log, notes);
    commands(log, &channels, collected, notes);
    speeds(log, &channels, collected, notes);
}

/// The filter's quaternion where it says what the angles say, else the angles.
fn attitude(log: &Log, collected: &mut Collected, notes: &mut Vec<String>) {
    let name = "attitude.q_ned_from_body_wxyz";
    let angles = |row: &[f64]| q_of_angles([row[0] * DEG, row[1] * DEG, row[2] * DEG]);
    let by_angles = log.with("ATT", 0, |topic| {
        let rows = topic.columns(&["Roll", "Pitch", "Yaw"])?;
        let q = |i: usize| angles(&[rows[0][i], rows[1][i], rows[2][i]]);
        let times = topic.time_us().iter().copied();
        Some(times.enumerate().map(|(i, t)| (t, q(i))).collect::<Vec<_>>())
    });
    let by_angles = by_angles.flatten().unwrap_or_default();
    let taken = log.with("XKQ", 0, |topic| {
        let q = ["Q1", "Q2", "Q3", "Q4"];
        let apart_rad = topic.columns(&q).map(|q| median_apart(topic.time_us(), &q, &by_angles));
        match apart_rad {
            Some(apart) if topic.time_us().len() >= by_angles.len() => {
                let agrees = by_angles.is_empty() || apart <= ATTITUDES_APART_MAX_RAD;
                if !agrees {
                    notes.push(format!(
                        "XKQ: left out, {:.1} deg from the angles of ATT",
                        apart / DEG
                    ));
                }
                agrees && collected.add(name, topic, &q, "w x y z, NED from FRD", same)
            }
            _ => false,
        }
    });
    if taken != Some(true) {
        log.with("ATT", 0, |topic| {
            let columns = ["Roll", "Pitch", "Yaw"];
            let origin = "deg, of FRD in NED, by yaw, pitch, roll";
            collected.add(name, topic, &columns, origin, |row, sample| sample.extend(angles(row)))
        });
    }
}

/// Median angle between quaternions and those of other messages, nearest in time, rad.
fn median_apart(time_us: &[f64], q: &[Cow<[f64]>], others: &[(f64, [f64; 4])]) -> f64 {
    let apart = |(i, t): (usize, &f64)| {
        let (_, other) = others.get(nearest(others.len(), *t, |k| others[k].0)?)?;
        let along: f64 = (0..4).map(|k| q[k][i] * other[k]).sum();
        Some(2.0 * along.abs().min(1.0).acos())
    };
    let mut all: Vec<f64> = time_us.iter().enumerate().filter_map(apart).collect();
    all.sort_unstable_by(f64::total_cmp);
    all.get(all.len() / 2).copied().unwrap_or(0.0)
}

/// Which of `count` times in order is nearest to `t`.
fn nearest(count: usize, t: f64, time: impl Fn(usize) -> f64) -> Option<usize> {
    let (mut low, mut high) = (0, count);
    while low < high {
        let middle = low.midpoint(high);
        if time(middle) < t { low = middle + 1 } else { high = middle }
    }
    let candidates = [low.checked_sub(1), Some(low).filter(|&i| i < count)];
    let away = |i: &usize| (time(*i) - t).abs();
    candidates.into_iter().flatten().min_by(|a, b| away(a).total_cmp(&away(b)))
}

/// The output, from 1, of each motor.
fn motors(log: &Log, notes: &mut Vec<String>) -> Vec<usize> {
    let channel = |motor: usize| {
        let function =
            if motor < 8 { FUNCTION_MOTOR_1 + motor } else { FUNCTION_MOTOR_9 + motor - 8 };
        let is = |n: &usize| {
            log.parameters.get(&format!("SERVO{n}_FUNCTION")) == Some(&(function as f64))
        };
        (1..=OUTPUTS_MAX).find(is)
    };
    let told: Vec<usize> = (0..MOTORS_MAX).map_while(channel).collect();
    if !told.is_empty() {
        let list: Vec<String> = told.iter().map(|n| format!("C{n}")).collect();
        notes.push(format!(
            "rotor.command: motors 1 to {} are RCOU {} by SERVOn_FUNCTION",
            told.len(),
            list.join(", ")
        ));
        return told;
    }
    if log.count("RCOU") > 0 {
        notes.push(
            "rotor.command: RCOU C1 to C4, for the log has no SERVOn_FUNCTION that says which outputs are motors".to_owned(),
        );
    }
    (1..=4).collect()
}

fn commands(log: &Log, channels: &[usize], collected: &mut Collected, notes: &mut Vec<String>) {
    let set = |name: &str| log.parameters.get(name).copied().filter(|&us| us > 0.0);
    let limits =
        (set("MOT_PWM_MIN").or(set("Q_M_PWM_MIN")), set("MOT_PWM_MAX").or(set("Q_M_PWM_MAX")));
    let (low, high, origin) = match limits {
        (Some(low), Some(high)) if low < high => {
            (low, high, "pulses, us; from MOT_PWM_MIN = 0 to MOT_PWM_MAX = 1")
        }
        _ => (1000.0, 2000.0, "pulses, us; from 1000 = 0 to 2000 = 1"),
    };
    let names: Vec<String> = channels.iter().map(|n| format!("C{n}")).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    // Outputs above 14 are in a message of their own.
    let message = if channels.iter().all(|&n| n > 14) { "RCO2" } else { "RCOU" };
    let fraction = |row: &[f64], sample: &mut Vec<f64>| {
        sample.extend(row.iter().map(|us| ((us - low) / (high - low)).clamp(0.0, 1.0)));
    };
    let added = log
        .with(message, 0, |topic| collected.add("rotor.command", topic, &names, origin, fraction));
    if added == Some(false) {
        notes.push(format!(
            "rotor.command: left out, {message} has not all of {}",
            names.join(", ")
        ));
    }
}

/// Speeds of the motors, each of which writes its own messages: at the times of the first, of the
/// others the samples nearest to these.
fn speeds(log: &Log, channels: &[usize], collected: &mut Collected, notes: &mut Vec<String>) {
    let all: Vec<(String, Rc<[f64]>, Vec<f64>)> = channels
        .iter()
        .filter_map(|&n| {
            // One message name with instances counted from 0; before 4.0 one name an ESC.
            let (name, instance) = match log.messages.message("ESC") {
                Some(message) if message.has_instances() => ("ESC".to_owned(), n - 1),
                _ => (format!("ESC{n}"), 0),
            };
            log.with(&name, u8::try_from(instance).ok()?, |topic| {
                let rpm = topic.columns(&["RPM"])?.swap_remove(0).into_owned();
                let label = if name == "ESC" {
                    format!("ESC[{instance}].RPM")
                } else {
                    format!("{name}.RPM")
                };
                Some((label, Rc::clone(topic.time_us()), rpm))
            })?
        })
        .collect();
    if all.len() != channels.len() || all.is_empty() {
        if !all.is_empty() {
            let have: Vec<&str> = all.iter().map(|(label, ..)| label.as_str()).collect();
            let problem = format!("{} motors, but only {}", channels.len(), have.join(", "));
            notes.push(format!("rotor.speed_rad_s: left out, {problem}"));
        }
        return;
    }
    let axis = Rc::clone(&all[0].1);
    let (mut values, mut apart_us) = (Vec::new(), 0.0_f64);
    for &t in &*axis {
        for (_, time_us, rpm) in &all {
            let sample = nearest(time_us.len(), t, |i| time_us[i]).map(|i| (time_us[i], rpm[i]));
            let (at, rpm) = sample.unwrap_or((t, f64::NAN));
            apart_us = apart_us.max((at - t).abs());
            values.push(rpm * RPM_RAD_S);
        }
    }
    let labels: Vec<String> = all.iter().map(|(label, ..)| label.clone()).collect();
    let times = format!(
        "rotor.speed_rad_s: at the times of {}, the other ESCs up to {:.1} ms away",
        labels[0],
        apart_us / 1e3
    );
    if collected.add_values("rotor.speed_rad_s", labels, "rpm", axis, values) {
        notes.push(times);
    }
}

//! What the frames of a blackbox log mean: Betaflight, INAV, Indiflight and the like.
//!
//! Gyroscope and accelerometer are in FLU: x forward, y left, z up. Betaflight's source shows it:
//! right stick asks for positive roll, stick forward for positive pitch (nose down), right yaw for
//! negative yaw, and at rest the accelerometer's z is +1 g. Its attitude is in a world of north,
//! west, up.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use super::super::blackbox_file::{BlackboxLog, Frames};
use super::super::frames::{AttitudeFrame, Body, Direction, Order, World};
use super::collect::{Collected, Topic};
use super::px4::dropped;

const DEG: f64 = TAU / 360.0;
const STANDARD_GRAVITY_M_S2: f64 = 9.806_65;
/// `imuQuaternion` is x, y, z of a quaternion with w >= 0, times this.
const QUATERNION_SCALE: f64 = 32767.0;
const MOTORS_MAX: usize = 8;
/// Every column that something is made of.
const VECTORS: [&str; 6] = ["gyroADC", "accSmooth", "imuQuaternion", "setpoint", "motor", "eRPM"];
const NUMBERS: [&str; 5] = ["vbatLatest", "vbat", "amperageLatest", "amperage", "baroAlt"];

/// Decodes the columns that something is made of.
pub(super) fn read(log: &BlackboxLog) -> Frames {
    let wanted = log.columns().iter().map(String::as_str).filter(|name| {
        let base = name.split('[').next().unwrap_or(name);
        VECTORS.contains(&base) || NUMBERS.contains(&base)
    });
    log.read(&wanted.collect::<Vec<_>>())
}

/// Adds what the log has; `notes` gets what was chosen.
pub(super) fn collect(
    log: &BlackboxLog,
    frames: &Frames,
    collected: &mut Collected,
    notes: &mut Vec<String>,
) {
    let Some(topic) = Topic::new("frame", frames, &[("time", 1.0)]) else { return };
    if topic.dropped > 0 {
        notes.push(dropped(&topic));
    }
    let parameters = log.parameters();
    let number = |name: &str| parameters.get(name).copied();
    if log.count > 1 {
        notes.push(format!("log {} of {} in the file, the longest", log.number, log.count));
    }
    // Of high-resolution logs the gyroscope and the setpoint are ten times as fine.
    let fine = if number("blackbox_high_resolution") == Some(1.0) { 10.0 } else { 1.0 };
    let gyro_rad_s = number("gyro_scale").or(number("gyro.scale")).unwrap_or(1.0) * DEG / fine;
    let omega = triple("gyroADC");
    let origin = "deg/s, FLU";
    collected.add("imu.omega_body_rad_s", &topic, &strs(&omega), origin, flu(gyro_rad_s));
    match number("acc_1G").filter(|&g| g > 0.0) {
        Some(g) => {
            let (name, force) = ("imu.specific_force_body_m_s2", triple("accSmooth"));
            let scale = STANDARD_GRAVITY_M_S2 / g;
            collected.add(name, &topic, &strs(&force), "of acc_1G, FLU", flu(scale));
        }
        None => notes
            .push("imu.specific_force_body_m_s2: left out, the header has no acc_1G".to_owned()),
    }
    let (name, vector) = ("attitude.q_ned_from_body_wxyz", triple("imuQuaternion"));
    let origin = "x y z / 32767, w >= 0, NWU from FLU";
    collected.add(name, &topic, &strs(&vector), origin, attitude);
    let asked = triple("setpoint");
    let (name, scale) = ("reference.omega_body_rad_s", DEG / fine);
    collected.add(name, &topic, &strs(&asked), "deg/s, FLU", flu(scale));
    battery(log, &topic, collected, notes);
    let up = |row: &[f64], sample: &mut Vec<f64>| sample.push(row[0] / 100.0);
    collected.add("baro.altitude_m", &topic, &["baroAlt"], "cm, up", up);
    motors(&parameters, &topic, collected, notes);
}

fn motors(
    parameters: &BTreeMap<String, f64>,
    topic: &Topic,
    collected: &mut Collected,
    notes: &mut Vec<String>,
) {
    let number = |name: &str| parameters.get(name).copied();
    let names = indexed(topic, "motor");
    let range = number("motorOutput[0]")
        .zip(number("motorOutput[1]"))
        .map(|range| (range, "as sent; from motorOutput: low = 0, high = 1"))
        .or_else(|| {
            let range = number("minthrottle").zip(number("maxthrottle"))?;
            Some((range, "pulses, us; from minthrottle = 0 to maxthrottle = 1"))
        });
    match range.filter(|((low, high), _)| low < high) {
        Some(((low, high), origin)) if !names.is_empty() => {
            let fraction = |row: &[f64], sample: &mut Vec<f64>| {
                sample.extend(row.iter().map(|x| ((x - low) / (high - low)).clamp(0.0, 1.0)));
            };
            collected.add("rotor.command", topic, &strs(&names), origin, fraction);
        }
        Some(_) => {}
        None => notes.push(
            "rotor.command: left out, the header has neither motorOutput nor minthrottle and maxthrottle that make a range"
                .to_owned(),
        ),
    }
    let erpm = indexed(topic, "eRPM");
    if erpm.is_empty() {
        return;
    }
    match number("motor_poles").filter(|&poles| poles >= 2.0) {
        Some(poles) => {
            let rad_s = 100.0 / (poles / 2.0) * TAU / 60.0;
            let speed = |row: &[f64], sample: &mut Vec<f64>| {
                sample.extend(row.iter().map(|x| x * rad_s));
            };
            let origin = "electrical rpm / 100, by motor_poles";
            collected.add("rotor.speed_rad_s", topic, &strs(&erpm), origin, speed);
        }
        None => notes
            .push("rotor.speed_rad_s: left out, the header has eRPM and no motor_poles".to_owned()),
    }
}

/// Voltage and current, in hundredths since Betaflight 4.0 and INAV 2.0.
fn battery(log: &BlackboxLog, topic: &Topic, collected: &mut Collected, notes: &mut Vec<String>) {
    let mut words = log.header.get("Firmware revision").map_or("", |text| text).split(' ');
    let (name, version) = (words.next().unwrap_or_default(), words.next().unwrap_or_default());
    let major: Option<u32> = version.split('.').next().and_then(|major| major.parse().ok());
    let old = match name.to_ascii_lowercase().as_str() {
        "betaflight" => major.is_some_and(|major| major < 4),
        "inav" => major.is_some_and(|major| major < 2),
        _ => false,
    };
    if old {
        notes.push(format!("battery: left out, {name} {version} writes other units"));
        return;
    }
    let hundredths = |row: &[f64], sample: &mut Vec<f64>| sample.push(row[0] / 100.0);
    // A battery that is not there is at 0 V.
    let known = |row: &[f64], sample: &mut Vec<f64>| {
        sample.push(if row[0] > 0.0 { row[0] / 100.0 } else { f64::NAN });
    };
    let origin = "V / 100";
    let _ = collected.add("battery.voltage_v", topic, &["vbatLatest"], origin, known)
        || collected.add("battery.voltage_v", topic, &["vbat"], origin, known);
    let origin = "A / 100";
    let _ = collected.add("battery.current_a", topic, &["amperageLatest"], origin, hundredths)
        || collected.add("battery.current_a", topic, &["amperage"], origin, hundredths);
}

fn triple(name: &str) -> Vec<String> {
    (0..3).map(|i| format!("{name}[{i}]")).collect()
}

/// As many columns `name[i]` as the frames have.
fn indexed(topic: &Topic, name: &str) -> Vec<String> {
    let names = (0..MOTORS_MAX).map(|i| format!("{name}[{i}]"));
    names.take_while(|name| topic.columns(&[name]).is_some()).collect()
}

fn strs(names: &[String]) -> Vec<&str> {
    names.iter().map(String::as_str).collect()
}

/// Appends a vector of FLU, times a factor, in FRD.
fn flu(scale: f64) -> impl Fn(&[f64], &mut Vec<f64>) {
    move |row, sample| sample.extend(Body::Flu.to_frd([row[0], row[1], row[2]].map(|x| x * scale)))
}

fn attitude(row: &[f64], sample: &mut Vec<f64>) {
    let [x, y, z] = [row[0], row[1], row[2]].map(|x| x / QUATERNION_SCALE);
    let w = (1.0 - x * x - y * y - z * z).max(0.0).sqrt();
    let frame = AttitudeFrame {
        order: Order::Wxyz,
        direction: Direction::WorldFromBody,
        world: World::Nwu,
        body: Body::Flu,
    };
    let q = frame.q_ned_from_body([w, x, y, z]);
    sample.extend([q.w, q.i, q.j, q.k]);
}

//! Import maps with one mistake: it is named with the channel and with what to change.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use crate::support::{hold, imported, nanobench, step, vehicle, vehicles};
use squirrel_gap::contradictions;
use squirrel_log::FlightLog;
use squirrel_log::import::{ImportMap, import};
use std::path::Path;

const OMEGA: &str = "imu.omega_body_rad_s";
const FORCE: &str = "imu.specific_force_body_m_s2";
const ATTITUDE: &str = "attitude.q_ned_from_body_wxyz";
const VELOCITY: &str = "gnss.velocity_ned_m_s";
const VOLTAGE: &str = "battery.voltage_v";
const COMMAND: &str = "rotor.command";

/// A mistake: what it is, what the map has, what stands there instead, the channels that may be
/// named, and a word of the remedy.
type Mistake = (&'static str, &'static str, &'static str, &'static [&'static str], &'static str);

const MISTAKES: [Mistake; 17] = [
    (
        "gyro axes swapped",
        "\"imu_gyro_x\", \"imu_gyro_y\"",
        "\"imu_gyro_y\", \"imu_gyro_x\"",
        &[OMEGA],
        "columns",
    ),
    (
        "accelerometer axes swapped",
        "\"imu_acc_y\", \"imu_acc_z\"",
        "\"imu_acc_z\", \"imu_acc_y\"",
        &[FORCE],
        "columns",
    ),
    (
        "velocity axes swapped",
        "[\"vx\", \"vy\", \"vz\"]",
        "[\"vy\", \"vx\", \"vz\"]",
        &[VELOCITY],
        "columns",
    ),
    (
        "specific force in g",
        "body = \"flu\", scale = 9.80665",
        "body = \"flu\"",
        &[FORCE],
        "scale = 9.80665",
    ),
    (
        "rates in deg/s",
        "body = \"flu\" }\n\"imu.spec",
        "body = \"flu\", scale = 57.29578 }\n\"imu.spec",
        &[OMEGA],
        "scale = 0.0174",
    ),
    (
        "voltage in mV",
        "[\"pwr_pm_vbat\"]",
        "[\"pwr_pm_vbat\"], scale = 1000.0",
        &[VOLTAGE],
        "scale = 0.001",
    ),
    ("quaternion order", "order = \"xyzw\"", "order = \"wxyz\"", &[ATTITUDE], "order"),
    ("quaternion direction", "world_from_body", "body_from_world", &[ATTITUDE], "direction"),
    (
        "attitude world",
        "order = \"xyzw\", world = \"nwu\"",
        "order = \"xyzw\", world = \"ned\"",
        &[ATTITUDE],
        "world",
    ),
    (
        "attitude body",
        "world = \"nwu\", body = \"flu\"",
        "world = \"nwu\", body = \"frd\"",
        &[ATTITUDE],
        "body",
    ),
    (
        "attitude enu",
        "order = \"xyzw\", world = \"nwu\"",
        "order = \"xyzw\", world = \"enu\"",
        &[ATTITUDE, VELOCITY],
        "world",
    ),
    (
        "velocity world",
        "\"vz\"], world = \"nwu\"",
        "\"vz\"], world = \"ned\"",
        &[VELOCITY],
        "world",
    ),
    (
        "gyro body",
        "\"imu_gyro_z\"], body = \"flu\"",
        "\"imu_gyro_z\"], body = \"frd\"",
        &[OMEGA],
        "body",
    ),
    (
        "accelerometer body",
        "\"imu_acc_z\"], body = \"flu\"",
        "\"imu_acc_z\"], body = \"frd\"",
        &[FORCE],
        "body",
    ),
    ("command unscaled", "4], scale = 1.5259021896696422e-5", "4]", &[COMMAND], "scale = 1.52"),
    ("motors 1 and 2 swapped", "[1, 2, 3, 4]", "[2, 1, 3, 4]", &[COMMAND], "rotors = [2, 1, 3, 4]"),
    ("motors 2 and 4 swapped", "[1, 2, 3, 4]", "[1, 4, 3, 2]", &[COMMAND], "rotors = [1, 4, 3, 2]"),
];

/// A mistake that no line of the map makes: what it is, channels that may be named, a word of the
/// remedy, and how it is made.
type Spoil = (&'static str, &'static [&'static str], &'static str, fn(&mut FlightLog));

const SPOILS: [Spoil; 12] = [
    ("world acceleration", &[FORCE], "world", |log| to_world(log, [0.0, 0.0, 0.0])),
    ("world acceleration less gravity", &[FORCE], "gravity", |log| {
        to_world(log, [0.0, 0.0, 9.80665]);
    }),
    ("fixes step 0.3 s", &[VELOCITY], "clock steps by +0.", |log| step(log, "gnss", 0.3)),
    ("fixes step 0.8 s", &[VELOCITY], "clock steps by +0.", |log| step(log, "gnss", 0.8)),
    ("attitude steps 0.2 s", &[ATTITUDE], "clock steps by +0.", |log| step(log, "attitude", 0.2)),
    ("attitude steps 0.5 s", &[ATTITUDE], "clock steps by +0.", |log| step(log, "attitude", 0.5)),
    ("commands step 0.2 s", &[COMMAND], "clock steps by +0.", |log| step(log, "rotor", 0.2)),
    ("unit steps 0.3 s", &[OMEGA, FORCE], "clock steps by", |log| step(log, "imu", 0.3)),
    ("gyro and accelerometer held", &[FORCE], "repeats", |log| hold(log, "imu", 5)),
    ("attitude held", &[ATTITUDE], "repeats", |log| hold(log, "attitude", 5)),
    ("fixes held", &[VELOCITY], "repeats", |log| hold(log, "gnss", 10)),
    ("commands held", &[COMMAND], "repeats", |log| hold(log, "rotor", 10)),
];

/// Gives specific force in the world frame, NED, plus something.
fn to_world(log: &mut FlightLog, plus: [f64; 3]) {
    let attitude = log.sources["attitude"].channels["q_ned_from_body_wxyz"].values.clone();
    let force = &mut log
        .sources
        .get_mut("imu")
        .unwrap()
        .channels
        .get_mut("specific_force_body_m_s2")
        .unwrap()
        .values;
    for (f, q) in force.chunks_exact_mut(3).zip(attitude.chunks_exact(4)) {
        let (w, v) = (q[0], [q[1], q[2], q[3]]);
        let cross = |a: [f64; 3], b: [f64; 3]| {
            [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
        };
        let once = cross(v, [f[0], f[1], f[2]]);
        let twice = cross(v, once);
        for i in 0..3 {
            f[i] += 2.0 * (w * once[i] + twice[i]) + plus[i];
        }
    }
}

fn map_with(from: &str, to: &str) -> ImportMap {
    let text = std::fs::read_to_string(vehicles("maps/nanobench.toml")).unwrap();
    assert!(text.contains(from), "{from}");
    ImportMap::parse(&text.replace(from, to), "spoilt").unwrap()
}

fn read(map: &ImportMap, file: &Path) -> FlightLog {
    import(map, &[file.to_owned()]).unwrap().0
}

/// How many of the flights name a mistake with a channel and a remedy; prints the others.
fn named(
    what: &str,
    channels: &[&str],
    remedy: &str,
    flights: impl Iterator<Item = (String, FlightLog)>,
) -> (usize, usize) {
    let vehicle = vehicle("crazyflie21_brushed.toml");
    let (mut right, mut count) = (0, 0);
    for (name, log) in flights {
        let found = contradictions(&vehicle, &[(name.clone(), log)]).unwrap();
        let first = found.first();
        if first.is_some_and(|a| channels.contains(&a.channel) && a.words.contains(remedy)) {
            right += 1;
        } else {
            println!("  {what}: {name}: {:?}", first.map(|a| &a.words));
        }
        count += 1;
    }
    println!("{what}: {right} of {count}");
    (right, count)
}

fn name_of(file: &Path) -> String {
    file.file_stem().unwrap().to_string_lossy().into_owned()
}

/// One flight of twenty hovers almost still, and some move along one axis alone: what nothing shows
/// is not named.
#[test]
fn a_spoilt_map_is_named_in_measured_flights() {
    let mut missed = Vec::new();
    for (what, from, to, channels, remedy) in MISTAKES {
        let map = map_with(from, to);
        let flights = nanobench().into_iter().map(|file| (name_of(&file), read(&map, &file)));
        let (right, count) = named(what, channels, remedy, flights);
        if 20 * right < 17 * count {
            missed.push(format!("{what}: {right} of {count}"));
        }
    }
    assert!(missed.is_empty(), "{missed:#?}");
}

#[test]
fn a_spoilt_source_is_named_in_measured_flights() {
    let mut missed = Vec::new();
    for (what, channels, remedy, spoil) in SPOILS {
        let flights = nanobench().into_iter().map(|file| {
            let mut log = imported("nanobench.toml", &file);
            spoil(&mut log);
            (name_of(&file), log)
        });
        let (right, count) = named(what, channels, remedy, flights);
        if 20 * right < 16 * count {
            missed.push(format!("{what}: {right} of {count}"));
        }
    }
    assert!(missed.is_empty(), "{missed:#?}");
}

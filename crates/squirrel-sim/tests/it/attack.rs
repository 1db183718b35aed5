//! What comes from outside under mutation: vehicle files, scenarios, weights, plans. None of them
//! ends the program, and what is taken flies or is refused in one line.
//!
//! `cargo xtask attack COUNT SEED` runs more of it.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use squirrel_core::nalgebra::Vector3;
use squirrel_core::policy::Policy;
use squirrel_log::FlightLog;
use squirrel_sim::arm::Arm;
use squirrel_sim::flight::{Integrator, Setup};
use squirrel_sim::scenario::{BUILT_IN, Scenario};
use squirrel_sim::track::{Track, TrackPoint};
use squirrel_sim::vehicle_file::VehicleFile;
use squirrel_sim::weights::{ParnnWeights, PolicyWeights};
use std::path::{Path, PathBuf};

/// Files a kind in a test, for seconds; the chore takes more.
const COUNT_IN_TESTS: u64 = 300;
/// Long enough for every law to have had its turn, s.
const FLIGHT_S: f64 = 0.12;

/// Numbers at the ends of what there is, and what is none.
pub(super) const ENDS: [&str; 16] = [
    "0",
    "-0.0",
    "-1",
    "1e-320",
    "1e-12",
    "1e5",
    "1e12",
    "1e38",
    "1e155",
    "1e308",
    "-1e308",
    "nan",
    "inf",
    "-inf",
    "9223372036854775807",
    "true",
];

const SQUIRREL: &str = include_str!("../../../../vehicles/squirrel_air.toml");
const PARNN: &[u8] = include_bytes!("../../../../vehicles/squirrel-parnn.safetensors");

pub(super) fn count_and_rng() -> (u64, Pcg64Mcg) {
    let number = |name: &str, default: u64| {
        std::env::var(name).map_or(default, |text| text.parse().unwrap())
    };
    let count = number("SQUIRREL_ATTACK_COUNT", COUNT_IN_TESTS);
    (count, Pcg64Mcg::seed_from_u64(number("SQUIRREL_ATTACK_SEED", 1)))
}

/// Where numbers stand in a text: behind `= `, `[` or `, `.
fn numbers(text: &str) -> Vec<std::ops::Range<usize>> {
    let (bytes, mut all, mut at) = (text.as_bytes(), Vec::new(), 1);
    while at < bytes.len() {
        let begins = bytes[at].is_ascii_digit() || bytes[at] == b'-';
        if begins && matches!(bytes[at - 1], b' ' | b'[') {
            let length = bytes[at..].iter().position(|b| !b"0123456789.e-+_".contains(b));
            let end = length.map_or(bytes.len(), |length| at + length);
            all.push(at..end);
            at = end;
        }
        at += 1;
    }
    all
}

/// A text with a few of its numbers, bytes or lines changed.
pub(super) fn mutated(good: &str, rng: &mut Pcg64Mcg) -> String {
    let mut text = good.to_owned();
    for _ in 0..rng.random_range(1..4) {
        let places = numbers(&text);
        match rng.random_range(0..8) {
            0..=4 if !places.is_empty() => {
                let place = places[rng.random_range(0..places.len())].clone();
                text.replace_range(place, ENDS[rng.random_range(0..ENDS.len())]);
            }
            5 => {
                let mut lines: Vec<&str> = text.lines().collect();
                let (from, to) =
                    (rng.random_range(0..lines.len()), rng.random_range(0..lines.len()));
                lines[to] = lines[from];
                text = lines.join("\n") + "\n";
            }
            6 => {
                let mut lines: Vec<&str> = text.lines().collect();
                lines.remove(rng.random_range(0..lines.len()));
                text = lines.join("\n") + "\n";
            }
            _ => {
                let at = rng.random_range(0..text.len());
                if text.is_char_boundary(at) {
                    text.insert(at, char::from(rng.random_range(0..127_u8)));
                }
            }
        }
        if text.lines().next().is_none() {
            break;
        }
    }
    text
}

/// An error is one line that is no screenful.
pub(super) fn is_a_line(error: &str) {
    assert!(!error.is_empty() && !error.contains('\n'), "{error}");
}

fn flies(vehicle: VehicleFile, scenario: Scenario, arm: Arm) -> Result<(), String> {
    let setup = Setup { vehicle, arm, scenario, integrator: Integrator::Rk4 };
    setup.fly(true, |_| {}).map(drop).map_err(|e| e.to_string())
}

#[test]
fn no_mutated_vehicle_ends_the_program() {
    let (count, mut rng) = count_and_rng();
    let (mut taken, mut flown) = (0, 0);
    let hover = Scenario { duration_s: FLIGHT_S, ..Scenario::find("hover").unwrap() };
    for _ in 0..count {
        let text = mutated(SQUIRREL, &mut rng);
        let vehicle = match VehicleFile::parse(&text, "v.toml") {
            Ok(vehicle) => vehicle,
            Err(error) => {
                is_a_line(&error.to_string());
                continue;
            }
        };
        taken += 1;
        if let Err(error) = vehicle.means() {
            is_a_line(&error);
        }
        let _ = vehicle.margins();
        for arm in [Arm::Pc, Arm::TwccPlus] {
            match flies(vehicle.clone(), hover.clone(), arm) {
                Ok(()) => flown += 1,
                Err(error) => is_a_line(&error),
            }
        }
    }
    assert!(taken > count / 20 && flown > 0, "{taken} of {count} taken, {flown} flown");
}

#[test]
fn no_mutated_scenario_ends_the_program() {
    let (count, mut rng) = count_and_rng();
    let mut flown = 0;
    for k in 0..count {
        let good = Scenario::find(BUILT_IN[k as usize % BUILT_IN.len()]).unwrap().to_toml();
        match Scenario::parse(&mutated(&good, &mut rng), "s.toml") {
            Ok(scenario) => {
                let short = Scenario { duration_s: FLIGHT_S, ..scenario };
                match flies(VehicleFile::squirrel(), short, Arm::TwccFlat) {
                    Ok(()) => flown += 1,
                    Err(error) => is_a_line(&error),
                }
            }
            Err(error) => is_a_line(&error),
        }
    }
    assert!(flown > 0);
}

pub(super) fn bytes(good: &[u8], rng: &mut Pcg64Mcg) -> Vec<u8> {
    let mut bytes = good.to_vec();
    for _ in 0..rng.random_range(1..4) {
        // The header is short and matters most.
        let end = if rng.random_range(0..2) == 0 { bytes.len().min(900) } else { bytes.len() };
        let at = rng.random_range(0..end);
        match rng.random_range(0..5) {
            0 => bytes[at] ^= 1 << rng.random_range(0..8),
            1 => bytes[at] = rng.random_range(0..=255),
            2 => bytes.truncate(at + 1),
            3 => bytes.insert(at, rng.random_range(b'0'..=b'9')),
            _ => bytes[at..(at + 8).min(end)].fill(0xFF),
        }
    }
    bytes
}

#[test]
fn no_mutated_weights_end_the_program() {
    let (count, mut rng) = count_and_rng();
    let path = folder().join("w.safetensors");
    PolicyWeights::save(&Policy::filled(0.25), &path).unwrap();
    let policy = std::fs::read(&path).unwrap();
    let mut taken = [0; 2];
    for k in 0..count {
        let is_policy = k % 2 == 1;
        let bytes = bytes(if is_policy { &policy } else { PARNN }, &mut rng);
        for (of_policy, read) in [
            (false, ParnnWeights::parse("w", bytes.clone()).map(drop)),
            (true, {
                std::fs::write(&path, &bytes).unwrap();
                PolicyWeights::load(&path).map(drop)
            }),
        ] {
            match read {
                Ok(()) => {
                    assert_eq!(of_policy, is_policy);
                    taken[usize::from(is_policy)] += 1;
                }
                Err(error) => is_a_line(&error.to_string()),
            }
        }
    }
    assert!(taken.iter().all(|taken| *taken > 0), "{taken:?} of {count} taken");
}

#[test]
fn no_mutated_plan_ends_the_program() {
    let (count, mut rng) = count_and_rng();
    let point = |k: u32| TrackPoint {
        position: Vector3::new(f64::from(k), 0.0, -30.0),
        velocity: Vector3::new(1.0, 0.0, 0.0),
        acceleration: Vector3::zeros(),
        thrust: Vector3::new(0.0, 0.0, -8.0),
        wing: 0.0,
    };
    let mut good = FlightLog::default();
    Track::even(0.1, (0..40).map(point).collect()).record(&mut good);
    let path = folder().join("plan.mcap");
    good.write(&path).unwrap();
    let good_bytes = std::fs::read(&path).unwrap();
    let mut taken = 0;
    for k in 0..count {
        let log = if k % 2 == 0 {
            std::fs::write(&path, bytes(&good_bytes, &mut rng)).unwrap();
            FlightLog::recover(&path).map(|(log, _)| log)
        } else {
            // What a checksum lets through, because it was written so.
            let mut log = good.clone();
            let source = log.sources.get_mut("plan").unwrap();
            let place = rng.random_range(0..source.time_s.len());
            let number: f64 = ENDS[rng.random_range(0..ENDS.len() - 1)].parse().unwrap();
            if rng.random_range(0..3) == 0 {
                source.time_s[place] = number;
            } else {
                let channels = source.channels.len();
                let channel = source.channels.values_mut().nth(rng.random_range(0..channels));
                let values = &mut channel.unwrap().values;
                let place = rng.random_range(0..values.len());
                values[place] = number;
            }
            Ok(log)
        };
        match log {
            Ok(log) => match Track::of(&log, 1.0) {
                Ok(track) => {
                    taken += 1;
                    assert!(track.at(0.5 * track.end_s()).is_some());
                }
                Err(error) => is_a_line(&error.to_string()),
            },
            Err(error) => is_a_line(&error.to_string()),
        }
    }
    assert!(taken > 0);
}

pub(super) fn folder() -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("attack");
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

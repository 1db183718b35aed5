//! Flights under motion capture: no accelerometer, no gyroscope, position and attitude at 100 Hz.
//! What is named is what the same flights with their IMU name.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use crate::support::{vehicle, vehicle_with};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use squirrel_gap::{Kind, Value, Verdict, diagnose, find};
use squirrel_log::FlightLog;
use squirrel_sim::arm::Arm;
use squirrel_sim::estimator::Estimator;
use squirrel_sim::flight::{Integrator, Setup};
use squirrel_sim::scenario::{MissionTable, Scenario};
use squirrel_sim::vehicle_file::VehicleFile;

type Flights = Vec<(String, FlightLog)>;

/// Noise of the cameras: position, m, attitude, rad, and their rate, Hz.
const POSITION_NOISE_M: f64 = 5e-4;
const ATTITUDE_NOISE_RAD: f64 = 2e-3;
const RATE_HZ: f64 = 100.0;

fn fly(individual: &VehicleFile, seed: u64) -> FlightLog {
    fly_as("excite_rich", individual, seed)
}

fn fly_as(scenario: &str, individual: &VehicleFile, seed: u64) -> FlightLog {
    let mut scenario = Scenario::find(scenario).unwrap();
    scenario.seed = seed;
    if let MissionTable::Excite(table) = &mut scenario.mission {
        table.heights_m = vec![1.5, 1.0, 0.7];
    }
    let vehicle = VehicleFile { estimator: Estimator::External, ..individual.clone() };
    let setup = Setup { vehicle, arm: Arm::Pc, scenario, integrator: Integrator::Rk4 };
    setup.fly(true, |_| {}).unwrap().log.unwrap()
}

/// What cameras and a radio give of a flight: no IMU, no GNSS, no barometer.
fn captured(log: &FlightLog, seed: u64) -> FlightLog {
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    let mut out = log.clone();
    for source in ["imu", "gnss", "baro", "attitude"] {
        out.sources.remove(source);
    }
    let (time_s, position) = log.channel("truth.position_ned_m").unwrap();
    let (_, attitude) = log.channel("truth.q_ned_from_body_wxyz").unwrap();
    let mut next_s = time_s[0];
    for (i, t) in time_s.iter().enumerate() {
        if *t < next_s - 1e-6 {
            continue;
        }
        next_s = t + 1.0 / RATE_HZ;
        let mut draw = |sd: f64| -> f64 {
            let x: f64 = StandardNormal.sample(&mut rng);
            sd * x
        };
        let p: Vec<f64> = position.row(i).iter().map(|p| p + draw(POSITION_NOISE_M)).collect();
        out.source_mut("gnss").push(*t, &[("position_ned_m", &p)]);
        let [w, x, y, z] = *attitude.row(i) else { panic!("four numbers") };
        let [a, b, c] = [(); 3].map(|()| draw(0.5 * ATTITUDE_NOISE_RAD));
        let q = [
            w - x * a - y * b - z * c,
            x + w * a + y * c - z * b,
            y + w * b + z * a - x * c,
            z + w * c + x * b - y * a,
        ];
        let norm = q.iter().map(|x| x * x).sum::<f64>().sqrt();
        out.source_mut("attitude").push(*t, &[("q_ned_from_body_wxyz", &q.map(|x| x / norm))]);
    }
    out
}

/// Three flights of an individual, with their IMU and without.
fn flights(individual: &VehicleFile) -> [Flights; 2] {
    let own: Flights =
        (1..=3).map(|seed| (format!("flight {seed}"), fly(individual, seed))).collect();
    let seen = own
        .iter()
        .zip(11..)
        .map(|((name, log), seed)| (name.clone(), captured(log, seed)))
        .collect();
    [own, seen]
}

fn verdict(vehicle: &VehicleFile, flights: &Flights) -> Verdict {
    let verdict = diagnose(vehicle, &flights[..2], &flights[2..], &|_| {}).unwrap().verdict;
    println!(
        "{:?}: {}\n{:?}\n{:#?}\n{:?}",
        verdict.verdict, verdict.words, verdict.effects, verdict.notes, verdict.gap
    );
    verdict
}

fn size(verdict: &Verdict, effect: &str, key: &str) -> [f64; 3] {
    let found = verdict
        .effects
        .iter()
        .find(|e| e.name == effect)
        .unwrap_or_else(|| panic!("{effect}: not named"));
    let Value::Number { value, low, high } = found.parameters[key] else {
        panic!("{key}: no number")
    };
    [value, low, high]
}

/// The corner of the filter, Hz, and the noise of forces, m/s^2, as a note says them.
fn said(notes: &[String]) -> [f64; 2] {
    let note = notes.iter().find(|n| n.contains("imu.specific_force_body_m_s2: missing")).unwrap();
    let after = |word: &str| {
        let number = note.split(word).nth(1).unwrap().trim_start().split(' ').next().unwrap();
        number.parse().unwrap_or_else(|_| panic!("{number} in {note}"))
    };
    [after("below"), after("with noise of")]
}

/// A right model leaves what the noise of positions is worth behind two differences and the filter,
/// and nothing is named.
#[test]
fn the_own_vehicle_leaves_the_noise_of_positions() {
    let own = vehicle("squirrel.toml");
    let [_, flights] = flights(&own);
    let finding = find(&own, &flights).unwrap();
    let [cutoff_hz, noise_m_s2] = said(&finding.notes);
    let tau_f = std::f64::consts::TAU * cutoff_hz;
    let formula = POSITION_NOISE_M * tau_f * tau_f * (2.0 * cutoff_hz / RATE_HZ / 5.0).sqrt();
    println!(
        "{cutoff_hz} Hz, {noise_m_s2} m/s^2, {formula} m/s^2, {:?}",
        finding.residual.force_body_rms_n
    );
    assert!((noise_m_s2 / formula - 1.0).abs() < 0.1, "said {noise_m_s2}, is {formula}");
    for force_n in finding.residual.force_body_rms_n {
        let over = force_n / (own.vehicle.parameters().mass_kg * formula);
        assert!((0.8..1.2).contains(&over), "{over} times the noise");
    }
    let notes = finding.notes.join("\n");
    assert!(
        notes.contains("imu.omega_body_rad_s: missing; rates are those of attitude"),
        "{notes}"
    );
    assert_eq!(verdict(&own, &flights).verdict, Kind::None);
}

/// The same name with the IMU and without, and the true number inside both intervals.
#[test]
fn names_are_those_of_the_same_flights_with_an_imu() {
    for (effect, key, hidden) in
        [("linear_drag", "extra_drag_n_s_per_m", 0.12), ("mass_error", "mass_fraction", 0.08)]
    {
        let table = format!("[effects.{effect}]\n{key} = {hidden}\n\n[limits]");
        let all = flights(&vehicle_with("squirrel.toml", &[("[limits]", &table)]));
        for flights in &all {
            let verdict = verdict(&vehicle("squirrel.toml"), flights);
            assert_eq!(verdict.verdict, Kind::Named, "{effect}");
            assert_eq!(verdict.effects.len(), 1, "{effect}");
            let [value, low, high] = size(&verdict, effect, key);
            assert!((low..high).contains(&hidden), "{effect}: {value}, {low} to {high}");
            assert!((value / hidden - 1.0).abs() < 0.1, "{effect}: {value}");
            assert!(verdict.gap.unwrap().removed_fraction > 0.95);
        }
    }
}

/// What an autopilot writes to a card: acceleration in the world less gravity, roll and yaw,
/// velocity; no pitch, no gyroscope.
fn carded(log: &FlightLog) -> FlightLog {
    let (time_s, force) = log.channel("imu.specific_force_body_m_s2").unwrap();
    let (true_s, attitude) = log.channel("truth.q_ned_from_body_wxyz").unwrap();
    let (_, velocity) = log.channel("truth.velocity_ned_m_s").unwrap();
    let mut out = log.clone();
    for source in ["imu", "gnss", "attitude"] {
        out.sources.remove(source);
    }
    for (i, t) in time_s.iter().enumerate().step_by(3) {
        let at = true_s.partition_point(|s| *s < t - 1e-6).min(true_s.len() - 1);
        let [w, x, y, z] = *attitude.row(at) else { panic!("four numbers") };
        let q = UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z));
        let felt = q * Vector3::from_column_slice(force.row(i)) + Vector3::new(0.0, 0.0, 9.80665);
        let (roll, _, yaw) = q.euler_angles();
        out.source_mut("imu").push(*t, &[("acceleration_ned_m_s2", felt.as_slice())]);
        out.source_mut("attitude").push(*t, &[("roll_rad", &[roll]), ("yaw_rad", &[yaw])]);
        out.source_mut("gnss").push(*t, &[("velocity_ned_m_s", velocity.row(at))]);
    }
    out
}

/// Pitch is that of the thrust, so that drag along the nose is lost in it; in slow flight thrust is
/// as well known as with an IMU.
#[test]
fn an_acceleration_in_the_world_and_two_angles_are_enough_for_thrust() {
    let own = vehicle("squirrel.toml");
    let log = fly_as("excite_calm", &own, 1);
    let with = find(&own, &[("f".to_owned(), log.clone())]).unwrap();
    let without = find(&own, &[("f".to_owned(), carded(&log))]).unwrap();
    let [with_n, without_n] = [&with, &without].map(|f| f.residual.force_body_rms_n[2]);
    println!("{with_n} N, {without_n} N, {:?}\n{:?}", without.residual, without.notes);
    // One sample of three leaves the square root of three times the white noise.
    let over = without_n / (3.0_f64.sqrt() * with_n);
    assert!((0.8..1.2).contains(&over), "{without_n} N, with the IMU {with_n} N");
    let notes = without.notes.join("\n");
    assert!(notes.contains("pitch is where thrust must point"), "{notes}");
    assert!(notes.contains("forces are those of imu.acceleration_ned_m_s2"), "{notes}");

    let mut log = carded(&log);
    log.sources.remove("gnss");
    assert_eq!(
        find(&own, &[("f".to_owned(), log)]).unwrap_err().to_string(),
        "f: attitude.q_ned_from_body_wxyz: missing; the residual needs it, or attitude.pitch_rad or gnss.velocity_ned_m_s"
    );
}

#[test]
fn neither_imu_nor_position_is_one_error() {
    let own = vehicle("squirrel.toml");
    let log = captured(&fly(&own, 1), 1);
    let without = |sources: &[&str]| {
        let mut log = log.clone();
        for source in sources {
            log.sources.remove(*source);
        }
        find(&own, &[("f".to_owned(), log)]).unwrap_err().to_string()
    };
    let instead = "gnss.position_ned_m, gnss.velocity_ned_m_s or imu.acceleration_ned_m_s2 with \
                   attitude.q_ned_from_body_wxyz";
    for missing in [&["gnss"][..], &["attitude"]] {
        assert_eq!(
            without(missing),
            format!(
                "f: imu.specific_force_body_m_s2: missing; the residual needs it, or {instead}"
            )
        );
    }
}

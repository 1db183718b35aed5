//! Labels from flight logs: what the accelerometer says the wings did, against what the simulator
//! knows.
#![allow(clippy::print_stdout, reason = "tests")]

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use squirrel_core::math::AIR_DENSITY_KG_M3;
use squirrel_core::rnn::parnn::WINDOW;
use squirrel_log::FlightLog;
use squirrel_nn::NnError;
use squirrel_nn::labels::windows;
use squirrel_nn::windows::Windows;
use squirrel_sim::arm::Arm;
use squirrel_sim::flight::{Integrator, Setup};
use squirrel_sim::scenario::Scenario;
use squirrel_sim::vehicle_file::VehicleFile;

/// A flight with dashes, climbs and opening wings.
fn flight() -> (VehicleFile, FlightLog) {
    let vehicle = VehicleFile::squirrel();
    let scenario = Scenario::find("excite_rich").unwrap();
    let setup =
        Setup { vehicle: vehicle.clone(), arm: Arm::Pc, scenario, integrator: Integrator::Rk4 };
    (vehicle, setup.fly(true, |_| {}).unwrap().log.unwrap())
}

fn without(log: &FlightLog, source: &str) -> FlightLog {
    let mut less = log.clone();
    less.sources.remove(source);
    less
}

#[test]
fn a_label_is_the_force_on_the_wings_but_for_noise() {
    let (vehicle, log) = flight();
    let found = windows(&vehicle, "rich", &log).unwrap();
    assert!(found.len() > 30, "{} windows", found.len());
    let (mut error, mut size, mut mean) = (0.0, 0.0, Vector3::zeros());
    for window in &found {
        let truth = Vector3::from(window.truth_body_n.unwrap()).cast::<f64>();
        let off = Vector3::from(window.label_body_n).cast::<f64>() - truth;
        error += off.norm_squared();
        size += truth.norm_squared();
        mean += off;
    }
    let n = found.len() as f64;
    let (error, size, mean) = ((error / n).sqrt(), (size / n).sqrt(), mean / n);
    println!("{n} windows: error {error:.4} N of {size:.4} N, mean {mean:?}");
    assert!(error < 0.05 * size, "{error} N of {size} N");
    assert!(mean.norm() < 0.02 * size);
    // A second of rows, oldest first: neighbouring windows share nine of them.
    let shared = found.windows(2).filter(|w| w[0].rows[1..] == w[1].rows[..WINDOW - 1]).count();
    assert!(shared * 10 > found.len() * 8);
    Windows::new().push("rich", &found).unwrap();
}

/// E9 by hand and by another way: acceleration from the change of true velocity, thrust from the
/// rotors' speeds, no accelerometer. The paper leaves the airframe's drag out; here it is taken
/// off.
#[test]
fn the_label_in_ned_is_what_is_left_of_the_papers_balance_of_forces() {
    let vehicle = VehicleFile::squirrel();
    let scenario = Scenario { duration_s: 12.0, ..Scenario::find("random_spread").unwrap() };
    let arm = Arm::PcWingsOpen;
    let setup = Setup { vehicle: vehicle.clone(), arm, scenario, integrator: Integrator::Rk4 };
    let log = setup.fly(true, |_| {}).unwrap().log.unwrap();
    let found = windows(&vehicle, "random", &log).unwrap();

    let parameters = vehicle.vehicle.parameters();
    let (mass_kg, weight) = (parameters.mass_kg, Vector3::z() * vehicle.vehicle.weight_n());
    let row = |name: &str, t: f64| {
        let (time_s, channel) = log.channel(name).unwrap();
        channel.row(time_s.partition_point(|s| *s < t - 1e-6)).to_vec()
    };
    let vector = |name: &str, t: f64| Vector3::from_column_slice(&row(name, t));
    let (mut error, mut size) = (0.0, 0.0);
    for (k, window) in found.iter().enumerate() {
        // All sources begin at 0: rows are at 0.05 s, 0.15 s, ..., and the first window ends with
        // the tenth.
        let t = 0.05 + 0.1 * (k + WINDOW - 1) as f64;
        let [before, after] = [t - 0.05, t + 0.05].map(|t| vector("truth.velocity_ned_m_s", t));
        let inertia = (after - before) * (mass_kg / 0.1);
        let mut others = Vector3::zeros();
        for i in 0..=30 {
            // By the trapezoidal rule: thrust turns with the vehicle, so that half a sample late
            // would be seen.
            let (t, share) =
                (t - 0.05 + f64::from(i) / 300.0, if i % 30 == 0 { 0.5 } else { 1.0 } / 30.0);
            let q = row("truth.q_ned_from_body_wxyz", t);
            let down = UnitQuaternion::new_normalize(Quaternion::new(q[0], q[1], q[2], q[3]))
                * Vector3::z();
            let squares: f64 = row("rotor.speed_rad_s", t).iter().map(|w| w * w).sum();
            let v = vector("truth.velocity_ned_m_s", t);
            let drag = v * (0.5 * AIR_DENSITY_KG_M3 * parameters.drag.area_m2 * v.norm());
            others -=
                (down * (parameters.propulsion.thrust_coefficient_n_s2 * squares) + drag) * share;
        }
        let by_hand = inertia - weight - others;
        error += (Vector3::from(window.label_ned_n()).cast::<f64>() - by_hand).norm_squared();
        size += by_hand.norm_squared();
    }
    let [error, size] = [error, size].map(|sum| (sum / found.len() as f64).sqrt());
    println!("{} windows: {error:.4} N of {size:.4} N", found.len());
    // What there is of it is the accelerometer's white noise: 0.25 m/s^2 an axis, the mean of 30
    // samples, three axes.
    let noise = mass_kg * 0.25 * (3.0_f64 / 30.0).sqrt();
    assert!(
        (error / noise - 1.0).abs() < 0.15 && size > 5.0 * error,
        "{error} N of {size} N, noise {noise} N"
    );
}

/// Memory goes with samples: one sample that is far away is named, and a pause is no window.
#[test]
fn a_clock_that_jumps_is_named_and_a_pause_is_left_out() {
    let (vehicle, log) = flight();
    for far_s in [1e4, 1e8, 1.7e9] {
        let mut jumps = log.clone();
        let times = &mut jumps.source_mut("imu").time_s;
        let last = times.len() - 1;
        times[last] = far_s;
        let problem = windows(&vehicle, "monday", &jumps).unwrap_err().to_string();
        let named = format!("monday: imu.specific_force_body_m_s2: time_s[{last}] = {far_s}: is ");
        assert!(problem.starts_with(&named), "{problem}");
        assert!(problem.ends_with("at most 3600; the clock has jumped"), "{problem}");
    }
    // An hour in the middle in which nothing was logged: nothing is learned there.
    let mut paused = log.clone();
    for source in paused.sources.values_mut() {
        let middle = source.time_s.partition_point(|t| *t < 20.0);
        for t in &mut source.time_s[middle..] {
            *t += 3590.0;
        }
    }
    let [whole, paused] = [&log, &paused].map(|log| windows(&vehicle, "monday", log).unwrap());
    assert!(paused.len() <= whole.len() && paused.len() + 40 > whole.len(), "{}", paused.len());
}

#[test]
fn a_log_that_lacks_something_says_what_and_why() {
    let (vehicle, log) = flight();
    let problem = |log: &FlightLog| windows(&vehicle, "monday", log).unwrap_err().to_string();
    for (source, words) in [
        ("imu", "monday: imu.specific_force_body_m_s2: missing; the force is measured by it"),
        ("gnss", "monday: gnss.velocity_ned_m_s: missing; the air meets the wings with it"),
        (
            "wing",
            "monday: wing.command: missing; wings must be spread where something is learned about them",
        ),
    ] {
        assert_eq!(problem(&without(&log, source)), words);
    }
    // A battery that is not logged is at its reference voltage, and no truth is none.
    let found = windows(&vehicle, "monday", &without(&without(&log, "battery"), "truth")).unwrap();
    assert!(found.iter().all(|window| window.truth_body_n.is_none()));

    let mut folded = log.clone();
    folded.source_mut("wing").channels.get_mut("command").unwrap().values.fill(0.0);
    assert!(matches!(windows(&vehicle, "monday", &folded), Err(NnError::Folded { .. })));
    let mut damaged = log.clone();
    damaged.source_mut("imu").channels.get_mut("omega_body_rad_s").unwrap().values[7] = f64::NAN;
    assert!(
        problem(&damaged).starts_with("monday: imu.omega_body_rad_s: NaN at "),
        "{}",
        problem(&damaged)
    );
    let mut narrow = log;
    narrow.source_mut("rotor").channels.get_mut("command").unwrap().width = 3;
    assert!(problem(&narrow).contains("rotor.command: has 3 numbers a sample, must have 4"));
}

//! Labels from flight logs: what the accelerometer says the wings did, against what the simulator knows.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use nalgebra::Vector3;
use squirrel_core::rnn::parnn::WINDOW;
use squirrel_nn::NnError;
use squirrel_nn::labels::windows;
use squirrel_nn::windows::Windows;
use squirrel_sim::arm::Arm;
use squirrel_sim::flight::{Integrator, Setup};
use squirrel_sim::log::FlightLog;
use squirrel_sim::scenario::Scenario;
use squirrel_sim::vehicle_file::VehicleFile;

/// A flight with dashes, climbs and opening wings.
fn flight() -> (VehicleFile, FlightLog) {
    let vehicle = VehicleFile::squirrel();
    let scenario = Scenario::find("excite_rich").unwrap();
    let setup = Setup { vehicle: vehicle.clone(), arm: Arm::Pc, scenario, integrator: Integrator::Rk4 };
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

#[test]
fn a_log_that_lacks_something_says_what_and_why() {
    let (vehicle, log) = flight();
    let problem = |log: &FlightLog| windows(&vehicle, "monday", log).unwrap_err().to_string();
    for (source, words) in [
        ("imu", "monday: imu.specific_force_body_m_s2: missing; the force is measured by it"),
        ("gnss", "monday: gnss.velocity_ned_m_s: missing; the air meets the wings with it"),
        ("wing", "monday: wing.command: missing; wings must be spread where something is learned about them"),
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
    assert!(problem(&damaged).starts_with("monday: imu.omega_body_rad_s: NaN at "), "{}", problem(&damaged));
    let mut narrow = log;
    narrow.source_mut("rotor").channels.get_mut("command").unwrap().width = 3;
    assert!(problem(&narrow).contains("rotor.command: has 3 numbers a sample, must have 4"));
}

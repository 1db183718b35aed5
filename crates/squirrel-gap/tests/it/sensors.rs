//! Sensors and clocks that err are named as such, and not as the physics that they look like.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use crate::support::fly_rich;
use squirrel_gap::{Kind, Value, Verdict, diagnose};
use squirrel_log::FlightLog;
use squirrel_sim::vehicle_file::VehicleFile;

/// Two flights of a squirrel with an effect, against its file without. The attitude is measured
/// from outside: one that a filter has made from the same gyroscope has its errors, too.
fn flown(effects: &str) -> [(String, FlightLog); 2] {
    let file = VehicleFile::squirrel().text.replace("filter = \"eskf\"", "filter = \"external\"");
    let vehicle = VehicleFile::parse(&format!("{file}\n{effects}"), "vehicle").unwrap();
    [fly_rich(&vehicle, 1), fly_rich(&vehicle, 2)]
}
fn verdict(flights: &[(String, FlightLog)]) -> Verdict {
    diagnose(&VehicleFile::squirrel(), flights, &[], &|_| {}).unwrap().verdict
}
/// The verdict names this effect and no other.
fn names(verdict: &Verdict, name: &str) {
    let effects: Vec<&str> = verdict.effects.iter().map(|e| e.name).collect();
    println!("{}", verdict.words);
    assert!(verdict.verdict == Kind::Named && effects == [name], "{}", verdict.words);
}
fn number(verdict: &Verdict, key: &str) -> f64 {
    match verdict.effects[0].parameters.iter().find(|(name, _)| **name == key).unwrap().1 {
        Value::Number { value, .. } => *value,
        Value::Choice { .. } => panic!("{key} is a number"),
    }
}

/// About each axis a scale is an alias of the inertia's, as far as angular accelerations go; the
/// attitude tells.
#[test]
fn a_scale_of_the_gyroscope_is_no_inertia() {
    let flights = flown(
        "[effects.gyro_scale]\nscale_x_fraction = 0.05\nscale_y_fraction = -0.05\nscale_z_fraction = 0.05\n",
    );
    let verdict = verdict(&flights);
    names(&verdict, "gyro_scale");
    for (axis, scale) in [("x", 0.05), ("y", -0.05), ("z", 0.05)] {
        let found = number(&verdict, &format!("scale_{axis}_fraction"));
        assert!((found - scale).abs() < 0.01, "{axis}: {found}");
    }
}

/// Along z a scale is an alias of thrust and mass, as far as forces go; the fixes tell.
#[test]
fn a_scale_of_the_accelerometer_is_no_thrust() {
    let flights = flown(
        "[effects.accel_scale]\nscale_x_fraction = 0.0\nscale_y_fraction = 0.0\nscale_z_fraction = 0.03\n",
    );
    let verdict = verdict(&flights);
    names(&verdict, "accel_scale");
    let found = number(&verdict, "scale_z_fraction");
    assert!((found - 0.03).abs() < 0.01, "{found}");
}

#[test]
fn a_compass_that_follows_the_current_is_no_heading_bias() {
    let verdict = verdict(&flown("[effects.compass_current]\nheading_in_hover_rad = 0.15\n"));
    names(&verdict, "compass_current");
    let found = number(&verdict, "heading_in_hover_rad");
    assert!((found - 0.15).abs() < 0.03, "{found}");
}

/// Forwards and backwards: a jump back stamps some times twice, of which a log has the first.
#[test]
fn a_step_of_the_clock_is_no_skew() {
    for step_s in [0.05, -0.04] {
        let verdict =
            verdict(&flown(&format!("[effects.clock_step]\nstep_s = {step_s}\nat_s = 17.0\n")));
        names(&verdict, "clock_step");
        let (by_s, at_s) = (number(&verdict, "step_s"), number(&verdict, "at_s"));
        assert!((by_s - step_s).abs() < 0.01 && (at_s - 17.0).abs() < 1.0, "{by_s} s at {at_s} s");
    }
}

/// A skew stays one.
#[test]
fn a_skew_of_the_clock_is_no_step() {
    names(&verdict(&flown("[effects.clock_skew]\nskew_ppm = 1000.0\n")), "clock_skew");
}

/// A bias that runs off has no name: the flights contradict themselves. A scale of a tenth is no
/// contradiction.
#[test]
fn a_gyroscope_that_drifts_is_set_aside_and_one_with_a_scale_is_not() {
    let scale = flown(
        "[effects.gyro_scale]\nscale_x_fraction = 0.1\nscale_y_fraction = 0.1\nscale_z_fraction = -0.1\n",
    );
    assert!(squirrel_gap::contradictions(&VehicleFile::squirrel(), &scale).unwrap().is_empty());
    let mut flights = flown("");
    for (_, log) in &mut flights {
        let imu = log.sources.get_mut("imu").unwrap();
        let omega = imu.channels.get_mut("omega_body_rad_s").unwrap();
        for (row, t) in omega.values.chunks_mut(3).zip(&imu.time_s) {
            row[1] += 2e-3 * t;
        }
    }
    let verdict = verdict(&flights);
    assert_eq!(verdict.verdict, Kind::DataProblem);
    assert!(verdict.words.contains("imu.omega_body_rad_s: runs off by +0.0"), "{}", verdict.words);
    assert!(verdict.words.contains("about y"), "{}", verdict.words);
}

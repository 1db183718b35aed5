//! First files of machines that others have measured.

use super::scaling::published::{MACHINES, Machine};
use super::sizes::INCH_M;
use super::*;
use crate::arm::Arm;
use crate::quantity::Provenance;

#[allow(clippy::unnecessary_wraps, reason = "every field of what is given is optional")]
fn said(value: f64) -> Option<Said> {
    Some(Said { value, source: "test".to_owned() })
}

/// Mass, frame and propeller only.
fn first_file(machine: &Machine) -> VehicleFile {
    Given {
        name: machine.name.to_owned(),
        frame: Some(Frame::QuadX),
        mass_kg: said(machine.mass_kg),
        propeller_inch: said(machine.diameter_m / INCH_M),
        ..Given::default()
    }
    .vehicle_file()
    .unwrap()
}

/// The declared sds of a field over its values.
fn spread(file: &VehicleFile, field: &str) -> Vec<f64> {
    let (_, Provenance { value, sd, .. }) =
        file.provenance.iter().find(|(name, _)| name == field).unwrap();
    let numbers = |text: &str| -> Vec<f64> {
        text.split(|c: char| "[], ".contains(c)).filter_map(|part| part.parse().ok()).collect()
    };
    let (value, sd) = (numbers(value), numbers(sd.as_ref().unwrap()));
    value.iter().zip(&sd).map(|(value, sd)| sd / value).collect()
}

#[test]
fn published_machines_lie_within_the_stated_tolerance() {
    let mut beyond_one = (0, 0);
    for machine in &MACHINES {
        let file = first_file(machine);
        let p = file.vehicle.parameters();
        let mut holds = |what: &str, guess: f64, truth: f64, sd: f64| {
            let off = (truth - guess) / (sd * guess);
            println!("{}: {what} {guess:.4}, published {truth:.4}: {off:+.2} sd", machine.name);
            beyond_one = (beyond_one.0 + usize::from(off.abs() > 1.0), beyond_one.1 + 1);
            assert!(off.abs() < 2.0, "{}: {what}", machine.name);
        };
        let inertia = spread(&file, "mass.inertia_kg_m2");
        for axis in 0..3 {
            let guess = p.inertia_kg_m2[(axis, axis)];
            holds("inertia", guess * 1e6, machine.inertia_kg_m2[axis] * 1e6, inertia[axis]);
        }
        let arm = p.rotors[0].position.vector.norm();
        holds("arm", arm, machine.arm_m, spread(&file, "rotor[0].position_body_m")[0]);
        if let Some(ratio) = machine.thrust_to_weight {
            let means = file.means().unwrap();
            let thrust = spread(&file, "propulsion.thrust_coefficient_n_s2")[0];
            holds("thrust over weight", means.thrust_to_weight, ratio, thrust);
            // Thrust goes with the square of the command.
            holds("hover command", means.hover_command, ratio.sqrt().recip(), 0.5 * thrust);
        }
    }
    // As many as a normal distribution has, or fewer.
    let (beyond, all) = beyond_one;
    println!("{beyond} of {all} beyond one sd");
    assert!(beyond * 100 <= 45 * all, "{beyond} of {all}");
}

#[test]
fn motors_and_cells_say_the_most_thrust() {
    // Foehn et al. 2022: 5.1 inch, four cells; the motor's speed constant as sold, 2400 rpm/V.
    let file = Given {
        name: "agilicious".to_owned(),
        frame: Some(Frame::QuadX),
        mass_kg: said(0.752),
        arm_m: said(0.125),
        propeller_inch: said(5.1),
        pitch_inch: said(4.6),
        cells: said(4.0),
        kv_rpm_per_v: said(2400.0),
        ..Given::default()
    }
    .vehicle_file()
    .unwrap();
    let ratio = file.means().unwrap().thrust_to_weight;
    let sd = spread(&file, "propulsion.thrust_coefficient_n_s2")[0];
    println!("thrust over weight {ratio:.2}, published 4.61, sd {:.0} %", 100.0 * sd);
    assert!((4.61 / ratio - 1.0).abs() < 2.0 * sd);
}

#[test]
fn every_frame_and_size_flies() {
    use crate::flight::{Integrator, Setup};
    use crate::scenario::Scenario;
    for (frame, mass, inch) in [
        ("quad-x", 0.027, 1.8),
        ("quad-x-betaflight", 0.6, 5.0),
        ("quad-plus", 1.5, 10.0),
        ("hexa-x", 3.0, 13.0),
        ("octo-x", 12.0, 18.0),
    ] {
        let vehicle = Given {
            name: frame.to_owned(),
            frame: Some(Frame::parse(frame).unwrap()),
            mass_kg: said(mass),
            propeller_inch: said(inch),
            ..Given::default()
        }
        .vehicle_file()
        .unwrap();
        let scenario = Scenario::find("hover").unwrap();
        let setup = Setup { vehicle, scenario, arm: Arm::Pc, integrator: Integrator::Rk4 };
        let metrics = setup.fly(false, |_| {}).unwrap().metrics;
        println!("{frame} of {mass} kg: {:.3} m from its place", metrics.rmse_m);
        assert!(metrics.rmse_m < 0.15, "{frame}: {metrics:?}");
        let setup = Setup { scenario: Scenario::find("track").unwrap(), ..setup };
        let metrics = setup.fly(false, |_| {}).unwrap().metrics;
        println!("track: {:.2} m, {:.2} m of height", metrics.rmse_m, metrics.height_lost_m);
        assert!(metrics.rmse_m < 3.5 && metrics.height_lost_m < 0.5, "{frame}: {metrics:?}");
    }
}

#[test]
fn what_is_missing_and_what_cannot_be_is_named() {
    let error = Given::default().vehicle_file().unwrap_err().to_string();
    assert_eq!(error, "missing: --frame, --mass-kg, --propeller-inch");
    let given = |mass: f64, inch: f64| Given {
        frame: Some(Frame::HexaX),
        mass_kg: said(mass),
        propeller_inch: said(inch),
        ..Given::default()
    };
    for (bad, word) in [
        (given(-1.0, 5.0), "mass_kg = -1"),
        (given(f64::NAN, 5.0), "mass_kg = NaN"),
        (given(1.0, 0.0), "propeller_inch = 0"),
        (Given { cells: said(3.5), ..given(1.0, 5.0) }, "cells = 3.5"),
        (
            Given { pitch_inch: said(50.0), ..given(1.0, 5.0) },
            "pitch_inch over propeller_inch = 10",
        ),
        (Given { hover_thrust_fraction: said(1.5), ..given(1.0, 5.0) }, "hover_thrust_fraction"),
    ] {
        let error = bad.vehicle_file().unwrap_err().to_string();
        assert!(error.starts_with(word), "{error}");
    }
    assert!(Frame::parse("triangle").unwrap_err().contains("quad-plus"));
}

#[test]
fn a_file_without_gains_gets_those_of_the_rule_and_says_so() {
    for text in [squirrel_vehicles::CRAZYFLIE21_BRUSHED, squirrel_vehicles::CRAZYFLIE2_ARPL] {
        let bare = VehicleFile::parse(text, "bare").unwrap();
        assert!(bare.control.is_none());
        let ruled = bare.with_gains_by_rule().unwrap();
        assert!(ruled.control.is_some() && ruled.text.starts_with(text.trim_end()));
        assert!(ruled.text.contains("by rule: "), "{}", ruled.text);
        assert_eq!(ruled.vehicle, bare.vehicle);
        // A file that has its own keeps them.
        assert_eq!(ruled.with_gains_by_rule().unwrap().text, ruled.text);
    }
}

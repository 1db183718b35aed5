//! Flights with measured rotor speeds: thrust is judged by the speeds that the rotors had, whatever
//! they were told.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use crate::support::{vehicle, vehicle_with};
use squirrel_gap::{Finding, Value, diagnose, find, nothing_to_add};
use squirrel_log::FlightLog;
use squirrel_sim::arm::Arm;
use squirrel_sim::flight::{Integrator, Setup};
use squirrel_sim::scenario::{MissionTable, Scenario};
use squirrel_sim::vehicle_file::VehicleFile;

type Flights = Vec<(String, FlightLog)>;

/// Three flights of an individual as another vehicle's log would have them, where what is known of
/// rotors was measured.
fn flights(individual: &VehicleFile) -> Flights {
    let fly = |seed: u64| {
        let mut scenario = Scenario::find("excite_rich").unwrap();
        scenario.seed = seed;
        if let MissionTable::Excite(table) = &mut scenario.mission {
            table.heights_m = vec![1.5, 1.0, 0.7];
        }
        let setup = Setup {
            vehicle: individual.clone(),
            arm: Arm::Pc,
            scenario,
            integrator: Integrator::Rk4,
        };
        let mut log = setup.fly(true, |_| {}).unwrap().log.unwrap();
        log.metadata.clear();
        log
    };
    (1..=3).map(|seed| (format!("flight {seed}"), fly(seed))).collect()
}

fn without_speeds(flights: &Flights) -> Flights {
    let mut flights = flights.clone();
    for (_, log) in &mut flights {
        log.source_mut("rotor").channels.remove("speed_rad_s").unwrap();
    }
    flights
}

fn hiding(table: &str) -> VehicleFile {
    let hidden = vehicle_with("squirrel.toml", &[("[limits]", &format!("{table}\n\n[limits]"))]);
    // What is hidden the flight code does not know either.
    VehicleFile { control: vehicle("squirrel.toml").control, ..hidden }
}

fn moments(finding: &Finding) -> [f64; 3] {
    finding.residual.moment_body_rms_n_m
}

/// Rotors that lag and sag: the commands are wrong about the speeds, the speeds are right about the
/// forces.
#[test]
fn lag_and_sag_do_not_leak_into_thrust() {
    let model = vehicle("squirrel.toml");
    let clean = find(&model, &flights(&model)).unwrap();
    let hidden = hiding(
        "[effects.motor_lag]\nextra_time_constant_s = 0.05\n[effects.battery_sag]\nvoltage_exponent = 1.0",
    );
    let flights = flights(&hidden);
    let measured = find(&model, &flights).unwrap();
    let told = find(&model, &without_speeds(&flights)).unwrap();
    println!(
        "{:?} {:?}\n{:?}\n{:?}",
        measured.residual.force_body_rms_n,
        moments(&measured),
        told.residual.force_body_rms_n,
        moments(&told)
    );
    for axis in 0..3 {
        let over =
            |f: &Finding| f.residual.force_body_rms_n[axis] / clean.residual.force_body_rms_n[axis];
        assert!((0.95..1.05).contains(&over(&measured)), "force, axis {axis}: {}", over(&measured));
        let over = |f: &Finding| moments(f)[axis] / moments(&clean)[axis];
        // Rotors that lag turn the vehicle less.
        assert!((0.7..1.05).contains(&over(&measured)), "moment, axis {axis}: {}", over(&measured));
    }
    let over = moments(&told)[1] / moments(&clean)[1];
    assert!(over > 1.5, "by the commands the lag is a moment: {over}");
    assert!(
        told.residual.force_body_rms_n[2] > 1.5 * clean.residual.force_body_rms_n[2],
        "and the sag a force"
    );
    let note = "rotor.speed_rad_s: measured, and taken instead of what commands make of it";
    assert!(measured.notes.iter().any(|n| n.contains(note)), "{:?}", measured.notes);
}

#[test]
fn a_hidden_thrust_coefficient_is_found_beside_a_lag() {
    let hidden = hiding(
        "[effects.motor_lag]\nextra_time_constant_s = 0.05\n[effects.thrust_coefficient]\nthrust_fraction = -0.12",
    );
    let flights = flights(&hidden);
    let verdict =
        diagnose(&vehicle("squirrel.toml"), &flights[..2], &flights[2..], &|_| {}).unwrap().verdict;
    println!(
        "{:?} {}\n{:#?}\n{:?}",
        verdict.verdict, verdict.words, verdict.effects, verdict.notes
    );
    // Whether the form is said to fit all of it depends on the noise of the flights.
    assert!(nothing_to_add(&verdict).is_none(), "{}", verdict.words);
    assert_eq!(verdict.effects.iter().map(|e| e.name).collect::<Vec<_>>(), ["thrust_coefficient"]);
    let Value::Number { value, low, high } = verdict.effects[0].parameters["thrust_fraction"]
    else {
        panic!("no number")
    };
    assert!((low..high).contains(&-0.12), "{value}, {low} to {high}");
    assert!(verdict.gap.unwrap().removed_fraction > 0.95);
}

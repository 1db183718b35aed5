//! A name must hold on flights that it was not fitted to.
#![allow(clippy::unwrap_used, reason = "tests")]

use crate::support::{fly_rich, vehicle_with};
use squirrel_gap::{Kind, diagnose};
use squirrel_sim::vehicle_file::VehicleFile;

/// Two flights of a vehicle with an effect, and one of a vehicle without it, which the file
/// describes well.
#[test]
fn what_makes_held_out_flights_worse_than_the_file_is_no_name() {
    let file = VehicleFile::squirrel();
    let effect = "[effects.yaw_torque_coeff]\ntorque_fraction = 0.3\n\n[limits]";
    let flown = vehicle_with("squirrel.toml", &[("[limits]", effect)]);
    let flights = [fly_rich(&flown, 1), fly_rich(&flown, 2)];
    let verdict = |held_out| diagnose(&file, &flights, &[held_out], &|_| {}).unwrap().verdict;

    let same = verdict(fly_rich(&flown, 3));
    assert_eq!(same.verdict, Kind::Named, "{}", same.words);

    let other = verdict(fly_rich(&file, 3));
    let gap = other.gap.as_ref().unwrap();
    assert!(gap.after > 1.05 * gap.before, "{gap:?}");
    assert_eq!(other.verdict, Kind::OutsideCatalogue, "{}", other.words);
    assert_eq!(other.effects[0].name, "yaw_torque_coeff", "what explains the others is told");
    assert!(other.words.contains("makes the error larger"), "{}", other.words);
}

/// Rotors quicker than a sample of the flights are simulated in shorter steps.
#[test]
fn rotors_of_a_millisecond_are_simulated() {
    let quick = |effects: &str| {
        let lag = ("value = 0.04, sd = 0.004", "value = 0.001, sd = 0.0001");
        let with = format!("{effects}[limits]");
        vehicle_with("squirrel.toml", &[lag, ("[limits]", &with)])
    };
    let flown = quick("[effects.linear_drag]\nextra_drag_n_s_per_m = 0.08\n\n");
    let flights = [fly_rich(&flown, 1), fly_rich(&flown, 2)];
    let held_out = [fly_rich(&flown, 3)];
    let verdict = diagnose(&quick(""), &flights, &held_out, &|_| {}).unwrap().verdict;
    assert_eq!(verdict.verdict, Kind::Named, "{}", verdict.words);
    assert_eq!(verdict.effects[0].name, "linear_drag", "{}", verdict.words);
    assert!(verdict.gap.as_ref().unwrap().removed_fraction > 0.99, "{:?}", verdict.gap);
}

//! Measured flights of Crazyflies through the whole workflow.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use crate::support::{flights, imported, vehicle};
use squirrel_gap::{Diagnosis, Kind, Verdict, add, diagnose, find};
use squirrel_log::FlightLog;
use squirrel_sim::vehicle_file::VehicleFile;

type Flights = Vec<(String, FlightLog)>;

/// Flights that train on a full battery and are held out on an emptier one.
fn nanobench() -> (Flights, Flights) {
    let folder = flights("nanobench");
    let read = |name: &str| {
        (name.to_owned(), imported("nanobench.toml", &folder.join(format!("{name}.csv"))))
    };
    let train = ["B8_star_slow_rep1", "B3_figure8_fast_rep1"].map(read);
    let held_out = ["B9_trefoil_slow_rep1", "B2_circle_medium_rep1"].map(read);
    (train.into(), held_out.into())
}

fn diagnosed(vehicle: &VehicleFile, flights: &Flights, held_out: &Flights) -> Diagnosis {
    let diagnosis = diagnose(vehicle, flights, held_out, &|_| {}).unwrap();
    println!("{}", serde_json::to_string_pretty(&diagnosis.verdict).unwrap());
    diagnosis
}

/// Names of the first explanation and of those that the verdict holds beside it.
fn names(verdict: &Verdict) -> Vec<&'static str> {
    let others = verdict.alternatives.iter().flat_map(|other| other.effects.iter().copied());
    verdict.effects.iter().map(|effect| effect.name).chain(others).collect()
}

/// Thrust is a constant times the sum of squares there, fitted at 3.42 to 3.78 V; the held-out
/// flights are at 3.17 to 3.54 V.
#[test]
fn thrust_sags_with_the_battery_of_a_crazyflie() {
    let (flights, held_out) = nanobench();
    let nominal = vehicle("crazyflie21_brushed.toml");
    let diagnosis = diagnosed(&nominal, &flights, &held_out);
    assert_eq!(diagnosis.verdict.effects[0].name, "battery_sag");

    let names: Vec<String> = flights.iter().map(|(name, _)| name.clone()).collect();
    let text = add(&nominal, &diagnosis, &names).unwrap();
    let patched = VehicleFile::parse(&text, "patched").unwrap();
    let vertical =
        |vehicle: &VehicleFile| find(vehicle, &held_out).unwrap().residual.force_body_rms_n[2];
    let (before, after) = (vertical(&nominal), vertical(&patched));
    println!("vertical force on the held-out flights: {before:.5} N, patched {after:.5} N");
    assert!(after <= 0.5 * before, "{after} N, without sag {before} N");
}

/// One flight of NanoBench against another one.
fn one_against_another(vehicle: &str, fitted: &[&str], held_out: &str) -> Verdict {
    let folder = flights("nanobench");
    let read = |name: &&str| {
        ((*name).to_owned(), imported("nanobench.toml", &folder.join(format!("{name}.csv"))))
    };
    let fitted: Flights = fitted.iter().map(read).collect();
    diagnosed(&self::vehicle(vehicle), &fitted, &vec![read(&held_out)]).verdict
}

/// A slow flight alone tells a sag from rotors that are late by twice what the file allows once the
/// accelerometer may be late: this one's is filtered at 30 Hz, which is 7.5 ms.
#[test]
fn a_filtered_accelerometer_is_no_lag_of_rotors() {
    let verdict = one_against_another(
        "crazyflie21_datasheet.toml",
        &["B9_trefoil_slow_rep1"],
        "B3_figure8_fast_rep1",
    );
    assert_eq!(verdict.verdict, Kind::Named, "{}", verdict.words);
    assert_eq!(verdict.effects[0].name, "battery_sag");
    let late = verdict.moved.iter().find(|moved| moved.name == "accelerometer.delay_s").unwrap();
    assert!((0.005..0.011).contains(&late.value), "{late:?}");
    for rival in &verdict.alternatives {
        assert_ne!(rival.effects, ["motor_lag"]);
        assert!(verdict.effects[0].evidence_nats - rival.evidence_nats > 10.0, "{rival:?}");
    }
}

/// Thrust of the held-out flight is another one, as it is from day to day with brushed motors: no
/// error of a name, and it hides none.
#[test]
fn the_thrust_of_a_held_out_flight_is_its_own() {
    let verdict = one_against_another(
        "crazyflie21_brushed.toml",
        &["B3_figure8_fast_rep1", "B8_star_slow_rep1", "B9_trefoil_slow_rep1"],
        "B2_circle_medium_rep1",
    );
    assert_eq!(verdict.verdict, Kind::Named, "{}", verdict.words);
    let gap = verdict.gap.unwrap();
    assert!(gap.removed_fraction > 0.5, "{gap:?}");
}

/// Where the thrust curve is free, the same flights cannot tell the curve from the sag.
#[test]
fn sag_and_a_free_thrust_curve_are_confounded() {
    let (flights, held_out) = nanobench();
    let verdict =
        diagnosed(&vehicle("crazyflie21_brushed_curve.toml"), &flights, &held_out).verdict;
    assert!(
        matches!(verdict.verdict, Kind::Ambiguous | Kind::NotIdentifiable),
        "{:?}",
        verdict.verdict
    );
    assert!(names(&verdict).contains(&"battery_sag"), "{:?}", names(&verdict));
    assert!(verdict.words.contains("curve"), "{}", verdict.words);
    assert!(verdict.fly_next.is_some());
}

/// No attitude, position or battery: the specific force alone shows how late the rotors are.
#[test]
fn rotors_lag_in_logs_that_hold_nothing_but_the_inertial_unit() {
    let folder = flights("arpl-motorlag");
    let read =
        |name: &str| (name.to_owned(), imported("arpl.toml", &folder.join(format!("{name}.csv"))));
    let verdict =
        diagnosed(&vehicle("crazyflie2_arpl.toml"), &vec![read("log10")], &vec![read("log16")])
            .verdict;
    // The battery is not logged: its slow drift of thrust stays, and is no other effect.
    assert_eq!(verdict.verdict, Kind::Named, "{}", verdict.words);
    let names: Vec<_> = verdict.effects.iter().map(|e| e.name).collect();
    assert_eq!(names, ["motor_lag"], "{}", verdict.words);
    assert!(!verdict.notes.is_empty(), "what the logs lack is said");
}

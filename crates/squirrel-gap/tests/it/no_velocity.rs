//! Flights whose logs do not say how the vehicle moves: no GNSS, no barometer, as indoors or in a
//! race. What the air does at an unknown velocity is no name.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use crate::support::{fly_rich, vehicle, vehicle_with};
use squirrel_gap::{Baseline, Kind, Value, Verdict, diagnose, diagnose_since};
use squirrel_log::FlightLog;
use squirrel_sim::vehicle_file::VehicleFile;

const SAGGING: (&str, &str) =
    ("[limits]", "[effects.battery_sag]\nvoltage_exponent = 0.9\n\n[limits]");

const WEAK: (&str, &str) =
    ("[limits]", "[effects.weak_rotor]\nrotor = 2\nthrust_loss_fraction = 0.12\n\n[limits]");

/// Flights of an individual, without their fixes.
fn flights(
    individual: &VehicleFile,
    seeds: std::ops::RangeInclusive<u64>,
) -> Vec<(String, FlightLog)> {
    seeds
        .map(|seed| {
            let (name, mut log) = fly_rich(individual, seed);
            for source in ["gnss", "baro", "truth"] {
                log.sources.remove(source);
            }
            log.source_mut("rotor").channels.remove("speed_rad_s");
            log.metadata.clear();
            (name, log)
        })
        .collect()
}

/// The verdict on two of them and a held-out one.
fn verdict(individual: &VehicleFile) -> Verdict {
    let flights = flights(individual, 1..=3);
    let own = vehicle("squirrel.toml");
    let verdict = diagnose(&own, &flights[..2], &flights[2..], &|_| {}).unwrap().verdict;
    println!("{:?}: {}\n{:#?}", verdict.verdict, verdict.words, verdict.notes);
    verdict
}

fn names(verdict: &Verdict) -> Vec<&str> {
    verdict.effects.iter().map(|effect| effect.name).collect()
}

/// Before wings were left out where nobody knows what blows on them, `rotor_wash` was named with
/// thousands of nats beside whatever was hidden.
#[test]
fn open_wings_at_an_unknown_velocity_are_no_rotor_wash() {
    let clean = verdict(&vehicle("squirrel.toml"));
    assert!(clean.effects.is_empty());
    assert_eq!(clean.verdict, Kind::NotIdentifiable);
    assert!(clean.notes.iter().any(|note| note.contains("time with open wings is left out")));
    // What remains may be drag and lift of the vehicle as it is.
    assert!(!clean.words.contains("the catalogue does not have"), "{}", clean.words);
    assert!(clean.fly_next.unwrap().contains("attitude and velocity"));

    let sagging = verdict(&vehicle_with("squirrel.toml", &[SAGGING]));
    assert_eq!(names(&sagging), ["battery_sag"]);
    assert_eq!(sagging.verdict, Kind::NamedIncomplete);
}

/// Rotors turn a vehicle whatever the air does; moments took no part in such flights.
#[test]
fn what_turns_a_vehicle_is_named_without_its_velocity() {
    let weak = vehicle_with("squirrel.toml", &[WEAK]);
    let rotor = Value::Number { value: 2.0, low: 2.0, high: 2.0 };
    let found = verdict(&weak);
    assert_eq!(names(&found), ["weak_rotor"]);
    assert_eq!(found.effects[0].parameters["rotor"], rotor);

    // And against the good flights of the same machine.
    let own = vehicle("squirrel.toml");
    let good = Baseline::fit(&own, &flights(&own, 4..=5), &|_| ()).unwrap();
    let since = diagnose_since(&good, &flights(&weak, 1..=2), &[], &|_| ()).unwrap().verdict;
    assert_eq!(names(&since), ["weak_rotor"], "{}", since.words);
    assert_eq!(since.effects[0].parameters["rotor"], rotor);
}

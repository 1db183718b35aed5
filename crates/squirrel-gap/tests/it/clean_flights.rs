//! Flights without a mistake in their maps: nothing is set aside.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use crate::support::{csv_files, imported, nanobench, vehicle, vehicle_with};
use hidden_effects::case::{Case, Set};
use hidden_effects::catalogue::{CATALOGUE, CLASS_MASS_KG, HiddenEffect, Value};
use hidden_effects::draw::Draw;
use squirrel_gap::contradictions;
use squirrel_log::FlightLog;
use squirrel_sim::vehicle_file::VehicleFile;
use std::path::PathBuf;

/// A part of a flight.
fn window(log: &FlightLog, from_s: f64, until_s: f64) -> FlightLog {
    let mut cut = log.clone();
    for source in cut.sources.values_mut() {
        let first = source.time_s.partition_point(|t| *t < from_s);
        let last = source.time_s.partition_point(|t| *t < until_s);
        source.time_s = source.time_s[first..last].to_vec();
        for channel in source.channels.values_mut() {
            channel.values = channel.values[first * channel.width..last * channel.width].to_vec();
        }
    }
    cut
}

/// A flight whole and in windows.
fn parts(name: &str, log: &FlightLog, length_s: f64) -> Vec<(String, FlightLog)> {
    let time_s = &log.sources["imu"].time_s;
    let (start_s, end_s) = (time_s[0], time_s[time_s.len() - 1]);
    // Windows overlap by half.
    let windows = (2.0 * (end_s - start_s) / length_s) as usize;
    let cut = |i: usize| {
        let from_s = start_s + 0.5 * i as f64 * length_s;
        (format!("{name} {from_s:.0} s"), window(log, from_s, from_s + length_s))
    };
    let whole = (name.to_owned(), log.clone());
    std::iter::once(whole).chain((0..windows).map(cut)).collect()
}

/// What is said of each part by itself, and how many there are.
fn alarms(vehicle: &VehicleFile, parts: &[(String, FlightLog)]) -> (usize, Vec<String>) {
    let (mut count, mut said) = (0, Vec::new());
    for part in parts {
        match contradictions(vehicle, std::slice::from_ref(part)) {
            Ok(found) => {
                count += 1;
                said.extend(found.into_iter().map(|aside| aside.words));
            }
            Err(error) => println!("not readable: {error}"),
        }
    }
    (count, said)
}

/// Alarms over flights, whole and in windows, and how many these are.
fn of_files(vehicle: &VehicleFile, map: &str, files: Vec<PathBuf>) -> (usize, Vec<String>) {
    let (mut count, mut said) = (0, Vec::new());
    for file in files {
        let name = file.file_stem().unwrap().to_string_lossy().into_owned();
        let log = imported(map, &file);
        for (length_s, first) in [(10.0, 0), (20.0, 1)] {
            // The whole flight once.
            let (n, found) = alarms(vehicle, &parts(&name, &log, length_s)[first..]);
            count += n;
            said.extend(found);
        }
    }
    (count, said)
}

#[test]
fn measured_flights_and_windows_raise_no_alarm() {
    let files = nanobench();
    let flights = files.len();
    let (nanobench, mut said) =
        of_files(&vehicle("crazyflie21_brushed.toml"), "nanobench.toml", files);
    let (arpl, of_arpl) =
        of_files(&vehicle("crazyflie2_arpl.toml"), "arpl.toml", csv_files("arpl-motorlag"));
    said.extend(of_arpl);
    println!("{nanobench} and {arpl} flights and windows, {} alarms", said.len());
    assert!(said.is_empty(), "{said:#?}");
    // Each whole and in windows.
    assert!(nanobench >= 4 * flights && arpl >= 2, "{nanobench} and {arpl}");
}

/// A first guess of a vehicle file is wrong by a lot, and no flight is to blame.
#[test]
fn a_rough_vehicle_file_raises_no_alarm() {
    let thrust = "value = 1.5456e-8";
    for (thrust_of, inertia_of) in [(0.5, 1.0), (2.0, 1.0), (1.0, 2.5), (1.6, 0.4)] {
        let thrust_n_s2 = format!("value = {:e}", 1.5456e-8 * thrust_of);
        let inertia = [1.657e-5, 1.666e-5, 2.926e-5].map(|j| j * inertia_of);
        let rough = vehicle_with(
            "crazyflie21_brushed.toml",
            &[
                (thrust, &thrust_n_s2),
                ("value = [1.657e-5, 1.666e-5, 2.926e-5]", &format!("value = {inertia:?}")),
            ],
        );
        let (count, said) = of_files(&rough, "nanobench.toml", nanobench());
        println!(
            "thrust {thrust_of}, inertia {inertia_of}: {count} flights and windows, {} alarms",
            said.len()
        );
        assert!(said.is_empty(), "thrust {thrust_of}, inertia {inertia_of}: {said:#?}");
    }
}

/// What is said of the flights of a case.
fn of_case(case: &Case) -> Vec<String> {
    let vehicle = VehicleFile::parse(&case.nominal().to_toml(), "nominal").unwrap();
    // A few cannot be flown.
    let Ok(log) = case.flight(0) else { return Vec::new() };
    let hidden =
        format!("{:?} {:?} {:?}", case.answer.set, case.answer.effects, case.answer.outside);
    contradictions(&vehicle, &[("flight".to_owned(), log)])
        .unwrap()
        .into_iter()
        .map(|aside| format!("{hidden}: {}", aside.words))
        .collect()
}

/// The largest of many draws of an effect.
fn largest(entry: usize, case: &Case) -> HiddenEffect {
    let mut draw = Draw::new(11 + entry as u64);
    let size = |effect: &HiddenEffect| -> f64 {
        let numbers = effect.parameters.iter().filter(|(key, _)| *key != "rotor");
        numbers.map(|(_, value)| if let Value::Number(x) = value { x.abs() } else { 0.0 }).sum()
    };
    let heavy = case.nominal().mass_kg.max(CLASS_MASS_KG);
    let rotors = case.nominal().rotors.len();
    let drawn = (0..60).map(|_| CATALOGUE[entry].draw(&mut draw, "standard", heavy, rotors));
    drawn.max_by(|a, b| size(a).total_cmp(&size(b))).unwrap()
}

/// Effects at their largest sizes, flown by both generators.
#[test]
fn no_effect_is_a_problem_of_the_data() {
    let mut said = Vec::new();
    for entry in 0..CATALOGUE.len() {
        for seed in 0..2 {
            let case = Case::draw(Set::Single, entry + seed * CATALOGUE.len(), 20 + seed as u64);
            said.extend(of_case(&case.hiding(vec![largest(entry, &case)], None)));
        }
    }
    assert!(said.is_empty(), "{said:#?}");
}

#[test]
fn nothing_hidden_two_effects_noise_and_calm_air_raise_no_alarm() {
    let mut said = Vec::new();
    for (set, cases) in
        [(Set::None, 10), (Set::Two, 20), (Set::OtherForm, 12), (Set::NoiseX3, 12), (Set::Calm, 12)]
    {
        for index in 0..cases {
            said.extend(of_case(&Case::draw(set, index, 31)));
        }
    }
    assert!(said.is_empty(), "{said:#?}");
}

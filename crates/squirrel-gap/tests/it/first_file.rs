//! Measured flights of a Crazyflie with a first file from nothing but mass, frame and propeller.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use crate::support::{flights, imported};
use squirrel_gap::diagnose;
use squirrel_log::FlightLog;
use squirrel_sim::vehicle_file::new::{Frame, Given, Said};

const FLIGHTS: [&str; 4] =
    ["B2_circle_medium_rep1", "B3_figure8_fast_rep1", "B8_star_slow_rep1", "B9_trefoil_slow_rep1"];

/// Guesses that are off by tens of per cent, each said to be, do not keep a flight from showing the
/// sag.
#[test]
fn a_first_file_lacks_the_sag() {
    let said = |value: f64| Some(Said { value, source: "test".to_owned() });
    let vehicle = Given {
        name: "crazyflie".to_owned(),
        frame: Some(Frame::QuadXCrazyflie),
        mass_kg: said(0.027),
        propeller_inch: said(1.8),
        ..Given::default()
    }
    .vehicle_file()
    .unwrap();
    let folder = flights("nanobench");
    let read = |name: &str| -> (String, FlightLog) {
        (name.to_owned(), imported("nanobench.toml", &folder.join(format!("{name}.csv"))))
    };
    for flight in FLIGHTS {
        let unseen: Vec<_> =
            FLIGHTS.iter().filter(|name| **name != flight).map(|name| read(name)).collect();
        let verdict = diagnose(&vehicle, &[read(flight)], &unseen, &|_| {}).unwrap().verdict;
        println!("{flight}: {}", verdict.words);
        assert_eq!(verdict.effects.first().map(|e| e.name), Some("battery_sag"), "{flight}");
    }
}

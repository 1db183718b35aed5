//! Measured flights of a Crazyflie with a vehicle file from data sheets and one hover: what a user
//! has before the first fit.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use crate::support::{flights, imported, vehicle};
use squirrel_gap::{Verdict, diagnose};
use squirrel_log::FlightLog;
use squirrel_sim::vehicle_file::VehicleFile;

const FLIGHTS: [&str; 4] =
    ["B2_circle_medium_rep1", "B3_figure8_fast_rep1", "B8_star_slow_rep1", "B9_trefoil_slow_rep1"];

/// The verdict on some of the flights, the others held out.
fn verdict(vehicle: &VehicleFile, of: &[&str]) -> Verdict {
    let folder = flights("nanobench");
    let read = |name: &&str| -> (String, FlightLog) {
        ((*name).to_owned(), imported("nanobench.toml", &folder.join(format!("{name}.csv"))))
    };
    let (now, unseen): (Vec<&str>, Vec<&str>) = FLIGHTS.iter().partition(|name| of.contains(name));
    let [now, unseen] = [now, unseen].map(|names| names.iter().map(read).collect::<Vec<_>>());
    let verdict = diagnose(vehicle, &now, &unseen, &|_| {}).unwrap().verdict;
    println!("{of:?}: {}", verdict.words);
    verdict
}

fn names(verdict: &Verdict) -> Vec<&'static str> {
    verdict.effects.iter().map(|effect| effect.name).collect()
}

/// Numbers as far off as data sheets are do not keep each flight alone from showing the sag, and
/// nothing else.
#[test]
fn a_file_from_data_sheets_lacks_the_sag_alone() {
    let vehicle = vehicle("crazyflie21_datasheet.toml");
    for flight in FLIGHTS {
        assert_eq!(names(&verdict(&vehicle, &[flight])), ["battery_sag"], "{flight}");
    }
}

//! Flights without a mistake in their maps: nothing is set aside.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

mod support;

use squirrel_gap::check;
use squirrel_sim::log::FlightLog;
use squirrel_sim::vehicle_file::VehicleFile;
use support::{imported, shared, vehicle};

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
        match check(vehicle, std::slice::from_ref(part)) {
            Ok(found) => {
                count += 1;
                said.extend(found.into_iter().map(|aside| aside.words));
            }
            Err(error) => println!("not readable: {error}"),
        }
    }
    (count, said)
}

#[test]
fn measured_flights_and_windows_raise_no_alarm() {
    let (mut count, mut said) = (0, Vec::new());
    let mut of = |vehicle: &VehicleFile, map: &str, folder: &str, lengths_s: [f64; 2]| {
        let Some(folder) = shared(folder) else { return };
        let mut files: Vec<_> =
            std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
        files.retain(|path| path.extension().is_some_and(|e| e == "csv"));
        files.sort();
        for file in files {
            let name = file.file_stem().unwrap().to_string_lossy().into_owned();
            let log = imported(map, &file);
            for length_s in lengths_s {
                let (n, found) = alarms(vehicle, &parts(&name, &log, length_s));
                count += n;
                said.extend(found);
            }
        }
    };
    let crazyflie = vehicle("crazyflie21_brushed.toml");
    of(&crazyflie, "nanobench.toml", "flights/nanobench", [10.0, 20.0]);
    of(&crazyflie, "nanobench.toml", "flights/nanobench-more", [10.0, 20.0]);
    of(&vehicle("crazyflie2_arpl.toml"), "arpl.toml", "flights/arpl-motorlag", [10.0, 20.0]);
    println!("{count} flights and windows, {} alarms", said.len());
    assert!(said.is_empty(), "{} of {count}: {said:#?}", said.len());
}

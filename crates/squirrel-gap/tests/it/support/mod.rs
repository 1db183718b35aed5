//! Flights and vehicles for the tests of the gap workflow.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use std::path::{Path, PathBuf};

use squirrel_log::FlightLog;
use squirrel_log::import::{ImportMap, import};
use squirrel_sim::arm::Arm;
use squirrel_sim::flight::{Integrator, Setup};
use squirrel_sim::scenario::Scenario;
use squirrel_sim::vehicle_file::VehicleFile;

/// A set of measured flights: the cut-outs in `tests/data/flights`, or the whole flights in the
/// folder `SQUIRREL_FLIGHTS`.
pub(crate) fn flights(set: &str) -> PathBuf {
    let cut_outs = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/flights");
    std::env::var_os("SQUIRREL_FLIGHTS").map_or_else(cut_outs, PathBuf::from).join(set)
}

/// The measured flights of NanoBench. The whole flights are in two folders, the cut-outs in one.
pub(crate) fn nanobench() -> Vec<PathBuf> {
    let more = flights("nanobench-more").exists().then(|| csv_files("nanobench-more"));
    csv_files("nanobench").into_iter().chain(more.unwrap_or_default()).collect()
}

/// The CSV files of a set, sorted.
pub(crate) fn csv_files(set: &str) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(flights(set)).unwrap();
    let mut files: Vec<_> = entries.map(|entry| entry.unwrap().path()).collect();
    files.retain(|path| path.extension().is_some_and(|extension| extension == "csv"));
    files.sort();
    files
}

/// A file of the folder `vehicles`.
pub(crate) fn vehicles(file: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../vehicles").join(file)
}

pub(crate) fn vehicle(file: &str) -> VehicleFile {
    VehicleFile::load(&vehicles(file)).unwrap()
}

/// A shipped vehicle file with a part of its text replaced.
pub(crate) fn vehicle_with(file: &str, changes: &[(&str, &str)]) -> VehicleFile {
    let mut text = std::fs::read_to_string(vehicles(file)).unwrap();
    for (from, to) in changes {
        assert!(text.contains(from), "{file} has no `{from}`");
        text = text.replace(from, to);
    }
    VehicleFile::parse(&text, file).unwrap()
}

pub(crate) fn imported(map: &str, path: &Path) -> FlightLog {
    let map = ImportMap::load(&vehicles("maps").join(map)).unwrap();
    import(&map, &[path.to_owned()]).unwrap().0
}

/// The clock of a source jumps in the middle of the flight.
pub(crate) fn step(log: &mut FlightLog, source: &str, by_s: f64) {
    let time_s = &mut log.sources.get_mut(source).unwrap().time_s;
    let middle = time_s.len() / 2;
    time_s[middle..].iter_mut().for_each(|t| *t += by_s);
}

/// All channels of a source keep each of their values for so many samples.
pub(crate) fn hold(log: &mut FlightLog, source: &str, samples: usize) {
    for channel in log.sources.get_mut(source).unwrap().channels.values_mut() {
        let width = channel.width;
        let old = channel.values.clone();
        for (i, x) in channel.values.iter_mut().enumerate() {
            *x = old[i / width / samples * samples * width + i % width];
        }
    }
}

/// A flight of the scenario that shows every effect.
pub(crate) fn fly_rich(vehicle: &VehicleFile, seed: u64) -> (String, FlightLog) {
    fly("excite_rich", vehicle, seed)
}

/// A flight of a scenario.
pub(crate) fn fly(scenario: &str, vehicle: &VehicleFile, seed: u64) -> (String, FlightLog) {
    let mut scenario = Scenario::find(scenario).unwrap();
    scenario.seed = seed;
    let setup =
        Setup { vehicle: vehicle.clone(), arm: Arm::Pc, scenario, integrator: Integrator::Rk4 };
    (format!("flight {seed}"), setup.fly(true, |_| {}).unwrap().log.unwrap())
}

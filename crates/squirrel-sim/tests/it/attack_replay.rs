//! A log that is replayed while it is read, under mutation: what it finds is what the replay of the
//! whole log finds, or it leaves the log to that.
//!
//! A number that changed in a file does not get past its checksum (`squirrel-log` attacks that), so
//! that here logs are changed and written anew, as a program that means harm would.

use crate::attack::{ENDS, count_and_rng, folder, is_a_line, mutated};
use rand::RngExt;
use rand_pcg::Pcg64Mcg;
use squirrel_log::{FlightLog, LogReader};
use squirrel_sim::arm::Arm;
use squirrel_sim::flight::{Integrator, Setup};
use squirrel_sim::replay::{replay, replay_pieces, setup, setup_of};
use squirrel_sim::scenario::Scenario;
use squirrel_sim::vehicle_file::VehicleFile;

/// Several chunks: a log has one a second.
const FLIGHT_S: f64 = 2.3;

/// One of them; the last is none.
fn number_of(rng: &mut Pcg64Mcg) -> &'static str {
    ENDS[rng.random_range(0..ENDS.len() - 1)]
}

/// A number of a log becomes another, or a time, a channel, samples, a source, or what is said of
/// the flight.
fn change(log: &mut FlightLog, rng: &mut Pcg64Mcg) {
    if rng.random_range(0..8) == 0 {
        let key = ["vehicle_toml", "scenario_toml", "arm", "estimator"][rng.random_range(0..4)];
        if let Some(text) = log.metadata.get_mut(key) {
            let is_name = !text.contains('\n');
            *text = if is_name { number_of(rng).to_owned() } else { mutated(text, rng) };
        }
        return;
    }
    let names: Vec<String> = log.sources.keys().cloned().collect();
    if names.is_empty() {
        return;
    }
    let name = &names[rng.random_range(0..names.len())];
    let Some(source) = log.sources.get_mut(name) else { return };
    let number: f64 = number_of(rng).parse().unwrap();
    let samples = source.time_s.len();
    let place = rng.random_range(0..samples);
    let channels: Vec<String> = source.channels.keys().cloned().collect();
    match rng.random_range(0..7) {
        0 => source.time_s[place] = number,
        // All later ones, too: time still runs forward.
        1 => source.time_s[place..].iter_mut().for_each(|t| *t += number.abs().min(1e9)),
        2 => source.time_s[place] += 1e-4,
        3 => drop(source.take(place)),
        4 => drop(log.sources.remove(name)),
        _ if channels.is_empty() => {}
        5 => drop(source.channels.remove(&channels[rng.random_range(0..channels.len())])),
        _ => {
            let name = &channels[rng.random_range(0..channels.len())];
            let values = &mut source.channels.get_mut(name).unwrap().values;
            let place = rng.random_range(0..values.len());
            values[place] = number;
        }
    }
}

#[test]
fn no_changed_log_ends_its_replay_in_pieces() {
    let (count, mut rng) = count_and_rng();
    let scenario = Scenario { duration_s: FLIGHT_S, ..Scenario::find("avoid").unwrap() };
    let vehicle = VehicleFile::squirrel();
    let flown = Setup { vehicle, arm: Arm::TwccFlat, scenario, integrator: Integrator::Rk4 };
    let good = flown.fly(true, |_| {}).unwrap().log.unwrap();
    let path = folder().join("replayed.mcap");
    let (mut in_pieces, mut whole) = (0, 0);
    for _ in 0..count {
        let mut log = good.clone();
        for _ in 0..rng.random_range(1..4) {
            change(&mut log, &mut rng);
        }
        if let Err(error) = log.write(&path) {
            is_a_line(&error.to_string());
            continue;
        }
        let mut reader = LogReader::open(&path).unwrap().unwrap();
        let found = match setup_of(reader.metadata()) {
            Err(error) => Err(error),
            Ok(setup) => replay_pieces(&mut reader, &setup),
        };
        let of_whole = setup(&log).and_then(|setup| replay(&log, &setup));
        match (found, of_whole) {
            (Ok(Some(found)), of_whole) => {
                in_pieces += 1;
                // As text: a number that is none is not itself.
                assert_eq!(format!("{:?}", Ok::<_, String>(found)), format!("{of_whole:?}"));
            }
            (Ok(None), Ok(_)) => whole += 1,
            (Ok(None), Err(error)) => is_a_line(&error),
            (Err(error), of_whole) => {
                is_a_line(&error);
                assert_eq!(of_whole.map(|_| ()), Err(error));
            }
        }
    }
    assert!(in_pieces > count / 10, "{in_pieces} of {count} in pieces, {whole} whole");
}

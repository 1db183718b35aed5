//! What the flights of a case are like: fast enough, high and low charge, files where they belong.

use hidden_effects::case::{Answer, Case, FLIGHTS, Set};
use squirrel_log::FlightLog;
use squirrel_sim::vehicle_file::VehicleFile;
use std::path::{Path, PathBuf};

fn column(log: &FlightLog, name: &str, i: usize) -> Vec<f64> {
    let (time_s, channel) = log.channel(name).unwrap();
    (0..time_s.len()).map(|k| channel.row(k)[i]).collect()
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |most, x| x.abs().max(most))
}

/// Speeds over ground at the edges of the wing command, m/s.
fn edge_speeds(log: &FlightLog) -> Vec<f64> {
    let (north, east) =
        (column(log, "gnss.velocity_ned_m_s", 0), column(log, "gnss.velocity_ned_m_s", 1));
    let wing = column(log, "wing.command", 0);
    let edges = (1..wing.len()).filter(|&k| wing[k] != wing[k - 1]);
    // Receiver samples come every 30 inertial ones, the first after 30.
    edges.map(|k| (k / 30).saturating_sub(1)).map(|k| north[k].hypot(east[k])).collect()
}

#[test]
fn rich_flights_go_fast_climb_and_open_the_wings_at_speed() {
    for index in 0..6 {
        let case = Case::draw(Set::None, 2 * index, 3);
        let flights: Vec<_> = (0..3).map(|number| case.flight(number).unwrap()).collect();
        for log in &flights {
            let (north, east) =
                (column(log, "gnss.velocity_ned_m_s", 0), column(log, "gnss.velocity_ned_m_s", 1));
            let speed: Vec<f64> = north.iter().zip(&east).map(|(n, e)| n.hypot(*e)).collect();
            let climb = column(log, "gnss.velocity_ned_m_s", 2);
            assert!((8.3..11.5).contains(&largest(&speed)), "{index}: {} m/s", largest(&speed));
            assert!(
                (2.6..4.4).contains(&largest(&climb)),
                "{index}: {} m/s up or down",
                largest(&climb)
            );
            let edges = edge_speeds(log);
            let fast = edges.iter().filter(|&&speed| speed > 4.5).count();
            assert!(edges.len() == 6 && fast >= 5, "{index}: wings move at {edges:.1?} m/s");
            let lowest = column(log, "baro.altitude_m", 0).into_iter().fold(f64::MAX, f64::min);
            assert!((-1.0..0.5).contains(&lowest), "{index}: {lowest} m");
        }
        let [high, low] = [0, 1].map(|k: usize| column(&flights[k], "battery.voltage_v", 0)[10]);
        assert!(high - low > 0.4, "{index}: {high} and {low} V");
    }
}

#[test]
fn calm_flights_stay_slow_and_folded() {
    for index in 0..6 {
        let log = Case::draw(Set::Calm, 2 * index, 3).flight(0).unwrap();
        let speeds = [0, 1].map(|axis| largest(&column(&log, "gnss.velocity_ned_m_s", axis)));
        // Noise of the receiver and its largest of 400 samples on top of 2 m/s.
        assert!(
            speeds[0].hypot(speeds[1]) < 2.9 && edge_speeds(&log).is_empty(),
            "{index}: {speeds:?}"
        );
    }
}

#[test]
fn a_case_is_a_folder_and_its_answer_is_elsewhere() {
    let folder = std::env::temp_dir().join(format!("hidden-effects-{}", std::process::id()));
    let case = Case::draw(Set::Two, 4, 9);
    let made = case.make(&folder).unwrap();
    let vehicle = VehicleFile::load(&made.join("vehicle.toml")).unwrap();
    for (number, name) in case.flight_names().iter().enumerate() {
        let log = FlightLog::read(&made.join(name)).unwrap();
        assert_eq!(log, case.flight(number).unwrap());
        assert!(
            log.metadata.is_empty(),
            "what a log says of its making could give the answer away"
        );
    }
    let answer = folder.join("answers").join(format!("{}.json", case.answer.case));
    let answer: Answer = serde_json::from_slice(&std::fs::read(answer).unwrap()).unwrap();
    assert_eq!(answer, case.answer);
    for effect in &answer.effects {
        assert!(!vehicle.text.contains(&effect.name));
    }
    // Made again, the same bytes.
    let before = std::fs::read(made.join(FLIGHTS[0])).unwrap();
    case.make(&folder).unwrap();
    assert!(before == std::fs::read(made.join(FLIGHTS[0])).unwrap());
    std::fs::remove_dir_all(&folder).unwrap();
}

/// Every file of a folder with its bytes, by path inside it.
fn files(folder: &Path, inside: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut entries: Vec<_> = std::fs::read_dir(folder.join(inside))
        .unwrap()
        .map(|entry| entry.unwrap().file_name())
        .collect();
    entries.sort();
    let mut all = Vec::new();
    for name in entries {
        let path = inside.join(name);
        match folder.join(&path) {
            whole if whole.is_dir() => all.extend(files(folder, &path)),
            whole => all.push((path, std::fs::read(whole).unwrap())),
        }
    }
    all
}

#[test]
fn the_same_seed_makes_the_same_bytes_in_every_new_set() {
    let folder =
        |which: &str| std::env::temp_dir().join(format!("hidden-{which}-{}", std::process::id()));
    let [first, second] = ["first", "second"].map(folder);
    for set in [
        Set::Estimates,
        Set::Sensors,
        Set::Capture,
        Set::Overstated,
        Set::Misfit,
        Set::Baseline,
        Set::Outside,
        Set::Inertial,
    ] {
        for folder in [&first, &second] {
            let (case, made) = Case::draw_and_make(set, 1, 7, folder).unwrap();
            assert_eq!(made.join("baseline").is_dir(), set == Set::Baseline);
            assert_eq!(
                folder.join(format!("answers/{}.toml", case.answer.case)).exists(),
                set == Set::Misfit
            );
            for name in case.flight_names() {
                let log = FlightLog::read(&made.join(name)).unwrap();
                assert!(log.metadata.is_empty() && !log.sources.contains_key("truth"), "{set:?}");
            }
        }
        let [one, other] = [&first, &second].map(|folder| files(folder, Path::new("")));
        assert!(one.len() > 4 && one == other, "{set:?}");
        for folder in [&first, &second] {
            std::fs::remove_dir_all(folder).unwrap();
        }
    }
}

//! Hours of logs take minutes: names come from parts of them.
#![allow(clippy::unwrap_used, reason = "tests")]

use squirrel_gap::{Kind, diagnose};
use squirrel_sim::arm::Arm;
use squirrel_sim::flight::{Integrator, Setup};
use squirrel_sim::scenario::{MissionTable, Scenario};
use squirrel_sim::vehicle_file::VehicleFile;

/// Ten minutes of circling: the drag is found, and the verdict says that it has not looked at
/// everything.
#[test]
fn a_long_flight_is_looked_at_in_parts() {
    let plain = VehicleFile::squirrel();
    let text = format!("{}\n[effects.linear_drag]\nextra_drag_n_s_per_m = 0.12\n", plain.text);
    let flown = VehicleFile::parse(&text, "flown").unwrap();
    let mission = MissionTable::Circle { radius_m: 6.0, speed_m_s: 4.0 };
    let scenario = Scenario { duration_s: 300.0, mission, ..Scenario::find("track").unwrap() };
    let fly = |seed: u64| {
        let scenario = Scenario { seed, ..scenario.clone() };
        let setup =
            Setup { vehicle: flown.clone(), arm: Arm::Pc, scenario, integrator: Integrator::Rk4 };
        (format!("flight {seed}"), setup.fly(true, |_| {}).unwrap().log.unwrap())
    };
    let verdict = diagnose(&plain, &[fly(1), fly(2)], &[], &|_| {}).unwrap().verdict;
    assert_eq!(verdict.verdict, Kind::Named, "{}", verdict.words);
    assert_eq!(verdict.effects[0].name, "linear_drag");
    assert!(
        verdict.notes.iter().any(|note| note.contains("of 600 s of flight")),
        "{:?}",
        verdict.notes
    );
}

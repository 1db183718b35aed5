//! Flights in which one thing fails, and studies that are stopped.

use squirrel_sim::arm::Arm;
use squirrel_sim::vehicle_file::VehicleFile;
use squirrel_study::campaign::Plan;
use squirrel_study::faults::{Faults, run};
use squirrel_study::journal::Keep;
use std::path::Path;

fn study(trials: u32, folder: Option<&Path>) -> Faults {
    study_of(1, trials, folder)
}

fn study_of(together: u32, trials: u32, folder: Option<&Path>) -> Faults {
    let plan = Plan::calm(VehicleFile::squirrel(), vec![Arm::TwccPlus], trials, 3);
    run(&plan, together, &Keep { folder, ..Keep::default() }).unwrap().unwrap()
}

#[test]
fn survivable_faults_are_survived_and_what_is_lost_is_flagged() {
    let study = study(1000, None);
    assert!(study.survived_share >= 0.99, "{:#?}", study.rows);
    assert_eq!(study.rows.len(), 10);
    for row in &study.rows {
        assert!(row.not_finite == 0 && row.lost_unflagged == 0, "{row:?}");
        // A hundred flights of each; about half of the weak rotors have too little thrust to spare.
        assert!(row.flights == 100 && row.survivable >= 35, "{row:?}");
    }
    let flagged = |fault: &str| study.rows.iter().find(|row| row.fault == fault).unwrap().flagged;
    for fault in ["imu_spike", "imu_stuck", "imu_nan", "imu_dead", "motor_weak"] {
        assert!(flagged(fault) >= 95, "{fault}: {}", flagged(fault));
    }
    for (k, flight) in study.flights.iter().enumerate() {
        let names = |flag: &str| flight.flags.iter().any(|f| f == flag);
        // A unit that is gone is named by its number.
        if flight.fault.name() == "imu_dead" {
            let which = flight.faults[&flight.fault].which.unwrap();
            assert!(names(&format!("imu_{which}_out")), "{k}: {flight:?}");
        }
        if flight.fault.name() == "gnss_lost" && flight.faults[&flight.fault].duration_s.is_none() {
            assert!(names("gnss_lost") && names("position_lost"), "{k}: {flight:?}");
        }
    }
}

#[test]
fn two_faults_at_once_are_survived_nineteen_times_of_twenty() {
    let study = study_of(2, 500, None);
    assert!(study.survived_share >= 0.95, "{:#?}", study.rows);
    assert!(study.flights.iter().all(|flight| flight.faults.len() == 2));
    for row in &study.rows {
        assert!(row.not_finite == 0 && row.lost_unflagged == 0, "{row:?}");
    }
    let sum = |of: fn(&squirrel_study::faults::Row) -> u32| study.rows.iter().map(of).sum::<u32>();
    let (costly, flagged) = (sum(|row| row.costly), sum(|row| row.costly_flagged));
    assert!(5 * flagged >= 4 * costly, "{flagged} of {costly} costly wings are flagged");
    let plan = Plan::calm(VehicleFile::squirrel(), vec![Arm::TwccPlus], 4, 3);
    let error = run(&plan, 3, &Keep::default()).unwrap_err().to_string();
    assert_eq!(error, "--faults 3: must be 1 or 2");
}

#[test]
fn a_study_that_was_stopped_goes_on_to_the_same_bytes() {
    let folder = std::env::temp_dir().join(format!("squirrel-faults-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let json = |study: &Faults| serde_json::to_string(study).unwrap();
    let whole = json(&study(24, None));
    assert_eq!(json(&study(24, Some(&folder))), whole);
    let file = folder.join("faults.trials.jsonl");
    let text = std::fs::read_to_string(&file).unwrap();
    assert_eq!(text.lines().count(), 25);
    // Stopped in the middle of a line.
    std::fs::write(&file, &text[..text.len() / 2]).unwrap();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    assert_eq!(json(&pool.install(|| study(24, Some(&folder)))), whole);
    assert_eq!(std::fs::read_to_string(&file).unwrap().lines().count(), 25);
    // What was kept is not flown again, and a line that somebody changed is not believed.
    let kept = std::fs::read_to_string(&file).unwrap();
    assert_eq!(json(&study(24, Some(&folder))), whole);
    assert_eq!(std::fs::read_to_string(&file).unwrap(), kept);
    let there = Keep { folder: Some(&folder), ..Keep::default() };
    std::fs::write(&file, kept.replace("\"survived\":true", "\"survived\":false")).unwrap();
    let same = Plan::calm(VehicleFile::squirrel(), vec![Arm::TwccPlus], 24, 3);
    let error = run(&same, 1, &there).unwrap_err().to_string();
    assert!(
        error.contains("faults.trials.jsonl: line ") && error.contains("has changed"),
        "{error}"
    );
    std::fs::write(&file, kept).unwrap();
    let other = Plan::calm(VehicleFile::squirrel(), vec![Arm::TwccPlus], 24, 4);
    let error = run(&other, 1, &there).unwrap_err().to_string();
    assert!(error.contains("faults.trials.jsonl: is of another plan"), "{error}");
    std::fs::write(&file, "not a journal\n").unwrap();
    assert!(run(&other, 1, &there).unwrap_err().to_string().contains("faults.trials.jsonl"));
    std::fs::remove_dir_all(&folder).unwrap();
}

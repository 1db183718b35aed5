//! Flights in which one thing fails, and studies that are stopped.

use crate::recorded::{self, number};
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

/// Of a thousand flights, by fault.
#[test]
fn survivable_faults_are_survived_and_what_is_lost_is_flagged() {
    let share = number("faults", "survived_share");
    assert!(share >= 0.99, "{share}");
    let rows = recorded::at("faults", "rows").as_array().unwrap();
    assert_eq!(rows.len(), 10);
    for row in rows {
        assert!(row["not_finite"] == 0 && row["lost_unflagged"] == 0, "{row}");
        // A hundred flights of each; about half of the weak rotors have too little thrust to spare.
        assert!(row["flights"] == 100 && row["survivable"].as_u64().unwrap() >= 35, "{row}");
    }
    for fault in ["imu_spike", "imu_stuck", "imu_nan", "imu_dead", "motor_weak"] {
        let flagged = number("faults", &format!("rows[fault={fault}]/flagged"));
        assert!(flagged >= 95.0, "{fault}: {flagged}");
    }
}

/// Of five hundred flights.
#[test]
fn two_faults_at_once_are_survived_nineteen_times_of_twenty() {
    let share = number("faults_together", "survived_share");
    assert!(share >= 0.95, "{share}");
    let rows = recorded::at("faults_together", "rows").as_array().unwrap();
    for row in rows {
        assert!(row["not_finite"] == 0 && row["lost_unflagged"] == 0, "{row}");
    }
    let sum = |of: &str| rows.iter().map(|row| row[of].as_u64().unwrap()).sum::<u64>();
    assert_eq!(sum("flights"), 500);
    let (costly, flagged) = (sum("costly"), sum("costly_flagged"));
    assert!(5 * flagged >= 4 * costly, "{flagged} of {costly} costly wings are flagged");
}

/// Other flights than those of the record: each fault ten times.
#[test]
fn what_fails_is_named() {
    let study = study(100, None);
    assert!(study.rows.iter().all(|row| row.flights == 10 && row.lost_unflagged == 0));
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
    let two = study_of(2, 20, None);
    assert!(two.flights.iter().all(|flight| flight.faults.len() == 2));
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

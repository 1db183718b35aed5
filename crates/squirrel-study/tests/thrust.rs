//! What the thrust study shows, on the trials that the README states.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use squirrel_sim::arm::Arm;
use squirrel_sim::vehicle_file::VehicleFile;
use squirrel_study::thrust::{Plan, Thrust, run};

fn study(trials: u32) -> Thrust {
    let arms = vec![Arm::Pc, Arm::TwccFlat, Arm::Phantom];
    run(&Plan { vehicle: VehicleFile::squirrel(), arms, trials, seed: 1 }, || ()).unwrap()
}

/// Wings help where thrust is scarce, and it is the wings that help: the same controller without them gains nothing there.
#[test]
fn wings_help_where_thrust_is_scarce() {
    let study = study(12);
    let row = |arm: &str, ratio: f64| {
        study.rows.iter().find(|r| r.arm == arm && (r.thrust_to_weight - ratio).abs() < 1e-9).unwrap()
    };
    assert!(row("twcc_flat", 1.2).gain.low > 0.10, "{:?}", row("twcc_flat", 1.2).gain);
    assert!(row("twcc_flat", 2.0).gain.high < 0.08, "{:?}", row("twcc_flat", 2.0).gain);
    assert!(row("phantom", 1.2).gain.value <= 0.0, "{:?}", row("phantom", 1.2).gain);
    assert!(row("pc", 1.2).height_lost_m > 1.5 * row("twcc_flat", 1.2).height_lost_m);
    assert_eq!(row("pc", 1.2).gain.value, 0.0);
}

#[test]
fn one_thread_and_two_give_the_same_numbers() {
    let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    assert_eq!(pool(1).install(|| study(2)), pool(2).install(|| study(2)));
}

#[test]
fn no_trials_is_an_error() {
    let plan = Plan { vehicle: VehicleFile::squirrel(), arms: vec![Arm::Pc], trials: 0, seed: 1 };
    assert!(run(&plan, || ()).unwrap_err().to_string().starts_with("trials = 0"));
}

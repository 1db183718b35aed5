//! A vehicle file that is nothing like what flew: the search looks at no vehicle that cannot be,
//! and gives an answer.
#![allow(clippy::unwrap_used, reason = "tests")]

use crate::support::vehicle_with;
use squirrel_gap::{Kind, diagnose};
use squirrel_sim::arm::Arm;
use squirrel_sim::flight::{Integrator, Setup};
use squirrel_sim::scenario::Scenario;
use squirrel_sim::vehicle_file::VehicleFile;

/// Ten times the inertia, and no better known: what is linear at it asks for one below zero.
#[test]
fn numbers_far_off_end_in_an_answer_and_not_in_an_error() {
    let scenario = Scenario::find("track").unwrap();
    let setup = Setup {
        vehicle: VehicleFile::squirrel(),
        arm: Arm::Pc,
        scenario,
        integrator: Integrator::Rk4,
    };
    let log = setup.fly(true, |_| {}).unwrap().log.unwrap();
    let mut light = log.clone();
    for f in
        &mut light.source_mut("imu").channels.get_mut("specific_force_body_m_s2").unwrap().values
    {
        *f *= 0.7;
    }
    let inertia = (
        "value = [3.22e-3, 4.68e-3, 7.72e-3], sd = [3e-5, 5e-5, 8e-5]",
        "value = [32.2e-3, 46.8e-3, 77.2e-3], sd = [3e-2, 5e-2, 8e-2]",
    );
    let file = vehicle_with("squirrel.toml", &[inertia]);
    for log in [log, light] {
        let verdict = diagnose(&file, &[("flight".to_owned(), log)], &[], &|_| {}).unwrap().verdict;
        assert_ne!(verdict.verdict, Kind::None, "{}", verdict.words);
    }
}

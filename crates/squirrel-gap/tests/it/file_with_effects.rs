//! A vehicle file may carry effects already; the workflow looks for what is missing beside them.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use squirrel_gap::{Kind, diagnose};
use squirrel_sim::arm::Arm;
use squirrel_sim::flight::{Integrator, Setup};
use squirrel_sim::scenario::Scenario;
use squirrel_sim::vehicle_file::VehicleFile;

/// A mass that is a tenth too small, and an effect that makes up for it, are the mass: the answer is the same to the numbers.
#[test]
fn an_effect_of_the_file_acts_once() {
    let plain = VehicleFile::squirrel();
    let text = plain.text.clone();
    let parse = |text: &str| VehicleFile::parse(text, "vehicle").unwrap();
    let flown = parse(&format!("{text}\n[effects.yaw_torque_coeff]\ntorque_fraction = 0.3\n"));
    let fly = |seed: u64| {
        let mut scenario = Scenario::find("excite_rich").unwrap();
        scenario.seed = seed;
        let setup = Setup { vehicle: flown.clone(), arm: Arm::Pc, scenario, integrator: Integrator::Rk4 };
        (format!("flight {seed}"), setup.fly(true, |_| {}).unwrap().log.unwrap())
    };
    let flights = [fly(1), fly(2)];

    let mass_kg = plain.vehicle.parameters().mass_kg;
    let light = text.replacen(&format!("value = {mass_kg}"), &format!("value = {}", mass_kg / 1.1), 1);
    assert_ne!(light, text, "the mass stands in the file");
    let light = parse(&format!("{light}\n[effects.mass_error]\nmass_fraction = 0.1\n"));

    let [plain, light] =
        [&plain, &light].map(|vehicle| diagnose(vehicle, &flights, &[], &|_| {}).unwrap().verdict);
    for verdict in [&plain, &light] {
        assert_eq!(verdict.verdict, Kind::Named, "{}", verdict.words);
        assert_eq!(verdict.effects[0].name, "yaw_torque_coeff");
    }
    let nats = [&plain, &light].map(|verdict| verdict.effects[0].evidence_nats);
    println!("{nats:?}");
    assert!((nats[0] - nats[1]).abs() < 0.02 * nats[0], "{nats:?}");
}

//! A vehicle file may carry effects already; the workflow looks for what is missing beside them.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use crate::support::{fly_rich, vehicle_with};
use squirrel_gap::{Kind, diagnose, find};
use squirrel_sim::arm::Arm;
use squirrel_sim::flight::{Integrator, Setup};
use squirrel_sim::scenario::Scenario;
use squirrel_sim::vehicle_file::VehicleFile;

/// A mass that is a tenth too small, and an effect that makes up for it, are the mass: the answer
/// is the same to the numbers.
#[test]
fn an_effect_of_the_file_acts_once() {
    let plain = VehicleFile::squirrel();
    let text = plain.text.clone();
    let parse = |text: &str| VehicleFile::parse(text, "vehicle").unwrap();
    let flown = parse(&format!("{text}\n[effects.yaw_torque_coeff]\ntorque_fraction = 0.3\n"));
    let fly = |seed: u64| {
        let mut scenario = Scenario::find("excite_rich").unwrap();
        scenario.seed = seed;
        let setup =
            Setup { vehicle: flown.clone(), arm: Arm::Pc, scenario, integrator: Integrator::Rk4 };
        (format!("flight {seed}"), setup.fly(true, |_| {}).unwrap().log.unwrap())
    };
    let flights = [fly(1), fly(2)];

    let mass_kg = plain.vehicle.parameters().mass_kg;
    let light =
        text.replacen(&format!("value = {mass_kg}"), &format!("value = {}", mass_kg / 1.1), 1);
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

/// What the file says of sensors, clocks and links is taken off before force and moment are
/// compared: a patched file leaves what a file leaves of which nothing is missing.
#[test]
fn find_knows_sensors_and_clocks_of_the_file() {
    let file = VehicleFile::squirrel();
    let with = |effect: &str| {
        vehicle_with("squirrel.toml", &[("[limits]", &format!("{effect}\n\n[limits]"))])
    };
    let left = |vehicle: &VehicleFile, flown: &VehicleFile| {
        let residual = find(vehicle, &[fly_rich(flown, 1)]).unwrap().residual;
        let norm = |x: [f64; 3]| x.iter().map(|x| x * x).sum::<f64>().sqrt();
        [norm(residual.force_body_rms_n), norm(residual.moment_body_rms_n_m)]
    };
    let usual = left(&file, &file);
    // So small that the vehicle flies on as it did. Which of force and moment it acts on, and how
    // many times what is usual it leaves of them at least.
    for (effect, channel, times) in [
        ("[effects.actuation_latency]\nlatency_s = 0.012", 1, 2.0),
        ("[effects.clock_skew]\nskew_ppm = 600.0", 1, 2.0),
        ("[effects.accel_bias]\nbias_x_m_s2 = 0.3\nbias_y_m_s2 = 0.0\nbias_z_m_s2 = -0.4", 0, 2.0),
        (
            "[effects.accel_scale]\nscale_x_fraction = 0.0\nscale_y_fraction = 0.0\nscale_z_fraction = 0.03",
            0,
            2.0,
        ),
        ("[effects.gnss_latency]\nlatency_s = 0.04", 0, 1.02),
    ] {
        let flown = with(effect);
        let (known, unknown) = (left(&flown, &flown)[channel], left(&file, &flown)[channel]);
        println!(
            "{effect}: {known:.2e} known, {unknown:.2e} unknown, {:.2e} usual",
            usual[channel]
        );
        assert!(unknown > times * usual[channel], "{effect}");
        assert!(known < 2.0 * usual[channel] && known < 0.9 * unknown, "{effect}");
    }
}

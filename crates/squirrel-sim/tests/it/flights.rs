//! Flights in closed loop: what plant, sensors and flight code do together.

use squirrel_sim::arm::Arm;
use squirrel_sim::flight::{Integrator, Metrics, Setup};
use squirrel_sim::scenario::Scenario;
use squirrel_sim::vehicle_file::VehicleFile;

fn setup(arm: Arm, scenario: &str) -> Setup {
    let scenario = Scenario::find(scenario).unwrap();
    Setup { vehicle: VehicleFile::squirrel(), arm, scenario, integrator: Integrator::Rk4 }
}

fn fly(setup: &Setup) -> Metrics {
    setup.fly(false, |_| {}).unwrap().metrics
}

#[test]
fn hover_stays_within_the_sensors_noise() {
    let metrics = fly(&setup(Arm::Pc, "hover"));
    assert!(metrics.rmse_m < 0.15, "{metrics:?}");
}

#[test]
fn the_shipped_practice_and_crazyflie_vehicles_are_sound_and_every_number_has_a_source() {
    for name in
        ["squirrel", "squirrel_air", "crazyflie21_brushed", "crazyflie21_datasheet", "practice"]
    {
        let path = format!("{}/../../vehicles/{name}.toml", env!("CARGO_MANIFEST_DIR"));
        let file = VehicleFile::load(path.as_ref()).unwrap();
        // Counts and signs are not measured: they are how the vehicle is built.
        let bare: Vec<&str> = file
            .without_source()
            .filter(|f| !f.ends_with("yaw_sign") && *f != "battery.cells")
            .collect();
        assert!(bare.is_empty(), "{name}: without a source: {bare:?}");
    }
}

/// Both files are whole, and only what rotors do in the air is said twice.
#[test]
fn the_squirrel_in_air_is_the_squirrel_but_for_its_rotors() {
    let of_rotors = [
        "name =",
        "linear_n_s_per_m =",
        "axial_inflow_s_per_m =",
        "translational_lift_s2_per_m2 =",
        "flapping_moment_n_m_s_per_m =",
        "vortex_ring_fraction =",
        "#",
    ];
    let rest = |file: VehicleFile| -> Vec<String> {
        let lines = file.text.lines().filter(|line| !of_rotors.iter().any(|o| line.starts_with(o)));
        lines.map(str::to_owned).collect()
    };
    assert_eq!(rest(VehicleFile::squirrel_in_air()), rest(VehicleFile::squirrel()));
}

#[test]
fn one_seed_one_flight() {
    let one = |seed| {
        let mut setup = setup(Arm::TwccFlat, "avoid");
        setup.scenario.seed = seed;
        setup.scenario.wind.gust_sigma_m_s = 0.5;
        setup.fly(true, |_| {}).unwrap().log.unwrap()
    };
    assert!(one(4) == one(4), "two flights of one seed differ");
    assert!(one(4) != one(5));
}

/// As in the paper's real flights: the wingless drone sinks when thrust is scarce, and not
/// otherwise. Rotors with inflow and drag leave the paper's law less to gain.
#[test]
fn the_wingless_drone_sinks_only_when_thrust_is_scarce() {
    let lost = |vehicle: VehicleFile, arm, ratio| {
        let mut setup = Setup { vehicle, ..setup(arm, "avoid") };
        setup.scenario.thrust_to_weight = Some(ratio);
        fly(&setup).height_lost_m
    };
    let shipped = VehicleFile::squirrel;
    assert!(lost(shipped(), Arm::Pc, 1.2) > 2.0);
    assert!(lost(shipped(), Arm::Pc, 2.0) < 0.5);
    assert!(lost(shipped(), Arm::TwccFlat, 1.2) < 0.6 * lost(shipped(), Arm::Pc, 1.2));
    let saved = |vehicle: fn() -> VehicleFile| {
        lost(vehicle(), Arm::Pc, 1.2) - lost(vehicle(), Arm::TwccFlat, 1.2)
    };
    let (kind, measured) = (saved(shipped), saved(VehicleFile::squirrel_in_air));
    assert!(measured < 0.7 * kind, "{measured} m with rotors as measured, {kind} m without");
}

#[test]
fn arms_do_what_they_are_named_for() {
    let of = |arm| fly(&setup(arm, "avoid"));
    assert_eq!(of(Arm::Pc).wings_open_s, 0.0);
    assert!(of(Arm::PcWingsOpen).wings_open_s > 5.0);
    let no_wings = of(Arm::WiicNoWings);
    assert!(no_wings.wiic_s > 0.5 && no_wings.wings_open_s == 0.0);
    let phantom = of(Arm::Phantom);
    assert!(
        phantom.wiic_s > 0.2 && phantom.wings_open_s == 0.0,
        "it believes in wings that are not there"
    );
    assert!(of(Arm::TwccOracle).wings_open_s > 0.2);
}

/// The paper's battery hypothesis, as physics: with `battery_sag` the rotors feel the voltage,
/// without it they do not.
#[test]
fn thrust_feels_the_battery_only_through_its_effect() {
    let text = format!(
        "{}\n[effects.battery_sag]\nvoltage_exponent = 0.9\n",
        squirrel_sim::vehicle_file::SQUIRREL_TOML
    );
    let rotor_command = |text: &str, charge: f64| {
        let mut setup = setup(Arm::Pc, "hover");
        setup.vehicle = VehicleFile::parse(text, "test").unwrap();
        setup.scenario.battery_charge = charge;
        let log = setup.fly(true, |_| {}).unwrap().log.unwrap();
        let (_, command) = log.channel("rotor.command").unwrap();
        command.values[command.values.len() / 2..].iter().sum::<f64>()
            / (command.values.len() / 2) as f64
    };
    let plain = squirrel_sim::vehicle_file::SQUIRREL_TOML;
    assert!((rotor_command(plain, 1.0) - rotor_command(plain, 0.2)).abs() < 2e-3);
    assert!(
        rotor_command(&text, 0.2) > rotor_command(&text, 1.0) + 0.02,
        "an emptier battery needs more command"
    );
}

#[cfg(feature = "rapier")]
mod with_a_world {
    use super::*;

    /// rapier's step is of first order; through the whole manoeuvre the error stays within 2 %.
    #[test]
    fn rapier_and_rk4_fly_the_manoeuvre_alike() {
        for arm in [Arm::Pc, Arm::TwccFlat] {
            let rk4 = setup(arm, "avoid");
            let rapier = Setup { integrator: Integrator::Rapier, ..rk4.clone() };
            let (a, b) = (fly(&rk4).rmse_m, fly(&rapier).rmse_m);
            assert!((b / a - 1.0).abs() < 0.02, "{arm:?}: {a} m by RK4, {b} m by rapier");
        }
    }

    #[test]
    fn solid_obstacles_are_hit_and_virtual_ones_are_not() {
        let virtual_ = setup(Arm::Pc, "avoid");
        let mut solid = virtual_.clone();
        solid.scenario.solid_obstacles = true;
        assert!(fly(&virtual_).contact_s.is_none());
        let hit = fly(&solid);
        assert!(hit.contact_s.is_some() && hit.clearance_m.unwrap() > -0.1, "{hit:?}");
    }

    #[test]
    fn a_vehicle_without_enough_thrust_meets_the_ground_and_stays_finite() {
        let mut low = setup(Arm::Pc, "hover");
        low.scenario.height_m = 1.0;
        low.scenario.wind.mean_ned_m_s = [0.0, 0.0, 14.0];
        low.scenario.thrust_to_weight = Some(1.01);
        let metrics = fly(&low);
        assert!(metrics.contact_s.is_some(), "{metrics:?}");
        assert!(metrics.height_lost_m < 1.1, "it does not go below the ground: {metrics:?}");
    }
}

//! Flights of the simulator, where the truth is known: against its own vehicle nothing but noise is
//! left, against another one what was changed.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use crate::support::vehicle_with;
use squirrel_gap::{Finding, diagnose, find};
use squirrel_log::FlightLog;
use squirrel_sim::arm::Arm;
use squirrel_sim::flight::{Integrator, Setup};
use squirrel_sim::scenario::Scenario;
use squirrel_sim::vehicle_file::VehicleFile;

fn fly(vehicle: &VehicleFile, scenario: &str, arm: Arm) -> FlightLog {
    let scenario = Scenario::find(scenario).unwrap();
    let setup = Setup { vehicle: vehicle.clone(), arm, scenario, integrator: Integrator::Rk4 };
    setup.fly(true, |_| {}).unwrap().log.unwrap()
}

fn found(vehicle: &VehicleFile, log: FlightLog) -> Finding {
    find(vehicle, &[("flight".to_owned(), log)]).unwrap()
}

fn squirrel_with(changes: &[(&str, &str)]) -> VehicleFile {
    vehicle_with("squirrel.toml", changes)
}

/// Residual that white noise of the IMU leaves: force, N, per axis and moment, N m.
///
/// A filter of 12 Hz passes `12 / 150` of the power of noise at 300 Hz. Of a derivative it passes
/// what lies below about 12 Hz: `(2 pi)^2 12^3 / (3 * 150)` of the power of the rate's noise. The
/// bar is 1.3 times that, because the edge of the filter is not sharp and the attitude and velocity
/// have noise of their own.
fn noise_bar(vehicle: &VehicleFile) -> ([f64; 3], [f64; 3]) {
    let (imu, p) = (&vehicle.sensors.imu, vehicle.vehicle.parameters());
    let force = p.mass_kg * imu.accel_noise_m_s2 * (12.0_f64 / 150.0).sqrt();
    let acceleration =
        imu.gyro_noise_rad_s * std::f64::consts::TAU * (12.0_f64.powi(3) / (3.0 * 150.0)).sqrt();
    ([1.3 * force; 3], [0, 1, 2].map(|i| 1.3 * p.inertia_kg_m2[(i, i)] * acceleration))
}

fn assert_noise(vehicle: &VehicleFile, finding: &Finding) {
    let (force, moment) = noise_bar(vehicle);
    let r = &finding.residual;
    println!(
        "force {:?}, bar {force:?}\nmoment {:?}, bar {moment:?}",
        r.force_body_rms_n, r.moment_body_rms_n_m
    );
    for axis in 0..3 {
        assert!(r.force_body_rms_n[axis] < force[axis], "force, axis {axis}");
        assert!(r.moment_body_rms_n_m[axis] < moment[axis], "moment, axis {axis}");
        assert!(r.force_body_rms_n[axis] > 0.5 * force[axis], "less than the noise cannot be");
    }
}

#[test]
fn the_own_vehicle_leaves_noise() {
    let vehicle = VehicleFile::squirrel();
    let finding = found(&vehicle, fly(&vehicle, "track", Arm::Pc));
    assert_noise(&vehicle, &finding);
    assert!(finding.notes.is_empty(), "{:?}", finding.notes);
}

#[test]
fn wings_and_effects_of_the_own_vehicle_leave_noise() {
    let flat = squirrel_with(&[("\"membrane\"", "\"flat\"")]);
    let sagging =
        squirrel_with(&[("[limits]", "[effects.battery_sag]\nvoltage_exponent = 0.9\n\n[limits]")]);
    let draggy = squirrel_with(&[(
        "[limits]",
        "[effects.linear_drag]\nextra_drag_n_s_per_m = 0.2\n\n[limits]",
    )]);
    for vehicle in [&VehicleFile::squirrel(), &flat, &sagging, &draggy] {
        let log = fly(vehicle, "avoid", Arm::TwccFlat);
        let (_, wing) = log.channel("wing.command").unwrap();
        assert!(wing.values.iter().any(|c| *c > 0.5), "the wings open");
        assert_noise(vehicle, &found(vehicle, log));
    }
}

/// Thrust near the ground depends on the height: at the ground's it would be a third more, 1.8 N.
#[test]
fn an_effect_of_height_in_the_file_acts_at_the_height_of_the_flight() {
    let near = squirrel_with(&[(
        "[limits]",
        "[effects.ground_effect]\neffective_radius_m = 0.5\n\n[limits]",
    )]);
    let log = fly(&near, "hover", Arm::Pc);
    let (_, altitude) = log.channel("baro.altitude_m").unwrap();
    assert!(altitude.values.iter().all(|h| *h > 1.0), "far from the ground");
    assert_noise(&near, &found(&near, log));
}

#[test]
fn a_wrong_mass_shows_as_weight() {
    let vehicle = VehicleFile::squirrel();
    let heavier = squirrel_with(&[("value = 0.548", "value = 0.6028")]);
    let finding = found(&heavier, fly(&vehicle, "hover", Arm::Pc));
    let tenth = 0.1 * vehicle.vehicle.weight_n();
    let [x, y, z] = finding.residual.force_body_rms_n;
    assert!((z / tenth - 1.0).abs() < 0.05, "{z} N along z, a tenth of the weight is {tenth} N");
    assert!(x < 0.2 * z && y < 0.2 * z, "{x} {y}");
}

#[test]
fn sag_that_the_model_lacks_grows_as_the_voltage_falls() {
    // Right with a full battery, which is so small that it sags a volt within the flight.
    let small = [
        ("value = 1.0, source = \"assumed: 850", "value = 0.08, source = \"assumed: 850"),
        ("value = 14.8", "value = 16.2"),
    ];
    let model = squirrel_with(&small);
    let sag = ("[limits]", "[effects.battery_sag]\nvoltage_exponent = 0.9\n\n[limits]");
    let sagging = squirrel_with(&[small[0], small[1], sag]);
    let log = fly(&sagging, "track", Arm::Pc);
    let (_, voltage) = log.channel("battery.voltage_v").unwrap();
    let (first, last) = (voltage.values[50], voltage.values[voltage.values.len() - 1]);
    assert!(first - last > 0.8, "{first} V to {last} V");

    assert_noise(&sagging, &found(&sagging, log.clone()));
    let finding = found(&model, log);
    let z: Vec<_> =
        finding.places.iter().filter(|place| place.channel == "force_body_z_n").collect();
    println!("{z:#?}");
    assert!(z.len() >= 5 && z[0].share > 0.1, "{}", z.len());
    assert!(
        z[..3].iter().all(|place| place.t0_s >= 12.0),
        "the worst windows are the last ones: {z:#?}"
    );
    assert!(z[0].condition.ends_with(" V"), "{}", z[0].condition);
}

/// The wing of the model, not the log's truth, decides: a model with another wing disagrees where
/// the wings are open.
#[test]
fn a_wrong_wing_shows_where_it_is_open() {
    let vehicle = VehicleFile::squirrel();
    // Weights of another area are refused.
    let model = squirrel_with(&[
        ("value = 0.02, sd = 0.0002", "value = 0.04, sd = 0.0002"),
        ("parnn_weights = \"squirrel-parnn.safetensors\"", ""),
    ]);
    let log = fly(&vehicle, "avoid", Arm::TwccFlat);
    let (time_s, wing) = log.channel("wing.command").unwrap();
    let opens = (0..time_s.len()).find(|&i| wing.row(i)[0] > 0.5).map(|i| time_s[i]).unwrap();
    let finding = found(&model, log.clone());
    println!("{:#?}", &finding.places[..3]);
    assert!(finding.residual.force_body_rms_n[2] > 2.0 * noise_bar(&vehicle).0[2]);
    assert!(
        finding.places[0].t1_s > opens && finding.places[0].t0_s < opens + 4.0,
        "opens at {opens} s"
    );
}

/// Two runs give the same bytes, and the fields have their order.
#[test]
fn a_finding_has_one_form() {
    let vehicle = VehicleFile::squirrel();
    let log = fly(&vehicle, "hover", Arm::Pc);
    let flights = [("b".to_owned(), log.clone()), ("a".to_owned(), log)];
    let text = |finding: &Finding| serde_json::to_string(finding).unwrap();
    let finding = find(&vehicle, &flights).unwrap();
    assert_eq!(text(&finding), text(&find(&vehicle, &flights).unwrap()));
    let json = text(&finding);
    let order = [
        "{\"residual\":{\"force_body_rms_n\":[",
        "],\"moment_body_rms_n_m\":[",
        "\"per_flight\":{\"a\":{",
        "\"samples\":",
        "\"duration_s\":",
        "\"b\":{",
        "\"where\":[{\"flight\":\"",
        "\"t0_s\":",
        "\"t1_s\":",
        "\"channel\":",
        "\"condition\":",
        "\"share\":",
        "\"notes\":[]}",
    ];
    let mut at = 0;
    for part in order {
        at += json[at..].find(part).unwrap_or_else(|| panic!("{part} after byte {at} of {json}"));
    }
    assert_eq!(finding.places.len(), 20);
    assert_eq!(finding.residual.per_flight["a"], finding.residual.per_flight["b"]);
}

/// Flights of the membrane against a file that says flat: what is missing first is the place of the
/// pressure, which travels along a flow that comes from all sides, and most of the gap goes with it.
/// The catalogue's level of the force is not the membrane's at every angle, so that nothing is said
/// of the further names.
#[test]
fn a_membranes_pressure_travels_where_the_file_says_flat() {
    let vehicle = VehicleFile::squirrel();
    let flights = |seeds: std::ops::Range<u64>| -> Vec<(String, FlightLog)> {
        seeds
            .map(|seed| {
                let mut scenario = Scenario::find("excite_rich").unwrap();
                scenario.seed = seed;
                let (vehicle, arm) = (vehicle.clone(), Arm::Pc);
                let setup = Setup { vehicle, arm, scenario, integrator: Integrator::Rk4 };
                (format!("f{seed}"), setup.fly(true, |_| {}).unwrap().log.unwrap())
            })
            .collect()
    };
    let flat = squirrel_with(&[("model = \"membrane\"", "model = \"flat\"")]);
    let verdict = diagnose(&flat, &flights(1..3), &flights(3..5), &|_| ()).unwrap().verdict;
    let names: Vec<_> = verdict.effects.iter().map(|e| (e.name, e.form)).collect();
    println!("{names:?} {:?}", verdict.gap);
    assert_eq!(names[0], ("wing_moment", "travelling"));
    assert!(verdict.gap.unwrap().removed_fraction > 0.9);
}

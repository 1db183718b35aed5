//! Flights with the paper's network in the flight code, in the plant, and in both.

use super::weights_support::{changed, folder, put, set_domain, silent, vehicle};
use squirrel_core::control::wing_force::Guard;
use squirrel_log::FlightLog;
use squirrel_sim::arm::Arm;
use squirrel_sim::estimator::Estimator;
use squirrel_sim::flight::{Flight, Integrator, Setup};
use squirrel_sim::replay::{OUTPUT_SOURCES, replay, setup};
use squirrel_sim::scenario::Scenario;
use squirrel_sim::vehicle_file::{SQUIRREL_TOML, VehicleFile};
use std::collections::BTreeSet;
use std::fs;

fn fly(vehicle: &VehicleFile, arm: Arm, scenario: &str, seed: u64) -> Flight {
    let mut scenario = Scenario::find(scenario).unwrap();
    scenario.seed = seed;
    scenario.wind.gust_sigma_m_s = 0.5;
    let setup = Setup { vehicle: vehicle.clone(), arm, scenario, integrator: Integrator::Rk4 };
    setup.fly(true, |_| {}).unwrap()
}

fn log_of(vehicle: &VehicleFile, arm: Arm, scenario: &str, seed: u64) -> FlightLog {
    fly(vehicle, arm, scenario, seed).log.unwrap()
}

fn column(log: &FlightLog, name: &str) -> Vec<f64> {
    log.channel(name).unwrap_or_else(|| panic!("no {name}")).1.values.clone()
}

/// What the guard said, tick by tick.
fn guards(log: &FlightLog) -> Vec<u8> {
    column(log, "control.parnn.guard").iter().map(|g| *g as u8).collect()
}

/// Below 0.3 m/s the network's wing has no force and the plate a tiny one; above, nothing at all
/// may differ.
#[test]
fn a_silent_network_flies_exactly_as_the_flat_plate() {
    let silent = vehicle("silent", "membrane", &silent());
    for seed in 1..4 {
        let (plate, network) = (
            fly(&silent, Arm::TwccFlat, "avoid", seed),
            fly(&silent, Arm::TwccParnn, "avoid", seed),
        );
        assert_eq!(plate.metrics, network.metrics);
        assert!(network.metrics.wiic_s > 0.2, "the estimate is used: {:?}", network.metrics);
        let (plate, network) = (plate.log.unwrap(), network.log.unwrap());
        assert!(guards(&network).iter().skip(9).all(|g| *g == Guard::Inside as u8));
        let mut names: BTreeSet<&String> = network.sources.keys().collect();
        assert!(names.remove(&"control.parnn".to_owned()));
        assert_eq!(names, plate.sources.keys().collect());
        for name in names {
            let (a, b) = (&plate.sources[name], &network.sources[name]);
            assert_eq!(a.time_s, b.time_s, "{name}");
            for (channel, values) in &a.channels {
                let by_force = ["wing_force_ned_n", "helpful_force_n"].contains(&channel.as_str());
                for (i, t) in a.time_s.iter().enumerate() {
                    if by_force && speed_at(&plate, *t) < 0.3 {
                        continue;
                    }
                    assert_eq!(
                        values.row(i),
                        b.channels[channel].row(i),
                        "{name}.{channel} at {t} s"
                    );
                }
            }
        }
    }
}

/// The ground speed that the flight code knew at a time, m/s.
fn speed_at(log: &FlightLog, t: f64) -> f64 {
    let (times, velocity) = log.channel("estimate.velocity_ned_m_s").unwrap();
    let i = times.partition_point(|s| *s <= t).max(1) - 1;
    velocity.row(i).iter().map(|v| v * v).sum::<f64>().sqrt()
}

#[test]
fn the_network_flies_another_way_and_the_log_shows_its_words() {
    let squirrel = VehicleFile::squirrel();
    let flat = log_of(&squirrel, Arm::TwccFlat, "avoid", 3);
    let log = log_of(&squirrel, Arm::TwccParnn, "avoid", 3);
    assert_ne!(column(&log, "truth.position_ned_m"), column(&flat, "truth.position_ned_m"));
    assert!(!flat.sources.contains_key("control.parnn"));
    let guards = guards(&log);
    assert_eq!(guards[..9], [Guard::WindowNotFull as u8; 9]);
    // Well after the turn it catches up, faster than anything in training.
    assert!(guards[9..85].iter().all(|g| *g == Guard::Inside as u8), "{guards:?}");
    for (name, low, high) in [
        ("control.parnn.alpha_w_rad", -1.57, 1.57),
        ("control.parnn.gamma", 0.1, 5.0),
        ("control.parnn.alpha_est_rad", -1.58, 1.58),
        ("control.parnn.force_body_n", -10.0, 10.0),
    ] {
        let (times, c) = log.channel(name).unwrap();
        assert!(times.len() > 80, "{name}");
        for i in 0..times.len() {
            let row = c.row(i);
            // Before the window is full the network has no word.
            let fits = |x: &f64| if i < 9 { x.is_nan() } else { (low..high).contains(x) };
            assert!(row.iter().all(fits), "{name} at {} s: {row:?}", times[i]);
        }
    }
    let alpha_w = column(&log, "control.parnn.alpha_w_rad");
    assert!(
        alpha_w[9..].iter().any(|a| a.abs() > 0.05),
        "trained weights correct something: {alpha_w:?}"
    );
}

/// Trained on nothing that this flight does, the arm is `twcc_flat`; and it says why.
#[test]
fn outside_what_was_trained_the_arm_is_the_flat_plates() {
    for (speed_m_s, alpha_rad, guard) in
        [([50.0, 60.0], [-2.0, 2.0], Guard::Speed), ([0.0, 60.0], [1.9, 2.0], Guard::AngleOfAttack)]
    {
        let narrow = changed(|_, text| set_domain(text, speed_m_s, alpha_rad));
        let narrow = vehicle(&format!("narrow_{}", guard as u8), "membrane", &narrow);
        let (flat, network) = (
            log_of(&narrow, Arm::TwccFlat, "avoid", 2),
            log_of(&narrow, Arm::TwccParnn, "avoid", 2),
        );
        for name in ["truth", "control.outer", "control.inner", "rotor", "wing"] {
            assert_eq!(flat.sources[name], network.sources[name], "{name}");
        }
        assert!(guards(&network)[9..].iter().all(|g| *g == guard as u8));
    }
    // A top speed in between: the guard closes while the vehicle is faster, and opens a window
    // later.
    let slow = changed(|_, text| set_domain(text, [0.0, 6.0], [-2.0, 2.0]));
    let log = log_of(&vehicle("slow", "membrane", &slow), Arm::TwccParnn, "avoid", 2);
    let (times, _) = log.channel("control.parnn.guard").unwrap();
    let mut seen = BTreeSet::new();
    for (t, guard) in times.iter().zip(guards(&log)).skip(9) {
        let fast = (0..10).any(|k| speed_at(&log, t - 0.1 * f64::from(k) + 1e-6) > 6.0);
        assert_eq!(guard, if fast { Guard::Speed } else { Guard::Inside } as u8, "{t} s");
        seen.insert(guard);
    }
    assert_eq!(seen.len(), 2, "the flight is on both sides of the limit");
}

/// Paper mode: what the controller believes is what the plant does, where both see the same.
#[test]
fn where_the_plant_is_the_network_the_estimate_is_the_truth() {
    let text = SQUIRREL_TOML.replace("model = \"membrane\"", "model = \"parnn\"");
    let mut paper = VehicleFile::parse(&text, "paper").unwrap();
    paper.estimator = Estimator::Oracle;
    let mut scenario = Scenario::find("random_spread").unwrap();
    scenario.seed = 7;
    let of = |vehicle: VehicleFile| {
        let scenario = scenario.clone();
        let setup = Setup { vehicle, arm: Arm::TwccParnn, scenario, integrator: Integrator::Rk4 };
        setup.fly(true, |_| {}).unwrap().log.unwrap()
    };
    let worst = |log: &FlightLog| {
        let (times, said) = log.channel("control.parnn.force_body_n").unwrap();
        let (truth_s, truth) = log.channel("truth.wing_force_body_n").unwrap();
        let deployment = &log.channel("wing.deployment").unwrap().1;
        let (mut worst, mut largest) = (0.0_f64, 0.0_f64);
        // The window of the plant is full 0.1 s after that of the flight code, which saw the start.
        for (k, t) in times.iter().enumerate().skip(11) {
            let i = truth_s.partition_point(|s| s < t);
            assert_eq!(truth_s[i], *t);
            assert!(deployment.row(i)[0] > 0.9);
            for axis in 0..3 {
                let force = truth.row(i)[axis] / deployment.row(i)[0];
                worst = worst.max((said.row(k)[axis] - force).abs());
                largest = largest.max(force.abs());
            }
        }
        assert!(largest > 1.0, "{largest} N");
        worst
    };
    let in_paper = worst(&of(paper.clone()));
    assert!(in_paper < 1e-4, "{in_paper} N");
    // The membrane is no network: the same comparison tells them apart.
    let mut membrane = VehicleFile::squirrel();
    membrane.estimator = Estimator::Oracle;
    assert!(worst(&of(membrane)) > 0.1);
}

/// A log is enough: vehicle file and weights are gone when it is replayed.
#[test]
fn own_weights_replay_from_the_log_alone() {
    let own = changed(|parts, _| parts.get_mut("output.bias").unwrap().2[..4].fill(0));
    let folder = folder("replay_alone");
    let logs = folder.join("logs");
    fs::create_dir(&logs).unwrap();
    for (model, arm) in [
        ("membrane", Arm::TwccParnn),
        ("parnn", Arm::TwccParnn),
        ("parnn", Arm::TwccFlat),
        ("parnn", Arm::TwccOracle),
    ] {
        let vehicle = VehicleFile::load(&put(&folder, model, &own)).unwrap();
        let path = logs.join(format!("{model}-{}.mcap", arm.name()));
        log_of(&vehicle, arm, "avoid", 7).write(&path).unwrap();
        fs::remove_file(folder.join("own.safetensors")).unwrap();
        fs::remove_file(folder.join("vehicle.toml")).unwrap();
        let log = FlightLog::read(&path).unwrap();
        let setup = setup(&log).unwrap();
        assert_eq!(setup.vehicle.weights, vehicle.weights);
        let again = replay(&log, &setup).unwrap();
        assert_eq!(again.first_difference, None, "{model}, {arm:?}");
        assert!(again.values > 100_000);
        assert_eq!(log.sources.contains_key("control.parnn"), arm == Arm::TwccParnn);
        // The plant too comes from the log: the same flight, not only the same commands.
        let second = path.with_extension("again");
        setup.fly(true, |_| {}).unwrap().log.unwrap().write(&second).unwrap();
        assert!(fs::read(&path).unwrap() == fs::read(&second).unwrap(), "{model}, {arm:?}");
    }
}

#[test]
fn a_log_with_changed_or_lost_weights_is_found_out() {
    assert!(OUTPUT_SOURCES.contains(&"control.parnn"));
    let log = log_of(&VehicleFile::squirrel(), Arm::TwccParnn, "avoid", 7);
    let hex = log.metadata["parnn_weights_hex"].clone();
    let with = |text: Option<String>| {
        let mut changed = log.clone();
        match text {
            Some(text) => changed.metadata.insert("parnn_weights_hex".to_owned(), text),
            None => changed.metadata.remove("parnn_weights_hex"),
        };
        changed
    };
    // The lowest bit of the last weight but one in the file.
    let mut bent = hex.clone();
    let at = bent.len() - 16;
    let digit = u8::from_str_radix(&bent[at + 1..at + 2], 16).unwrap();
    bent.replace_range(at + 1..at + 2, &format!("{:x}", digit ^ 1));
    let bent = with(Some(bent));
    let difference = replay(&bent, &setup(&bent).unwrap()).unwrap().first_difference.unwrap();
    assert!(difference.channel.starts_with("control.parnn."), "{difference:?}");
    assert!((0.8..1.5).contains(&difference.time_s), "{difference:?}");

    let lost = with(None);
    let error = replay(&lost, &setup(&lost).unwrap()).unwrap_err();
    assert!(error.contains("arm = twcc_parnn: needs weights"), "{error}");
    for broken in ["", "0", "zz", &hex[1..], &hex[..400]] {
        let error = setup(&with(Some(broken.to_owned()))).unwrap_err();
        assert!(
            error.starts_with("metadata parnn_weights_hex: not a whole safetensors file: "),
            "{error}"
        );
    }
}

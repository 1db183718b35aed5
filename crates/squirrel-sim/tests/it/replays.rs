//! Replay: the same bits from the same inputs, and the first thing that differs where something was
//! changed.

use squirrel_log::flight_code::INPUT_SOURCES;
use squirrel_log::{FlightLog, LogReader};
use squirrel_sim::arm::Arm;
use squirrel_sim::estimator::Estimator;
use squirrel_sim::flight::{Integrator, Setup};
use squirrel_sim::replay::{OUTPUT_SOURCES, replay, replay_pieces, setup, setup_of};
use squirrel_sim::scenario::{Conditions, Scenario};
use squirrel_sim::vehicle_file::VehicleFile;

fn flown(arm: Arm) -> FlightLog {
    flown_by(VehicleFile::squirrel(), arm)
}

fn flown_by(vehicle: VehicleFile, arm: Arm) -> FlightLog {
    let mut scenario = Scenario::find("avoid").unwrap();
    scenario.seed = 7;
    scenario.wind.gust_sigma_m_s = 0.5;
    let setup = Setup { vehicle, arm, scenario, integrator: Integrator::Rk4 };
    setup.fly(true, |_| {}).unwrap().log.unwrap()
}

#[test]
fn every_arm_replays_bit_for_bit_through_a_file() {
    let folder = std::env::temp_dir().join(format!("squirrel-replays-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    for arm in Arm::ALONE {
        let path = folder.join(arm.name()).with_extension("mcap");
        flown(arm).write(&path).unwrap();
        let log = FlightLog::read(&path).unwrap();
        let result = replay(&log, &setup(&log).unwrap()).unwrap();
        assert_eq!(result.first_difference, None, "{arm:?}");
        assert!(result.steps > 3000 && result.values > 100_000);
        // As it is read in pieces.
        let mut log = LogReader::open(&path).unwrap().unwrap();
        let setup = setup_of(log.metadata()).unwrap();
        assert_eq!(replay_pieces(&mut log, &setup).unwrap(), Some(result), "{arm:?}");
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

/// Wind, late fixes and sag are the flight's, and the log says so: it replays, and another seed has
/// another wind.
#[test]
fn a_flight_outdoors_replays_from_its_log() {
    let fly = |seed, conditions| {
        let scenario =
            Scenario { seed, conditions, duration_s: 5.0, ..Scenario::find("hover").unwrap() };
        let vehicle = VehicleFile::squirrel();
        let setup = Setup { vehicle, arm: Arm::TwccFlat, scenario, integrator: Integrator::Rk4 };
        setup.fly(true, |_| {}).unwrap()
    };
    let flight = fly(7, Conditions::Outdoors);
    let log = flight.log.unwrap();
    assert_eq!(replay(&log, &setup(&log).unwrap()).unwrap().first_difference, None);
    let wind = |log: &FlightLog| log.sources["truth"].channels["wind_ned_m_s"].row(0).to_vec();
    let calm = fly(7, Conditions::Calm);
    assert!(wind(&calm.log.unwrap()).iter().all(|x| *x == 0.0));
    assert!(wind(&log)[0].hypot(wind(&log)[1]) > 1.0);
    assert_ne!(wind(&log), wind(&fly(8, Conditions::Outdoors).log.unwrap()));
    assert!(flight.metrics.rmse_m > calm.metrics.rmse_m);
}

#[test]
fn a_changed_gain_is_found_at_the_first_output_that_it_reaches() {
    let mut log = flown(Arm::TwccFlat);
    let changed = log.metadata["vehicle_toml"]
        .replace("c1_per_s = { value = [5.3,", "c1_per_s = { value = [5.301,");
    assert_ne!(changed, log.metadata["vehicle_toml"]);
    log.metadata.insert("vehicle_toml".to_owned(), changed);
    let of_whole = replay(&log, &setup(&log).unwrap()).unwrap();
    let path = std::env::temp_dir().join(format!("squirrel-gain-{}.mcap", std::process::id()));
    log.write(&path).unwrap();
    let mut in_pieces = LogReader::open(&path).unwrap().unwrap();
    let changed = setup_of(in_pieces.metadata()).unwrap();
    assert_eq!(replay_pieces(&mut in_pieces, &changed).unwrap(), Some(of_whole.clone()));
    std::fs::remove_file(&path).unwrap();
    let difference = of_whole.first_difference.unwrap();
    assert!(
        difference.time_s < 0.1 && difference.channel.starts_with("control.inner."),
        "{difference:?}"
    );
}

/// Every input source matters: a changed number changes an output.
#[test]
fn a_changed_input_changes_an_output() {
    let mut outside = VehicleFile::squirrel();
    outside.estimator = Estimator::External;
    let sag = "\n[effects.battery_sag]\nvoltage_exponent = 0.9\n";
    let sagging = VehicleFile::parse(&(VehicleFile::squirrel().text + sag), "vehicle").unwrap();
    let logs = [
        flown(Arm::TwccOracle),
        flown_by(outside, Arm::TwccOracle),
        flown_by(sagging, Arm::TwccOracle),
    ];
    for (log, channel, row) in [
        (&logs[0], "imu.omega_body_rad_s", 1000),
        (&logs[0], "imu.specific_force_body_m_s2", 1000),
        (&logs[0], "imu_2.omega_body_rad_s", 1000),
        (&logs[1], "attitude.q_ned_from_body_wxyz", 1000),
        (&logs[0], "gnss.position_ned_m", 50),
        (&logs[0], "gnss.velocity_ned_m_s", 50),
        (&logs[0], "baro.altitude_m", 250),
        (&logs[0], "magnetometer.field_body_ut", 250),
        (&logs[2], "battery.voltage_v", 250),
        (&logs[0], "wing_force.as_if_spread_ned_n", 1500),
    ] {
        let (source, name) = channel.rsplit_once('.').unwrap();
        assert!(INPUT_SOURCES.contains(&source));
        let mut changed = log.clone();
        let c = changed.sources.get_mut(source).unwrap().channels.get_mut(name).unwrap();
        let i = row * c.width;
        c.values[i] = f64::from(c.values[i] as f32 * 1.001 + 1e-4);
        let t = log.sources[source].time_s[row];
        let difference = replay(&changed, &setup(log).unwrap()).unwrap().first_difference;
        let difference = difference.unwrap_or_else(|| panic!("{channel} does not matter"));
        assert!(
            difference.time_s >= t && difference.time_s <= t + 0.11,
            "{channel} at {t}: {difference:?}"
        );
    }
}

#[test]
fn a_log_without_what_replay_needs_is_refused_by_name() {
    let log = flown(Arm::Pc);
    let mut bare = log.clone();
    bare.metadata.remove("vehicle_toml");
    assert!(setup(&bare).unwrap_err().starts_with("metadata vehicle_toml: missing"));
    let mut frameless = log.clone();
    frameless.sources.remove("frame");
    assert!(
        replay(&frameless, &setup(&log).unwrap())
            .unwrap_err()
            .starts_with("frame.time_us: missing")
    );
    let mut outputless = log.clone();
    outputless.sources.remove(OUTPUT_SOURCES[0]);
    assert!(
        replay(&outputless, &setup(&log).unwrap())
            .unwrap_err()
            .starts_with("control.status: in only one")
    );
}
